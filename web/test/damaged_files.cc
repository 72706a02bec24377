// maille_damaged_files COUNT [FIRST]: damaged files, those of maille_mutate, for web/test/damage.js on standard output: each
// with three numbers of 32 bits: size, what decode() says here (0: a mesh, else ErrorCode), the checksum of the mesh.
#include <maille/decode.h>
#include <maille/source.h>

#include <array>
#include <cstdio>
#include <cstdlib>

#include "faults/seeds.h"
#include "mesh_checksum.h"

namespace maille::testing {
namespace {

/// That of damage.js.
constexpr Limits limits{uint64_t{16} << 20};

void write(Bytes file) {
  const auto source = memory_source(file, "x");
  DecodeOptions options;
  options.limits = limits;
  const auto mesh = decode(*source, options);
  const std::array<uint32_t, 3> head = {
      static_cast<uint32_t>(file.size()),
      mesh ? 0 : static_cast<uint32_t>(mesh.error().code), mesh ? static_cast<uint32_t>(checksum_of(*mesh)) : 0};
  std::fwrite(head.data(), sizeof(uint32_t), head.size(), stdout);
  std::fwrite(file.data(), 1, file.size(), stdout);
}

void write_damaged(uint64_t count, uint64_t first) {
  const std::vector<Seed> seeds = maille_seeds();
  for (uint64_t number = first; number < first + count; ++number) {
    Random random(number * 4 + 5);
    const Seed& seed = seeds[random.below(seeds.size())];
    write(mutated(seed, seeds, random).bytes);
  }
}

}  // namespace
}  // namespace maille::testing

int main(int count, char** arguments) {
  const uint64_t files = count > 1 ? std::strtoull(arguments[1], nullptr, 10) : 1000;
  maille::testing::write_damaged(files, count > 2 ? std::strtoull(arguments[2], nullptr, 10) : 0);
}
