// maille_mesh_checksums FILE...: a CRC-32 of each decoded mesh, for the tests of the WebAssembly decoder, which must decode
// the same (web/test/checksum.js takes the same bytes in the same order).
#include <maille/decode.h>
#include <maille/source.h>

#include <cstdio>

#include "mesh_checksum.h"

int main(int count, char** paths) {
  for (int i = 1; i < count; ++i) {
    const auto source = maille::file_source(paths[i]);
    const auto mesh = source ? maille::decode(**source) : tl::unexpected(source.error());
    if (!mesh) {
      std::printf("error-%d %s\n", static_cast<int>(mesh.error().code), paths[i]);
      continue;
    }
    std::printf("%08lx %s\n", maille::testing::checksum_of(*mesh), paths[i]);
  }
}
