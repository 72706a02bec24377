#include "io/gltf/gltf_cells.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <numeric>

#include "base/bytes.h"
#include "base/result.h"
#include "io/buffered_writer.h"
#include "io/cells.h"
#include "io/reading.h"

namespace maille {
namespace {

/// Goes over the blocks and sorts their cells into primitives by kind and material.
class Collector {
 public:
  Collector(const Mesh& mesh, std::vector<std::string>& notes) : mesh_(mesh), notes_(notes) {}

  Result<GltfCells> collect();

 private:
  void find_material();
  int material_of(uint64_t cell) const;
  Result<> split_points();
  bool same_values(uint64_t a, uint64_t b) const { return compare_values(a, b) == 0; }
  int compare_values(uint64_t a, uint64_t b) const;
  void add_block(size_t block);
  void add_cell(CellType type, std::span<const uint32_t> nodes, std::vector<uint32_t>* lists[3]);
  void note_changes();

  const Mesh& mesh_;
  std::vector<std::string>& notes_;
  GltfCells cells_;
  std::vector<const Array*> corner_arrays_;
  std::vector<uint32_t> corner_points_;  ///< point written of each corner; empty: as in the connectivity
  uint64_t cell_ = 0, corner_ = 0;       ///< first of the current block
  uint64_t polygons_ = 0, strips_ = 0, dropped_ = 0, degenerate_ = 0;
};

void Collector::find_material() {
  const Array* array = mesh_.find("material", Domain::cell);
  if (!array || array->role != Role::label || array->components != 1 || is_float(array->type)) return;
  cells_.material = array;
  cells_.materials = array->labels;
  // The reader adds an empty name for cells without a material.
  if (!cells_.materials.empty() && cells_.materials.back().empty()) cells_.materials.pop_back();
}

/// The material of a cell; -1 for values without a name.
int Collector::material_of(uint64_t cell) const {
  if (!cells_.material) return -1;
  const std::byte* from = cells_.material->bytes.data() + cell * cells_.material->tuple_size();
  const uint64_t value = with_type(
      cells_.material->type, [&](auto zero) { return static_cast<uint64_t>(load<decltype(zero)>(from)); });
  return value < cells_.materials.size() ? static_cast<int>(value) : -1;
}

int Collector::compare_values(uint64_t a, uint64_t b) const {
  for (const Array* array : corner_arrays_) {
    const size_t size = array->tuple_size();
    const int order = std::memcmp(array->bytes.data() + a * size, array->bytes.data() + b * size, size);
    if (order != 0) return order;
  }
  return 0;
}

/// Makes one point for every point and different values of its corners, in the order of the old points;
/// points without corners stay. Values are compared by their bytes, so that none changes.
Result<> Collector::split_points() {
  for (const Array& array : mesh_.arrays) {
    if (array.domain == Domain::corner) corner_arrays_.push_back(&array);
  }
  cells_.point_count = mesh_.point_count();
  if (corner_arrays_.empty()) return {};
  std::vector<uint32_t> point_of;
  for (const CellBlock& block : mesh_.blocks) {
    point_of.insert(point_of.end(), block.connectivity.begin(), block.connectivity.end());
  }
  std::vector<uint64_t> order(point_of.size());
  std::iota(order.begin(), order.end(), uint64_t{0});
  // The corner's number decides at last, so that the order is total and every compiler makes the same file.
  std::sort(order.begin(), order.end(), [&](uint64_t a, uint64_t b) {
    if (point_of[a] != point_of[b]) return point_of[a] < point_of[b];
    const int values = compare_values(a, b);
    return values != 0 ? values < 0 : a < b;
  });
  corner_points_.resize(order.size());
  size_t next = 0;
  for (uint64_t point = 0; point < mesh_.point_count(); ++point) {
    if (next == order.size() || point_of[order[next]] != point) {
      cells_.old_point.push_back(static_cast<uint32_t>(point));
      cells_.corner_of_point.push_back(GltfCells::no_corner);
    }
    for (bool first = true; next < order.size() && point_of[order[next]] == point; ++next, first = false) {
      if (first || !same_values(order[next - 1], order[next])) {
        if (cells_.old_point.size() == max_points) {
          return failure(ErrorCode::usage, "splitting points at corners gives more than 2^32 points");
        }
        cells_.old_point.push_back(static_cast<uint32_t>(point));
        cells_.corner_of_point.push_back(order[next]);
      }
      corner_points_[order[next]] = static_cast<uint32_t>(cells_.old_point.size() - 1);
    }
  }
  cells_.point_count = cells_.old_point.size();
  const uint64_t more = cells_.point_count - mesh_.point_count();
  notes_.push_back("glTF has no arrays on corners: " + counted(more, "point") +
                   " added where corners differ");
  return {};
}

/// Adds a cell to the list of its kind; `lists`: points, lines, triangles.
void Collector::add_cell(CellType type, std::span<const uint32_t> nodes, std::vector<uint32_t>* lists[3]) {
  const size_t n = nodes.size();
  const auto triangle = [&](size_t a, size_t b, size_t c) {
    lists[2]->insert(lists[2]->end(), {nodes[a], nodes[b], nodes[c]});
  };
  switch (type) {
    case CellType::vertex:
    case CellType::poly_vertex:
      lists[0]->insert(lists[0]->end(), nodes.begin(), nodes.end());
      return;
    case CellType::line:
    case CellType::poly_line:
      for (size_t i = 0; i + 1 < n; ++i) lists[1]->insert(lists[1]->end(), {nodes[i], nodes[i + 1]});
      return;
    case CellType::triangle:
    case CellType::quad:
    case CellType::polygon:
      if (n < 3) ++degenerate_;
      if (n > 3) ++polygons_;
      // A fan around the first corner.
      for (size_t i = 0; i + 2 < n; ++i) triangle(0, i + 1, i + 2);
      return;
    case CellType::pixel:
      ++polygons_;
      triangle(0, 1, 3);
      triangle(0, 3, 2);
      return;
    case CellType::triangle_strip:
      ++strips_;
      for (size_t i = 0; i + 2 < n; ++i) triangle(i, i + 1 + i % 2, i + 2 - i % 2);
      return;
    default:
      ++dropped_;
  }
}

void Collector::add_block(size_t b) {
  const CellBlock& block = mesh_.blocks[b];
  const size_t first = cells_.primitives.size();
  std::map<int, std::array<std::vector<uint32_t>, 3>> by_material;
  uint64_t corner = corner_;
  for (uint64_t i = 0; i < block.size(); ++i) {
    std::span<const uint32_t> nodes = block.cell(i);
    if (!corner_points_.empty())
      nodes = std::span<const uint32_t>(corner_points_).subspan(corner, nodes.size());
    corner += nodes.size();
    auto& lists = by_material[material_of(cell_ + i)];
    std::vector<uint32_t>* pointers[3] = {&lists[0], &lists[1], &lists[2]};
    add_cell(block.type == CellType::mixed ? static_cast<CellType>(block.types[i]) : block.type, nodes,
             pointers);
    // One whole polyline is what glTF calls a strip. Several would each take a primitive of its own, so they
    // become lines.
    if (block.type == CellType::poly_line && block.size() == 1 && nodes.size() > 1)
      lists[1].assign(nodes.begin(), nodes.end());
  }
  cell_ += block.size();
  corner_ = corner;
  static constexpr GltfPrimitive::Mode modes[3] = {GltfPrimitive::points, GltfPrimitive::lines,
                                                   GltfPrimitive::triangles};
  // In the order of materials, not of a hash.
  for (auto& [material, lists] : by_material) {
    for (size_t k = 0; k < 3; ++k) {
      if (lists[k].empty()) continue;
      GltfPrimitive primitive;
      const bool strip = k == 1 && block.type == CellType::poly_line && block.size() == 1;
      primitive.mode = strip ? GltfPrimitive::line_strip : modes[k];
      primitive.block = b;
      primitive.material = material;
      const auto [least, most] = std::minmax_element(lists[k].begin(), lists[k].end());
      primitive.least = *least;
      primitive.most = *most;
      primitive.indices = std::move(lists[k]);
      cells_.primitives.push_back(std::move(primitive));
    }
  }
  if (cells_.primitives.size() == first && block.size() == 0) {
    notes_.push_back("the empty block \"" + block.name + "\" left out");
  }
}

void Collector::note_changes() {
  if (polygons_ != 0) {
    notes_.push_back("glTF has triangles only: " + counted(polygons_, "polygon") +
                     " cut into fans (concave ones may fold over)");
  }
  if (strips_ != 0) notes_.push_back(counted(strips_, "triangle strip") + " split into triangles");
  if (degenerate_ != 0) notes_.push_back(counted(degenerate_, "face") + " of fewer than 3 corners left out");
  if (dropped_ != 0)
    notes_.push_back(counted(dropped_, "volume or quadratic cell") + " left out: glTF has none");
}

Result<GltfCells> Collector::collect() {
  find_material();
  MAILLE_CHECK(split_points());
  for (size_t b = 0; b < mesh_.blocks.size(); ++b) add_block(b);
  note_changes();
  if (cells_.primitives.empty() && mesh_.cell_count() != 0) {
    return failure(ErrorCode::usage, "glTF holds points, lines and triangles, but the mesh has none");
  }
  if (cells_.primitives.empty() && mesh_.point_count() != 0) {
    GltfPrimitive all;
    all.mode = GltfPrimitive::points;
    all.most = static_cast<uint32_t>(mesh_.point_count() - 1);
    cells_.primitives.push_back(std::move(all));
    notes_.push_back("there are no cells: the points are written as a primitive of points");
  }
  return std::move(cells_);
}

}  // namespace

Result<GltfCells> collect_gltf_cells(const Mesh& mesh, std::vector<std::string>& notes) {
  return Collector(mesh, notes).collect();
}

}  // namespace maille
