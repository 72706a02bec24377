#include "io/vtk/joined_parts.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <tuple>

#include "io/reading.h"
#include "io/vtk/vtk_field_data.h"
#include "mesh/cut_out.h"

namespace maille {
namespace {

constexpr uint32_t none = UINT32_MAX;

/// The array if it holds whole numbers, one for each element; else null.
const Array* numbers_of(const Mesh& mesh, const std::string& name, Domain domain) {
  const Array* const array = mesh.find(name, domain);
  return array != nullptr && !is_float(array->type) && array->components == 1 ? array : nullptr;
}

/// VTK's flags of points and cells that other parts have as their own. Older versions of VTK wrote
/// vtkGhostLevels instead.
class Ghosts {
 public:
  Ghosts(const Mesh& mesh, Domain domain)
      : types_(numbers_of(mesh, "vtkGhostType", domain)),
        levels_(numbers_of(mesh, "vtkGhostLevels", domain)) {}
  bool has(uint64_t element) const {
    constexpr uint64_t duplicate = 1;  // vtkDataSetAttributes::DUPLICATECELL, DUPLICATEPOINT
    return (types_ != nullptr && (integer_at(*types_, element) & duplicate) != 0) ||
           (levels_ != nullptr && integer_at(*levels_, element) != 0);
  }

 private:
  const Array* types_;
  const Array* levels_;
};

/// A number of the whole mesh, or of a place, and a point or cell that has it. Sorted by both, so that groups
/// of one key come together and in the order of the parts.
struct Holder {
  uint64_t key = 0;
  uint32_t element = 0;
  bool operator<(const Holder& o) const { return std::tie(key, element) < std::tie(o.key, o.element); }
};

template <class Act>
Result<> for_each_group(const std::vector<Holder>& sorted, Act act) {
  for (size_t begin = 0, end = 0; begin < sorted.size(); begin = end) {
    while (end < sorted.size() && sorted[end].key == sorted[begin].key) ++end;
    MAILLE_CHECK(act(std::span(sorted).subspan(begin, end - begin)));
  }
  return {};
}

/// Joins parts in four steps: which elements are ghosts, which points are one, which cells and points are
/// kept, and a new mesh of these. All orders are total, so the result depends on the parts only. Memory: some
/// tens of bytes for each point beside the mesh.
class PartJoiner {
 public:
  PartJoiner(const std::string& name, const std::vector<uint64_t>& first_points,
             const std::vector<uint64_t>& first_cells, const PartMarks& marks, CellKeys* apart, Mesh& mesh,
             std::vector<std::string>& notes)
      : name_(name),
        first_points_(first_points),
        first_cells_(first_cells),
        apart_(apart),
        mesh_(mesh),
        notes_(notes),
        point_ghosts_(mesh, Domain::point),
        cell_ghosts_(mesh, Domain::cell),
        point_ids_(numbers_of(mesh, marks.point_ids, Domain::point)),
        cell_ids_(numbers_of(mesh, marks.cell_ids, Domain::cell)) {}

  Result<> run() {
    find_ghosts();
    // A single part shares nothing with others; its ghosts, should it have some, are kept.
    if (first_points_.size() < 2 && apart_ == nullptr) return {};
    find_owned_points();
    joined_.resize(mesh_.point_count());
    std::iota(joined_.begin(), joined_.end(), 0u);
    if (point_ids_ != nullptr) {
      MAILLE_CHECK(weld_by_numbers());
    } else {
      find_places();
      has_ghosts_ ? weld_by_places() : tell_of_points_apart();
    }
    MAILLE_CHECK(choose_cells());
    if (apart_ == nullptr) MAILLE_CHECK(check_owners());
    if (apart_ != nullptr && point_ids_ != nullptr) tell_cells();
    choose_points();
    tell_differences();
    rebuild();
    drop_flags();
    return {};
  }

 private:
  tl::unexpected<Error> malformed(const std::string& what) const {
    return failure(ErrorCode::malformed_input, name_ + ": " + what);
  }
  size_t part_of(const std::vector<uint64_t>& firsts, uint64_t element) const {
    return static_cast<size_t>(std::upper_bound(firsts.begin(), firsts.end(), element) - firsts.begin()) - 1;
  }
  size_t part_of_point(uint64_t point) const { return part_of(first_points_, point); }

  template <class Act>
  void for_each_cell(Act act) const {
    uint64_t cell = 0;
    for (const CellBlock& block : mesh_.blocks) {
      for (uint64_t i = 0, cells = block.size(); i < cells; ++i) act(cell++, block, i);
    }
  }

  void find_ghosts() {
    const uint64_t cells = mesh_.cell_count();
    ghost_.resize(cells);
    for (uint64_t i = 0; i < cells; ++i) ghost_[i] = cell_ghosts_.has(i);
    has_ghosts_ = std::find(ghost_.begin(), ghost_.end(), true) != ghost_.end();
    for (uint64_t i = 0; i < mesh_.point_count() && !has_ghosts_; ++i) has_ghosts_ = point_ghosts_.has(i);
  }

  /// Marks the points of cells that a part has as its own. A point of ghost cells only has its values from
  /// another part, and these may be of an earlier moment.
  void find_owned_points() {
    used_.resize(mesh_.point_count());
    owned_.resize(mesh_.point_count());
    for_each_cell([&](uint64_t cell, const CellBlock& block, uint64_t i) {
      for (const uint32_t point : block.cell(i)) {
        used_[point] = true;
        if (!ghost_[cell]) owned_[point] = true;
      }
    });
  }

  /// How well a point knows its own values: not being a ghost counts more than being on a cell of the part.
  int rank_of(uint32_t point) const { return (point_ghosts_.has(point) ? 0 : 2) + (owned_[point] ? 1 : 0); }
  void weld(std::span<const Holder> group) {
    uint32_t best = group[0].element;
    // Of several that know equally well the first decides.
    for (const Holder& holder : group) {
      if (rank_of(holder.element) > rank_of(best)) best = holder.element;
    }
    for (const Holder& holder : group) joined_[holder.element] = best;
    welded_ += group.size() - 1;
  }

  bool same_place(uint32_t a, uint32_t b) const {
    const size_t size = mesh_.points.tuple_size();
    const auto at = [&](uint32_t point) {
      return mesh_.points.bytes.begin() + static_cast<ptrdiff_t>(point * size);
    };
    return std::equal(at(a), at(a) + static_cast<ptrdiff_t>(size), at(b));
  }

  /// Gives equal positions equal keys, by their bytes: exact, so that -0 and 0 are two places, as are points
  /// that differ by rounding.
  void find_places() {
    const size_t size = mesh_.points.tuple_size();
    std::vector<uint32_t> order(mesh_.point_count());
    std::iota(order.begin(), order.end(), 0u);
    const std::byte* const bytes = mesh_.points.bytes.data();
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
      const int sign = std::memcmp(bytes + a * size, bytes + b * size, size);
      return sign != 0 ? sign < 0 : a < b;
    });
    for (size_t i = 0; i < order.size(); ++i) {
      const bool is_new = i == 0 || !same_place(order[i], order[i - 1]);
      by_place_.push_back({is_new ? i : by_place_.back().key, order[i]});
    }
  }

  Result<> weld_by_numbers() {
    std::vector<Holder> holders(mesh_.point_count());
    for (uint32_t i = 0; i < holders.size(); ++i) holders[i] = {integer_at(*point_ids_, i), i};
    std::sort(holders.begin(), holders.end());
    return for_each_group(holders, [&](std::span<const Holder> group) -> Result<> {
      for (const Holder& holder : group) {
        if (same_place(holder.element, group[0].element)) continue;
        const auto in_part = [&](uint32_t point) {
          const size_t part = part_of_point(point);
          return "point " + std::to_string(point - first_points_[part]) + " of piece " + std::to_string(part);
        };
        return malformed(in_part(group[0].element) + " and " + in_part(holder.element) +
                         " both have number " + std::to_string(holder.key) + " in \"" + point_ids_->name +
                         "\", but different positions; without this array pieces are joined by position");
      }
      weld(group);
      return {};
    });
  }

  /// Whether each part has at most one point at this place. The group is sorted by point, and so by part:
  /// looking at neighbours is enough.
  bool is_clear(std::span<const Holder> group) const {
    for (size_t i = 1; i < group.size(); ++i) {
      if (part_of_point(group[i].element) == part_of_point(group[i - 1].element)) return false;
    }
    return true;
  }
  void weld_by_places() {
    uint64_t unclear = 0;
    static_cast<void>(for_each_group(by_place_, [&](std::span<const Holder> group) -> Result<> {
      const bool several = part_of_point(group.front().element) != part_of_point(group.back().element);
      if (several && is_clear(group)) weld(group);
      if (several && !is_clear(group)) ++unclear;
      return {};
    }));
    if (unclear > 0)
      notes_.push_back(
          "at " + counted(unclear, "place") +
          " a piece has several points, and there is no GlobalPointIds to tell which of them is which: "
          "the pieces stay apart there");
  }
  void tell_of_points_apart() {
    uint64_t apart = 0;
    static_cast<void>(for_each_group(by_place_, [&](std::span<const Holder> group) -> Result<> {
      apart += part_of_point(group.front().element) != part_of_point(group.back().element);
      return {};
    }));
    if (apart > 0)
      notes_.push_back(counted(apart, "place") +
                       " where several pieces have points: these stay apart, as the pieces have neither "
                       "GlobalPointIds nor ghosts (vtkGhostType) that tell them to be one");
  }

  /// The corners of a cell as joined points, sorted; where there are no numbers, as places.
  void corners_of(const CellBlock& block, uint64_t i, std::vector<uint64_t>& out) const {
    out.clear();
    for (const uint32_t point : block.cell(i))
      out.push_back(point_ids_ != nullptr ? joined_[point] : place_[point]);
    std::sort(out.begin(), out.end());
  }
  // 0x9e37...15 is 2^64 divided by the golden ratio (Knuth's multiplicative hashing). Equal hashes of
  // different cells can only hide that a part is missing, nothing else.
  static uint64_t hash_of(const std::vector<uint64_t>& corners) {
    uint64_t hash = corners.size();
    for (const uint64_t corner : corners) hash = (hash ^ corner) * 0x9e3779b97f4a7c15 + (hash >> 29);
    return hash;
  }

  /// Chooses the cells that stay: those that a part has as its own, and of several with one number the first.
  Result<> choose_cells() {
    std::vector<bool> kept(ghost_.size());
    for (size_t i = 0; i < kept.size(); ++i) kept[i] = !ghost_[i];
    std::vector<Holder> holders;
    for (uint32_t i = 0; cell_ids_ != nullptr && i < kept.size(); ++i) {
      if (kept[i]) holders.push_back({integer_at(*cell_ids_, i), i});
    }
    std::sort(holders.begin(), holders.end());
    uint64_t twice = 0;
    MAILLE_CHECK(for_each_group(holders, [&](std::span<const Holder> group) -> Result<> {
      for (const Holder& holder : group.subspan(1)) {
        if (part_of(first_cells_, holder.element) == part_of(first_cells_, group[0].element))
          return malformed("piece " + std::to_string(part_of(first_cells_, holder.element)) +
                           " has several cells of number " + std::to_string(holder.key) + " in \"" +
                           cell_ids_->name + "\"; without this array cells are kept as they come");
        kept[holder.element] = false;
        ++twice;
      }
      return {};
    }));
    for (const Holder& holder : holders) {
      if (kept[holder.element]) cells_.push_back(holder.element);
    }
    // Where there is one block, cells can come in the order of their numbers, which is that of the mesh
    // before it was divided. With several, each keeps its cells in the order in which they come.
    if (cell_ids_ == nullptr || mesh_.blocks.size() != 1) {
      cells_.clear();
      for (uint32_t i = 0; i < kept.size(); ++i) {
        if (kept[i]) cells_.push_back(i);
      }
    }
    if (twice > 0) notes_.push_back(counted(twice, "cell") + " that another piece has, too, left out");
    const auto ghosts = static_cast<uint64_t>(std::count(ghost_.begin(), ghost_.end(), true));
    if (ghosts > 0) notes_.push_back(counted(ghosts, "ghost cell") + " left out");
    return {};
  }

  // A ghost cell is left out because another part has it. If none has, a part is missing, and leaving the
  // cell out would lose it without a word.
  Result<> check_owners() {
    if (std::find(ghost_.begin(), ghost_.end(), true) == ghost_.end()) return {};
    place_.resize(mesh_.point_count());
    for (const Holder& holder : by_place_) place_[holder.element] = holder.key;
    std::vector<uint64_t> owners;
    std::vector<uint64_t> corners;
    const auto key_of = [&](uint64_t cell, const CellBlock& block, uint64_t i) {
      if (cell_ids_ != nullptr) return integer_at(*cell_ids_, cell);
      corners_of(block, i, corners);
      return hash_of(corners);
    };
    for_each_cell([&](uint64_t cell, const CellBlock& block, uint64_t i) {
      if (!ghost_[cell]) owners.push_back(key_of(cell, block, i));
    });
    std::sort(owners.begin(), owners.end());
    uint64_t without = 0, first = 0;
    for_each_cell([&](uint64_t cell, const CellBlock& block, uint64_t i) {
      if (!ghost_[cell] || std::binary_search(owners.begin(), owners.end(), key_of(cell, block, i))) return;
      if (without++ == 0) first = cell;
    });
    if (without == 0) return {};
    const size_t part = part_of(first_cells_, first);
    return malformed("cell " + std::to_string(first - first_cells_[part]) + " of piece " +
                     std::to_string(part) + " is a ghost that no piece owns" +
                     (without > 1 ? ", as are " + counted(without - 1, "other") : "") +
                     "; is a piece missing?");
  }

  // Keys by the numbers of the whole mesh, as joined points have other places in other parts.
  void tell_cells() {
    std::vector<uint64_t> corners;
    for_each_cell([&](uint64_t cell, const CellBlock& block, uint64_t i) {
      corners.clear();
      for (const uint32_t point : block.cell(i)) corners.push_back(integer_at(*point_ids_, point));
      std::sort(corners.begin(), corners.end());
      (ghost_[cell] ? apart_->ghosts : apart_->own).push_back(hash_of(corners));
    });
  }

  /// Chooses the points that stay: those that kept cells use, and those that no cell uses; not those of
  /// ghosts alone.
  void choose_points() {
    std::vector<bool> wanted(mesh_.point_count());
    for (uint32_t i = 0; i < wanted.size(); ++i)
      wanted[i] = joined_[i] == i && (owned_[i] || (!used_[i] && !point_ghosts_.has(i)));
    // An owner that has been joined brings its point along.
    for (uint32_t i = 0; i < wanted.size(); ++i) {
      if (owned_[i]) wanted[joined_[i]] = true;
    }
    for (uint32_t i = 0; i < wanted.size(); ++i) {
      if (wanted[i]) points_.push_back(i);
    }
    if (point_ids_ != nullptr) {
      std::stable_sort(points_.begin(), points_.end(), [&](uint32_t a, uint32_t b) {
        return integer_at(*point_ids_, a) < integer_at(*point_ids_, b);
      });
    }
    if (welded_ > 0) notes_.push_back(counted(welded_, "point") + " joined with those of other pieces");
  }

  void tell_differences() {
    for (const Array& array : mesh_.arrays) {
      if (array.domain != Domain::point || array.name == "vtkGhostType" || array.name == "vtkGhostLevels")
        continue;
      const size_t size = array.tuple_size();
      uint64_t differ = 0;
      for (uint32_t i = 0; i < joined_.size(); ++i) {
        const auto at = [&](uint32_t point) {
          return array.bytes.begin() + static_cast<ptrdiff_t>(point * size);
        };
        if (joined_[i] != i)
          differ += !std::equal(at(i), at(i) + static_cast<ptrdiff_t>(size), at(joined_[i]));
      }
      if (differ > 0)
        notes_.push_back("array \"" + array.name + "\": " + counted(differ, "value") +
                         " of joined points differed; the piece that owns the point decides");
    }
  }

  void rebuild() {
    std::vector<uint32_t> number(mesh_.point_count(), none);
    for (uint32_t i = 0; i < points_.size(); ++i) number[points_[i]] = i;
    std::vector<CellBlock> blocks;
    std::vector<uint64_t> ends;
    uint64_t cells = 0;
    for (const CellBlock& block : mesh_.blocks) ends.push_back(cells += block.size());
    size_t b = 0;
    for (const CellBlock& block : mesh_.blocks) blocks.push_back(without_cells(block));
    // With several blocks cells_ ascends, so `b` only moves forward.
    for (const uint32_t cell : cells_) {
      if (mesh_.blocks.size() > 1) {
        while (cell >= ends[b]) ++b;
      }
      append_cell(mesh_.blocks[b], cell - (ends[b] - mesh_.blocks[b].size()), blocks[b]);
    }
    for (CellBlock& block : blocks) {
      for (uint32_t& point : block.connectivity) point = number[joined_[point]];
    }
    mesh_.blocks = std::move(blocks);
    mesh_.points = taken(mesh_.points, points_);
    for (Array& array : mesh_.arrays) {
      if (array.domain == Domain::point) array = taken(array, points_);
      if (array.domain == Domain::cell) array = taken(array, cells_);
    }
  }

  /// Clears the flags of what was there twice. Other flags (hidden cells, say) stay, and the arrays go when
  /// nothing is left in them.
  void drop_flags() {
    const auto is_spent = [](Array& array) {
      if (array.domain != Domain::point && array.domain != Domain::cell) return false;
      if (array.name == "vtkGhostLevels") return true;
      if (array.name != "vtkGhostType" || array.type != Scalar::u8) return false;
      for (std::byte& flags : array.bytes) flags &= std::byte{0xfe};
      return std::all_of(array.bytes.begin(), array.bytes.end(),
                         [](std::byte b) { return b == std::byte{0}; });
    };
    mesh_.arrays.erase(std::remove_if(mesh_.arrays.begin(), mesh_.arrays.end(), is_spent),
                       mesh_.arrays.end());
  }

  const std::string& name_;
  const std::vector<uint64_t>& first_points_;
  const std::vector<uint64_t>& first_cells_;
  CellKeys* apart_;
  Mesh& mesh_;
  std::vector<std::string>& notes_;
  Ghosts point_ghosts_, cell_ghosts_;
  const Array* point_ids_;
  const Array* cell_ids_;
  bool has_ghosts_ = false;
  uint64_t welded_ = 0;
  std::vector<bool> ghost_;               ///< by cell
  std::vector<bool> used_, owned_;        ///< by point: by any cell; by one of its part's own
  std::vector<Holder> by_place_;          ///< points, sorted; none where they have numbers
  std::vector<uint64_t> place_;           ///< by point
  std::vector<uint32_t> joined_;          ///< by point, the one that stands for it
  std::vector<uint32_t> points_, cells_;  ///< that are kept, in their new order
};

}  // namespace

Result<> join_parts(const std::string& name, const std::vector<uint64_t>& first_points,
                    const std::vector<uint64_t>& first_cells, const PartMarks& marks, CellKeys* apart,
                    Mesh& mesh, std::vector<std::string>& notes) {
  return PartJoiner(name, first_points, first_cells, marks, apart, mesh, notes).run();
}

}  // namespace maille
