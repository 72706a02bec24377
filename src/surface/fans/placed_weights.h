#pragma once

// Weights by positions: where an element lies beside the triangles of its gates says what share each of
// their elements has. docs/format.md, 13.2.

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "surface/fans/forecast.h"
#include "surface/vector3.h"

namespace maille {

/// Which map of a gate's triangle goes on beyond its edge.
enum class Placement : uint8_t {
  none,
  hinge,    ///< the linear one, with the triangle laid flat around the edge
  similar,  ///< the one of the edge that keeps angles: two components, textures
  both,     ///< the mean of these
};
inline constexpr unsigned placement_count = 4;

/// Elements that have only a known edge, without a face beyond it, stand in this place.
inline constexpr unsigned edge_place = 1;
/// The valence class says which of an element's first two references comes first around its face.
inline constexpr bool kind_is_swapped(unsigned kind) {
  return (kind / 2) % valence_classes != 0;
}

/// Decoded positions of elements.
struct ElementPlaces {
  std::span<const Vector3> positions;  ///< of points, finite
  std::span<const uint32_t> point_of;  ///< by element; empty: elements are points
  const Vector3& operator[](uint32_t element) const {
    return positions[point_of.empty() ? element : point_of[element]];
  }
};

/// Weights of the references, and those of the references turned by a right angle, of two components.
struct PlacedWeights {
  Weights straight{}, turned{};
};

/// Computes weights from decoded positions, in doubles in a fixed order. A gate's triangle has a linear map
/// from positions to the array's values; the element's position, laid flat into the plane of that triangle
/// (`hinge`), or turned and scaled with the edge (`similar`), says what the map gives there. Lossless at -5,
/// bytes of texture coordinates: helmet 49,206 to 45,626, makehuman 60,370 to 53,174 (cc7f669).
class GatePlacer {
 public:
  GatePlacer(ElementPlaces places, Placement placement)
      : places_(places),
        similar_(placement == Placement::similar ? 1
                 : placement == Placement::both  ? 0.5
                                                 : 0) {}

  PlacedWeights place(uint32_t element, const VertexReferences& references, unsigned kind) const {
    Sum sum;
    const unsigned place = place_of_kind(kind);
    if (place == start_place) {
      sum.straight[R::last] = 1;
    } else if (place == edge_place) {
      add_edge(element, references, sum);
    } else {
      const double share = 1.0 / (1 + kind_is_last(kind) + kind_has_late(kind));
      add_gate(element, references, {R::focus, R::last, R::before}, share, 1, sum);
      if (kind_is_last(kind))
        add_gate(element, references, {R::focus, R::next, R::next_opposite}, share, -1, sum);
      if (kind_has_late(kind))
        add_gate(element, references, {R::late, R::late + 1, R::late + 2}, share,
                 kind_is_swapped(kind) ? -1 : 1, sum);
    }
    PlacedWeights weights;
    for (unsigned r = 0; r < R::count; ++r) {
      weights.straight[r] = static_cast<float>(sum.straight[r]);
      weights.turned[r] = static_cast<float>(sum.turned[r]);
    }
    return weights;
  }

 private:
  using R = VertexReferences;
  struct Sum {
    std::array<double, R::count> straight{}, turned{};
  };
  /// Of references: the edge from a to b, and the element across it.
  struct Gate {
    unsigned a, b, across;
  };
  // In lengths of the edge. Chosen, not swept (cc7f669): maps extrapolated from slivers make weights huge, so
  // the plain parallelogram stands in there.
  static constexpr double most = 4;  ///< farther from the triangle its map is worth nothing

  void add_gate(uint32_t element, const VertexReferences& references, Gate gate, double share, int sign,
                Sum& sum) const {
    const Vector3& a = places_[references.at[gate.a]];
    const Vector3 to = places_[element] - a;
    const Vector3 from = places_[references.at[gate.across]] - a;
    // A straight line that goes on beyond an edge of no length: only how far, relative to the step before,
    // can be placed.
    if (references.at[gate.a] == references.at[gate.b]) {
      const double beyond = std::sqrt(dot(to, to) / dot(from, from));
      const double ahead = beyond < most ? beyond : 1;
      sum.straight[gate.a] += share * (1 + ahead);
      sum.straight[gate.across] -= share * ahead;
      return;
    }
    const Vector3 edge = places_[references.at[gate.b]] - a;
    const double square = dot(edge, edge);
    const double along = dot(to, edge) / square, across_along = dot(from, edge) / square;
    const Vector3 beside = to - edge * along, across = from - edge * across_along;
    const double off = std::sqrt(dot(beside, beside) / square);
    const double beyond = std::sqrt(dot(beside, beside) / dot(across, across));
    // Comparisons are false for NaN, as of edges without length: then it is the parallelogram.
    if (!(std::fabs(along - 0.5) < most && off < most && beyond < most &&
          std::fabs(across_along - 0.5) < most)) {
      sum.straight[gate.a] += share;
      sum.straight[gate.b] += share;
      sum.straight[gate.across] -= share;
      return;
    }
    const double linear = (1 - similar_) * beyond;
    sum.straight[gate.a] += share * (1 - along + linear * (1 - across_along));
    sum.straight[gate.b] += share * (along + linear * across_along);
    sum.straight[gate.across] -= share * linear;
    turn(gate, share * similar_ * off * sign, sum);
  }

  void add_edge(uint32_t element, const VertexReferences& references, Sum& sum) const {
    const Vector3& a = places_[references.at[R::focus]];
    const Vector3 to = places_[element] - a, edge = places_[references.at[R::last]] - a;
    const double square = dot(edge, edge);
    double along = dot(to, edge) / square;
    const Vector3 beside = to - edge * along;
    const double off = std::sqrt(dot(beside, beside) / square);
    if (!(std::fabs(along - 0.5) < most && off < most)) {
      sum.straight[R::focus] = sum.straight[R::last] = 0.5;
      return;
    }
    // One edge alone predicts badly far beyond its ends.
    along = along < -1 ? -1 : along > 2 ? 2 : along;
    sum.straight[R::focus] = 1 - along;
    sum.straight[R::last] = along;
    turn({R::focus, R::last, R::last}, similar_ > 0 ? off : 0, sum);
  }

  static void turn(Gate gate, double by, Sum& sum) {
    sum.turned[gate.a] -= by;
    sum.turned[gate.b] += by;
  }

  ElementPlaces places_;
  double similar_;
};

}  // namespace maille
