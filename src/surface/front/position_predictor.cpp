#include "surface/front/position_predictor.h"

#include <algorithm>
#include <cmath>

namespace maille {
namespace {

constexpr double pi = 3.14159265358979324;
constexpr double half_pi = pi / 2;
constexpr double regular_angle = pi / 3;
constexpr double farthest = 1e30;

template <class T>
T bounded(T value, T low, T high) {
  return value > low ? value < high ? value : high : low;  // low for what is not a number
}

/// Angle of the direction (x, y) for y >= 0, to 1.7e-6; 0 for no direction. The polynomial is the one of six
/// terms of Hastings, Approximations for Digital Computers, 1955. A polynomial, because libm's atan2()
/// differs between machines.
double angle_of(double x, double y) {
  const double width = x < 0 ? -x : x;
  const double larger = width > y ? width : y;
  if (!(larger > 0)) return 0;
  const double t = (width > y ? y : width) / larger;
  const double s = t * t;
  const double arc =
      t * (0.99997726 +
           s * (-0.33262347 + s * (0.19354346 + s * (-0.11643287 + s * (0.05265332 - s * 0.01172120)))));
  const double first = width > y ? arc : half_pi - arc;
  return x < 0 ? pi - first : first;
}

/// Cotangent of an angle from 0.1 to pi - 0.1, to 4e-5: the quotient of the Taylor series of sine and cosine.
double cotangent(double angle) {
  const double y = angle - half_pi;
  const double s = y * y;
  const double sine = y * (1 + s * (-1.0 / 6 + s * (1.0 / 120 + s * (-1.0 / 5040 + s * (1.0 / 362880)))));
  const double cosine =
      1 + s * (-1.0 / 2 + s * (1.0 / 24 + s * (-1.0 / 720 + s * (1.0 / 40320 - s * (1.0 / 3628800)))));
  return -sine / cosine;
}

}  // namespace

PositionPredictor::PositionPredictor(const PatchSurface& surface, const VertexRings& rings, uint32_t points)
    : surface_(surface),
      smooth_(surface, rings),
      positions_(points),
      points_(points),
      // By valence class and ring_class(); the others by number of parallelograms, valence and whether the
      // ring is open.
      by_ring_(8 * 8),
      by_parallelograms_(4 * 5 * 2) {
  for (auto& square : class_square_) square = {1, 1, 1};
}

const PositionPrediction& PositionPredictor::predict_other() {
  vertex_ = none;
  around_.parallelogram_count = around_.ring_count = around_.valence = 0;
  around_.border = false;
  predict_without_parallelograms();
  return result_;
}

/// The order of steps is that of the format (14.6). Four experts come out: parallelograms corrected by least
/// squares, the smoothest surface, angles, and the mean of the first and of parallelograms corrected by the
/// ring's weights, which is the expected position.
const PositionPrediction& PositionPredictor::predict(uint32_t vertex) {
  vertex_ = vertex;
  find_neighbourhood(surface_, vertex, around_);
  result_.valence_class = bounded(around_.valence, 3u, 10u) - 3;
  if (around_.parallelogram_count == 0) {
    predict_without_parallelograms();
    return result_;
  }
  result_.parallelogram_class = std::min(around_.parallelogram_count, 4u);
  gather();
  find_frame();
  angle_ = angle_prediction();
  smooth_place_ = smooth_prediction(vertex);
  find_features();
  find_variance();
  find_covariance();
  order_axes();

  const unsigned valence = bounded(around_.valence, 4u, 8u) - 4;
  const unsigned open = around_.ring_count > around_.parallelogram_count + 1 ? 1 : 0;
  ring_weights_ = &by_ring_[result_.valence_class * 8 + ring_class()];
  parallelogram_weights_ = &by_parallelograms_[((result_.parallelogram_class - 1) * 5 + valence) * 2 + open];
  const Vector3 by_parallelograms = corrected(*parallelogram_weights_);
  const Vector3 by_ring = corrected(*ring_weights_);
  result_.mean = {by_parallelograms, smooth_place_, angle_, (by_parallelograms + by_ring) * 0.5};
  const Vector3 apart = by_parallelograms - result_.mean_parallelogram;
  result_.disagreement = std::sqrt(dot(apart, apart));
  return result_;
}

/// Near the known neighbours, else near the point before. The same place for all experts, as nothing tells
/// them apart before a face across an edge is known; that concerns the first vertices of a component.
void PositionPredictor::predict_without_parallelograms() {
  Vector3 mean;
  double edge = 0;
  for (unsigned i = 0; i < around_.ring_count; ++i) mean = mean + positions_[around_.ring[i]];
  if (around_.ring_count > 0) {
    mean = mean * (1.0 / around_.ring_count);
  } else if (newest_ != none) {
    mean = positions_[newest_];
  }
  frame_ = {Vector3{{0, 0, 1}}, Vector3{{1, 0, 0}}, Vector3{{0, 1, 0}}};
  variance_ = {class_square_[0][0] + 0.05, class_square_[0][1] + 0.05, class_square_[0][2] + 0.05};
  result_.mean = {mean, mean, mean, mean};
  result_.mean_parallelogram = result_.best_parallelogram = mean;
  result_.spread = result_.disagreement = 0;
  result_.edge = edge;
  result_.parallelogram_class = 0;
  result_.best_a = result_.best_b = result_.best_across = none;
  find_covariance();
  result_.axes = {0, 1, 2};
}

/// Means over the parallelograms and the known neighbours. The best parallelogram is the one whose corners
/// missed least when they were coded, with a small charge for one that is sheared: if its edges from the far
/// corner differ in length, the completed parallelogram is a poor triangle.
void PositionPredictor::gather() {
  const double inverse = 1.0 / around_.parallelogram_count;
  std::array<Vector3, Neighbourhood::most_parallelograms> tips;
  Vector3 sum, middle, edges, across, across_residual, far;
  unsigned far_count = 0;
  double least = 0;
  double edge_square = 0;
  const auto take_tip = [&](uint32_t tip) {
    if (tip == none) return;
    far = far + positions_[tip];
    ++far_count;
  };
  for (unsigned i = 0; i < around_.parallelogram_count; ++i) {
    const WideParallelogram& parallelogram = around_.parallelograms[i];
    const Vector3& a = positions_[parallelogram.a];
    const Vector3& b = positions_[parallelogram.b];
    const Vector3& w = positions_[parallelogram.across];
    const Vector3 edge = b - a;
    tips[i] = a + (b - w);
    sum = sum + tips[i];
    middle = middle + a + b;
    edges = edges + edge;
    edge_square += dot(edge, edge);
    across = across + w;
    across_residual = across_residual + points_[parallelogram.across].residual;
    take_tip(parallelogram.tip_a);
    take_tip(parallelogram.tip_b);
    const Vector3 aw = a - w;
    const Vector3 bw = b - w;
    const double skew = dot(aw, aw) - dot(bw, bw);
    const double error = static_cast<double>(points_[parallelogram.a].error) +
                         points_[parallelogram.b].error + points_[parallelogram.across].error +
                         0.02 * (skew < 0 ? -skew : skew);
    if (i > 0 && !(error < least)) continue;
    least = error;
    result_.best_parallelogram = tips[i];
    result_.best_a = parallelogram.a;
    result_.best_b = parallelogram.b;
    result_.best_across = parallelogram.across;
  }
  result_.mean_parallelogram = sum * inverse;
  middle_ = middle * (0.5 * inverse);
  mean_edge_ = edges * inverse;
  mean_across_ = across * inverse;
  across_residual_ = across_residual * inverse;
  result_.edge = std::sqrt(edge_square * inverse);
  has_tips_ = far_count > 0;
  mean_tips_ = has_tips_ ? far * (1.0 / far_count) : Vector3{};
  double spread = 0;
  for (unsigned i = 0; i < around_.parallelogram_count; ++i) {
    const Vector3 apart = tips[i] - result_.mean_parallelogram;
    spread += dot(apart, apart);
  }
  result_.spread = std::sqrt(spread * inverse);

  Vector3 ring, residual, ends;
  unsigned end_count = 0;
  for (unsigned i = 0; i < around_.ring_count; ++i) {
    const Point& point = points_[around_.ring[i]];
    ring = ring + positions_[around_.ring[i]];
    residual = residual + point.residual;
    if (!around_.arc_end[i]) continue;
    ends = ends + positions_[around_.ring[i]];
    ++end_count;
  }
  const double ring_inverse = around_.ring_count > 0 ? 1.0 / around_.ring_count : 0.0;
  mean_ring_ = around_.ring_count > 0 ? ring * ring_inverse : middle_;
  ring_residual_ = residual * ring_inverse;
  arc_ends_ = end_count > 0 ? ends * (1.0 / end_count) : mean_ring_;
}

/// The normal is the sum of the faces across, as long as their areas: large faces count more.
void PositionPredictor::find_frame() {
  Vector3 normal;
  for (unsigned i = 0; i < around_.parallelogram_count; ++i) {
    const WideParallelogram& parallelogram = around_.parallelograms[i];
    const Vector3& a = positions_[parallelogram.a];
    normal = normal + cross(positions_[parallelogram.across] - a, positions_[parallelogram.b] - a);
  }
  find_tangents(normal, result_.mean_parallelogram - middle_);
}

/// The frame of a normal, with its first tangent ahead, or where that is no direction, along a coordinate
/// axis. The bounds only keep lengths from underflowing: positions are clamped to 1e30, and squares of them
/// fit doubles.
void PositionPredictor::find_tangents(const Vector3& direction, Vector3 ahead) {
  const double square = dot(direction, direction);
  const Vector3 normal = square > 1e-30 ? direction * (1 / std::sqrt(square)) : Vector3{{0, 0, 1}};
  Vector3 tangent = ahead - normal * dot(ahead, normal);
  double length = dot(tangent, tangent);
  if (!(length > 1e-8 * dot(ahead, ahead)) || !(length > 1e-30)) {
    unsigned least = 0;
    for (unsigned k = 1; k < 3; ++k) {
      if (std::fabs(normal[k]) < std::fabs(normal[least])) least = k;
    }
    Vector3 axis;
    axis[least] = 1;
    tangent = axis - normal * normal[least];
    length = dot(tangent, tangent);
  }
  tangent = tangent * (1 / std::sqrt(length));
  frame_ = {normal, tangent, cross(normal, tangent)};
}

/// An inner point's angles sum up to about 2 pi, so what is left is shared by the faces to come; at a border,
/// or where all are known, the mean of those known. The bounds, 17 to 103 degrees, keep a tip near its edge.
double PositionPredictor::expected_angle(const Point& point) const {
  if (point.border || point.angles >= point.faces) {
    return point.angles == 0 ? regular_angle
                             : bounded(static_cast<double>(point.angle) / point.angles, 0.3, 1.8);
  }
  return bounded((2 * pi - static_cast<double>(point.angle)) / (point.faces - point.angles), 0.3, 1.8);
}

/// The tip of a triangle on the parallelogram, in the plane of the face across, with the angles that are
/// left. Angles are scaled so that they sum up to pi. With the edge as base, the foot lies at cot a / (cot a
/// + cot b) of it, the height is 1 / (cot a + cot b) of its length. False where the triangle would be a
/// sliver, or the face across has no area.
bool PositionPredictor::angle_tip(const WideParallelogram& parallelogram, Vector3& tip) const {
  double at_a = expected_angle(points_[parallelogram.a]);
  double at_b = expected_angle(points_[parallelogram.b]);
  const double at_tip = around_.border ? regular_angle : bounded(2 * pi / around_.valence, 0.3, 1.8);
  const double scale = pi / (at_a + at_b + at_tip);
  at_a = bounded(at_a * scale, 0.15, 2.9);
  at_b = bounded(at_b * scale, 0.15, 2.9);
  const double cot_a = cotangent(at_a);
  const double cot_b = cotangent(at_b);
  const double sum = cot_a + cot_b;
  if (!(sum > 0.05)) return false;
  const Vector3& a = positions_[parallelogram.a];
  const Vector3& b = positions_[parallelogram.b];
  const Vector3 edge = b - a;
  const double edge_square = dot(edge, edge);
  Vector3 up = (a + b) * 0.5 - positions_[parallelogram.across];
  if (!(edge_square > 1e-30)) return false;
  up = up - edge * (dot(up, edge) / edge_square);
  const double up_square = dot(up, up);
  if (!(up_square > 1e-6 * edge_square)) return false;
  tip = a + edge * (cot_a / sum) + up * (std::sqrt(edge_square / up_square) / sum);
  return true;
}

Vector3 PositionPredictor::angle_prediction() const {
  Vector3 sum;
  unsigned count = 0;
  if (!surface_.half_edges.all_triangles()) return result_.mean_parallelogram;
  for (unsigned i = 0; i < around_.parallelogram_count; ++i) {
    Vector3 tip;
    if (!angle_tip(around_.parallelograms[i], tip)) continue;
    sum = sum + tip;
    ++count;
  }
  return count == 0 ? result_.mean_parallelogram : sum * (1.0 / count);
}

/// The smooth place, unless it lies more than five edges from the parallelograms: where hardly anything is
/// known, the system is nearly singular and its solution can be anywhere.
Vector3 PositionPredictor::smooth_prediction(uint32_t vertex) {
  Vector3 found;
  if (!smooth_.predict(vertex, positions_, result_.mean_parallelogram, found))
    return result_.mean_parallelogram;
  const Vector3 apart = found - result_.mean_parallelogram;
  return dot(apart, apart) < 25 * result_.edge * result_.edge ? found : result_.mean_parallelogram;
}

/// Twelve vectors that may say where the position is off the mean parallelogram; each direction of the frame
/// has weights of its own, as what lies along the normal behaves otherwise than what lies along the surface.
/// With eight features quality fell by 0.1 to 1 %, for 3 % of the time (be83a6c).
void PositionPredictor::find_features() {
  const Vector3& base = result_.mean_parallelogram;
  const Vector3 nothing;
  const std::array<Vector3, features> all = {
      mean_ring_ - base,
      mean_across_ - base,
      has_tips_ ? mean_tips_ - base : nothing,
      ring_residual_,
      cross(frame_[0], mean_edge_),
      smooth_place_ - base,
      middle_ - base,
      arc_ends_ - base,
      angle_ - base,
      across_residual_,
      result_.best_parallelogram - base,
      newest_ == none ? nothing : points_[newest_].residual,
  };
  for (unsigned k = 0; k < 3; ++k) {
    for (unsigned j = 0; j < features; ++j) {
      features_[k][j] = static_cast<float>(bounded(dot(all[j], frame_[k]), -farthest, farthest));
    }
  }
}

/// The mean valence of known neighbours, in halves from 4 to 7.5; 6 where nothing is known.
unsigned PositionPredictor::ring_class() const {
  uint32_t sum = 0;
  for (unsigned i = 0; i < around_.ring_count; ++i) sum += std::min(points_[around_.ring[i]].faces, 20u);
  const unsigned halves = around_.ring_count == 0 ? 12 : 2 * sum / around_.ring_count;
  return bounded(halves, 8u, 15u) - 8;
}

Vector3 PositionPredictor::corrected(const Weights& weights) const {
  Vector3 correction;
  for (unsigned k = 0; k < 3; ++k) correction = correction + frame_[k] * weights[k].predict(features_[k]);
  // A weight out of hand must not lead far away.
  const double most = 25 * result_.edge * result_.edge + 1e4;
  if (!(dot(correction, correction) < most)) return result_.mean_parallelogram;
  return result_.mean_parallelogram + correction;
}

/// Per direction of the frame, the mean of what was missed at the neighbours, drawn towards the mean of the
/// class as if six more neighbours had missed that much. The constant keeps it from vanishing where codes are
/// exact: rounding to whole units alone has a variance of 1/12.
void PositionPredictor::find_variance() {
  std::array<double, 3> sum = {};
  unsigned count = 0;
  const auto take = [&](uint32_t point) {
    for (unsigned k = 0; k < 3; ++k) sum[k] += points_[point].square[k];
    ++count;
  };
  for (unsigned i = 0; i < around_.ring_count; ++i) take(around_.ring[i]);
  for (unsigned i = 0; i < around_.parallelogram_count; ++i) take(around_.parallelograms[i].across);
  for (unsigned k = 0; k < 3; ++k) {
    variance_[k] = (sum[k] + 6 * class_square_[result_.parallelogram_class][k]) / (count + 6) + 0.05;
  }
}

/// Of the coordinate axes. Errors are taken to be independent in the frame of the surface, where those along
/// the normal are the smallest, and not along the axes on which numbers are coded.
void PositionPredictor::find_covariance() {
  for (unsigned i = 0; i < 3; ++i) {
    for (unsigned j = 0; j < 3; ++j) {
      double sum = 0;
      for (unsigned k = 0; k < 3; ++k) sum += variance_[k] * frame_[k][i] * frame_[k][j];
      result_.covariance[i][j] = sum;
    }
  }
}

/// The axis nearest to the normal comes last: given the other two, the plane of the surface tells most of it.
void PositionPredictor::order_axes() {
  unsigned last = 0;
  for (unsigned k = 1; k < 3; ++k) {
    if (std::fabs(frame_[0][k]) > std::fabs(frame_[0][last])) last = k;
  }
  result_.axes = {last == 0 ? 1u : 0u, last == 2 ? 1u : 2u, last};
}

/// In the order of the format (14.6, "Learning"): what the point missed by, its class' mean, weights, angles.
void PositionPredictor::learn(uint32_t number, const Vector3& where) {
  Point& point = points_[number];
  for (unsigned k = 0; k < 3; ++k) positions_[number][k] = bounded(where[k], -farthest, farthest);
  const Vector3 residual = positions_[number] - result_.mean[3];
  const bool with_parallelograms = around_.parallelogram_count > 0;
  double error = 0;
  for (unsigned k = 0; k < 3; ++k) {
    const double along = dot(residual, frame_[k]);
    // One far off must not make everything after it look uncertain.
    const double square = std::min(along * along, 400 * variance_[k]);
    point.square[k] = static_cast<float>(std::min(square, 1e30));
    error += point.square[k];
    double& mean = class_square_[result_.parallelogram_class][k];
    // A mean over about the last hundred points of the class; part of the format, not swept.
    mean += (point.square[k] - mean) * 0.01;
    point.residual[k] = bounded(residual[k], -farthest, farthest);
  }
  point.error = static_cast<float>(error);
  point.faces = around_.valence;
  point.border = around_.border;
  if (with_parallelograms) learn_weights(positions_[number]);
  if (vertex_ != none && surface_.half_edges.all_triangles()) learn_angles(number);
  newest_ = number;
}

/// A residual beyond twenty deviations is an edge or a jump to another sheet: it would pull the weights of
/// all smooth places and is left out.
void PositionPredictor::learn_weights(const Vector3& position) {
  const Vector3 target = position - result_.mean_parallelogram;
  const Vector3 residual = position - result_.mean[3];
  const double variance = variance_[0] + variance_[1] + variance_[2];
  if (!(dot(residual, residual) < 400 * variance)) return;
  for (unsigned k = 0; k < 3; ++k) {
    const auto along = static_cast<float>(dot(target, frame_[k]));
    // Weighted least squares: errors are divided by their deviation; the constant keeps exact regions from
    // ruling all others.
    const auto certainty = static_cast<float>(1 / std::sqrt(variance_[k] + 0.5));
    (*ring_weights_)[k].learn(features_[k], along, certainty);
    (*parallelogram_weights_)[k].learn(features_[k], along, certainty);
  }
}

/// The faces that this point completes.
void PositionPredictor::learn_angles(uint32_t number) {
  const HalfEdges& edges = surface_.half_edges;
  Point& v = points_[number];
  const uint32_t first = surface_.vertices.corner[vertex_];
  uint32_t h = first;
  do {
    const uint32_t next = edges.origin[edges.next(h)];
    const uint32_t previous = edges.origin[edges.previous(h)];
    h = edges.turn(h);
    if (next >= vertex_ || previous >= vertex_) continue;
    const uint32_t i = surface_.point(next);
    const uint32_t j = surface_.point(previous);
    Point& a = points_[i];
    Point& b = points_[j];
    const Vector3 va = positions_[i] - positions_[number];
    const Vector3 vb = positions_[j] - positions_[number];
    const Vector3 ab = positions_[j] - positions_[i];
    const Vector3 normal = cross(va, vb);
    const double area = std::sqrt(dot(normal, normal));
    v.angle += static_cast<float>(angle_of(dot(va, vb), area));
    a.angle += static_cast<float>(angle_of(-dot(va, ab), area));
    b.angle += static_cast<float>(angle_of(dot(vb, ab), area));
    ++v.angles;
    ++a.angles;
    ++b.angles;
  } while (h != first);
}

}  // namespace maille
