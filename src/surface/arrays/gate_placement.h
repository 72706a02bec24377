#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "surface/arrays/array_coder.h"
#include "surface/arrays/stencil.h"
#include "surface/vector3.h"

namespace maille {

/// How a gate's elements predict the one behind it. docs/format.md, "Placed gates".
enum class Placement : uint8_t {
  parallelogram,  ///< a + b - across
  hinge,          ///< the linear map of the gate's triangle, laid flat around the edge ab
  similar,        ///< the map of the edge ab that keeps angles: two components, textures
  both,           ///< the mean of the last two
};
inline constexpr unsigned placement_count = 4;

/// Where an element lies beside a gate, by positions: at `along` of the edge from a to b, `off` of the edge's
/// length beside it; `beyond` says how far in distances of `across`, which lies at `across_along`.
struct PlacedGate {
  double along = 1;
  double off = 0;
  double across_along = 0;
  double beyond = 1;
  bool flat = false;  ///< no triangle: the parallelogram
};

/// Places the elements of points or corners by decoded positions. Doubles in a fixed order.
class GatePlacement {
 public:
  GatePlacement(const PatchElements& elements, Domain domain)
      : surface_(*elements.surface), positions_(elements.positions), corners_(domain == Domain::corner) {}

  PlacedGate place(uint32_t element, const Gate& gate) const {
    const Vector3& a = position(gate.a);
    const Vector3 to = position(element) - a;
    if (gate.a == gate.b) return straight_on(to, position(gate.across) - a);
    const Vector3 from = gate.across == none ? Vector3{} : position(gate.across) - a;
    const Vector3 edge = position(gate.b) - a;
    const double square = dot(edge, edge);
    PlacedGate placed;
    placed.along = dot(to, edge) / square;
    placed.across_along = dot(from, edge) / square;
    const Vector3 beside = to - edge * placed.along;
    const Vector3 across = from - edge * placed.across_along;
    placed.off = std::sqrt(dot(beside, beside) / square);
    placed.beyond = gate.across == none ? 0 : std::sqrt(dot(beside, beside) / dot(across, across));
    // Far from the triangle its map is worth nothing; comparisons are false for NaN.
    placed.flat = !(std::fabs(placed.along - 0.5) < most && placed.off < most && placed.beyond < most &&
                    std::fabs(placed.across_along - 0.5) < most);
    return placed;
  }

 private:
  static constexpr double most = 4;

  /// a and b are one: straight on from `across`, as far as it is.
  static PlacedGate straight_on(const Vector3& to, const Vector3& from) {
    PlacedGate placed;
    placed.along = 0;
    placed.beyond = std::sqrt(dot(to, to) / dot(from, from));
    placed.flat = !(placed.beyond < most);
    return placed;
  }
  const Vector3& position(uint32_t element) const {
    return positions_[corners_ ? surface_.point(surface_.half_edges.origin[element]) : element];
  }

  const PatchSurface& surface_;
  std::span<const Vector3> positions_;
  bool corners_;
};

}  // namespace maille
