#include "generate/transfinite_curve.h"

#include <algorithm>
#include <cmath>

#include "base/result.h"
#include "generate/transfinite_vector.h"

namespace maille {

namespace {

constexpr double pi = 3.14159265358979323846;

tl::unexpected<Error> bad(const char* what) {
  return failure(ErrorCode::malformed_input, what);
}

}  // namespace

Result<Position> arc_middle(const Position& from, const Position& to, double degrees, const Position& axis) {
  const double size = length(axis);
  if (!(size > 0)) return bad("the axis has no direction");
  const double half = degrees * pi / 360;
  if (!(std::fabs(degrees) > 0 && std::fabs(degrees) < 360)) return bad("the angle is not between 0 and 360");
  const Position unit = (1 / size) * axis;
  const Position chord = to - from;
  // 1e-9 of the length was chosen, not swept.
  if (std::fabs(dot(unit, chord)) > 1e-9 * length(chord)) return bad("the axis is not across the chord");
  // The sagitta, from the middle of the chord away from the centre, is chord / 2 * tan(angle / 4).
  return 0.5 * (from + to) - (0.5 * std::tan(half / 2)) * cross(unit, chord);
}

Result<Position> arc_middle_about(const Position& from, const Position& to, const Position& centre,
                                  double factor) {
  const Position a = from - centre;
  const Position b = to - centre;
  const Position between = a + b;
  if (!(length(cross(a, b)) > 1e-12 * length(a) * length(b))) return bad("the origin is on the chord");
  const double radius = factor * 0.5 * (length(a) + length(b));
  return centre + (radius / length(between)) * between;
}

Result<Curve> Curve::make(const BlockCurve& curve, const Position& from, const Position& to,
                          const Surfaces& surfaces) {
  Curve made;
  made.kind_ = curve.kind;
  made.points_.push_back(from);
  made.points_.insert(made.points_.end(), curve.points.begin(), curve.points.end());
  if (curve.kind == CurveKind::projected) {
    made.surfaces_ = &surfaces;
    made.on_ = curve.surfaces;
    // Fine enough that lengths of a half circle are right to 1e-3 before points are projected again. Chosen,
    // not swept.
    constexpr unsigned segments = 64;
    for (unsigned i = 1; i < segments; ++i) {
      const double t = static_cast<double>(i) / segments;
      made.points_.push_back(surfaces.project((1 - t) * from + t * to, made.on_));
    }
  }
  made.points_.push_back(to);
  if (curve.kind == CurveKind::arc) {
    if (curve.points.size() != 1) return bad("an arc has one point between its ends");
    MAILLE_CHECK(made.make_arc());
    return made;
  }
  made.lengths_.push_back(0);
  for (size_t i = 1; i < made.points_.size(); ++i) {
    made.lengths_.push_back(made.lengths_.back() + length(made.points_[i] - made.points_[i - 1]));
  }
  const double whole = made.lengths_.back();
  if (!(whole > 0)) return bad("a curve without length");
  for (double& x : made.lengths_) x /= whole;
  made.lengths_.back() = 1;
  return made;
}

Result<> Curve::make_arc() {
  const Position a = points_[1] - points_[0];
  const Position b = points_[2] - points_[0];
  const Position normal = cross(a, b);
  const double area = dot(normal, normal);
  // That is an angle of less than 1e-12 between the chords, where doubles no longer tell the centre.
  if (!(area > 1e-24 * dot(a, a) * dot(b, b))) return bad("the points of the arc are on a line");
  // Centre of the circle through 0, a and b.
  const Position centre = (1 / (2 * area)) * (dot(a, a) * cross(b, normal) - dot(b, b) * cross(a, normal));
  centre_ = points_[0] + centre;
  across_ = points_[0] - centre_;
  along_ = (1 / std::sqrt(area)) * cross(normal, across_);
  // Where the point is beyond the end, or more than half a circle away, blockMesh goes from the start towards
  // the point by the shorter way, and may never reach it.
  if (dot(points_[1] - centre_, along_) < -1e-12 * dot(across_, across_)) along_ = -1.0 * along_;
  const Position end = points_[2] - centre_;
  angle_ = std::atan2(dot(end, along_), dot(end, across_));
  if (angle_ < 0) angle_ += 2 * pi;
  return {};
}

Position Curve::on_arc(double t) const {
  return centre_ + std::cos(angle_ * t) * across_ + std::sin(angle_ * t) * along_;
}

// De Casteljau's scheme: stable, and exact at both ends.
Position Curve::on_bezier(double t) const {
  std::vector<Position> points = points_;
  for (size_t n = points.size() - 1; n > 0; --n) {
    for (size_t i = 0; i < n; ++i) points[i] = (1 - t) * points[i] + t * points[i + 1];
  }
  return points[0];
}

Position Curve::knot(size_t i) const {
  // Numbered from 1, so that one is left on each side.
  if (i == 0) return 2.0 * points_[0] - points_[1];
  if (i > points_.size()) return 2.0 * points_.back() - points_[points_.size() - 2];
  return points_[i - 1];
}

Position Curve::on_segments(double t) const {
  // The segment that holds t; the first and the last bounds are left out, so that i is valid for all t.
  const auto behind = std::upper_bound(lengths_.begin() + 1, lengths_.end() - 1, t);
  const auto i = static_cast<size_t>(behind - lengths_.begin());
  const double span = lengths_[i] - lengths_[i - 1];
  const double s = span > 0 ? (t - lengths_[i - 1]) / span : 0;
  const Position b = points_[i - 1];
  const Position c = points_[i];
  if (kind_ == CurveKind::polyline || kind_ == CurveKind::line) return (1 - s) * b + s * c;
  if (kind_ == CurveKind::projected) return surfaces_->project((1 - s) * b + s * c, on_);
  const Position a = knot(i - 1);
  const Position d = knot(i + 2);
  // Catmull and Rom's spline through b and c.
  if (kind_ == CurveKind::spline) {
    return b + (0.5 * s) * ((c - a) + s * ((2.0 * a - 5.0 * b + 4.0 * c - d) + s * (3.0 * (b - c) + d - a)));
  }
  // The uniform cubic B-spline, which does not go through its points.
  const double r = 1 - s;
  return (1.0 / 6) *
         ((r * r * r) * a + ((3 * s - 6) * s * s + 4) * b + ((3 * r - 6) * r * r + 4) * c + (s * s * s) * d);
}

Position Curve::at(double t) const {
  if (t <= 0) return points_.front();
  if (t >= 1) return points_.back();
  if (kind_ == CurveKind::arc) return on_arc(t);
  return kind_ == CurveKind::bezier ? on_bezier(t) : on_segments(t);
}

}  // namespace maille
