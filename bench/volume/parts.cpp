#include "parts.h"

#include <array>

namespace maille::bench {
namespace {

template <class T>
void append(Part& part, T value) {
  const size_t at = part.bytes.size();
  part.bytes.resize(at + sizeof(T));
  std::memcpy(part.bytes.data() + at, &value, sizeof(T));
}

Part make(std::string name, Scalar type, size_t components = 1) {
  return {std::move(name), Part::Holds::connectivity, type, components, {}};
}

/// Cells of one type behind one another, so that differences are between the same corners.
void add_block(const CellBlock& block, std::vector<Part>& parts) {
  std::array<std::vector<uint64_t>, 256> cells;
  for (uint64_t i = 0; i < block.size(); ++i) cells[static_cast<uint8_t>(block.type_of(i))].push_back(i);
  for (size_t type = 0; type < cells.size(); ++type) {
    if (cells[type].empty()) continue;
    const unsigned nodes = nodes_of(static_cast<CellType>(type));
    Part indices = make("connectivity", Scalar::i32, nodes == 0 ? 1 : nodes);
    Part sizes = make("sizes", Scalar::i32);
    for (const uint64_t i : cells[type]) {
      for (const uint32_t point : block.cell(i)) append(indices, point);
      if (nodes == 0) append(sizes, static_cast<uint32_t>(block.cell(i).size()));
    }
    parts.push_back(std::move(indices));
    if (nodes == 0) parts.push_back(std::move(sizes));
  }
  if (block.type == CellType::mixed) {
    Part types = make("types", Scalar::u8);
    for (const uint8_t type : block.types) append(types, type);
    parts.push_back(std::move(types));
  }
  if (!block.face_sizes.empty()) {
    Part faces = make("face sizes", Scalar::i32);
    for (const uint32_t size : block.face_sizes) append(faces, size);
    parts.push_back(std::move(faces));
    Part counts = make("faces", Scalar::i32);
    for (size_t i = 1; i < block.cell_faces.size(); ++i)
      append(counts, static_cast<uint32_t>(block.cell_faces[i] - block.cell_faces[i - 1]));
    parts.push_back(std::move(counts));
  }
}

void add_values(const Mesh& mesh, std::vector<Part>& parts) {
  parts.push_back({"position", Part::Holds::geometry, mesh.points.type, 3, mesh.points.bytes.vector()});
  for (const Array& array : mesh.arrays)
    parts.push_back({array.name, Part::Holds::field, array.type, array.components, array.bytes.vector()});
}

}  // namespace

std::vector<Part> parts_by_type(const Mesh& mesh) {
  std::vector<Part> parts;
  for (const CellBlock& block : mesh.blocks) add_block(block, parts);
  add_values(mesh, parts);
  return parts;
}

std::vector<Part> parts_as_vtk(const Mesh& mesh) {
  Part indices = make("connectivity", Scalar::i64), offsets = make("offsets", Scalar::i64),
       types = make("types", Scalar::u8), faces = make("faces", Scalar::i64);
  uint64_t end = 0;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      for (const uint32_t point : block.cell(i)) append(indices, uint64_t{point});
      append(offsets, end += block.cell(i).size());
      append(types, static_cast<uint8_t>(block.type_of(i)));
      for (const uint32_t size : block.faces(i)) append(faces, uint64_t{size});
    }
  }
  std::vector<Part> parts;
  for (Part* part : {&indices, &offsets, &types, &faces}) {
    if (!part->bytes.empty()) parts.push_back(std::move(*part));
  }
  add_values(mesh, parts);
  return parts;
}

}  // namespace maille::bench
