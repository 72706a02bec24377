// Feeds inputs to the fuzzers without libFuzzer, for `make test`: replay lists their names, replay NAME
// FOLDER... feeds one. Each fuzzer is compiled with its own name for its entry (tests/CMakeLists.txt).

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <vector>

using Fuzzer = int(const uint8_t*, size_t);
extern "C" {
Fuzzer connectivity_fuzz, container_fuzz, decode_fuzz, fan_fuzz, generate_fuzz, random_fuzz, read_fuzz,
    round_trip_fuzz, stream_fuzz;
}

namespace {

constexpr struct {
  std::string_view name;
  Fuzzer* fuzzer;
} fuzzers[] = {{"connectivity_fuzz", connectivity_fuzz},
               {"container_fuzz", container_fuzz},
               {"decode_fuzz", decode_fuzz},
               {"fan_fuzz", fan_fuzz},
               {"generate_fuzz", generate_fuzz},
               {"random_fuzz", random_fuzz},
               {"read_fuzz", read_fuzz},
               {"round_trip_fuzz", round_trip_fuzz},
               {"stream_fuzz", stream_fuzz}};

/// By name, so that a run can be repeated.
std::vector<std::filesystem::path> files_of(const char* folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// In memory of its own size, so that a sanitizer sees what is read behind it; says which file it is before,
/// as a finding ends the program.
void feed(Fuzzer* fuzzer, const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  std::fprintf(stderr, "%s\n", path.c_str());
  fuzzer(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) {
    for (const auto& each : fuzzers) std::printf("%s\n", each.name.data());
    return 0;
  }
  const auto* const found = std::find_if(std::begin(fuzzers), std::end(fuzzers),
                                         [&](const auto& each) { return each.name == arguments[1]; });
  if (found == std::end(fuzzers)) return 2;
  size_t inputs = 0;
  for (int i = 2; i < count; ++i) {
    for (const auto& path : files_of(arguments[i])) {
      feed(found->fuzzer, path);
      ++inputs;
    }
  }
  std::printf("%s: %zu inputs\n", arguments[1], inputs);
  return 0;
}
