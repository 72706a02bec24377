// maille_mesh_checksums FILE...: a CRC-32 of each decoded mesh, for the tests of the WebAssembly decoder, which must decode
// the same (web/test/checksum.js takes the same bytes in the same order).
#include <maille/decode.h>
#include <maille/source.h>

#include <zlib.h>

#include <cstdio>

namespace {

template <class T>
void add(uLong& checksum, const maille::Buffer<T>& values) {
  // Of no bytes at no address zlib gives the first checksum again.
  if (values.empty()) return;
  checksum = crc32_z(checksum, reinterpret_cast<const Bytef*>(values.data()), values.size() * sizeof(T));
}

uLong checksum_of(const maille::Mesh& mesh) {
  uLong checksum = crc32_z(0, nullptr, 0);
  add(checksum, mesh.points.bytes);
  for (const maille::CellBlock& block : mesh.blocks) {
    add(checksum, block.types);
    add(checksum, block.offsets);
    add(checksum, block.connectivity);
  }
  for (const maille::Array& array : mesh.arrays) add(checksum, array.bytes);
  return checksum;
}

}  // namespace

int main(int count, char** paths) {
  for (int i = 1; i < count; ++i) {
    const auto source = maille::file_source(paths[i]);
    const auto mesh = source ? maille::decode(**source) : tl::unexpected(source.error());
    if (!mesh) {
      std::printf("error-%d %s\n", static_cast<int>(mesh.error().code), paths[i]);
      continue;
    }
    std::printf("%08lx %s\n", checksum_of(*mesh), paths[i]);
  }
}
