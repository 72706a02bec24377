// Reads a mesh in any format maille knows, compresses it in memory, brings it back and compares.
#include <maille/compare.h>
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/io.h>
#include <cstdio>

namespace {

// Every function that can fail returns a maille::Result: a value, or an error with a sentence for the user.
maille::Result<void> roundtrip(const std::string& path) {
  const auto input = maille::read_mesh(path);
  if (!input) return tl::unexpected(input.error());

  maille::EncodeOptions options;
  const auto threads = maille::thread_executor(0);
  options.executor = threads.get();

  std::vector<std::byte> file;
  const auto report = maille::encode(input->mesh, *maille::memory_sink(file), options);
  if (!report) return tl::unexpected(report.error());

  const auto decoded = maille::decode(*maille::memory_source(maille::Bytes(file)));
  if (!decoded) return tl::unexpected(decoded.error());

  const auto comparison = maille::compare(input->mesh, *decoded);
  if (!comparison.equal) return maille::failure(maille::ErrorCode::differs, comparison.differences.front());

  std::printf("%s: %llu points, %llu faces in %zu bytes, equal after decoding\n", path.c_str(),
              static_cast<unsigned long long>(report->points), static_cast<unsigned long long>(report->cells),
              file.size());
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s MESH\n", argv[0]);
    return 2;
  }
  const auto result = roundtrip(argv[1]);
  if (result) return 0;
  std::fprintf(stderr, "%s\n", result.error().message.c_str());
  return static_cast<int>(result.error().code);
}
