#include "io/cell_store.h"

#include <algorithm>

namespace maille {

// The type alone is not enough: a cell that got another number of nodes than its type has would make the
// block invalid. With uniform lengths the first cell decides.
bool CellStore::is_uniform(uint64_t first, uint64_t count, CellType type) const {
  const auto begin = types_.begin() + static_cast<ptrdiff_t>(first);
  const auto is_type = [&](uint8_t other) { return other == static_cast<uint8_t>(type); };
  if (!std::all_of(begin, begin + static_cast<ptrdiff_t>(count), is_type)) return false;
  if (nodes_of(type) == 0) return true;
  for (uint64_t i = first; i < first + count; ++i) {
    if (lengths_.length(i) != nodes_of(type)) return false;
    if (lengths_.uniform()) return true;
  }
  return true;
}

CellType CellStore::common_type(uint64_t first, uint64_t count) const {
  if (count == 0) return CellType::mixed;
  return is_uniform(first, count, type(first)) ? type(first) : CellType::mixed;
}

// The subtraction cannot wrap: `first` never exceeds count(), as each shape is compared with what is left.
bool CellStore::fits(std::span<const NamedRun> shapes) const {
  uint64_t first = 0;
  for (const NamedRun& shape : shapes) {
    if (shape.cells > count() - first) return false;
    if (shape.type != CellType::mixed && !is_uniform(first, shape.cells, shape.type)) return false;
    first += shape.cells;
  }
  return first == count();
}

CellBlock CellStore::make_block(uint64_t first, const NamedRun& shape) {
  CellBlock block;
  block.name = shape.name;
  block.type = shape.type;
  const uint64_t last = first + shape.cells;
  if (shape.cells == 0) return block;
  const uint64_t begin = lengths_.begin(first);
  const uint64_t end = lengths_.begin(last - 1) + lengths_.length(last - 1);
  // One block for all is the usual case: moving it halves the memory at the peak.
  const bool all = shape.cells == count();
  if (all) {
    block.connectivity = std::move(nodes);
  } else {
    block.connectivity.assign(nodes.begin() + static_cast<ptrdiff_t>(begin),
                              nodes.begin() + static_cast<ptrdiff_t>(end));
  }
  if (block.type == CellType::mixed) {
    block.types.assign(types_.begin() + static_cast<ptrdiff_t>(first),
                       types_.begin() + static_cast<ptrdiff_t>(last));
  }
  if (nodes_of(block.type) == 0) {
    block.offsets.reserve(shape.cells + 1);
    for (uint64_t i = first; i < last; ++i) block.offsets.push_back(lengths_.begin(i) - begin);
    block.offsets.push_back(end - begin);
  }
  const uint64_t first_face = faces_.begin(first);
  const uint64_t last_face = faces_.begin(last - 1) + faces_.length(last - 1);
  const std::span types = std::span(types_).subspan(first, shape.cells);
  const bool polyhedra =
      std::find(types.begin(), types.end(), static_cast<uint8_t>(CellType::polyhedron)) != types.end();
  if (!polyhedra) return block;
  block.face_sizes.assign(face_sizes.begin() + static_cast<ptrdiff_t>(first_face),
                          face_sizes.begin() + static_cast<ptrdiff_t>(last_face));
  for (uint64_t i = first; i < last; ++i) block.cell_faces.push_back(faces_.begin(i) - first_face);
  block.cell_faces.push_back(last_face - first_face);
  return block;
}

std::vector<CellBlock> CellStore::take(std::span<const NamedRun> shapes) {
  std::vector<CellBlock> blocks;
  uint64_t first = 0;
  for (const NamedRun& shape : shapes) {
    NamedRun actual = shape;
    if (!is_uniform(first, shape.cells, shape.type)) actual.type = CellType::mixed;
    blocks.push_back(make_block(first, actual));
    first += shape.cells;
  }
  return blocks;
}

std::vector<CellBlock> CellStore::take() {
  if (count() == 0) return {};
  const NamedRun all{count(), common_type(0, count()), {}};
  return take(std::span(&all, 1));
}

}  // namespace maille
