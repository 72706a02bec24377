// Decompresses a .maille file that is in memory, and says what it holds.
#include <maille/decode.h>
#include <maille/source.h>

#include <cstdio>
#include <fstream>
#include <iterator>
#include <span>
#include <vector>

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: decode FILE.maille\n");
    return 2;
  }
  std::ifstream file(argv[1], std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
  const auto source = maille::memory_source(std::as_bytes(std::span(bytes)), argv[1]);
  const auto mesh = maille::decode(*source);
  if (!mesh) {
    std::fprintf(stderr, "%s\n", mesh.error().message.c_str());
    return 1;
  }
  std::printf("%llu points, %llu cells\n", static_cast<unsigned long long>(mesh->point_count()),
              static_cast<unsigned long long>(mesh->cell_count()));
}
