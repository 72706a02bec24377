#pragma once

// What encoder and decoder of the positions of adaptive fans share. docs/format.md, "POSI 2".

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/lanes.h"
#include "base/pages.h"
#include "code/residual_model.h"
#include "entropy/integer_model.h"
#include "numbers/number_map.h"
#include "surface/fans/valence_rows.h"
#include "surface/fans/value_dictionary.h"

namespace maille {

/// How positions are coded, chosen by the encoder.
struct AdaptiveCoding {
  /// What residuals are relative to. An integer parallelogram keeps what repeats visible.
  enum class Centre : uint8_t { fitted, gate };
  enum class Repeats : uint8_t {
    none,
    levels,      ///< which coordinates are in a dictionary comes first, as a pattern
    candidates,  ///< each coordinate may be that of a neighbour or of a parallelogram, or in a dictionary
  };
  Centre centre = Centre::fitted;
  Repeats repeats = Repeats::none;
  /// Residuals of up to so many bits share a symbol, by coordinate.
  std::array<uint8_t, 3> base{};
  ValenceRows rows;
  std::array<ValueDictionary, 3> dictionaries;
};

using Codes3 = std::array<int32_t, 3>;

/// Positions while they are coded; those to come are zero.
struct AdaptivePoints {
  std::vector<Codes3> codes;
  std::vector<std::array<double, 3>> values;  ///< the codes, or the numbers of curved maps
  std::array<const NumberMap*, 3> curved{};   ///< maps whose codes are not proportional to numbers

  AdaptivePoints(size_t count, std::span<const NumberMap> maps) {
    reserve_pages(codes, count);
    codes.resize(count);
    reserve_pages(values, count);
    values.resize(count);
    for (unsigned k = 0; k < 3; ++k) curved[k] = maps[k].is_curved() ? &maps[k] : nullptr;
  }
  bool any_curved() const { return curved[0] || curved[1] || curved[2]; }
  /// Infinities would make NaN, and numbers near the largest overflow.
  double value_of(unsigned k, int32_t code) const {
    return curved[k] ? std::clamp(curved[k]->value_of(Scalar::f32, code), -1e37, 1e37) : code;
  }
};

/// The nearest integer (the even one of two), modulo 2^32, of numbers up to 2^51.
inline constexpr double rounding_sum = 6755399441055744.0;  // 2^52 + 2^51: the integer is in the lowest bits
inline uint32_t rounded(double x) {
  const double shifted = x + rounding_sum;
  uint64_t bits;
  __builtin_memcpy(&bits, &shifted, sizeof bits);
  return static_cast<uint32_t>(bits);
}

/// Size of a residual: 0, else about two to the octave, 3 for 1.
[[gnu::always_inline]] inline unsigned residual_size(uint32_t magnitude) {
  // No branches: small and large ones alternate.
  const uint64_t odd = uint64_t{2} * magnitude + 1;
  const auto below = 63u - static_cast<unsigned>(__builtin_clzll(odd));
  return 2 * below + static_cast<unsigned>(2 * odd >> below & 1);
}
[[gnu::always_inline]] inline unsigned residual_length(uint32_t magnitude) {
  return 63u - static_cast<unsigned>(__builtin_clzll(uint64_t{2} * magnitude + 1));
}

/// Magnitude of a number of 32 bits; that of -2^31 is itself.
[[gnu::always_inline]] inline int32_t magnitude(int32_t x) {
  return x < 0 ? static_cast<int32_t>(0 - static_cast<uint32_t>(x)) : x;
}
[[gnu::always_inline]] inline int32_t wrapped_difference(int32_t a, int32_t b) {
  return static_cast<int32_t>(static_cast<uint32_t>(a) - static_cast<uint32_t>(b));
}

/// What is expected of a vertex, by coordinate.
struct alignas(16) Expectation {
  using Four = std::array<int32_t, 4>;
  Four centre;
  Four fitted;
  Four gate, closing, late;
  Four apart;   ///< another prediction less the centre
  Four spread;  ///< how far predictions lie apart
};

template <bool curved>
class Expecter {
 public:
  Expecter(const AdaptivePoints& points, const AdaptiveCoding& coding, const uint8_t* valences)
      : points_(points),
        weights_(std::make_unique<ValenceWeights>(coding.rows)),
        by_gate_(coding.centre == AdaptiveCoding::Centre::gate),
        valences_(valences) {}

  [[gnu::always_inline]] void expect(const VertexReferences& references, unsigned kind, uint32_t v,
                                     Expectation& result) const {
    using R = VertexReferences;
    FloatLanes low, high;
    weights_->sum(ValenceRows::group_of(kind), references, v, valences_, low, high);
    const Place last = place(references.at[R::last]), focus = place(references.at[R::focus]),
                before = place(references.at[R::before]), next = place(references.at[R::next]),
                beyond = place(references.at[R::next_opposite]), late_0 = place(references.at[R::late]),
                late_1 = place(references.at[R::late + 1]), late_2 = place(references.at[R::late + 2]);
    // The newest one last, for which the processor waits: what is multiplied by its weight makes the sum 1.
    Place fitted{};
    double rest = 1;
    const auto add = [&](const Place& at, float weight) {
      const auto w = static_cast<double>(weight);
      fitted.xy += Pair{w, w} * at.xy;
      fitted.z += w * at.z;
      rest -= w;
    };
    add(focus, low[int{R::focus}]);
    add(next, low[int{R::next}]);
    add(beyond, low[int{R::next_opposite}]);
    add(late_0, low[int{R::late}]);
    add(late_1, high[R::late - 3]);
    add(late_2, high[R::late - 2]);
    add(before, high[R::before - 4]);
    fitted.xy += Pair{rest, rest} * last.xy;
    fitted.z += rest * last.z;
    const Lanes to_fitted = to_codes(fitted);
    put(to_fitted, result.fitted);
    if (place_of_kind(kind) == start_place) [[unlikely]]
      return expect_nothing(result);
    const auto parallelogram = [&](const Place& a, const Place& b, const Place& across) {
      return to_codes({a.xy + b.xy - across.xy, a.z + b.z - across.z});
    };
    const bool has_closing = kind_is_last(kind), has_late = kind_has_late(kind);
    const Lanes gate = parallelogram(focus, last, before);
    const Lanes closing = has_closing ? parallelogram(focus, next, beyond) : gate;
    const Lanes late = has_late ? parallelogram(late_0, late_1, late_2) : gate;
    put(gate, result.gate);
    put(closing, result.closing);
    put(late, result.late);
    compare(to_fitted, gate, closing, late, has_closing && has_late ? 2 : 1, result);
  }

  /// Where only `fitted` is known.
  static void expect_nothing(Expectation& result) {
    result.gate = result.closing = result.late = result.centre = result.fitted;
    result.apart = {};
    result.spread = {};
  }

 private:
  using Pair = double __attribute__((vector_size(16)));
  struct Place {
    Pair xy;
    double z;
  };

  [[gnu::always_inline]] Place place(uint32_t v) const {
    Place result;
    const double* value = points_.values[v].data();
    __builtin_memcpy(&result.xy, value, sizeof result.xy);
    result.z = value[2];
    return result;
  }
  [[gnu::always_inline]] static void put(Lanes lanes, Expectation::Four& to) {
    __builtin_memcpy(to.data(), &lanes, sizeof lanes);
  }

  [[gnu::always_inline]] Lanes to_codes(const Place& place) const {
    if constexpr (curved) {
      return Lanes{code_of(0, place.xy[0]), code_of(1, place.xy[1]), code_of(2, place.z), 0};
    } else {
      // As rounded() does.
      const Pair xy = place.xy + Pair{rounding_sum, rounding_sum};
      const Pair z = {place.z + rounding_sum, 0};
      return __builtin_shufflevector(reinterpret_cast<Lanes>(xy), reinterpret_cast<Lanes>(z), 0, 2, 4, 6);
    }
  }
  uint32_t code_of(unsigned k, double value) const {
    return points_.curved[k] ? static_cast<uint32_t>(points_.curved[k]->nearest_code(Scalar::f32, value))
                             : rounded(value);
  }

  /// Four coordinates at once, of which the last is none. The mean of the parallelograms is meant, nearly.
  [[gnu::always_inline]] void compare(Lanes to_fitted, Lanes gate, Lanes to_closing, Lanes to_late,
                                      int halvings, Expectation& result) const {
    const auto half = [](Lanes x, int times) {
      return reinterpret_cast<Lanes>(reinterpret_cast<SignedLanes>(x) >> times);
    };
    const auto size = [](Lanes x) {
      const auto sign = reinterpret_cast<Lanes>(reinterpret_cast<SignedLanes>(x) >> 31);
      return reinterpret_cast<SignedLanes>((x ^ sign) - sign);
    };
    const auto larger = [](SignedLanes a, SignedLanes b) { return a > b ? a : b; };
    const Lanes fitted = to_fitted;
    to_fitted -= gate;
    to_closing -= gate;
    to_late -= gate;
    const Lanes mean = half(to_closing, halvings) + half(to_late, halvings);
    const Lanes apart = by_gate_ ? to_fitted : mean - to_fitted;
    put(by_gate_ ? gate : fitted, result.centre);
    put(apart, result.apart);
    const SignedLanes spread = larger(size(apart), larger(size(to_closing), size(to_late)) >> 1);
    put(reinterpret_cast<Lanes>(spread), result.spread);
  }

  const AdaptivePoints& points_;
  std::unique_ptr<ValenceWeights> weights_;
  bool by_gate_;
  const uint8_t* valences_;
};

/// Models of lengths of residuals in contexts of sizes, in half octaves, and of what follows them.
struct AdaptivePositionModels {
  static constexpr unsigned size_classes = 48;
  static constexpr unsigned spread_classes = 40;
  static constexpr unsigned before_classes = 24;  // octaves of the coordinates before
  static constexpr unsigned first_coordinate = before_classes - 1;
  static constexpr unsigned relations = 5;
  static constexpr size_t offset_contexts = 8 * relations * relations * relations;
  static constexpr size_t candidate_contexts = 3 * 10 * 10 * 4 * 4;

  explicit AdaptivePositionModels(AdaptiveCoding::Repeats repeats) {
    if (repeats == AdaptiveCoding::Repeats::candidates) candidates.resize(candidate_contexts);
    if (repeats != AdaptiveCoding::Repeats::none) offsets.resize(offset_contexts);
  }
  template <class Visitor>
  void visit_models(Visitor& visitor) {
    for (SymbolModel& model : by_size) visitor(model);
    for (SymbolModel& model : by_spread) visitor(model);
    visitor(low);
    for (SymbolModel& model : head) visitor(model);
    for (SymbolModel& model : pattern) visitor(model);
    for (SymbolModel& model : candidates) visitor(model);
    for (SymbolModel& model : offsets) visitor(model);
  }

  std::array<SymbolModel, size_classes * 4> by_size;
  std::array<SymbolModel, before_classes * spread_classes> by_spread;
  SymbolModel low;
  std::array<SymbolModel, 33 * 4> head;
  std::array<SymbolModel, 8 * 8 * 8> pattern;
  std::vector<SymbolModel> candidates;
  std::vector<SymbolModel> offsets;
};

/// All that is known of positions before a patch: adaptive_start.h.
struct PositionsStart {
  std::vector<NumberMap> maps;
  AdaptiveCoding coding;
  std::unique_ptr<AdaptivePositionModels> models;
};

/// Codes one vertex after the other. `start`: what its models know already. `repeating`: with repeats, if
/// there are any, which are looked for beforehand; `curved`: with curved maps, if there are any. The encoder
/// finds the codes in `wanted`; both put them into `points`.
template <class Coder, bool curved, bool repeating>
class AdaptivePositionCoder {
 public:
  AdaptivePositionCoder(Coder& coder, const AdaptiveCoding& coding, const FanSurface& fans,
                        AdaptivePoints& points, std::span<const Codes3> wanted,
                        const AdaptivePositionModels* start)
      : coder_(coder),
        coding_(coding),
        fans_(fans),
        points_(points),
        wanted_(wanted),
        expecter_(points, coding, fans.valences.data()),
        sizes_(points.codes.size()),
        repeats_(repeating ? points.codes.size() : 0),
        models_(start == nullptr ? std::make_unique<Models>(coding.repeats)
                                 : std::make_unique<Models>(*start)) {}

  const AdaptivePositionModels& models() const { return *models_; }

  /// Vertex v, once all before it are coded.
  [[gnu::always_inline]] void code(uint32_t v) {
    VertexReferences beside;
    const VertexReferences* references = &beside;
    unsigned kind = start_place * valence_classes * 2;
    if (v < fans_.vertices) {
      references = &fans_.references[v];
      kind = fans_.kinds[v];
      expecter_.expect(*references, kind, v, expected_);
    } else {
      beside.at.fill(v == 0 ? 0 : v - 1);
      expect_before(beside.at[0]);
    }
    known_ = 0;
    if constexpr (Coder::encoding) codes_ = wanted_[v];
    if constexpr (repeating) {
      if (coding_.repeats != AdaptiveCoding::Repeats::none) code_repeats(v, *references, kind);
    }
    code_residuals(v, *references, ValenceRows::parallelograms(ValenceRows::group_of(kind)));
    if constexpr (repeating && !Coder::encoding) {
      if (coding_.repeats == AdaptiveCoding::Repeats::candidates) find_indices(repeats_[v]);
    }
    points_.codes[v] = codes_;
    if constexpr (curved) {
      for (unsigned k = 0; k < 3; ++k) points_.values[v][k] = points_.value_of(k, codes_[k]);
    } else {
      // In one store: the next vertex loads both at once, for which two would not do.
      using Pair = double __attribute__((vector_size(16)));
      const Pair xy = {static_cast<double>(codes_[0]), static_cast<double>(codes_[1])};
      __builtin_memcpy(points_.values[v].data(), &xy, sizeof xy);
      points_.values[v][2] = codes_[2];
    }
  }

 private:
  using R = VertexReferences;
  using Expected = Expecter<curved>;

  void expect_before(uint32_t before) {
    const Codes3& codes = points_.codes[before];
    expected_.fitted = {codes[0], codes[1], codes[2], 0};
    Expecter<curved>::expect_nothing(expected_);
  }

  using Models = AdaptivePositionModels;
  static constexpr unsigned size_classes = Models::size_classes;
  static constexpr unsigned spread_classes = Models::spread_classes;
  static constexpr unsigned first_coordinate = Models::first_coordinate;

  [[gnu::always_inline]] void code_residuals(uint32_t v, const VertexReferences& references,
                                             unsigned parallelograms) {
    const uint32_t last = sizes_[references.at[R::last]];
    const uint32_t around = 2 * last + 2 * sizes_[references.at[R::focus]] +
                            sizes_[references.at[R::before]] + sizes_[references.at[R::next]];
    Residual x, y, z;
    // The size of a coordinate before stands in for one that is not known yet.
    code_length<0>(x, around, 2 * (last & 1023), first_coordinate, parallelograms);
    code_length<1>(y, around, 4 * x.length, std::min(x.length, first_coordinate - 1), parallelograms);
    const unsigned both = x.length + y.length;
    code_length<2>(z, around, 2 * both, std::min(both / 2, first_coordinate - 1), parallelograms);
    code_head<0>(x);
    code_head<1>(y);
    code_head<2>(z);
    code_low_bits(x, y, z);
    sizes_[v] = finish<0>(x) | finish<1>(y) << 10 | finish<2>(z) << 20;
  }

  struct Residual {
    int32_t value = 0;
    unsigned length = 0;
    uint32_t high = 0;  ///< bits of the magnitude, but the lowest
    unsigned low_count = 0;
    uint32_t low = 0;
    bool negative = false;
  };

  template <unsigned k>
  [[gnu::always_inline]] void code_length(Residual& residual, uint32_t around, unsigned own, unsigned before,
                                          unsigned parallelograms) {
    const bool known = is_known(k);
    if (Coder::encoding || known) {
      residual.value = wrapped_difference(codes_[k], expected_.centre[k]);
      residual.length = residual_length(static_cast<uint32_t>(magnitude(residual.value)));
    }
    if (known) return;
    const unsigned size = std::min(((around >> (10 * k) & 1023) + own + 4) >> 3, size_classes - 1);
    const unsigned apart =
        std::min(residual_size(static_cast<uint32_t>(expected_.spread[k])), spread_classes - 1);
    residual.length = code_length(residual.length, k, models_->by_size[size * 4 + parallelograms],
                                  models_->by_spread[before * spread_classes + apart]);
  }

  /// Bits that no model expects: those of all coordinates at once, where they are not too many.
  [[gnu::always_inline]] void code_low_bits(Residual& x, Residual& y, Residual& z) {
    if (x.low_count + y.low_count + z.low_count > 32) [[unlikely]] {
      for (Residual* one : {&x, &y, &z}) one->low = coder_.code_raw(one->low, one->low_count);
      return;
    }
    const unsigned below_z = x.low_count + y.low_count;
    const uint64_t all = x.low | uint64_t{y.low} << x.low_count | uint64_t{z.low} << below_z;
    const uint64_t coded = coder_.code_raw(static_cast<uint32_t>(all), below_z + z.low_count);
    x.low = static_cast<uint32_t>(coded) & ((1u << x.low_count) - 1);
    y.low = static_cast<uint32_t>(coded >> x.low_count) & ((1u << y.low_count) - 1);
    z.low = static_cast<uint32_t>(coded >> below_z);
  }

  /// Returns its size in half octaves.
  template <unsigned k>
  [[gnu::always_inline]] uint32_t finish(Residual& residual) {
    if (is_known(k)) return residual_size(static_cast<uint32_t>(magnitude(residual.value)));
    const uint32_t size = residual.high << residual.low_count | residual.low;
    const uint32_t value = residual.negative ? 0 - size : size;
    codes_[k] = static_cast<int32_t>(static_cast<uint32_t>(expected_.centre[k]) + value);
    return residual_size(size);
  }
  [[gnu::always_inline]] bool is_known(unsigned k) const { return repeating && (known_ >> k & 1) != 0; }

  [[gnu::always_inline]] unsigned code_length(unsigned length, unsigned k, SymbolModel& a, SymbolModel& b) {
    const unsigned base = coding_.base[k];
    const unsigned above = length > base ? length - base : 0;
    const unsigned symbol = SymbolModel::code_in_mean(coder_, a, b, std::min(above, 15u), k);
    if (symbol == 15) [[unlikely]]
      return std::min(base + 15 + coder_.code_raw(above - 15, 5, k), 32u);
    if (symbol == 0 && base > 0) return models_->low.code(coder_, length, k);
    return base + symbol;
  }

  /// Sign, relative to that of `apart`, and up to three bits below the top one as a symbol.
  template <unsigned k>
  [[gnu::always_inline]] void code_head(Residual& residual) {
    const unsigned length = residual.length;
    if (is_known(k) || length == 0) return;
    const int32_t apart = expected_.apart[k];
    const auto relation =
        static_cast<int>(residual_length(static_cast<uint32_t>(magnitude(apart)))) - static_cast<int>(length);
    const unsigned context = apart == 0 ? 0 : static_cast<unsigned>(std::clamp(relation + 2, 1, 3));
    const unsigned head_bits = std::min(length - 1, 3u);
    residual.low_count = length - 1 - head_bits;
    const auto size = static_cast<uint32_t>(magnitude(residual.value));
    const bool other_way = (residual.value < 0) != (apart < 0);
    const uint32_t mask = (1u << head_bits) - 1;
    unsigned head = static_cast<unsigned>(other_way) << head_bits | (size >> residual.low_count & mask);
    residual.low = size & ((1u << residual.low_count) - 1);
    head = models_->head[length * 4 + context].code(coder_, head, k);
    // Of a damaged stream only these bits count.
    residual.negative = ((head >> head_bits & 1) != 0) != (apart < 0);
    residual.high = 1u << head_bits | (head & mask);
  }

  // Repeated values.
  static constexpr uint16_t no_index = 0xffff;
  static constexpr unsigned in_dictionary = 8;
  struct Repeat {
    std::array<uint16_t, 3> index;
    std::array<uint8_t, 3> candidate;
    uint8_t pattern;
  };
  static constexpr unsigned relations = Models::relations;

  [[gnu::noinline]] void code_repeats(uint32_t v, const VertexReferences& references, unsigned kind) {
    Repeat& repeat = repeats_[v];
    repeat = {{no_index, no_index, no_index}, {}, 0};
    if constexpr (Coder::encoding) {
      for (unsigned k = 0; k < 3; ++k) {
        const ValueDictionary& dictionary = coding_.dictionaries[k];
        const uint32_t i = dictionary.size() == 0 ? 0 : dictionary.find(codes_[k]);
        if (i == dictionary.size()) continue;
        repeat.index[k] = static_cast<uint16_t>(i);
        repeat.pattern = static_cast<uint8_t>(repeat.pattern | 1u << k);
      }
    }
    // Of the vertices that come before; the others count as if they had no values in a dictionary.
    third_ = place_of_kind(kind) < first_open_place ? R::next : R::before;
    if (coding_.repeats == AdaptiveCoding::Repeats::levels) {
      const auto pattern = [&](unsigned r) -> unsigned {
        return references.at[r] < v ? repeats_[references.at[r]].pattern : 7;
      };
      SymbolModel& model = models_->pattern[(pattern(R::last) * 8 + pattern(R::focus)) * 8 + pattern(third_)];
      repeat.pattern = static_cast<uint8_t>(model.code(coder_, repeat.pattern) & 7);
      for (unsigned k = 0; k < 3; ++k) {
        if ((repeat.pattern >> k & 1) == 0) continue;
        known_ |= 1u << k;
        code_index(v, references, k);
      }
      return;
    }
    unsigned before = 9;
    for (unsigned k = 0; k < 3; ++k) {
      before = code_candidate(v, references, kind, k, before);
      repeat.candidate[k] = static_cast<uint8_t>(before);
      if (before != 0) known_ |= 1u << k;
    }
  }

  /// Later vertices want to know where in the dictionary all coordinates are.
  void find_indices(Repeat& repeat) const {
    for (unsigned k = 0; k < 3; ++k) {
      const ValueDictionary& dictionary = coding_.dictionaries[k];
      if (dictionary.size() == 0 || repeat.index[k] != no_index) continue;
      const uint32_t i = dictionary.find(codes_[k]);
      if (i < dictionary.size()) repeat.index[k] = static_cast<uint16_t>(i);
    }
  }

  unsigned code_candidate(uint32_t v, const VertexReferences& references, unsigned kind, unsigned k,
                          unsigned before) {
    const auto code = [&](unsigned r) {
      return references.at[r] < v ? points_.codes[references.at[r]][k] : 0;
    };
    const bool closed = third_ == R::next;
    const std::array<int32_t, 7> candidates = {expected_.gate[k],
                                               code(R::last),
                                               code(R::focus),
                                               code(third_),
                                               closed ? code(R::before) : expected_.closing[k],
                                               expected_.closing[k],
                                               expected_.late[k]};
    unsigned symbol = 0;
    if constexpr (Coder::encoding) {
      while (symbol < 7 && candidates[symbol] != codes_[k]) ++symbol;
      symbol = symbol < 7 ? symbol + 1 : repeats_[v].index[k] != no_index ? in_dictionary : 0;
    }
    const unsigned equal = static_cast<unsigned>(candidates[0] == candidates[1]) |
                           static_cast<unsigned>(candidates[0] == candidates[2]) << 1;
    const uint32_t last = references.at[R::last];
    const unsigned of_last = last < v ? repeats_[last].candidate[k] : 0;
    const unsigned parallelograms = ValenceRows::parallelograms(ValenceRows::group_of(kind));
    const size_t context = (((size_t{k} * 10 + before) * 10 + of_last) * 4 + equal) * 4 + parallelograms;
    symbol = std::min(models_->candidates[context].code(coder_, symbol), in_dictionary);
    if (symbol == in_dictionary && coding_.dictionaries[k].size() == 0) symbol = 0;
    if (symbol == in_dictionary) {
      code_index(v, references, k);
    } else if (symbol > 0) {
      codes_[k] = candidates[symbol - 1];
    }
    return symbol;
  }

  /// The index in the dictionary, less that of the value nearest to what is expected.
  void code_index(uint32_t v, const VertexReferences& references, unsigned k) {
    const ValueDictionary& dictionary = coding_.dictionaries[k];
    if (dictionary.size() == 0) {
      codes_[k] = 0;
      return;
    }
    const uint32_t near = dictionary.nearest(expected_.fitted[k]);
    const int64_t beyond = int64_t{expected_.fitted[k]} - dictionary[near];
    const uint32_t other = beyond >= 0 ? near + 1 : near - 1;
    unsigned eighth = 3;
    if (other < dictionary.size()) {
      const int64_t gap = int64_t{dictionary[other]} - dictionary[near];
      eighth = static_cast<unsigned>(std::min<int64_t>(8 * beyond / gap, 3));
    }
    const unsigned part = beyond >= 0 ? 4 + eighth : 3 - eighth;
    const auto relation = [&](unsigned r) -> unsigned {
      const uint32_t at = references.at[r];
      if (at >= v || repeats_[at].index[k] == no_index) return 4;
      const auto offset = static_cast<int>(repeats_[at].index[k]) - static_cast<int>(near);
      return offset == 0 ? 0 : offset == 1 ? 1 : offset == -1 ? 2 : 3;
    };
    SymbolModel& model =
        models_
            ->offsets[((part * relations + relation(R::last)) * relations + relation(R::focus)) * relations +
                      relation(third_)];
    int offset = 0;
    if constexpr (Coder::encoding) offset = static_cast<int>(repeats_[v].index[k]) - static_cast<int>(near);
    const unsigned symbol =
        model.code(coder_, offset >= -7 && offset <= 7 ? static_cast<unsigned>(offset + 7) : 15u);
    uint32_t index = near + symbol - 7;
    if (symbol == 15) index = coder_.code_raw(repeats_[v].index[k], 16);
    // Only damaged bytes lead beyond the end.
    index = std::min(index, dictionary.size() - 1);
    repeats_[v].index[k] = static_cast<uint16_t>(index);
    codes_[k] = dictionary[index];
  }

  Coder& coder_;
  const AdaptiveCoding& coding_;
  const FanSurface& fans_;
  AdaptivePoints& points_;
  std::span<const Codes3> wanted_;
  Expected expecter_;
  std::vector<uint32_t> sizes_;  // of residuals in half octaves, ten bits for each coordinate
  std::vector<Repeat> repeats_;
  std::unique_ptr<Models> models_;
  // Of the vertex at hand.
  Expectation expected_;
  Codes3 codes_{};
  unsigned known_ = 0;  // coordinates, as bits
  unsigned third_ = 0;
};

}  // namespace maille
