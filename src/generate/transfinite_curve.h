#pragma once

#include <maille/generate.h>
#include <vector>

#include "generate/surfaces.h"

namespace maille {

/// The point halfway along the arc of `degrees` about an axis, right-handed from one point to another. Error
/// (malformed_input): angle or axis are none for these points.
Result<Position> arc_middle(const Position& from, const Position& to, double degrees, const Position& axis);

/// The point halfway along the shorter arc about a centre; its distance is the mean of that of both ends
/// times `factor`. Error (malformed_input): the three points are on a line.
Result<Position> arc_middle_about(const Position& from, const Position& to, const Position& centre,
                                  double factor);

/// A curve ready to be evaluated, in the units of the description.
class Curve {
 public:
  /// `surfaces` must outlive a projected one. Error (malformed_input): an arc whose points are on a line, no
  /// point where one is needed.
  static Result<Curve> make(const BlockCurve& curve, const Position& from, const Position& to,
                            const Surfaces& surfaces = {});
  /// The point at t in [0, 1], the ends exactly. Lengths along polylines and splines are those of the polygon
  /// of their points, as blockMesh has them.
  Position at(double t) const;

 private:
  Result<> make_arc();
  Position on_arc(double t) const;
  Position on_bezier(double t) const;
  Position on_segments(double t) const;
  /// The polygon's point i, reflected beyond both ends.
  Position knot(size_t i) const;

  CurveKind kind_ = CurveKind::line;
  std::vector<Position> points_;            ///< with both ends
  std::vector<double> lengths_;             ///< from the start to each point, the last 1
  Position centre_{}, across_{}, along_{};  ///< arc: centre + cos * across + sin * along
  double angle_ = 0;
  const Surfaces* surfaces_ = nullptr;
  std::vector<uint32_t> on_;  ///< of a projected one
};

}  // namespace maille
