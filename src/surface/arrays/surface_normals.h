#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "surface/arrays/array_coder.h"
#include "surface/vector3.h"

namespace maille {

/// How the normals of faces add up to one of a point.
enum class NormalWeight : uint8_t {
  area,           ///< the cross products themselves
  equal,          ///< unit vectors
  angle,          ///< unit vectors times the angle of the face there
  inverse_edges,  ///< cross products over the squared lengths of both edges (Max 1999)
};
inline constexpr unsigned normal_weight_count = 4;

/// A vector expected somewhere on the surface, not of unit length.
struct ExpectedNormal {
  Vector3 vector;
  /// How far faces disagree, or (one face) how much the rounding of its corners turns it; 0: unknown.
  double spread = 0;
  uint32_t twin = none;  ///< welded: the point before at the same place
};

/// Normals of the faces of a patch from its decoded positions, in the orientation of the mesh, and their sums
/// around points and in wedges of corners. Doubles in a fixed order: the same everywhere. `elements` and
/// `face_of` must stay. docs/format.md, 13.5.
class SurfaceNormals {
 public:
  /// `elements` has positions.
  SurfaceNormals(const PatchElements& elements, const std::vector<uint32_t>& face_of, NormalWeight weight);

  ExpectedNormal of_face(uint32_t face) const;
  /// Sums for all points of the surface; others have no expectation.
  /// `welded`: points at the same place share theirs.
  std::vector<ExpectedNormal> of_points(bool welded) const;
  ExpectedNormal of_wedge(std::span<const uint32_t> corners) const;
  /// The cosine between the faces of two corners; 1 where one has no normal.
  double cosine(uint32_t corner, uint32_t other) const;

 private:
  struct Sum {
    Vector3 vector;
    double length = 0;  ///< sum of the lengths of what was added
    ExpectedNormal expected() const;
  };

  const Vector3& position(uint32_t h) const;
  Vector3 cross_of_face(uint32_t face) const;
  void weld(const std::vector<Sum>& sums, std::vector<ExpectedNormal>& expected) const;
  void add(uint32_t corner, uint32_t face, Sum& sum) const;

  const PatchSurface& surface_;
  std::span<const Vector3> positions_;
  const std::vector<uint32_t>& face_of_;
  NormalWeight weight_;
  std::vector<Vector3> crosses_;  ///< by face
  std::vector<double> lengths_;   ///< of these
};

/// Positions as doubles for a prediction, infinities and NaN as 0.
std::vector<Vector3> positions_as_doubles(const Array& positions);
/// The same as the decoder will see them: through `maps`, in coded order.
std::vector<Vector3> decoded_positions(const Array& positions, const ArrayMaps& maps,
                                       std::span<const uint32_t> source);

}  // namespace maille
