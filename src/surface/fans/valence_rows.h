#pragma once

// Predictions of positions as sums of weights times references, where weights follow the valences around.
// docs/format.md, 12.3.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/lanes.h"
#include "entropy/bit_model.h"
#include "entropy/symbol_model.h"
#include "surface/fans/fan_connectivity.h"

namespace maille {

/// How much wider than 60 degrees the corners at a vertex of so many triangles are, if they are equal: 360 /
/// valence - 60, for 3 to 10 of them; others count as the nearest.
inline constexpr std::array<int8_t, 8> corner_degrees = {60, 30, 12, 0, -9, -15, -20, -24};
inline constexpr auto valence_deviations = [] {
  std::array<float, 256> table{};
  for (int valence = 0; valence < 256; ++valence)
    table[static_cast<size_t>(valence)] = corner_degrees[static_cast<size_t>(valence < 3    ? 0
                                                                             : valence > 10 ? 7
                                                                                            : valence - 3)];
  return table;
}();

/// Rows of weights over the references of a vertex but the last one, whose weight is 1 less the others. Its
/// place in the fan, and whether there is a late triple, choose six rows. What counts is the first row plus
/// the sum of the other rows times the deviation of a valence each: of focus, last, before, next and the
/// vertex itself. Following valences is worth most of all that positions over fans do: log2 of residuals at
/// 14 bits, armadillo 11.0 to 9.1 bits a vertex, bear 9.0 to 6.9 (6e37002).
struct ValenceRows {
  enum Term : unsigned { base, by_focus, by_last, by_before, by_next, by_itself, terms };
  static constexpr unsigned groups = fan_places * 2;
  static constexpr unsigned references = VertexReferences::last;
  static constexpr int base_unit = 1 << 7;        ///< weights are numbers of this part of 1
  static constexpr int deviation_unit = 1 << 12;  ///< the same in the other rows, for a degree
  // Fitted rows are clamped to this: weights of 8 in the first row, 1/4 a degree in others. Chosen, not
  // swept; a decoder takes any 16 bits.
  static constexpr int largest = 1 << 10;

  using Row = std::array<int16_t, references>;
  /// How much of a group is stored: nothing (the mean of parallelograms), the first row, all rows.
  std::array<uint8_t, groups> kept{};
  std::array<std::array<Row, terms>, groups> rows;
  bool polygons = false;  ///< the groups of their places are stored as well

  ValenceRows();
  static constexpr unsigned group_of(unsigned kind) {
    return place_of_kind(kind) * 2 + static_cast<unsigned>(kind_has_late(kind));
  }
  static constexpr bool is_closed(unsigned group) { return group / 2 < first_open_place; }
  static constexpr bool has_closing(unsigned group) { return kind_is_last(group / 2 * 2 * valence_classes); }
  static constexpr unsigned parallelograms(unsigned group) {
    return group / 2 == start_place ? 0 : 1u + has_closing(group) + group % 2;
  }
  /// The references that say something in this group, as a mask.
  static unsigned useful(unsigned group);
  static constexpr bool is_useful(unsigned group, unsigned term) {
    return term != by_next || is_closed(group);
  }
  /// The mean of a group's parallelograms, in the format's rounding: floor(128 / count) each.
  static Row plain_row(unsigned group);

  /// Only the first rows count then.
  void forget_valences();

  template <class Coder>
  void code(Coder& coder);
};

/// Rows by place alone and rows that follow valences, too, with about the bits that residuals of all vertices
/// have then, rows included.
struct FittedRows {
  ValenceRows by_place, by_valence;
  double bits_by_place = 0, bits_by_valence = 0;
};

/// Rows for a surface, by least absolute errors, where they save more than they take. `values` by vertex;
/// `units` are what a difference of one code is about; without valences both rows are the same.
/// 1 to 4 components.
template <unsigned components>
FittedRows fit_valence_rows(const FanSurface& fans, std::span<const std::array<double, components>> values,
                            const std::array<double, components>& units, bool with_valences);

/// The rows as a predictor uses them: padded, in parts of 1.
struct ValenceWeights {
  struct alignas(16) Padded : std::array<float, 8> {};
  std::array<std::array<Padded, ValenceRows::terms>, ValenceRows::groups> rows;

  explicit ValenceWeights(const ValenceRows& from);
  /// The first row of a group.
  void base(unsigned group, FloatLanes& low, FloatLanes& high) const { load(rows[group][0], low, high); }
  /// The sum of a group's rows for a vertex.
  [[gnu::always_inline]] void sum(unsigned group, const VertexReferences& references, uint32_t vertex,
                                  const uint8_t* valences, FloatLanes& low, FloatLanes& high) const {
    using R = VertexReferences;
    const Padded* row = rows[group].data();
    load(row[0], low, high);
    const auto add = [&](unsigned term, uint32_t of) {
      const float degrees = valence_deviations[valences[of]];
      const FloatLanes factor = {degrees, degrees, degrees, degrees};
      FloatLanes a, b;
      load(row[term], a, b);
      low += factor * a;
      high += factor * b;
    };
    add(ValenceRows::by_focus, references.at[R::focus]);
    add(ValenceRows::by_last, references.at[R::last]);
    add(ValenceRows::by_before, references.at[R::before]);
    add(ValenceRows::by_next, references.at[R::next]);
    add(ValenceRows::by_itself, vertex);
  }

 private:
  [[gnu::always_inline]] static void load(const Padded& row, FloatLanes& low, FloatLanes& high) {
    __builtin_memcpy(&low, row.data(), sizeof low);
    __builtin_memcpy(&high, row.data() + 4, sizeof high);
  }
};

template <class Coder>
void ValenceRows::code(Coder& coder) {
  std::array<BitModel, 2> stored;
  std::array<SymbolModel, 2> length;
  for (unsigned g = 0; g < (polygons ? unsigned{groups} : 2 * first_polygon_place); ++g) {
    if (useful(g) == 0) continue;
    for (unsigned l = 0; l < 2 && kept[g] >= l; ++l) {
      const bool more = stored[l].code(coder, kept[g] > l);
      if constexpr (!Coder::encoding) kept[g] = static_cast<uint8_t>(kept[g] + more);
    }
    if (kept[g] == 0) continue;
    const Row plain = plain_row(g);
    for (unsigned t = 0; t < (kept[g] > 1 ? unsigned{terms} : 1u); ++t) {
      for (unsigned r = 0; r < references && is_useful(g, t); ++r) {
        if ((useful(g) >> r & 1) == 0) continue;
        const int expected = t == base ? plain[r] : 0;
        const int offset = rows[g][t][r] - expected;
        const unsigned size = static_cast<unsigned>(offset < 0 ? -offset : offset);
        const unsigned bits = length[t > 0].code(coder, bit_length(size));
        if (bits == 0) {
          rows[g][t][r] = static_cast<int16_t>(expected);
          continue;
        }
        const bool negative = coder.code_raw(offset < 0, 1) != 0;
        const uint32_t top = 1u << (bits - 1);
        const auto value = static_cast<int>(top + coder.code_raw(size - top, bits - 1));
        rows[g][t][r] = static_cast<int16_t>(expected + (negative ? -value : value));
      }
    }
  }
}

}  // namespace maille
