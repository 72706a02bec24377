#pragma once

#include <maille/mesh.h>

#include <span>
#include <string>
#include <vector>

#include "io/list_sorter.h"

namespace maille {

/// The faces of a mesh as polyMesh has them: each once, with the cells on both sides. They are sorted twice,
/// out of core: by corners, so that equal ones stand together, then as they are written. Order of calls:
/// add_cell(), add_face() and add_zone_face() in any order, join(), then visit() as often as wanted.
class FoamFaceTable {
 public:
  static constexpr uint64_t no_cell = ~uint64_t{0};
  struct Mark {
    uint64_t zone, order;
    bool flipped;  ///< the zone sees the face from the other side
  };
  struct Face {
    uint64_t owner = 0, neighbour = no_cell;
    uint64_t side = ~uint64_t{0};  ///< of a patch: the number of the cell that is this face, among those
    std::span<const uint32_t> corners;
    std::span<const Mark> marks;
  };

  /// `memory`: bytes, about. `name`: the file's.
  FoamFaceTable(uint64_t memory, const std::string& folder, std::string name)
      : name_(std::move(name)), sides_(memory / 2, folder), sorted_(memory / 2, folder) {}

  /// Error: usage, where polyMesh cannot hold the cell. False: it is of a type that polyMesh does not have.
  Result<bool> add_cell(CellType type, std::span<const uint32_t> nodes, std::span<const uint32_t> face_sizes);
  /// A cell that is a face.
  Result<> add_face(std::span<const uint32_t> corners, uint64_t patch);
  /// A face of a zone; it may be inside.
  Result<> add_zone_face(std::span<const uint32_t> corners, uint64_t zone);
  /// Call this behind the last one. Error: usage, where polyMesh cannot hold the mesh.
  Result<> join();

  /// Calls f(const Face&) for every face, in the order of the files: inner ones by owner and neighbour, those
  /// of patches in the order of the mesh, those in no patch. `last`: the patch that comes behind all others,
  /// so that the rest can join it.
  template <class F>
  Result<> visit(uint64_t last, F f) {
    if (last == no_patch) return visit_places(0, no_place, f);
    MAILLE_CHECK(visit_places(0, place_of(last), f));
    MAILLE_CHECK(visit_places(place_of(last) + 1, rest_place, f));
    MAILLE_CHECK(visit_places(place_of(last), place_of(last) + 1, f));
    return visit_places(rest_place, no_place, f);
  }
  static constexpr uint64_t no_patch = ~uint64_t{0};

  std::vector<uint64_t> patch_faces;  ///< number by patch; those behind the last that has some are missing
  uint64_t cells = 0, faces = 0, inner = 0, corners = 0;
  uint64_t rest = 0;           ///< faces at the boundary, but in no patch
  uint64_t left_out = 0;       ///< cells of types that polyMesh does not have
  uint64_t simplified = 0;     ///< cells with a face that had a point twice
  uint64_t same_side = 0;      ///< inner faces that both cells see from the same side
  uint64_t between_cells = 0;  ///< of the cells that are faces, those inside
  uint64_t repeated = 0;       ///< ... in two patches
  uint64_t loose = 0;          ///< ... of no cell
  uint64_t turned = 0;         ///< ... seen from inside

 private:
  /// A face as a cell has it, or as a cell of its own. The sorter has its corners from the least one on,
  /// towards the lesser of the two beside it.
  struct Side {
    uint64_t number;  ///< in the order of the mesh, those of volume cells before all others
    uint64_t cell;
    uint64_t target;  ///< patch or zone
    uint64_t turn;    ///< place of the least corner, and whether the list goes backwards
    bool backwards() const { return (turn & 1) != 0; }
  };
  // Beyond the number of sides that any mesh has.
  static constexpr uint64_t of_faces = uint64_t{1} << 62;  ///< first number of a side that is a cell
  static constexpr uint64_t zone_target = uint64_t{1} << 62;
  // The first number of what is sorted for writing.
  static constexpr uint64_t place_of(uint64_t patch) { return patch + 1; }
  static constexpr uint64_t rest_place = uint64_t{1} << 62, no_place = ~uint64_t{0};
  static constexpr size_t mark_size = 4;

  /// `anywhere`: the face may begin with any corner; it begins with the least, so that what is written does
  /// not depend on how cells begin. False: fewer than three corners are left.
  Result<bool> add(std::span<const uint32_t> face, Side side, bool anywhere, bool& repeats);
  Result<> add_alone(std::span<const uint32_t> corners, uint64_t target);
  Result<> join_same();
  Result<> write(const std::array<uint64_t, 4>& place, const Side& side, bool turn_over);
  void collect_marks(const Side& first);

  template <class F>
  Result<> visit_places(uint64_t begin, uint64_t end, F& f) {
    MAILLE_CHECK(sorted_.rewind());
    while (sorted_.front() != nullptr && sorted_.front()->numbers[0] < end) {
      if (sorted_.front()->numbers[0] >= begin) MAILLE_CHECK(f(face_of(*sorted_.front())));
      MAILLE_CHECK(sorted_.take());
    }
    return {};
  }
  Face face_of(const ListSorter<5>::Item& item);

  std::string name_;
  ListSorter<4, SortBy::list> sides_;
  /// Inner: 0, owner, neighbour, number. Others: place, number, owner, 0. Then how many marks are behind the
  /// corners.
  ListSorter<5> sorted_;
  uint64_t cell_sides_ = 0, face_sides_ = 0;
  std::vector<uint32_t> kept_, same_, list_;
  std::vector<Side> group_;
  std::vector<Mark> marks_;
};

}  // namespace maille
