#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "surface/vector3.h"

namespace maille {

/// What was lost of positions when they were written: up to half a step each way.
struct Rounding {
  enum class Step : uint8_t {
    fixed,    ///< the same for all numbers
    binary,   ///< proportional to the power of 2 below a number, as floats have it
    decimal,  ///< to that of 10, as so many significant digits have it
  };
  static constexpr unsigned step_count = 3;
  static constexpr int16_t most_scale = 600;

  Step step = Step::fixed;
  int16_t scale = 0;  ///< the step for numbers from 1 to 2 (10), in half octaves
};

/// A normal that is expected, of length 1, with its covariance by component.
struct NormalEstimate {
  Vector3 normal;  ///< 0 where there is none
  std::array<Vector3, 3> covariance;
};

/// The squared distance of a vector to an estimate, in variances, of which `unit` squared is added; not
/// always finite.
double squared_distance(const Vector3& v, const NormalEstimate& estimate, double unit);

/// Normals in files are often older than the positions beside them, which lost digits on the way: they belong
/// to corners that are a little elsewhere. Where, is learnt from each normal (Kalman 1960): a normal tells
/// how far its corners were lifted, which other facets have, too; and edges are at right angles to the
/// normals of both sides. Doubles in a fixed order: the same everywhere. docs/format.md, 13.6.
class RoundedCorners {
 public:
  /// Faces with more corners have no estimates.
  static constexpr unsigned most_corners = 4;

  /// A known normal at the edge from corner `edge` to the next.
  struct Neighbour {
    unsigned edge;
    Vector3 normal;
  };

  /// `unit`: the distance between numbers of normals, of those near 1/2.
  RoundedCorners(std::span<const Vector3> positions, const Rounding& rounding, double unit);

  /// What the normal of a face with these corners should be; 0 where it has more than most_corners, or no
  /// area. Changes nothing.
  NormalEstimate estimate(std::span<const uint32_t> corners, std::span<const Neighbour> neighbours) const;
  /// Moves the corners to where this normal says that they were. `units`: by component, the distance between
  /// numbers there.
  void learn(std::span<const uint32_t> corners, const Vector3& normal, const Vector3& units);

 private:
  static constexpr unsigned most = 3 * most_corners;

  struct Corner {
    Vector3 moved;                    ///< what is known of position before rounding - position
    std::array<double, 6> variances;  ///< xx, xy, xz, yy, yz, zz
  };
  /// The corners of one face together.
  struct Joint {
    unsigned count = 0;
    std::array<Vector3, most_corners> places;
    std::array<std::array<double, most>, most> covariance;
  };
  /// A normal, and by corner how it turns when that is lifted along it.
  struct Turns {
    Vector3 normal;
    std::array<Vector3, most_corners> turn;
    bool exists = false;
  };

  /// Its covariance is 12 by 12 at most, on the stack.
  Joint joint_of(std::span<const uint32_t> corners) const;
  void condition(Joint& joint, const Neighbour& neighbour) const;
  static Turns turns_of(const Joint& joint);
  static std::array<Vector3, 3> covariance_of(const Joint& joint, const Turns& turns);

  std::span<const Vector3> positions_;
  std::vector<Corner> corners_;
  double unit_variance_;
};

/// The component of largest size; among equals 2 comes before 0 and 0 before 1.
unsigned largest_component(const Vector3& v);

}  // namespace maille
