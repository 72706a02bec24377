#pragma once

#include <maille/mesh.h>
#include <zlib.h>

namespace maille::testing {

template <class T>
inline void add_to(uLong& checksum, const Buffer<T>& values) {
  // Of no bytes at no address zlib gives the first checksum again.
  if (values.empty()) return;
  checksum = crc32_z(checksum, reinterpret_cast<const Bytef*>(values.data()), values.size() * sizeof(T));
}

inline uLong checksum_of(const Mesh& mesh) {
  uLong checksum = crc32_z(0, nullptr, 0);
  add_to(checksum, mesh.points.bytes);
  for (const CellBlock& block : mesh.blocks) {
    add_to(checksum, block.types);
    add_to(checksum, block.offsets);
    add_to(checksum, block.connectivity);
  }
  for (const Array& array : mesh.arrays) add_to(checksum, array.bytes);
  return checksum;
}

}  // namespace maille::testing
