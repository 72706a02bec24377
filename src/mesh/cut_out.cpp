#include "mesh/cut_out.h"

#include <algorithm>

#include "mesh/empty_like.h"
#include "mesh/ranked_set.h"

namespace maille {
namespace {

/// Numbers of the corners of cells, through all blocks.
/// `cells` rise. The corners of all cells are counted on the way, since cells of a mixed block differ in
/// size.
std::vector<uint32_t> corners_of(const Mesh& mesh, std::span<const uint32_t> cells) {
  std::vector<uint32_t> corners;
  uint64_t first = 0;
  uint32_t corner = 0;
  size_t next = 0;
  for (const CellBlock& block : mesh.blocks) {
    const uint64_t count = block.size();
    for (uint64_t i = 0; i < count; ++i) {
      const auto nodes = static_cast<uint32_t>(block.cell(i).size());
      const bool wanted = next < cells.size() && cells[next] == first + i;
      next += wanted ? 1 : 0;
      for (uint32_t k = 0; wanted && k < nodes; ++k) corners.push_back(corner + k);
      corner += nodes;
    }
    first += count;
  }
  return corners;
}

void take_arrays(const Mesh& mesh, std::span<const uint32_t> cells, CutArrays arrays, CutOut& cut) {
  cut.mesh.points = taken(mesh.points, cut.points);
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::point) {
      cut.mesh.arrays.push_back(taken(array, cut.points));
    } else if (array.domain == Domain::cell) {
      cut.mesh.arrays.push_back(taken(array, cells));
    } else if (arrays == CutArrays::all) {
      cut.mesh.arrays.push_back(array.domain == Domain::corner ? taken(array, corners_of(mesh, cells))
                                                               : array);
    }
  }
  if (arrays == CutArrays::all) cut.mesh.metadata = mesh.metadata;
}

}  // namespace

CellBlock without_cells(const CellBlock& block) {
  CellBlock none;
  none.name = block.name;
  none.type = block.type;
  if (!block.offsets.empty()) none.offsets.push_back(0);
  if (!block.cell_faces.empty()) none.cell_faces.push_back(0);
  return none;
}

void append_cell(const CellBlock& from, uint64_t i, CellBlock& to) {
  const auto points = from.cell(i);
  if (!from.types.empty()) to.types.push_back(from.types[i]);
  to.connectivity.insert(to.connectivity.end(), points.begin(), points.end());
  if (!from.offsets.empty()) to.offsets.push_back(to.connectivity.size());
  if (from.cell_faces.empty()) return;
  const auto faces = from.faces(i);
  to.face_sizes.insert(to.face_sizes.end(), faces.begin(), faces.end());
  to.cell_faces.push_back(to.face_sizes.size());
}

Array taken(const Array& from, std::span<const uint32_t> tuples) {
  Array to = empty_like(from);
  const size_t size = from.tuple_size();
  to.bytes.resize(tuples.size() * size);
  for (size_t i = 0; i < tuples.size(); ++i)
    std::copy_n(from.bytes.data() + tuples[i] * size, size, to.bytes.data() + i * size);
  return to;
}

// Two passes: all points of the chosen cells are marked, then each gets its rank among them as its new
// number. So points keep their order, and nothing is sorted. All blocks are kept, also those of which no cell
// is taken, so that numbers of blocks stay.
CutOut cut_out(const Mesh& mesh, std::span<const uint32_t> cells, CutArrays arrays) {
  CutOut cut;
  RankedSet points(mesh.point_count());
  uint64_t first = 0;
  size_t next = 0;
  for (const CellBlock& block : mesh.blocks) {
    const uint64_t end = first + block.size();
    CellBlock& to = cut.mesh.blocks.emplace_back(without_cells(block));
    for (; next < cells.size() && cells[next] < end; ++next) append_cell(block, cells[next] - first, to);
    for (const uint32_t point : to.connectivity) points.add(point);
    first = end;
  }
  points.count();
  cut.points = points.numbers();
  for (CellBlock& block : cut.mesh.blocks) {
    for (uint32_t& point : block.connectivity) point = points.rank(point);
  }
  take_arrays(mesh, cells, arrays, cut);
  return cut;
}

}  // namespace maille
