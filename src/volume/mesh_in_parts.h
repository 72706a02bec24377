#pragma once

#include <maille/mesh_source.h>

#include <algorithm>

// Meshes in memory as sources and sinks of parts, for tests.

namespace maille::testing {

inline MeshDescription description_of(const Mesh& mesh) {
  MeshDescription description;
  description.points = mesh.point_count();
  description.cells = mesh.cell_count();
  description.corners = mesh.corner_count();
  description.point_type = mesh.points.type;
  for (const CellBlock& block : mesh.blocks)
    description.blocks.push_back({block.name, block.type, block.size()});
  for (const Array& array : mesh.arrays) {
    Array copy = array;
    if (array.domain != Domain::mesh) copy.bytes.clear();
    (array.domain == Domain::mesh ? description.mesh_arrays : description.arrays).push_back(std::move(copy));
  }
  description.metadata = mesh.metadata;
  return description;
}

class MeshInParts final : public MeshSource {
 public:
  explicit MeshInParts(const Mesh& mesh) : mesh_(mesh), description_(description_of(mesh)) {
    for (const Array& array : mesh.arrays) {
      if (array.domain != Domain::mesh) arrays_.push_back(&array);
    }
  }
  const MeshDescription& description() const override { return description_; }
  Result<> read_points(uint64_t first, uint64_t count, std::span<std::byte> out) override {
    return copy(mesh_.points, first, count, out);
  }
  Result<> read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) override {
    return copy(*arrays_[array], first, count, out);
  }
  Result<> read_cells(uint64_t first, uint64_t count, CellPiece& out) override {
    out = {};
    out.offsets.push_back(0);
    for (const CellBlock& block : mesh_.blocks) {
      for (; first < block.size() && count > 0; ++first, --count) {
        const auto nodes = block.cell(first);
        out.types.push_back(static_cast<uint8_t>(block.type_of(first)));
        out.connectivity.insert(out.connectivity.end(), nodes.begin(), nodes.end());
        out.offsets.push_back(out.connectivity.size());
        if (block.type_of(first) != CellType::polyhedron && out.cell_faces.empty()) continue;
        out.cell_faces.resize(out.types.size(), out.face_sizes.size());
        if (block.type_of(first) == CellType::polyhedron)
          out.face_sizes.insert(out.face_sizes.end(), block.faces(first).begin(), block.faces(first).end());
        out.cell_faces.push_back(out.face_sizes.size());
      }
      first -= std::min(first, block.size());
    }
    return count == 0 ? Result<>() : failure(ErrorCode::usage, "too many cells");
  }

 private:
  static Result<> copy(const Array& array, uint64_t first, uint64_t count, std::span<std::byte> out) {
    const size_t size = array.tuple_size();
    if (out.size() != count * size || (first + count) * size > array.bytes.size())
      return failure(ErrorCode::usage, "too many tuples");
    std::copy_n(array.bytes.data() + first * size, count * size, out.data());
    return {};
  }

  const Mesh& mesh_;
  MeshDescription description_;
  std::vector<const Array*> arrays_;
};

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
    if (!cells.cell_faces.empty()) {
      const auto at = [&](uint64_t k) { return cells.face_sizes.begin() + static_cast<ptrdiff_t>(k); };
      block.face_sizes.insert(block.face_sizes.end(), at(cells.cell_faces[i]), at(cells.cell_faces[i + 1]));
    }
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
