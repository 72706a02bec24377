#include "surface/arrays/rounded_corners.h"

#include <algorithm>
#include <cmath>

#include "base/bytes.h"

namespace maille {
namespace {

/// 2^(half / 2); for odd ones 1.5 * 2^floor(half / 2), as 1.5 is exact where the square root of 2 is not.
double half_octave(int half) {
  const int octave = half >> 1;
  double power = 1;
  for (int i = 0; i < octave; ++i) power *= 2;
  for (int i = 0; i > octave; --i) power /= 2;
  return (half & 1) != 0 ? 1.5 * power : power;
}

/// The power of `base` at or below a size, by multiplication, as pow() and log() differ between machines.
/// Sizes are 1e-30 / 65536 to 1e30, so the loops are short.
double power_below(double size, double base) {
  double power = 1;
  while (power * base <= size) power *= base;
  while (power > size) power /= base;
  return power;
}

/// Coordinates near 0 were computed from others, with their errors: so far below the largest one.
constexpr double least_part = 1.0 / 65536;

/// Where xx, yy and zz stand among the variances of a corner.
constexpr std::array<size_t, 3> diagonal = {0, 3, 5};

}  // namespace

unsigned largest_component(const Vector3& v) {
  unsigned largest = 2;
  for (unsigned k = 0; k < 3; ++k) {
    if (std::fabs(v[k]) > std::fabs(v[largest])) largest = k;
  }
  return largest;
}

/// Mahalanobis' distance, squared, in the plane of the two smaller components: the third follows from these.
/// The determinant is kept off 0, as estimates of flat neighbourhoods are nearly singular.
double squared_distance(const Vector3& v, const NormalEstimate& estimate, double unit) {
  // In the plane of the two smaller components.
  const unsigned last = largest_component(estimate.normal);
  const unsigned a = (last + 1) % 3;
  const unsigned b = (last + 2) % 3;
  const double x = v[a] - estimate.normal[a];
  const double y = v[b] - estimate.normal[b];
  const double aa = estimate.covariance[a][a] + unit * unit;
  const double bb = estimate.covariance[b][b] + unit * unit;
  const double ab = estimate.covariance[a][b];
  const double determinant = std::max(aa * bb - ab * ab, 0.01 * unit * unit * (aa + bb));
  return (x * x * bb - 2 * x * y * ab + y * y * aa) / determinant;
}

RoundedCorners::RoundedCorners(std::span<const Vector3> positions, const Rounding& rounding, double unit)
    : positions_(positions), corners_(positions.size()), unit_variance_(unit * unit / 12) {
  double largest = 1e-30;
  for (const Vector3& p : positions) {
    for (const double x : p.x) largest = std::max(largest, std::min(std::fabs(x), 1e30));
  }
  const double unit_step = half_octave(rounding.scale);
  const double base = rounding.step == Rounding::Step::decimal ? 10 : 2;
  for (size_t i = 0; i < corners_.size(); ++i) {
    for (unsigned k = 0; k < 3; ++k) {
      const double size = std::clamp(std::fabs(positions[i][k]), largest * least_part, largest);
      const double step =
          rounding.step == Rounding::Step::fixed ? unit_step : unit_step * power_below(size, base);
      // What was rounded to a step is off by up to half of it, evenly: that has a variance of step^2 / 12.
      corners_[i].variances[diagonal[k]] = step * step / 12;
    }
  }
}

RoundedCorners::Joint RoundedCorners::joint_of(std::span<const uint32_t> corners) const {
  Joint joint;
  joint.count = static_cast<unsigned>(corners.size());
  // Corners are independent of each other at first: what they have in common is not kept.
  joint.covariance = {};
  for (unsigned i = 0; i < joint.count; ++i) {
    const Corner& corner = corners_[corners[i]];
    joint.places[i] = positions_[corners[i]] + corner.moved;
    unsigned at = 0;
    for (unsigned a = 0; a < 3; ++a) {
      for (unsigned b = a; b < 3; ++b, ++at) {
        joint.covariance[3 * i + a][3 * i + b] = corner.variances[at];
        joint.covariance[3 * i + b][3 * i + a] = corner.variances[at];
      }
    }
  }
  return joint;
}

/// The edge is at right angles to the neighbour's normal: a Kalman update by the measurement n . (to - from)
/// = 0, whose own variance is that of the normal's rounding times the edge's length squared. `reach` is the
/// covariance of each coordinate with it.
void RoundedCorners::condition(Joint& joint, const Neighbour& neighbour) const {
  const unsigned from = neighbour.edge;
  const unsigned to = from + 1 < joint.count ? from + 1 : 0;
  const unsigned size = 3 * joint.count;
  const Vector3& n = neighbour.normal;
  std::array<double, most> reach;
  for (unsigned i = 0; i < size; ++i) {
    const auto& row = joint.covariance[i];
    reach[i] = n[0] * (row[3 * to] - row[3 * from]) + n[1] * (row[3 * to + 1] - row[3 * from + 1]) +
               n[2] * (row[3 * to + 2] - row[3 * from + 2]);
  }
  const Vector3 edge = joint.places[to] - joint.places[from];
  double variance = dot(edge, edge) * unit_variance_;
  for (unsigned k = 0; k < 3; ++k) variance += n[k] * (reach[3 * to + k] - reach[3 * from + k]);
  // Such bounds keep quotients finite; NaN fails them, too.
  if (!(variance > 1e-280) || !(variance < 1e280)) return;
  const double gain = -dot(n, edge) / variance;
  for (unsigned i = 0; i < joint.count; ++i) {
    for (unsigned k = 0; k < 3; ++k) joint.places[i][k] += reach[3 * i + k] * gain;
  }
  for (unsigned i = 0; i < size; ++i) {
    const double part = reach[i] / variance;
    for (unsigned j = 0; j < size; ++j) joint.covariance[i][j] -= part * reach[j];
  }
}

/// The normal of a polygon is the sum of its triangles' cross products over its length. Its derivative by a
/// corner lifted along the normal is the cross product with the diagonal between the corner's neighbours,
/// over the same length.
RoundedCorners::Turns RoundedCorners::turns_of(const Joint& joint) {
  Turns turns;
  Vector3 sum;
  for (unsigned i = 2; i < joint.count; ++i) {
    sum = sum + cross(joint.places[i - 1] - joint.places[0], joint.places[i] - joint.places[0]);
  }
  const double length = std::sqrt(dot(sum, sum));
  if (!(length > 1e-100) || !(length < 1e100)) return turns;
  turns.exists = true;
  turns.normal = sum * (1 / length);
  for (unsigned i = 0; i < joint.count; ++i) {
    const unsigned next = i + 1 < joint.count ? i + 1 : 0;
    const unsigned previous = i > 0 ? i - 1 : joint.count - 1;
    turns.turn[i] = cross(turns.normal, joint.places[next] - joint.places[previous]) * (1 / length);
  }
  return turns;
}

/// The corners' covariance, carried through that derivative. Only what lies along the normal turns it; shifts
/// within the plane do not.
std::array<Vector3, 3> RoundedCorners::covariance_of(const Joint& joint, const Turns& turns) {
  std::array<Vector3, 3> covariance;
  const Vector3& n = turns.normal;
  for (unsigned i = 0; i < joint.count; ++i) {
    for (unsigned j = 0; j < joint.count; ++j) {
      double lifted = 0;
      for (unsigned a = 0; a < 3; ++a) {
        const auto& row = joint.covariance[3 * i + a];
        lifted += n[a] * (row[3 * j] * n[0] + row[3 * j + 1] * n[1] + row[3 * j + 2] * n[2]);
      }
      for (unsigned a = 0; a < 3; ++a) {
        const double part = turns.turn[i][a] * lifted;
        for (unsigned b = 0; b < 3; ++b) covariance[a][b] += part * turns.turn[j][b];
      }
    }
  }
  return covariance;
}

NormalEstimate RoundedCorners::estimate(std::span<const uint32_t> corners,
                                        std::span<const Neighbour> neighbours) const {
  if (corners.size() < 3 || corners.size() > most_corners) return {};
  Joint joint = joint_of(corners);
  for (const Neighbour& neighbour : neighbours) condition(joint, neighbour);
  const Turns turns = turns_of(joint);
  if (!turns.exists) return {};
  return {turns.normal, covariance_of(joint, turns)};
}

/// Corners learn apart from each other, and not from edges again: what they have in common is not kept, and
/// would count twice.
void RoundedCorners::learn(std::span<const uint32_t> corners, const Vector3& normal, const Vector3& units) {
  if (corners.size() < 3 || corners.size() > most_corners) return;
  const Joint joint = joint_of(corners);
  const Turns turns = turns_of(joint);
  if (!turns.exists) return;
  const std::array<Vector3, 3> covariance = covariance_of(joint, turns);
  const unsigned last = largest_component(turns.normal);
  const unsigned a = (last + 1) % 3;
  const unsigned b = (last + 2) % 3;
  const double aa = covariance[a][a] + units[a] * units[a] / 12;
  const double bb = covariance[b][b] + units[b] * units[b] / 12;
  const double ab = covariance[a][b];
  const double determinant = aa * bb - ab * ab;
  if (!(determinant > 1e-280) || !(determinant < 1e280)) return;
  const double off_a = normal[a] - turns.normal[a];
  const double off_b = normal[b] - turns.normal[b];
  const double pull_a = (bb * off_a - ab * off_b) / determinant;
  const double pull_b = (aa * off_b - ab * off_a) / determinant;
  for (unsigned i = 0; i < joint.count; ++i) {
    Corner& corner = corners_[corners[i]];
    Vector3 lift;
    for (unsigned k = 0; k < 3; ++k) {
      const auto& row = joint.covariance[3 * i + k];
      lift[k] =
          row[3 * i] * turns.normal[0] + row[3 * i + 1] * turns.normal[1] + row[3 * i + 2] * turns.normal[2];
    }
    const double turn_a = turns.turn[i][a];
    const double turn_b = turns.turn[i][b];
    corner.moved = corner.moved + lift * (turn_a * pull_a + turn_b * pull_b);
    const double known =
        (bb * turn_a * turn_a - 2 * ab * turn_a * turn_b + aa * turn_b * turn_b) / determinant;
    unsigned at = 0;
    for (unsigned j = 0; j < 3; ++j) {
      for (unsigned k = j; k < 3; ++k, ++at) corner.variances[at] -= lift[j] * lift[k] * known;
    }
  }
}

}  // namespace maille
