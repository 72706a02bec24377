// Which faces are the same: sorted by their corners, so that equal ones stand together.
#include "io/polymesh_faces.h"

#include <algorithm>
#include <utility>

#include "io/cell_faces.h"

namespace maille {

bool FoamFaceTable::add(std::span<const uint32_t> face, uint64_t cell, uint64_t patch, bool anywhere,
                        bool& repeats) {
  Side side{};
  side.begin = corners_.size();
  for (size_t i = 0; i < face.size(); ++i) {
    if (face[i] != face[(i + 1) % face.size()]) corners_.push_back(face[i]);
  }
  side.size = static_cast<uint32_t>(corners_.size() - side.begin);
  repeats = repeats || side.size < face.size();
  if (side.size < 3) {
    corners_.resize(side.begin);
    return false;
  }
  uint32_t* const from = corners_.data() + side.begin;
  side.least = static_cast<uint32_t>(std::min_element(from, from + side.size) - from);
  if (anywhere) std::rotate(from, from + std::exchange(side.least, 0u), from + side.size);
  const uint32_t next = from[(side.least + 1) % side.size];
  const uint32_t before = from[(side.least + side.size - 1) % side.size];
  side.backwards = before < next;
  side.key = uint64_t{from[side.least]} << 32 | std::min(before, next);
  side.cell = cell;
  side.patch = patch;
  sides_.push_back(side);
  return true;
}

Result<> FoamFaceTable::add_cell(const CellBlock& block, uint64_t i, const std::string& name) {
  uint64_t faces = 0;
  bool repeats = false;
  const bool anywhere = block.type_of(i) != CellType::polyhedron;
  const bool has_faces = for_each_face(block, i, [&](std::span<const uint32_t> face) {
    faces += add(face, cells, 0, anywhere, repeats) ? 1 : 0;
  });
  if (!has_faces) {
    ++left_out;
    return {};
  }
  if (faces < 4) {
    return failure(ErrorCode::usage, name + ": volume cell " + std::to_string(cells) + " has " +
                                         std::to_string(faces) +
                                         " faces of three points or more, but a cell of polyMesh has four");
  }
  simplified += repeats ? 1 : 0;
  ++cells;
  return {};
}

Result<> FoamFaceTable::collect(const Mesh& mesh, const PatchOf& patch_of, const std::string& name) {
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      if (!is_face(block.type_of(i))) MAILLE_CHECK(add_cell(block, i, name));
    }
  }
  uint64_t cell = 0;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i, ++cell) {
      bool repeats = false;
      if (is_face(block.type_of(i)) && !add(block.cell(i), no_cell, patch_of(block, cell), false, repeats))
        ++loose;
    }
  }
  return {};
}

/// As strcmp() does, of the corners from the least one on.
int FoamFaceTable::compare(const Side& a, const Side& b) const {
  if (a.key != b.key) return a.key < b.key ? -1 : 1;
  if (a.size != b.size) return a.size < b.size ? -1 : 1;
  for (uint32_t i = 2; i < a.size; ++i) {
    const uint32_t left = corner(corners_, a, i), right = corner(corners_, b, i);
    if (left != right) return left < right ? -1 : 1;
  }
  return 0;
}

/// Sides with the same corners; those of cells come first.
Result<> FoamFaceTable::join(std::span<const uint64_t> same, const std::string& name) {
  size_t of_cells = 0;
  while (of_cells < same.size() && sides_[same[of_cells]].cell != no_cell) ++of_cells;
  const auto cell = [&](size_t i) { return std::to_string(sides_[same[i]].cell); };
  const size_t alone = same.size() - of_cells;
  if (of_cells > 2) {
    return failure(ErrorCode::usage, name + ": volume cells " + cell(0) + ", " + cell(1) + " and " + cell(2) +
                                         " share a face, but polyMesh has two cells at a face at most");
  }
  if (of_cells == 0) {
    loose += alone;
    return {};
  }
  const Side& first = sides_[same[0]];
  corner_count += first.size;
  if (of_cells == 2) {
    const Side& second = sides_[same[1]];
    if (first.cell == second.cell)
      return failure(ErrorCode::usage, name + ": volume cell " + cell(0) +
                                           " has the same face twice, which polyMesh cannot hold");
    same_side += first.backwards == second.backwards ? 1 : 0;
    between_cells += alone;
    inner.push_back({first.cell, second.cell, same[0]});
    return {};
  }
  if (alone == 0) {
    rest.push_back({first.cell, same[0], false});
    return {};
  }
  const Side& face = sides_[same[1]];
  const bool inside = face.backwards != first.backwards;
  patches[face.patch].push_back({first.cell, same[1], inside});
  repeated += alone - 1;
  turned += inside ? 1 : 0;
  return {};
}

Result<> FoamFaceTable::join_all(const std::string& name) {
  std::vector<uint64_t> sorted(sides_.size());
  for (uint64_t i = 0; i < sorted.size(); ++i) sorted[i] = i;
  std::sort(sorted.begin(), sorted.end(), [&](uint64_t a, uint64_t b) {
    const int compared = compare(sides_[a], sides_[b]);
    return compared != 0 ? compared < 0 : a < b;
  });
  for (size_t begin = 0, end = 0; begin < sorted.size(); begin = end) {
    while (end < sorted.size() && compare(sides_[sorted[begin]], sides_[sorted[end]]) == 0) ++end;
    MAILLE_CHECK(join(std::span(sorted).subspan(begin, end - begin), name));
  }
  return {};
}

void FoamFaceTable::order() {
  std::sort(inner.begin(), inner.end(), [](const Inner& a, const Inner& b) {
    if (a.owner != b.owner) return a.owner < b.owner;
    return a.neighbour != b.neighbour ? a.neighbour < b.neighbour : a.side < b.side;
  });
  const auto by_side = [](const Outer& a, const Outer& b) { return a.side < b.side; };
  for (std::vector<Outer>& patch : patches) std::sort(patch.begin(), patch.end(), by_side);
  std::sort(rest.begin(), rest.end(), by_side);
}

Result<FoamFaceTable> FoamFaceTable::make(const Mesh& mesh, uint64_t patches, const PatchOf& patch_of,
                                          const std::string& name) {
  FoamFaceTable table;
  table.patches.resize(patches);
  MAILLE_CHECK(table.collect(mesh, patch_of, name));
  if (table.cells == 0)
    return failure(ErrorCode::usage, name + ": polyMesh holds volume cells, but the mesh has none");
  MAILLE_CHECK(table.join_all(name));
  table.order();
  return table;
}

}  // namespace maille
