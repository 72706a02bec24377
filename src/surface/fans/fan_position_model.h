#pragma once

// What encoder and decoder of the positions of fans share. docs/format.md, "POSI 1".

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <utility>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "base/pages.h"
#include "base/unfilled.h"
#include "entropy/integer_model.h"
#include "numbers/number_map.h"
#include "surface/fans/fan_connectivity.h"

namespace maille::fan_positions {

using R = VertexReferences;

// Predictions are sums of weights times references, divided by this.
inline constexpr int weight_bits = 6;
inline constexpr int weight_sum = 1 << weight_bits;
inline constexpr int largest_weight = 511;

inline constexpr unsigned selectors = 4;
inline constexpr unsigned fitted_selector = 1;
inline constexpr unsigned qualities = 4;
inline constexpr unsigned selector_contexts = selectors * 4;
inline constexpr unsigned most_size_tables = 8;
inline constexpr unsigned most_shape_tables = 16;
inline constexpr unsigned class_bits = 9;
inline constexpr unsigned selector_bits = 8;
// Bits of the largest of a vertex's residuals.
inline constexpr unsigned narrow_sizes = 17;
inline constexpr unsigned wide_sizes = 33;
/// Classes of a block are decoded before its positions: four lanes, a quarter of the block each.
inline constexpr uint32_t block_vertices = FanDecoder::window;

inline constexpr uint8_t flag_wide = 1;
inline constexpr uint8_t flag_selectors = 2;
inline constexpr uint8_t flag_late = 4;

inline constexpr unsigned start_kind = start_place * valence_classes * 2;

/// What the fans promise about a prediction, for the size of its residuals.
inline constexpr auto quality_of_kind = [] {
  std::array<uint8_t, vertex_kinds> table{};
  for (unsigned kind = 0; kind < vertex_kinds; ++kind) {
    const bool late = kind_has_late(kind);
    table[kind] = static_cast<uint8_t>(place_of_kind(kind) >= first_open_place ? (late ? 1 : 0)
                                       : kind_is_last(kind)                    ? (late ? 3 : 2)
                                                                               : (late ? 2 : 1));
  }
  return table;
}();
constexpr unsigned selector_context(unsigned before, unsigned kind) {
  return before * 4 + kind_is_last(kind) * 2u + kind_has_late(kind);
}

struct alignas(16) Row : std::array<int16_t, 8> {};
using Rows = std::array<Row, vertex_kinds * selectors>;

inline Row row_of(std::initializer_list<std::pair<unsigned, int>> weights) {
  Row row{};
  for (const auto& [reference, weight] : weights) row[reference] = static_cast<int16_t>(weight);
  return row;
}
inline Row mean_of(const Row& a, const Row& b) {
  Row row{};
  for (unsigned k = 0; k < 8; ++k) row[k] = static_cast<int16_t>((a[k] + b[k]) / 2);
  return row;
}

inline const Row gate_row = row_of({{R::focus, 64}, {R::last, 64}, {R::before, -64}});
inline const Row closing_row = row_of({{R::focus, 64}, {R::next, 64}, {R::next_opposite, -64}});
inline const Row late_row = row_of({{R::late, 64}, {R::late + 1, 64}, {R::late + 2, -64}});
inline const Row last_row = row_of({{R::last, 64}});

/// The rows before any is fitted.
inline Row plain_row(unsigned kind, unsigned selector) {
  if (place_of_kind(kind) == start_place) return last_row;
  const bool late = kind_has_late(kind);
  const bool closing = kind_is_last(kind);
  const Row second = closing ? closing_row : late ? late_row : last_row;
  switch (selector) {
    case 0:
      return gate_row;
    case 1:
      return closing || late ? mean_of(gate_row, second) : gate_row;
    case 2:
      return second;
    default:
      return closing && late ? late_row : mean_of(gate_row, second);
  }
}

inline const Rows& plain_rows() {
  static const Rows all = [] {
    Rows rows;
    for (unsigned kind = 0; kind < vertex_kinds; ++kind) {
      for (unsigned s = 0; s < selectors; ++s) rows[kind * selectors + s] = plain_row(kind, s);
    }
    return rows;
  }();
  return all;
}

/// References that say something at this kind; the others repeat the focus.
inline unsigned useful_references(unsigned kind) {
  const unsigned place = place_of_kind(kind);
  if (place == start_place) return 0;
  unsigned mask = 1u << R::focus | 1u << R::before | 1u << R::last;
  if (place < first_open_place) mask |= 1u << R::next | 1u << R::next_opposite;
  if (kind_has_late(kind)) mask |= 7u << R::late;
  return mask;
}

/// Fitted rows: for a place in the fan, and where it pays for single valences too.
struct FittedRows {
  // By place and late, and by kind.
  std::array<bool, first_polygon_place * 2> has_place{};
  std::array<Row, first_polygon_place * 2> of_place{};
  std::array<bool, vertex_kinds> has_kind{};
  std::array<Row, vertex_kinds> of_kind{};

  static unsigned place(unsigned kind) { return place_of_kind(kind) * 2 + kind_has_late(kind); }
  static unsigned kind(unsigned place, unsigned valence) {
    return (place / 2 * valence_classes + valence) * 2 + place % 2;
  }

  template <class Coder>
  void code(Coder& coder) {
    std::array<BitModel, 2> there;
    std::array<OffsetModel, 2> step;
    for (unsigned p = 0; p < first_polygon_place * 2; ++p) {
      if (place_of_kind(kind(p, 0)) == start_place) continue;
      has_place[p] = there[0].code(coder, has_place[p]);
      if (!has_place[p]) continue;
      code_row(coder, step[0], of_place[p], plain_row(kind(p, 0), fitted_selector), kind(p, 0));
      for (unsigned v = 0; v < valence_classes; ++v) {
        const unsigned k = kind(p, v);
        has_kind[k] = there[1].code(coder, has_kind[k]);
        if (has_kind[k]) code_row(coder, step[1], of_kind[k], of_place[p], k);
      }
    }
  }
  void apply(Rows& rows) const {
    for (unsigned k = 0; k < triangle_kinds; ++k) {
      if (!has_place[place(k)]) continue;
      rows[k * selectors + fitted_selector] = has_kind[k] ? of_kind[k] : of_place[place(k)];
    }
  }

 private:
  template <class Coder>
  static void code_row(Coder& coder, OffsetModel& model, Row& row, const Row& expected, unsigned kind) {
    int sum = 0;
    for (unsigned k = 0; k < R::last; ++k) {
      if ((useful_references(kind) >> k & 1) == 0) {
        row[k] = 0;
        continue;
      }
      // Steps are a multiple of two weights in most cases that matter; both directions share the rounding.
      const int value = expected[k] + model.code(coder, row[k] - expected[k]);
      row[k] = static_cast<int16_t>(std::clamp(value, -largest_weight, largest_weight));
      sum += row[k];
    }
    row[R::last] = static_cast<int16_t>(weight_sum - sum);
  }
};

/// Two symbols tell the classes of a vertex's residuals: the size of the largest, and a shape: by how many
/// bits each is smaller. A step of two stands for larger ones too, but for a residual of 0.
enum ShapeStep : unsigned { as_large, one_less, two_less, zero_residual, shape_steps };
constexpr unsigned step_in(unsigned steps, unsigned k) {
  return steps >> (2 * k) & 3;
}
/// Shapes that can be, as the steps of x, y and z, two bits each: one is as large as the largest, or all are
/// 0.
inline constexpr unsigned shapes = 38;
inline constexpr auto steps_of_shape = [] {
  std::array<uint8_t, shapes> table{};
  unsigned count = 0;
  for (unsigned steps = 0; steps < 64; ++steps) {
    const bool possible = step_in(steps, 0) == as_large || step_in(steps, 1) == as_large ||
                          step_in(steps, 2) == as_large || steps == 63;
    if (possible) table[count++] = static_cast<uint8_t>(steps);
  }
  return table;
}();
inline constexpr auto shape_of_steps = [] {
  std::array<uint8_t, 64> table{};
  for (unsigned shape = 0; shape < shapes; ++shape)
    table[steps_of_shape[shape]] = static_cast<uint8_t>(shape);
  return table;
}();
/// The coordinates without a residual, a bit each.
inline constexpr auto zeros_of_shape = [] {
  std::array<uint8_t, shapes> table{};
  for (unsigned shape = 0; shape < shapes; ++shape) {
    for (unsigned k = 0; k < 3; ++k) {
      if (step_in(steps_of_shape[shape], k) == zero_residual)
        table[shape] = static_cast<uint8_t>(table[shape] | 1u << k);
    }
  }
  return table;
}();

/// The context of a size: the size before, and what the kind promises; that of a shape: the size, and where
/// the residuals before were 0.
constexpr unsigned size_context(unsigned before, unsigned quality) {
  return before * qualities + quality;
}
constexpr unsigned shape_context(unsigned size, unsigned zeros_before) {
  return size * 8 + zeros_before;
}

inline unsigned class_of(int32_t residual) {
  const uint32_t size = residual < 0 ? 0 - static_cast<uint32_t>(residual) : static_cast<uint32_t>(residual);
  return bit_length(size);
}
struct SizeAndShape {
  unsigned size;
  unsigned shape;
};
template <class Residuals>
[[gnu::always_inline]] inline SizeAndShape size_and_shape(const Residuals& residuals) {
  const unsigned x = class_of(residuals[0]), y = class_of(residuals[1]), z = class_of(residuals[2]);
  const unsigned size = std::max(std::max(x, y), z);
  const auto step = [size](unsigned c) {
    const unsigned less = std::min<unsigned>(size - c, two_less);
    return c == 0 ? unsigned{zero_residual} : less;
  };
  return {size, shape_of_steps[step(x) | step(y) << 2 | step(z) << 4]};
}

/// The raw bits of a residual: of a known class c, where the residual is not below -2^c, the number itself if
/// it is positive, so that the highest bit is set (`half`), else the number plus `back` = 2^c - 1; else the
/// number plus 2^c.
struct Field {
  unsigned bits = 0;
  uint64_t half = 0;
  uint64_t back = 0;
};
constexpr Field field_of(unsigned size, unsigned step) {
  if (step == zero_residual || size <= step) return {};
  const unsigned c = size - step;
  if (step == two_less) return {c + 1, 0, uint64_t{1} << c};
  return {c, uint64_t{1} << (c - 1), (uint64_t{1} << c) - 1};
}
inline uint64_t raw_bits(int32_t residual, const Field& field) {
  if (residual >= 0 && field.half != 0) return static_cast<uint32_t>(residual);
  return static_cast<uint64_t>(int64_t{residual}) + field.back;
}
inline int32_t residual_of(uint64_t bits, const Field& field) {
  return static_cast<int32_t>(static_cast<uint32_t>(bits - ((bits & field.half) == 0 ? field.back : 0)));
}

/// Positions whose codes span 16 bits: two references at once in one multiply-add.
struct NarrowPoints {
  using Point = std::array<int16_t, 4>;
  static constexpr unsigned sizes = narrow_sizes;

  Unfilled<Point> points;
  std::array<int32_t, 3> bias{};
  size_t most;

  explicit NarrowPoints(size_t count) : most(count) { reserve_pages(points, count); }
  /// Makes those below `end`: a decoder in pieces that stay in the cache until they are written.
  void grow(size_t end) {
    const size_t begin = points.size();
    if (begin >= std::min(end, most)) return;
    points.resize(std::min(end, most));
    std::memset(points.data() + begin, 0, (points.size() - begin) * sizeof(Point));
  }

  using Codes = std::array<int32_t, 3>;
  void set(uint32_t v, const Codes& codes) {
    for (unsigned k = 0; k < 3; ++k)
      points[v][k] = static_cast<int16_t>(static_cast<uint32_t>(codes[k]) - static_cast<uint32_t>(bias[k]));
  }
  int32_t code(uint32_t v, unsigned k) const {
    return static_cast<int32_t>(static_cast<uint32_t>(bias[k]) +
                                static_cast<uint32_t>(int32_t{points[v][k]}));
  }
  double value(uint32_t v, unsigned k) const { return points[v][k]; }

#ifdef __SSE2__
  /// Two references at once; the same integers.
  Codes predict(const VertexReferences& references, const Row& row) const {
    const auto at = [&](unsigned r) {
      return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(points.data() + references.at[r]));
    };
    const __m128i weights = _mm_load_si128(reinterpret_cast<const __m128i*>(row.data()));
    const auto pair = [&](unsigned r, __m128i two) {
      return _mm_madd_epi16(_mm_unpacklo_epi16(at(r), at(r + 1)), two);
    };
    __m128i sum = _mm_set1_epi32(weight_sum / 2);
    sum = _mm_add_epi32(sum, pair(0, _mm_shuffle_epi32(weights, 0x00)));
    sum = _mm_add_epi32(sum, pair(2, _mm_shuffle_epi32(weights, 0x55)));
    sum = _mm_add_epi32(sum, pair(4, _mm_shuffle_epi32(weights, 0xaa)));
    sum = _mm_add_epi32(sum, pair(6, _mm_shuffle_epi32(weights, 0xff)));
    sum = _mm_srai_epi32(sum, weight_bits);
    alignas(16) std::array<int16_t, 8> narrow;
    _mm_store_si128(reinterpret_cast<__m128i*>(narrow.data()), _mm_packs_epi32(sum, sum));
    return {narrow[0], narrow[1], narrow[2]};
  }
#else
  Codes predict(const VertexReferences& references, const Row& row) const {
    Codes sum{};
    for (unsigned r = 0; r < 8; ++r) {
      for (unsigned k = 0; k < 3; ++k) sum[k] += int32_t{row[r]} * points[references.at[r]][k];
    }
    for (unsigned k = 0; k < 3; ++k)
      sum[k] = std::clamp((sum[k] + weight_sum / 2) >> weight_bits, -32768, 32767);
    return sum;
  }
#endif
  int32_t residual(uint32_t v, unsigned k, int32_t predicted) const {
    return static_cast<int16_t>(points[v][k] - predicted);
  }
  /// Of a vertex, with each of some rows.
  template <size_t count>
  std::array<Codes, count> residuals(uint32_t v, const VertexReferences& references, const Row* rows) const {
    std::array<Codes, count> all;
#ifdef __SSE2__
    const auto at = [&](uint32_t point) {
      return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(points.data() + point));
    };
    const auto pair = [&](unsigned r) {
      return _mm_unpacklo_epi16(at(references.at[r]), at(references.at[r + 1]));
    };
    const __m128i a = pair(0), b = pair(2), c = pair(4), d = pair(6), own = at(v);
    for (size_t s = 0; s < count; ++s) {
      const __m128i weights = _mm_load_si128(reinterpret_cast<const __m128i*>(rows[s].data()));
      __m128i sum = _mm_set1_epi32(weight_sum / 2);
      sum = _mm_add_epi32(sum, _mm_madd_epi16(a, _mm_shuffle_epi32(weights, 0x00)));
      sum = _mm_add_epi32(sum, _mm_madd_epi16(b, _mm_shuffle_epi32(weights, 0x55)));
      sum = _mm_add_epi32(sum, _mm_madd_epi16(c, _mm_shuffle_epi32(weights, 0xaa)));
      sum = _mm_add_epi32(sum, _mm_madd_epi16(d, _mm_shuffle_epi32(weights, 0xff)));
      sum = _mm_srai_epi32(sum, weight_bits);
      const auto three =
          static_cast<uint64_t>(_mm_cvtsi128_si64(_mm_sub_epi16(own, _mm_packs_epi32(sum, sum))));
      for (unsigned k = 0; k < 3; ++k) all[s][k] = static_cast<int16_t>(three >> (16 * k) & 0xffff);
    }
#else
    for (size_t s = 0; s < count; ++s) {
      const Codes predicted = predict(references, rows[s]);
      for (unsigned k = 0; k < 3; ++k) all[s][k] = residual(v, k, predicted[k]);
    }
#endif
    return all;
  }
  void reconstruct(uint32_t v, const Codes& predicted, const Codes& residuals) {
    for (unsigned k = 0; k < 3; ++k) points[v][k] = static_cast<int16_t>(predicted[k] + residuals[k]);
  }
};

/// Any codes of 32 bits: predicted in doubles, floats by their values.
struct WidePoints {
  static constexpr unsigned sizes = wide_sizes;

  std::vector<std::array<int32_t, 3>> codes;
  std::vector<std::array<double, 3>> values;
  std::array<const NumberMap*, 3> curved{};  ///< maps whose codes are not proportional to numbers

  explicit WidePoints(size_t count) : codes(count), values(count) {}
  void grow(size_t) {}

  using Codes = std::array<int32_t, 3>;
  void set(uint32_t v, const Codes& to) {
    codes[v] = to;
    for (unsigned k = 0; k < 3; ++k) {
      // Infinities would make NaN, and numbers near the largest overflow.
      values[v][k] = curved[k] ? std::clamp(curved[k]->value_of(Scalar::f32, to[k]), -1e37, 1e37) : to[k];
    }
  }
  int32_t code(uint32_t v, unsigned k) const { return codes[v][k]; }
  double value(uint32_t v, unsigned k) const { return values[v][k]; }

  Codes predict(const VertexReferences& references, const Row& row) const {
    std::array<double, 3> sum{};
    for (unsigned r = 0; r < 8; ++r) {
      for (unsigned k = 0; k < 3; ++k) sum[k] += row[r] * values[references.at[r]][k];
    }
    Codes result;
    for (unsigned k = 0; k < 3; ++k) {
      const double mean = sum[k] * (1.0 / weight_sum);
      if (curved[k]) {
        result[k] = static_cast<int32_t>(curved[k]->nearest_code(Scalar::f32, mean));
      } else {
        result[k] = static_cast<int32_t>(std::clamp(std::floor(mean + 0.5), -2147483648.0, 2147483647.0));
      }
    }
    return result;
  }
  int32_t residual(uint32_t v, unsigned k, int32_t predicted) const {
    return static_cast<int32_t>(static_cast<uint32_t>(codes[v][k]) - static_cast<uint32_t>(predicted));
  }
  template <size_t count>
  std::array<Codes, count> residuals(uint32_t v, const VertexReferences& references, const Row* rows) const {
    std::array<Codes, count> all;
    for (size_t s = 0; s < count; ++s) {
      const Codes predicted = predict(references, rows[s]);
      for (unsigned k = 0; k < 3; ++k) all[s][k] = residual(v, k, predicted[k]);
    }
    return all;
  }
  void reconstruct(uint32_t v, const Codes& predicted, const Codes& residuals) {
    Codes sum;
    for (unsigned k = 0; k < 3; ++k)
      sum[k] =
          static_cast<int32_t>(static_cast<uint32_t>(predicted[k]) + static_cast<uint32_t>(residuals[k]));
    set(v, sum);
  }
};

/// Points that are not vertices of fans are predicted by the one before.
inline VertexReferences references_beside(uint32_t v) {
  VertexReferences references;
  references.at.fill(v == 0 ? 0 : v - 1);
  return references;
}

/// Vertices of the fans, then the other points.
struct Vertices {
  const FanSurface& fans;
  uint32_t count;
  bool with_late;

  unsigned kind(uint32_t v) const {
    return v < fans.vertices ? fans.kinds[v] & (with_late ? 255u : 254u) : start_kind;
  }
  VertexReferences references(uint32_t v) const {
    return v < fans.vertices ? fans.references[v] : references_beside(v);
  }
};

/// How a block of classes is dealt to the lanes.
struct Deal {
  uint32_t begin;
  uint32_t end;
  uint32_t share() const { return (end - begin + group_lanes - 1) / group_lanes; }
};

template <class Visit>
void for_each_group(uint32_t count, Visit visit) {
  for (uint32_t begin = 0; begin < count; begin += block_vertices) {
    const Deal deal{begin, std::min(count, begin + block_vertices)};
    for (uint32_t i = 0; i < deal.share(); ++i) {
      for (unsigned lane = 0; lane < group_lanes; ++lane) {
        const uint32_t v = begin + lane * deal.share() + i;
        if (v < deal.end) visit(v, lane);
      }
    }
  }
}

}  // namespace maille::fan_positions
