#pragma once

#include <maille/error.h>
#include <maille/executor.h>
#include <maille/source.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace maille {

/// The parts of a mesh are coded by themselves; points on the cuts are in several of them. Such points have
/// the same position, bit for bit, in all their parts. So a file says where the shared points of each part
/// are, and for each position that several of them have, whether these are one point. docs/format.md,
/// "Joins".

/// By part, the numbers of its shared points, ascending.
using SharedPoints = std::vector<std::vector<uint32_t>>;
/// The bits of the three numbers of a decoded position.
using Place = std::array<uint64_t, 3>;
/// By part and shared point.
using SharedPlaces = std::vector<std::vector<Place>>;

/// Which points are in more than one part. `whole` gives for each part and point its number in the whole
/// mesh, all below `points`.
SharedPoints find_shared_points(std::span<const std::span<const uint32_t>> whole, uint32_t points,
                                Executor& executor = serial_executor());

/// Codes them in two sections; `places` are those of `shared`.
std::vector<std::byte> encode_joins(const SharedPoints& shared, const SharedPlaces& places,
                                    std::span<const std::span<const uint32_t>> whole);

/// The first section. Safe on any bytes: as many lists as parts, of numbers below `part_points`.
Result<SharedPoints> decode_shared_points(Bytes bytes, std::span<const uint32_t> part_points);

/// The numbers of a part's points in the mesh. Its new points follow one another from `first_new` on; the
/// others have the numbers that earlier parts gave them.
struct JoinedPart {
  uint32_t points = 0;
  uint32_t first_new = 0;
  std::vector<uint32_t> joined;   ///< points of the part that are not new, ascending
  std::vector<uint32_t> numbers;  ///< theirs in the mesh

  /// Of all points.
  std::vector<uint32_t> all_numbers() const;
};
struct JoinedPoints {
  std::vector<JoinedPart> parts;
  uint32_t count = 0;
};

/// The second section. Safe on any bytes: numbers below `count`, which is below 2^32 - 1.
Result<JoinedPoints> decode_joins(Bytes bytes, std::span<const uint32_t> part_points,
                                  const SharedPoints& shared, const SharedPlaces& places);

}  // namespace maille
