#include <maille/triangles.h>
#include <maille/with_type.h>

namespace maille {
namespace {

/// The corners of a face among its nodes, in their order around it; none: it is no face.
size_t corners_of(CellType type, size_t nodes) {
  switch (type) {
    case CellType::triangle:
    case CellType::quad:
    case CellType::polygon:
    case CellType::pixel:
      return nodes;
    case CellType::quadratic_triangle:
    case CellType::biquadratic_triangle:
      return 3;
    case CellType::quadratic_quad:
    case CellType::biquadratic_quad:
    case CellType::quadratic_linear_quad:
      return 4;
    case CellType::quadratic_polygon:
      return nodes / 2;
    default:
      return 0;
  }
}

void add_triangles(CellType type, std::span<const uint32_t> nodes, std::vector<uint32_t>& out) {
  const auto add = [&](size_t a, size_t b, size_t c) {
    out.insert(out.end(), {nodes[a], nodes[b], nodes[c]});
  };
  if (type == CellType::triangle_strip) {
    // Every second triangle of a strip is turned over.
    for (size_t i = 0; i + 2 < nodes.size(); ++i) i % 2 == 0 ? add(i, i + 1, i + 2) : add(i + 1, i, i + 2);
    return;
  }
  const size_t corners = corners_of(type, nodes.size());
  if (type == CellType::pixel && corners == 4) {  // its last two corners are the other way round
    add(0, 1, 3);
    add(0, 3, 2);
    return;
  }
  for (size_t i = 1; i + 1 < corners; ++i) add(0, i, i + 1);
}

}  // namespace

std::vector<uint32_t> triangle_indices(const Mesh& mesh) {
  std::vector<uint32_t> indices;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0, count = block.size(); i < count; ++i)
      add_triangles(block.type_of(i), block.cell(i), indices);
  }
  return indices;
}

std::vector<float> positions_as_floats(const Mesh& mesh) {
  return with_type(mesh.points.type, [&](auto zero) {
    std::vector<float> positions;
    const auto values = mesh.points.values<decltype(zero)>();
    positions.reserve(values.size());
    for (const auto value : values) positions.push_back(static_cast<float>(value));
    return positions;
  });
}

}  // namespace maille
