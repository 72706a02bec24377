#pragma once

// The parts of a stream of positions, as encoder and decoder need them.

#include "base/bytes.h"
#include "base/pages.h"
#include "surface/fans/position_coder.h"

namespace maille::positions {

inline constexpr uint8_t flag_wide = 1, flag_gate = 2, flag_valences = 4, flag_spread = 8, flag_listed = 16,
                         flag_candidates = 32, flag_refined = 64;
inline constexpr uint16_t flag_sheared = 128, flag_polygons = 256;

inline uint16_t flags_of(const Coding& coding, bool wide) {
  return static_cast<uint16_t>((wide ? flag_wide : 0) | (coding.centre == Centre::gate ? flag_gate : 0) |
                               (coding.rows.polygons ? flag_polygons : 0) |
                               (coding.with_valences ? flag_valences : 0) |
                               (coding.with_spread ? flag_spread : 0) |
                               (coding.repeats == Repeats::listed       ? flag_listed
                                : coding.repeats == Repeats::candidates ? flag_candidates
                                                                        : 0));
}
/// False: bits that are not defined, or both kinds of repeats. Wide, refined and sheared are read by the
/// caller.
inline bool read_flags(uint64_t flags, Coding& coding) {
  if (flags > 511 || ((flags & flag_listed) != 0 && (flags & flag_candidates) != 0)) return false;
  coding.rows.polygons = (flags & flag_polygons) != 0;
  coding.centre = (flags & flag_gate) != 0 ? Centre::gate : Centre::fitted;
  coding.with_valences = (flags & flag_valences) != 0;
  coding.with_spread = (flags & flag_spread) != 0;
  coding.repeats = (flags & flag_listed) != 0       ? Repeats::listed
                   : (flags & flag_candidates) != 0 ? Repeats::candidates
                                                    : Repeats::none;
  return true;
}

/// How many lanes of the coder are used: one for each component, and one for masks, if there are that many.
inline unsigned lanes_of(const Coding& coding) {
  const unsigned last =
      coding.repeats == Repeats::listed ? listed_lane(coding.components) : coding.components - 1;
  return last + 1;
}

/// The contexts of symbols of one kind.
struct Alphabet {
  unsigned first, contexts, symbols, most_tables;
};
template <class Visit>
void for_each_alphabet(const Coding& coding, Visit visit) {
  const unsigned n = coding.components;
  const bool spread = coding.with_spread;
  visit(Alphabet{0, residual_contexts_of(n, spread), symbols, most_residual_tables});
  if (coding.repeats == Repeats::none) return;
  if (coding.repeats == Repeats::listed)
    visit(Alphabet{first_listed, listed_contexts_of(n), listed_symbols_of(n), most_listed_tables});
  visit(Alphabet{first_index, index_contexts, index_symbols, most_index_tables});
  if (coding.repeats == Repeats::candidates)
    visit(Alphabet{first_candidate, candidate_contexts_of(n), candidate_symbols, most_candidate_tables});
}

/// The step of the second of two components in steps of the first, by which edges are turned; 0 where that is
/// none.
inline double turn_ratio(std::span<const NumberMap> maps, Scalar type) {
  const auto step = [&](const NumberMap& map) {
    return map.is_curved() ? 1 : map.value_of(type, 1) - map.value_of(type, 0);
  };
  const double ratio = step(maps[1]) / step(maps[0]);
  return ratio > 1e-30 && ratio < 1e30 ? ratio : 0;
}

inline constexpr uint8_t loose_kind = start_place * valence_classes * 2;
/// Points that are not vertices of fans are predicted by the one before.
inline VertexReferences references_beside(uint32_t v) {
  VertexReferences references;
  references.at.fill(v == 0 ? 0 : v - 1);
  return references;
}

/// Weights of a window of vertices, computed before their positions: with valences a row for each vertex,
/// which follows from connectivity alone. So the loop over positions has no chain of look-ups for weights.
/// Memory is that of one window.
class WindowWeights {
 public:
  /// `valences`: none for rows by place alone.
  WindowWeights(const Coding& coding, std::span<const uint8_t> valences, const ElementPlaces& places)
      : rows_(std::make_unique<ValenceWeights>(coding.rows)),
        valences_(coding.with_valences ? valences : std::span<const uint8_t>{}),
        placement_(coding.placement),
        placer_(places, coding.placement) {
    for (unsigned g = 0; g < ValenceRows::groups; ++g) {
      FloatLanes low, high;
      rows_->base(g, low, high);
      finish(low, high, by_group_[g]);
    }
  }
  void compute(const VertexReferences* references, const uint8_t* kinds, uint32_t begin, uint32_t end) {
    at_.resize(end - begin);
    if (placement_ != Placement::none) return place(references, kinds, begin, end);
    for (uint32_t v = begin; v < end; ++v) {
      const unsigned group = group_of_kind[kinds[v - begin]];
      Weights& weights = at_[v - begin];
      // Points behind the vertices have no valence; without valences nobody has.
      if (v >= valences_.size() || place_of_kind(kinds[v - begin]) == start_place) {
        weights = by_group_[group];
        continue;
      }
      FloatLanes low, high;
      rows_->sum(group, references[v - begin], v, valences_.data(), low, high);
      finish(low, high, weights);
    }
  }
  const Weights& operator[](size_t i) const { return at_[i]; }
  const Weights& turned(size_t i) const { return turned_.empty() ? at_[i] : turned_[i]; }

 private:
  [[gnu::always_inline]] static void finish(FloatLanes low, FloatLanes high, Weights& to) {
    // The weight of `last` is 1 less the others, added in the order of the format (12.3, "Forecast").
    const FloatLanes four = low + high;
    high[3] = 1 - ((four[0] + four[1]) + (four[2] + four[3]));
    __builtin_memcpy(to.data(), &low, sizeof low);
    __builtin_memcpy(to.data() + 4, &high, sizeof high);
  }

  void place(const VertexReferences* references, const uint8_t* kinds, uint32_t begin, uint32_t end) {
    turned_.resize(end - begin);
    for (uint32_t v = begin; v < end; ++v) {
      const PlacedWeights placed = placer_.place(v, references[v - begin], kinds[v - begin]);
      at_[v - begin] = placed.straight;
      turned_[v - begin] = placed.turned;
    }
  }

  std::unique_ptr<ValenceWeights> rows_;
  std::span<const uint8_t> valences_;
  std::array<Weights, ValenceRows::groups> by_group_;
  std::vector<Weights> at_, turned_;
  Placement placement_;
  GatePlacer placer_;
};

template <unsigned n>
DoublePoints<n> wide_points(std::span<const NumberMap> maps, Scalar type) {
  DoublePoints<n> points;
  for (unsigned k = 0; k < n; ++k) {
    points.curved[k] = CurvedMap(maps[k], type);
    // Floats' maps with digits have neither decimals nor factors, and those of ordered bits have NaN.
    points.has_numbers[k] =
        type == Scalar::f32 && points.curved[k] && maps[k].kind != NumberMap::Kind::ordered;
  }
  return points;
}

}  // namespace maille::positions
