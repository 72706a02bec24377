#pragma once

#include <maille/mesh.h>

namespace maille {

/// Bytes of positions, connectivity and arrays; labels, names and metadata do not count, nor
/// does what vectors have reserved beyond their sizes.
inline uint64_t size_in_memory(const Mesh& mesh) {
  uint64_t size = mesh.points.bytes.size();
  for (const CellBlock& block : mesh.blocks) {
    size += block.types.size() + (block.offsets.size() + block.cell_faces.size()) * sizeof(uint64_t) +
            (block.connectivity.size() + block.face_sizes.size()) * sizeof(uint32_t);
  }
  for (const Array& array : mesh.arrays) size += array.bytes.size();
  return size;
}

}  // namespace maille
