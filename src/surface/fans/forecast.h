#pragma once

// What the position of a vertex of fans should be: a sum of weights times references, and how far
// parallelograms lie apart. docs/format.md, 12.3.

#include <array>
#include <cstdint>

#include "surface/fans/valence_rows.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace maille {

/// a < b ? a : b, and a > b ? a : b, of which gcc 12 makes five instructions.
[[gnu::always_inline]] inline FloatLanes smaller_lanes(FloatLanes a, FloatLanes b) {
#ifdef __SSE2__
  return _mm_min_ps(a, b);
#else
  return a < b ? a : b;
#endif
}
[[gnu::always_inline]] inline FloatLanes larger_lanes(FloatLanes a, FloatLanes b) {
#ifdef __SSE2__
  return _mm_max_ps(a, b);
#else
  return a > b ? a : b;
#endif
}

/// The components of a tuple as a processor adds them, up to four: the x, y, z of a position and nothing.
/// Narrow codes (position_model.h) are floats, others doubles. Each operation is rounded by itself, in the
/// order in which it stands here, so that both sides and all machines compute the same; no operation may be
/// fused or reordered.
struct FloatPoint {
  using Real = float;
  using Integer = int32_t;
  FloatLanes v;

  static FloatPoint of(float x) { return {FloatLanes{x, x, x, x}}; }
  FloatPoint operator+(FloatPoint o) const { return {v + o.v}; }
  FloatPoint operator-(FloatPoint o) const { return {v - o.v}; }
  FloatPoint operator*(FloatPoint o) const { return {v * o.v}; }
  FloatPoint smaller(FloatPoint o) const { return {smaller_lanes(v, o.v)}; }
  FloatPoint larger(FloatPoint o) const { return {larger_lanes(v, o.v)}; }
  /// The first two components turned by a right angle.
  FloatPoint turned(double ratio) const {
    return {FloatLanes{v[1] * static_cast<float>(ratio), -v[0] / static_cast<float>(ratio), 0, 0}};
  }
  /// Their area with another edge is negative.
  bool turns_right(FloatPoint o) const { return v[0] * o.v[1] - v[1] * o.v[0] < 0; }
  bool turns_left(FloatPoint o) const { return v[0] * o.v[1] - v[1] * o.v[0] > 0; }
  FloatPoint magnitude() const {
    return {reinterpret_cast<FloatLanes>(reinterpret_cast<SignedLanes>(v) & 0x7fffffff)};
  }
};
struct DoublePoint {
  using Real = double;
  using Integer = int64_t;
  using Pair = double __attribute__((vector_size(16)));
  using Bits = int64_t __attribute__((vector_size(16)));
  Pair xy, zw;

  static DoublePoint of(double x) { return {Pair{x, x}, Pair{x, x}}; }
  DoublePoint operator+(DoublePoint o) const { return {xy + o.xy, zw + o.zw}; }
  DoublePoint operator-(DoublePoint o) const { return {xy - o.xy, zw - o.zw}; }
  DoublePoint operator*(DoublePoint o) const { return {xy * o.xy, zw * o.zw}; }
  DoublePoint smaller(DoublePoint o) const { return {xy < o.xy ? xy : o.xy, zw < o.zw ? zw : o.zw}; }
  DoublePoint larger(DoublePoint o) const { return {xy > o.xy ? xy : o.xy, zw > o.zw ? zw : o.zw}; }
  DoublePoint turned(double ratio) const { return {Pair{xy[1] * ratio, -xy[0] / ratio}, Pair{}}; }
  bool turns_right(DoublePoint o) const { return xy[0] * o.xy[1] - xy[1] * o.xy[0] < 0; }
  bool turns_left(DoublePoint o) const { return xy[0] * o.xy[1] - xy[1] * o.xy[0] > 0; }
  DoublePoint magnitude() const {
    const auto positive = [](Pair p) {
      return reinterpret_cast<Pair>(reinterpret_cast<Bits>(p) & 0x7fffffffffffffff);
    };
    return {positive(xy), positive(zw)};
  }
};

/// What the place of a vertex says about its forecast, for a group of ValenceRows: which parallelograms
/// there are beside the one at its gate, and the share of each.
struct GatesOfPlace {
  float closing, late, share;
  uint32_t parallelograms;
};
inline constexpr auto gates_of_group = [] {
  std::array<GatesOfPlace, ValenceRows::groups> table{};
  for (unsigned g = 0; g < ValenceRows::groups; ++g) {
    const unsigned n = ValenceRows::parallelograms(g);
    // A half, or a quarter of each for all three: nearly the mean, in exact numbers.
    table[g] = {ValenceRows::has_closing(g) ? 1.0f : 0.0f, g % 2 != 0 && n > 0 ? 1.0f : 0.0f,
                n == 3 ? 0.25f : 0.5f, n};
    // The straight line says how far to trust the gate, no more.
    if (g / 2 >= first_polygon_place) table[g].share = 0;
  }
  return table;
}();

/// Weights of the references of a vertex, in the order of VertexReferences. Their sum is 1, so that
/// predictions do not depend on where the origin lies.
struct alignas(16) Weights : std::array<float, 8> {};

template <class Point>
struct Forecast {
  Point fitted;         ///< by weights
  Point gate;           ///< by the triangle before
  Point closing, late;  ///< the same as `gate` where there is none
  Point mean;           ///< of the parallelograms, nearly
  Point spread;         ///< how far predictions lie apart

  void find_spread() {
    const Point apart = (closing - gate).magnitude().larger((late - gate).magnitude());
    spread = (mean - fitted).magnitude().larger(apart * Point::of(typename Point::Real{0.5}));
  }
  void turn(Point by) {
    fitted = fitted + by;
    find_spread();
  }
};

/// Points that are not decoded yet are zero.
template <class Point>
[[gnu::always_inline]] inline Forecast<Point> forecast(const Point* points,
                                                       const VertexReferences& references,
                                                       const Weights& weights, unsigned group) {
  using R = VertexReferences;
  using Real = typename Point::Real;
  const auto at = [&](unsigned r) -> Point { return points[references.at[r]]; };
  const auto weight = [&](unsigned r) { return static_cast<Real>(weights[r]); };
  const Point focus = at(R::focus), next = at(R::next), beyond = at(R::next_opposite), late_0 = at(R::late),
              late_1 = at(R::late + 1), late_2 = at(R::late + 2), before = at(R::before), last = at(R::last);
  Forecast<Point> result;
  // The newest one last, for which the processor waits.
  Point sum = Point::of(weight(R::focus)) * focus;
  sum = sum + Point::of(weight(R::next)) * next;
  sum = sum + Point::of(weight(R::next_opposite)) * beyond;
  sum = sum + Point::of(weight(R::late)) * late_0;
  sum = sum + Point::of(weight(R::late + 1)) * late_1;
  sum = sum + Point::of(weight(R::late + 2)) * late_2;
  sum = sum + Point::of(weight(R::before)) * before;
  Real of_last = weight(R::last);
  // (The float's last weight was made so that the eight sum up to 1 in floats: WindowWeights::finish().)
  if constexpr (sizeof(Real) == 8) {
    // As a float it would not make the sum 1 exactly enough.
    of_last = 1;
    for (unsigned r = 0; r < R::last; ++r) of_last -= weight(r);
  }
  result.fitted = sum + Point::of(of_last) * last;
  const GatesOfPlace& gates = gates_of_group[group];
  result.gate = (focus - before) + last;
  const Point to_closing = ((focus - beyond) + next - result.gate) * Point::of(gates.closing);
  const Point to_late = ((late_0 - late_2) + late_1 - result.gate) * Point::of(gates.late);
  result.closing = result.gate + to_closing;
  result.late = result.gate + to_late;
  result.mean = result.gate + (to_closing + to_late) * Point::of(gates.share);
  const Point apart = (result.mean - result.fitted).magnitude();
  result.spread = apart.larger(to_closing.magnitude().larger(to_late.magnitude()) * Point::of(Real{0.5}));
  return result;
}

/// What the turned references add to a forecast of two components. `mirrored`: the side of the face coded
/// last, for those that only know an edge. `ratio`: of the components' steps.
template <class Point>
[[gnu::always_inline]] inline Point turned_part(const Point* points, const VertexReferences& references,
                                                const Weights& weights, double ratio, bool swapped,
                                                bool& mirrored) {
  using R = VertexReferences;
  using Real = typename Point::Real;
  const auto at = [&](unsigned r) -> Point { return points[references.at[r]]; };
  const auto part = [&](unsigned r) -> Point { return Point::of(static_cast<Real>(weights[r])) * at(r); };
  const Point edge = at(R::last) - at(R::focus), across = at(R::before) - at(R::focus);
  if (edge.turns_right(across)) mirrored = !swapped;
  if (edge.turns_left(across)) mirrored = swapped;
  // The weights' sum is nothing, which floats only nearly give.
  const Real others = -(((static_cast<Real>(weights[R::focus]) + static_cast<Real>(weights[R::next])) +
                         static_cast<Real>(weights[R::late])) +
                        static_cast<Real>(weights[R::late + 1]));
  const Point sum = (((part(R::focus) + part(R::next)) + part(R::late)) + part(R::late + 1)) +
                    Point::of(others) * at(R::last);
  return mirrored == swapped ? sum.turned(ratio) : Point::of(0) - sum.turned(ratio);
}

}  // namespace maille
