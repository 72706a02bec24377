#pragma once

#include <maille/mesh_source.h>

#include <algorithm>

#include "mesh/cell_faces.h"

// A mesh in memory as a sink of parts, for tests; as a source: mesh/mesh_as_source.h.

namespace maille::testing {

class MeshFromParts final : public MeshSink {
 public:
  explicit MeshFromParts(const MeshDescription& description) : description_(description) {
    mesh.points = make_array("position", Domain::point, description.point_type, 3);
    mesh.points.resize(description.points);
    mesh.arrays = description.arrays;
    for (Array& array : mesh.arrays) array.resize(description.count_of(array));
    for (const auto& block : description.blocks) {
      CellBlock& made = mesh.blocks.emplace_back();
      made.name = block.name;
      made.type = block.type;
    }
  }
  Result<> write_points(uint64_t first, Bytes positions) override {
    return put(mesh.points, first, positions);
  }
  Result<> write_array(size_t array, uint64_t first, Bytes tuples) override {
    return put(mesh.arrays[array], first, tuples);
  }
  Result<> write_cells(const CellPiece& cells) override {
    for (size_t i = 0; i < cells.size(); ++i) {
      while (cells_ == description_.blocks[block_].cells) next_block();
      CellBlock& block = mesh.blocks[block_];
      if (nodes_of(block.type) == 0 && block.offsets.empty()) block.offsets.push_back(0);
      for (size_t k = cells.offsets[i]; k < cells.offsets[i + 1]; ++k)
        block.connectivity.push_back(static_cast<uint32_t>(cells.connectivity[k]));
      if (nodes_of(block.type) == 0) block.offsets.push_back(block.connectivity.size());
      if (block.type == CellType::mixed) block.types.push_back(cells.types[i]);
      const bool polyhedron = static_cast<CellType>(cells.types[i]) == CellType::polyhedron;
      if (polyhedron || !block.cell_faces.empty()) add_faces(cells, i, block);
      ++cells_;
    }
    return {};
  }
  Result<> commit() override {
    mesh.arrays.insert(mesh.arrays.end(), description_.mesh_arrays.begin(), description_.mesh_arrays.end());
    mesh.metadata = description_.metadata;
    committed = true;
    return {};
  }

  Mesh mesh;
  bool committed = false;

 private:
  static void add_faces(const CellPiece& cells, size_t i, CellBlock& block) {
    block.cell_faces.resize(block.size(), block.face_sizes.size());
    const auto sizes = face_sizes_of(cells, i);
    block.face_sizes.insert(block.face_sizes.end(), sizes.begin(), sizes.end());
    block.cell_faces.push_back(block.face_sizes.size());
  }
  void next_block() {
    ++block_;
    cells_ = 0;
  }
  static Result<> put(Array& array, uint64_t first, Bytes bytes) {
    if (first * array.tuple_size() + bytes.size() > array.bytes.size())
      return failure(ErrorCode::usage, "too many tuples");
    std::copy(bytes.begin(), bytes.end(),
              array.bytes.begin() + static_cast<ptrdiff_t>(first * array.tuple_size()));
    return {};
  }
  MeshDescription description_;
  size_t block_ = 0;
  uint64_t cells_ = 0;
};

}  // namespace maille::testing
