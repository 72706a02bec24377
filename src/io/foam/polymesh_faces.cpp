// Which faces are the same: sorted by their corners, so that equal ones stand together. Each list begins with
// the least corner and goes towards the lesser of its neighbours, whoever sees it.
#include "io/foam/polymesh_faces.h"

#include <algorithm>
#include <utility>

#include "io/cell_faces.h"

namespace maille {

Result<bool> FoamFaceTable::add(std::span<const uint32_t> face, Side side, bool anywhere, bool& repeats) {
  kept_.clear();
  // A corner that follows itself says nothing.
  for (size_t i = 0; i < face.size(); ++i) {
    if (face[i] != face[(i + 1) % face.size()]) kept_.push_back(face[i]);
  }
  const size_t size = kept_.size();
  repeats = repeats || size < face.size();
  if (size < 3) return false;
  auto least = static_cast<size_t>(std::min_element(kept_.begin(), kept_.end()) - kept_.begin());
  if (anywhere)
    std::rotate(kept_.begin(), kept_.begin() + static_cast<ptrdiff_t>(std::exchange(least, 0u)), kept_.end());
  const bool backwards = kept_[(least + size - 1) % size] < kept_[(least + 1) % size];
  side.turn = uint64_t{least} << 1 | (backwards ? 1 : 0);
  list_.clear();
  for (size_t i = 0; i < size; ++i) list_.push_back(kept_[(least + (backwards ? size - i : i)) % size]);
  MAILLE_CHECK(sides_.add({side.number, side.cell, side.target, side.turn}, list_));
  return true;
}

Result<bool> FoamFaceTable::add_cell(CellType type, std::span<const uint32_t> nodes,
                                     std::span<const uint32_t> face_sizes) {
  uint64_t added = 0;
  bool repeats = false;
  const bool anywhere = type != CellType::polyhedron;
  Result<> status;
  const bool has_faces = for_each_linear_face(type, nodes, face_sizes, [&](std::span<const uint32_t> face) {
    if (!status) return;
    const auto is_face = add(face, {cell_sides_++, cells, 0, 0}, anywhere, repeats);
    if (!is_face) status = tl::unexpected(is_face.error());
    added += is_face && *is_face ? 1 : 0;
  });
  MAILLE_CHECK(status);
  if (!has_faces) {
    ++left_out;
    return false;
  }
  if (added < 4) {
    return failure(ErrorCode::usage, name_ + ": volume cell " + std::to_string(cells) + " has " +
                                         std::to_string(added) +
                                         " faces of three points or more, but a cell of polyMesh has four");
  }
  simplified += repeats ? 1 : 0;
  ++cells;
  return true;
}

Result<> FoamFaceTable::add_alone(std::span<const uint32_t> corners, uint64_t target) {
  bool repeats = false;
  if (!MAILLE_TRY(add(corners, {of_faces + face_sides_++, no_cell, target, 0}, false, repeats))) ++loose;
  return {};
}

Result<> FoamFaceTable::add_face(std::span<const uint32_t> corners, uint64_t patch) {
  return add_alone(corners, patch);
}

Result<> FoamFaceTable::add_zone_face(std::span<const uint32_t> corners, uint64_t zone) {
  return add_alone(corners, zone_target | zone);
}

/// Puts the face `same_`, as one of its sides has it, with marks_ into its place in the order of writing.
Result<> FoamFaceTable::write(const std::array<uint64_t, 4>& place, const Side& side, bool turn_over) {
  const size_t size = same_.size(), least = side.turn >> 1;
  list_.resize(size);
  for (size_t i = 0; i < size; ++i) list_[(least + (side.backwards() ? size - i : i)) % size] = same_[i];
  // Turned over, it keeps its first corner.
  if (turn_over) std::reverse(list_.begin() + 1, list_.end());
  for (const Mark& mark : marks_) {
    list_.push_back(static_cast<uint32_t>(mark.zone));
    list_.push_back(mark.flipped ? 1 : 0);
    list_.push_back(static_cast<uint32_t>(mark.order));
    list_.push_back(static_cast<uint32_t>(mark.order >> 32));
  }
  ++faces;
  corners += size;
  return sorted_.add({place[0], place[1], place[2], place[3], marks_.size()}, list_);
}

FoamFaceTable::Face FoamFaceTable::face_of(const ListSorter<5>::Item& item) {
  const std::span<const uint32_t> list = item.list;
  const size_t behind = list.size() - mark_size * static_cast<size_t>(item.numbers[4]);
  marks_.clear();
  for (size_t at = behind; at < list.size(); at += mark_size)
    marks_.push_back({list[at], list[at + 2] | uint64_t{list[at + 3]} << 32, list[at + 1] != 0});
  const bool is_inner = item.numbers[0] == 0;
  const uint64_t number = item.numbers[1];
  return {item.numbers[is_inner ? 1 : 2], is_inner ? item.numbers[2] : no_cell,
          is_inner || number < of_faces ? ~uint64_t{0} : number - of_faces, list.first(behind), marks_};
}

/// Takes the sides that are of zones out of the group; they are marks of the face.
void FoamFaceTable::collect_marks(const Side& first) {
  marks_.clear();
  const auto is_mark = [](const Side& side) {
    return side.cell == no_cell && (side.target & zone_target) != 0;
  };
  for (const Side& side : group_) {
    if (is_mark(side))
      marks_.push_back({side.target & ~zone_target, side.number, side.backwards() != first.backwards()});
  }
  group_.erase(std::remove_if(group_.begin(), group_.end(), is_mark), group_.end());
}

/// Makes one face of the sides in group_, which have the same corners; those of cells come first, as their
/// numbers are lower.
Result<> FoamFaceTable::join_same() {
  size_t of_cells = 0;
  while (of_cells < group_.size() && group_[of_cells].cell != no_cell) ++of_cells;
  const auto cell = [&](size_t i) { return std::to_string(group_[i].cell); };
  if (of_cells > 2) {
    return failure(ErrorCode::usage, name_ + ": volume cells " + cell(0) + ", " + cell(1) + " and " +
                                         cell(2) +
                                         " share a face, but polyMesh has two cells at a face at most");
  }
  if (of_cells == 0) {
    loose += group_.size();
    return {};
  }
  const Side first = group_[0];
  collect_marks(first);
  const size_t alone = group_.size() - of_cells;
  if (of_cells == 2) {
    const Side& second = group_[1];
    if (first.cell == second.cell)
      return failure(ErrorCode::usage, name_ + ": volume cell " + cell(0) +
                                           " has the same face twice, which polyMesh cannot hold");
    // Two cells must see a face from different sides.
    same_side += first.backwards() == second.backwards() ? 1 : 0;
    between_cells += alone;
    ++inner;
    return write({0, first.cell, second.cell, first.number}, first, false);
  }
  if (alone == 0) {
    ++rest;
    return write({rest_place, first.number, first.cell, 0}, first, false);
  }
  const Side& face = group_[1];
  const bool inside = face.backwards() != first.backwards();
  repeated += alone - 1;
  turned += inside ? 1 : 0;
  if (patch_faces.size() <= face.target) patch_faces.resize(face.target + 1);
  ++patch_faces[face.target];
  return write({place_of(face.target), face.number, first.cell, 0}, face, inside);
}

Result<> FoamFaceTable::join() {
  if (cells == 0)
    return failure(ErrorCode::usage, name_ + ": polyMesh holds volume cells, but the mesh has none");
  MAILLE_CHECK(sides_.sort());
  while (sides_.front() != nullptr) {
    same_ = sides_.front()->list;
    group_.clear();
    while (sides_.front() != nullptr && sides_.front()->list == same_) {
      const auto& [number, cell, target, turn] = sides_.front()->numbers;
      group_.push_back({number, cell, target, turn});
      MAILLE_CHECK(sides_.take());
    }
    MAILLE_CHECK(join_same());
  }
  // Its memory is free for the second sort.
  sides_ = {0, ""};  // its memory
  return sorted_.sort();
}

}  // namespace maille
