#pragma once

#include <maille/error.h>
#include <maille/mesh.h>
#include <maille/source.h>

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace maille {

/// Pieces of a mesh that are coded by themselves, parts or charts of level 0, have points in common. Such
/// points have the same position, bit for bit, in all of them. docs/format.md, 15.1.

/// What joining takes for a point in a list of those that a patch or piece shares: its number and copy, its
/// place, and where it is sorted to. Fitted to cells over points anywhere in parts of 2,000 (maille_scaling).
inline constexpr uint64_t bytes_to_join = 48;

/// A point that several pieces have. Those of one position are told apart by the number of the copy, nearly
/// always 0.
struct SharedPoint {
  uint32_t point = 0;  ///< in the piece
  uint32_t copy = 0;
};

/// The bits of the three numbers of a decoded position: what shared points are known by.
using Place = std::array<uint64_t, 3>;
Place place_of(const Array& positions, uint32_t point);

/// Points on edges of one face (of any odd number), up to chance, rising.
std::vector<uint32_t> points_on_borders(const Mesh& piece);
/// The same of the piece as it is coded; `points` are its points in this order.
std::vector<uint32_t> borders_of_coded(const Mesh& piece, std::span<const uint32_t> points);

/// By piece the points that others have as well, rising. `points` are those of the pieces in the whole mesh,
/// all below `count`. Points of one place are numbered as pieces have them, one after the other.
std::vector<std::vector<SharedPoint>> find_shared(std::span<const std::span<const uint32_t>> points,
                                                  uint32_t count,
                                                  const std::function<Place(uint32_t)>& place_of_point);

/// `border`: of the piece as it is coded. `on_side`: by point there whether it lies on a side of the box
/// around the piece, where one that was cut out of a lattice has its neighbours; none: that is not looked at.
/// No bytes where all points of the border are shared, no others, and there are no copies.
std::vector<std::byte> encode_shared(std::span<const SharedPoint> shared, uint32_t points,
                                     const std::vector<uint32_t>& border,
                                     std::span<const uint8_t> on_side = {});
/// Inverse, rising. Safe on any bytes. Error: corrupt.
Result<std::vector<SharedPoint>> decode_shared(Bytes bytes, uint32_t points,
                                               const std::vector<uint32_t>& border,
                                               std::span<const uint8_t> on_side = {});

/// The numbers of a piece's points in the mesh. Its new points follow one another from `first_new` on; the
/// others have the numbers that earlier pieces gave them.
struct JoinedPart {
  uint32_t points = 0;
  uint32_t first_new = 0;
  std::vector<uint32_t> joined;   ///< points of the piece that are not new, ascending
  std::vector<uint32_t> numbers;  ///< theirs in the mesh

  /// Of all points.
  std::vector<uint32_t> all_numbers() const;
};
/// Which points of pieces are one, as both sides number them.
struct JoinedPoints {
  std::vector<JoinedPart> parts;
  uint32_t count = 0;
};

/// The points of a piece.
struct PieceOfPoints {
  uint32_t points = 0;
  std::span<const SharedPoint> shared;
  std::vector<Place> places = {};  ///< of the shared points
};
/// `place_of_point` is asked for shared points only.
PieceOfPoints piece_of_points(uint32_t points, std::span<const SharedPoint> shared,
                              const std::function<Place(uint32_t)>& place_of_point);
/// Of a decoded piece.
PieceOfPoints piece_of_points(const Array& positions, std::span<const SharedPoint> shared);
/// Numbers for the points of all, in their order: shared points of one place and copy are one. Safe for any
/// shared points below a piece's count: damaged files only join what should be apart.
JoinedPoints join_points(std::span<const PieceOfPoints> pieces);

}  // namespace maille
