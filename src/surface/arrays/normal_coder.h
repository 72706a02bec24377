#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include "base/bytes.h"
#include "code/parallelogram.h"
#include "code/residual_model.h"
#include "numbers/float_bits.h"
#include "numbers/number_map.h"
#include "surface/arrays/stencil.h"
#include "surface/arrays/surface_normals.h"

namespace maille {

/// How an array of normals is coded, chosen by the encoder. docs/format.md, 13.5.
struct NormalCoding {
  /// Who is asked for the normal: a NormalWeight, or the neighbours only.
  uint8_t weight = 0;
  static constexpr uint8_t own = normal_weight_count;

  bool unit = true;      ///< of length 1: the last component follows from the others
  bool summed = false;   ///< of the length that the sum over faces has
  bool inward = false;   ///< the other way round
  bool follows = false;  ///< what the neighbours have beside their expectations is added
  bool repeats = false;  ///< a flag tells if the normal is a neighbour's
  bool welded = false;   ///< points at the same place have their faces together, and often one normal

  uint8_t flags() const {
    return static_cast<uint8_t>(unit | summed << 1 | inward << 2 | follows << 3 | repeats << 4 | welded << 5);
  }
  static constexpr uint8_t most_flags = 63;
  static NormalCoding from(uint8_t weight, uint8_t flags) {
    const auto has = [flags](unsigned flag) { return (flags & flag) != 0; };
    return {weight, has(1), has(2), has(4), has(8), has(16), has(32)};
  }
};

/// Of length 1; 0 for a vector that is 0 or not finite.
inline Vector3 unit_vector(const Vector3& v) {
  // Scaled first, for squares that overflow or vanish.
  const double largest = std::max({std::fabs(v[0]), std::fabs(v[1]), std::fabs(v[2])});
  if (!(largest > 1e-300) || !(largest < 1e300)) return {};
  const Vector3 scaled{{v[0] / largest, v[1] / largest, v[2] / largest}};
  const double length = std::sqrt(dot(scaled, scaled));
  return {{scaled[0] / length, scaled[1] / length, scaled[2] / length}};
}

/// The vector that codes stand for; 0 for numbers that are not finite.
template <class Code>
Vector3 normal_of_codes(Scalar type, const ArrayMaps& maps, const Code* codes) {
  if (maps.octahedral)
    return {maps.octahedral->vector_of({static_cast<int32_t>(codes[0]), static_cast<int32_t>(codes[1])})};
  Vector3 vector;
  for (unsigned k = 0; k < 3; ++k) {
    vector[k] = maps.maps[k].number_near(type, codes[k]);
  }
  return vector;
}

/// Codes normals, each predicted from the surface and the normals around it. One class serves both
/// directions. `Code` is int64_t for f64, else int32_t. What is known is kept by tuple instead of by element,
/// as corners of one wedge share theirs. Doubles in a fixed order, with halves of octaves as sizes, so that
/// contexts are integers. Lossless at -5: SheenCloth 472,143 to 271,765 bytes, scallop 389,967 to 49,989
/// (4d9a598). docs/format.md, 13.5.
template <class Coder, class Code>
class NormalCoder {
 public:
  NormalCoder(Coder& coder, const NormalCoding& coding, Scalar type, const ArrayMaps& maps,
              std::span<Code> codes)
      : coder_(coder),
        coding_(coding),
        type_(type),
        maps_(maps),
        codes_(codes),
        exponents_(3 * 12),
        tuple_of_(codes.size() / maps.maps.size()),
        tuples_(1) {
    for (unsigned k = 0; k < maps.maps.size() && !maps.octahedral; ++k) {
      if (!maps.maps[k].is_curved()) even_step_[k] = step_in_half_octaves(value_of_step(maps.maps[k]));
    }
  }

  void code(uint32_t element, const ElementStencil& stencil, const ExpectedNormal& expected) {
    find_neighbours(stencil);
    before_ = element;
    Vector3 towards = expected.vector * (coding_.inward ? -1.0 : 1.0);
    if (!coding_.summed) towards = unit_vector(towards);
    tuple_of_[element] = static_cast<uint32_t>(tuples_.size());
    Tuple& tuple = tuples_.emplace_back();
    tuple.expected = towards;
    if (coding_.repeats) tuple.direction = unit_vector(towards);
    // The spread of what is not finite may be NaN, of either sign.
    tuple.spread =
        half_octaves_of(expected.spread > least_spread ? std::min(expected.spread, 1e30) : least_spread);
    // From the most certain to the least: the twin's normal, a neighbour's, then numbers.
    if (expected.twin != none && code_same(element, expected.twin, twin_[twins_], twins_)) return;
    if (coding_.repeats && neighbour_count_ > 0 && code_repeat(element)) return;
    find_context(element);
    predict(towards);
    if (maps_.octahedral) return code_octahedral(element);
    code_components(element);
    keep(element);
  }

  void copy(uint32_t to, uint32_t from) {
    const size_t components = maps_.maps.size();
    for (size_t k = 0; k < components; ++k) codes_[to * components + k] = codes_[from * components + k];
    tuple_of_[to] = tuple_of_[from];
  }

  /// Which elements are copies of each other: for each the number of its tuple, 0 where there is none.
  std::vector<uint32_t> take_tuple_numbers() { return std::move(tuple_of_); }

 private:
  /// What is known of elements that have one tuple.
  struct Tuple {
    Vector3 value, expected;
    Vector3 direction;  ///< of `expected`, where normals repeat
    int error = 0;      ///< half octaves
    int spread = 0;
    uint8_t completion = 0;

    void copy_value(const Tuple& other) {
      value = other.value;
      error = other.error;
      completion = other.completion;
    }
  };
  Tuple& tuple(uint32_t element) { return tuples_[tuple_of_[element]]; }

  static constexpr double least_spread = 1.0 / 4096;
  static constexpr bool wide = sizeof(Code) == 8;
  static constexpr int mantissa_bits = wide ? 52 : 23;
  // Errors far below a unit in the last place (2^-23, 2^-52) of numbers near 1 are all the same: exact.
  static constexpr int least_error = wide ? -128 : -68;  // half octaves
  // The class of elements without neighbours, behind the eleven of find_context().
  static constexpr unsigned no_class = 11;

  bool is_ordered(unsigned k) const {
    return maps_.maps[k].kind == NumberMap::Kind::ordered && maps_.maps[k].table.empty();
  }
  static bool is_zero(const Vector3& v) { return v[0] == 0 && v[1] == 0 && v[2] == 0; }

  /// The elements beside this one that are known, each once; where there are none, the one before in this
  /// array, which is mostly near.
  void find_neighbours(const ElementStencil& stencil) {
    neighbour_count_ = 0;
    const auto add = [&](uint32_t element) {
      for (unsigned i = 0; i < neighbour_count_; ++i) {
        if (neighbours_[i] == element) return;
      }
      neighbours_[neighbour_count_++] = element;
    };
    for (unsigned i = 0; i < stencil.parallelogram_count; ++i) {
      add(stencil.parallelograms[i].a);
      add(stencil.parallelograms[i].b);
    }
    if (neighbour_count_ > 0) return;
    const uint32_t other = stencil.neighbour != none ? stencil.neighbour : before_;
    if (other != none) add(other);
  }

  /// The neighbour whose face, or surface, is turned least against the element's: flat parts have one normal.
  /// How much it is turned is the context, in sixteen classes of seven half octaves.
  bool code_repeat(uint32_t element) {
    double largest = -2;
    uint32_t nearest = neighbours_[0];
    for (unsigned i = 0; i < neighbour_count_; ++i) {
      const double cosine = dot(tuple(neighbours_[i]).direction, tuple(element).direction);
      if (!(cosine > largest)) continue;
      largest = cosine;
      nearest = neighbours_[i];
    }
    const int turn = half_octaves_of(std::clamp(1 - largest, 1e-16, 2.0));  // -107 to 2
    const auto turned = static_cast<unsigned>(2 - turn) / 7;                // 0 to 15
    return code_same(element, nearest, repeat_[turned][repeated_], repeated_);
  }

  /// Codes if the tuple is that of another element; the last two such decisions are the history.
  bool code_same(uint32_t element, uint32_t other, BitModel& model, unsigned& history) {
    const size_t components = maps_.maps.size();
    bool same = true;
    if constexpr (Coder::encoding) {
      for (size_t k = 0; k < components; ++k)
        same &= codes_[element * components + k] == codes_[other * components + k];
    }
    same = model.code(coder_, same);
    history = (history << 1 | static_cast<unsigned>(same)) & 3;
    if (!same) return false;
    for (size_t k = 0; k < components; ++k) codes_[element * components + k] = codes_[other * components + k];
    tuple(element).copy_value(tuple(other));
    return true;
  }

  /// The error expected, from the neighbours', and how much more than they the element is spread.
  void find_context(uint32_t element) {
    if (neighbour_count_ == 0) {
      error_ = 0;
      class_ = no_class;
      completion_ = 0;
      return;
    }
    int errors = 0;
    int spreads = 0;
    int completions = 0;
    for (unsigned i = 0; i < neighbour_count_; ++i) {
      const Tuple& other = tuple(neighbours_[i]);
      errors += other.error;
      spreads += other.spread;
      completions += other.completion;
    }
    const int count = static_cast<int>(neighbour_count_);
    error_ = floor_div(errors, count);
    const int more = tuple(element).spread - floor_div(spreads, count);
    class_ = static_cast<unsigned>(std::clamp((more + 11) >> 1, 0, 10));
    completion_ = static_cast<unsigned>(completions / count);
  }
  /// Rounds down for both signs; division of integers rounds towards 0.
  static int floor_div(int sum, int count) { return (sum - (sum < 0 ? count - 1 : 0)) / count; }

  /// Where nothing is expected, the mean of the neighbours; else the expectation, with what neighbours have
  /// beside theirs if that pays.
  void predict(const Vector3& towards) {
    Vector3 sum;
    const bool alone = is_zero(towards);
    for (unsigned i = 0; i < neighbour_count_; ++i) {
      const Tuple& other = tuple(neighbours_[i]);
      sum = sum + other.value - (alone ? Vector3{} : other.expected);
    }
    if (neighbour_count_ > 0) sum = sum * (1.0 / neighbour_count_);
    prediction_ = alone ? sum : coding_.follows ? towards + sum : towards;
    if (coding_.unit) prediction_ = unit_vector(prediction_);
    for (double& x : prediction_.x) {
      if (!std::isfinite(x)) x = 0;
    }
    // A unit vector in any case: the octahedron divides by the sum of its components' sizes.
    if (coding_.unit && is_zero(prediction_)) prediction_ = {{0, 0, 1}};
  }

  /// With unit length the largest component comes last, as it follows best from the others: its error is
  /// theirs times their share of its size.
  void code_components(uint32_t element) {
    unsigned last = 2;
    if (coding_.unit) {
      for (unsigned k = 0; k < 3; ++k) {
        if (std::fabs(prediction_[k]) > std::fabs(prediction_[last])) last = k;
      }
    }
    const unsigned first = (last + 1) % 3;
    const unsigned second = (last + 2) % 3;
    predicted_ = prediction_;
    code_component(element, first, 0);
    if (coding_.unit) rescale(first, second, last);
    inform(first);
    code_component(element, second, 1);
    if (coding_.unit) return complete(element, first, second, last);
    code_component(element, last, 2);
  }

  /// Components are wrong together: the error of the first moves the one expected, half way up or a quarter
  /// of the way down. It saves 0.6 % of all normals (29938cd).
  void inform(unsigned first) {
    const int found = error_in_half_octaves(std::fabs(value_[first] - predicted_[first]));
    error_ = found > error_ ? (error_ + found + 1) >> 1 : (3 * error_ + found + 2) >> 2;
  }
  static int error_in_half_octaves(double error) {
    return std::max(half_octaves_of(std::clamp(error, 1e-30, 1e30)), least_error);
  }

  /// With one component known, the others of a unit vector are longer or shorter.
  void rescale(unsigned first, unsigned second, unsigned last) {
    const double left = 1 - value_[first] * value_[first];
    const double now = prediction_[second] * prediction_[second] + prediction_[last] * prediction_[last];
    if (!(left > 0) || !(now > 0)) return;
    const double factor = std::sqrt(left / now);
    prediction_[second] *= factor;
    prediction_[last] *= factor;
  }

  Code& code_at(uint32_t element, unsigned k) { return codes_[size_t{element} * maps_.maps.size() + k]; }

  Code code_near(unsigned k, double value) const {
    return static_cast<Code>(maps_.maps[k].nearest_code(type_, value));
  }
  /// 0 for infinities (number_near()), so that these do not spread.
  double value_of(unsigned k, Code code) const { return maps_.maps[k].number_near(type_, code); }

  /// The distance between numbers near this one, in half octaves.
  int step_at(unsigned k, double value) const {
    if (is_ordered(k))
      return 2 * (half_octaves_of(std::max(std::fabs(value), 1e-37)) >> 1) - 2 * mantissa_bits;
    const NumberMap& map = maps_.maps[k];
    return map.is_curved() ? step_in_half_octaves(curved_step(map, value)) : even_step_[k];
  }
  static int step_in_half_octaves(double step) {
    return half_octaves_of(std::clamp(std::fabs(step), 1e-37, 1e37));
  }
  /// Unsigned, so that the last code has a next one, too.
  double curved_step(const NumberMap& map, double value) const {
    const int64_t code = map.nearest_code(type_, value);
    const auto next = static_cast<int64_t>(static_cast<uint64_t>(code) + 1);
    return map.number_near(type_, next) - map.number_near(type_, code);
  }
  static double value_of_step(const NumberMap& map) {
    if (map.kind == NumberMap::Kind::lattice) return map.step;
    std::byte number[8];
    map.store_number(Scalar::f64, 1, number);
    return load<double>(number);
  }

  /// Ordered floats have no even steps near 0: there zeros, then sign, exponent and mantissa are coded apart;
  /// elsewhere a residual of codes.
  void code_component(uint32_t element, unsigned k, unsigned place) {
    const double p = prediction_[k];
    Code& code = code_at(element, k);
    if (is_ordered(k)) {
      const int apart = half_octaves_of(std::clamp(std::fabs(p), 1e-37, 1e37)) - error_;
      if (apart < 14 && code_zero(code, k, apart)) {
        value_[k] = 0;
        return;
      }
      if (apart < 2) {
        code_small(code, k, place, apart);
        value_[k] = value_of(k, code);
        return;
      }
    }
    // The error in steps, both in half octaves, is the size that a residual is expected to have; an error of
    // one step counts as 2.
    const int expected = std::max(error_ - step_at(k, p) + 2, 0);
    code_residual(code, code_near(k, p), static_cast<unsigned>(expected), class_, place);
    value_[k] = value_of(k, code);
  }

  /// A residual of codes, by the model that volumes and surfaces share (13.4). Returns its size in half
  /// octaves.
  unsigned code_residual(Code& code, Code prediction, unsigned expected, unsigned spread, unsigned place) {
    Code residual = 0;
    if constexpr (Coder::encoding) residual = wrapped_difference(code, prediction);
    const unsigned length =
        model_.code_length(coder_, bit_length(size_of_residual(residual)), place, {expected, spread}, 0);
    residual = static_cast<Code>(model_.code_value(coder_, residual, length, place, 0));
    if constexpr (!Coder::encoding) code = wrapped_sum(prediction, residual);
    return half_octaves(size_of_residual(residual));
  }
  static uint64_t size_of_residual(Code residual) {
    const auto value = static_cast<int64_t>(residual);
    return value < 0 ? -static_cast<uint64_t>(value) : static_cast<uint64_t>(value);
  }

  /// +0 and -0 stand out among floats: many normals lie in a plane. The sign is the prediction's, mostly.
  bool code_zero(Code& code, unsigned k, int apart) {
    const auto near = static_cast<unsigned>(std::clamp(apart + 17, 0, 31)) / 2;
    unsigned around = 0;
    for (unsigned i = 0; i < neighbour_count_; ++i) around |= tuple(neighbours_[i]).value[k] == 0 ? 2u : 1u;
    const bool zero = zero_[near][around].code(coder_, code == 0 || code == -1);
    if (!zero) return false;
    const bool negative = std::signbit(prediction_[k]);
    const Code other = neighbour_count_ > 0 ? code_at(neighbours_[0], k) : Code{1};
    const unsigned context = (negative ? 3u : 0u) + (other == 0 ? 1u : other == -1 ? 2u : 0u);
    code = zero_sign_[context].code(coder_, code == -1) ? Code{-1} : Code{0};
    return true;
  }

  /// A number that may lie on either side of 0: sign, exponent and mantissa. The mantissa is raw, as nothing
  /// is known of it.
  void code_small(Code& code, unsigned k, unsigned place, int apart) {
    using Bits = std::make_unsigned_t<Code>;
    constexpr unsigned exponent_bits = wide ? 11 : 8;
    constexpr int bias = wide ? 1023 : 127;
    Bits bits = static_cast<Bits>(code < 0 ? code ^ std::numeric_limits<Code>::max() : code);
    const bool positive = !std::signbit(prediction_[k]);
    const auto near = static_cast<unsigned>(std::clamp(apart + 13, 0, 15));
    const bool same = small_sign_[near].code(coder_, ((bits >> (8 * sizeof(Code) - 1)) == 0) == positive);
    auto exponent = static_cast<unsigned>(bits >> mantissa_bits) & ((1u << exponent_bits) - 1);
    // Numbers are hardly ever larger than sixteen times the error that is expected; fifteen exponents, from
    // there down, have a symbol.
    const int base = (error_ >> 1) + 3 + bias;
    const int below = base - static_cast<int>(exponent);
    const unsigned symbol = exponents_[place * 12 + class_].code(
        coder_, below >= 0 && below < 15 ? static_cast<unsigned>(below) : 15u);
    if (symbol == 15) {
      exponent = coder_.code_raw(exponent, exponent_bits);
    } else {
      exponent = static_cast<unsigned>(base - static_cast<int>(symbol)) & ((1u << exponent_bits) - 1);
    }
    Bits mantissa = bits & ((Bits{1} << mantissa_bits) - 1);
    if constexpr (wide) {
      const Bits high = coder_.code_raw(static_cast<uint32_t>(mantissa >> 32), mantissa_bits - 32);
      mantissa = high << 32 | coder_.code_raw(static_cast<uint32_t>(mantissa), 32);
    } else {
      mantissa = coder_.code_raw(mantissa, mantissa_bits);
    }
    bits = mantissa | Bits{exponent} << mantissa_bits | Bits{same != positive} << (8 * sizeof(Code) - 1);
    const auto number = static_cast<Code>(bits);
    code = number < 0 ? number ^ std::numeric_limits<Code>::max() : number;
  }

  /// The last component of a unit vector: what is left, and its sign. d(last) = -(x dx + y dy) / last, so the
  /// steps of the others say how exact it is.
  void complete(uint32_t element, unsigned first, unsigned second, unsigned last) {
    const double x = value_[first];
    const double y = value_[second];
    Code& code = code_at(element, last);
    const int apart = half_octaves_of(std::clamp(std::fabs(prediction_[last]), 1e-37, 1e37)) - error_;
    const auto near = static_cast<unsigned>(std::clamp(apart + 2, 0, 15));
    const bool negative = prediction_[last] < 0;
    bool same = false;
    if constexpr (Coder::encoding) same = (value_of(last, code) < 0) == negative;
    same = side_[near].code(coder_, same);
    const double left = std::sqrt(std::max(1 - x * x - y * y, 0.0));
    const double predicted = same == negative ? -left : left;
    // What the steps of the others can make of it, in its own steps.
    const int steps = std::max(half_octaves_of(std::clamp(std::fabs(x), 1e-30, 2.0)) + step_at(first, x),
                               half_octaves_of(std::clamp(std::fabs(y), 1e-30, 2.0)) + step_at(second, y)) -
                      half_octaves_of(std::max(left, 1e-30));
    const int expected = std::clamp(steps - step_at(last, left) + 2, 0, 60);
    const unsigned size = code_residual(code, code_near(last, predicted), static_cast<unsigned>(expected),
                                        std::min(completion_, no_class), 2);
    tuple(element).completion = static_cast<uint8_t>(size);
    value_[last] = value_of(last, code);
  }

  void keep(uint32_t element) {
    double error = 0;
    for (unsigned k = 0; k < 3; ++k) error = std::max(error, std::fabs(value_[k] - predicted_[k]));
    tuple(element).value = value_;
    tuple(element).error = error_in_half_octaves(error);
  }

  using Pair = std::array<int32_t, 2>;

  /// Turns the other half of the octahedron to the middle of the square; it is its own inverse. All wraps, so
  /// that any codes are safe.
  static Pair turned_out(Pair codes, int32_t steps) {
    const auto fold = [steps](int32_t from, int32_t other) {
      const int32_t size =
          static_cast<int32_t>(static_cast<uint32_t>(steps) - (other < 0 ? 0u - static_cast<uint32_t>(other)
                                                                         : static_cast<uint32_t>(other)));
      return from < 0 ? static_cast<int32_t>(0u - static_cast<uint32_t>(size)) : size;
    };
    return {fold(codes[0], codes[1]), fold(codes[1], codes[0])};
  }

  /// Two codes on the square; around the expected half of the octahedron nothing is torn.
  void code_octahedral(uint32_t element) {
    const int32_t steps = maps_.octahedral->steps;
    const Vector3 p = unit_vector(prediction_);
    const double sum = std::fabs(p[0]) + std::fabs(p[1]) + std::fabs(p[2]);
    const bool below = p[2] < 0;
    const Pair expected = {static_cast<int32_t>(std::floor(p[0] / sum * steps + 0.5)),
                           static_cast<int32_t>(std::floor(p[1] / sum * steps + 0.5))};
    Pair codes = {static_cast<int32_t>(code_at(element, 0)), static_cast<int32_t>(code_at(element, 1))};
    if (below) codes = turned_out(codes, steps);
    unsigned largest = 0;
    for (unsigned k = 0; k < 2; ++k) {
      auto code = static_cast<Code>(codes[k]);
      const unsigned size = code_residual(code, static_cast<Code>(expected[k]),
                                          static_cast<unsigned>(std::max(error_, 0)), class_, k);
      codes[k] = static_cast<int32_t>(code);
      largest = std::max(largest, size);
    }
    if (below) codes = turned_out(codes, steps);
    for (unsigned k = 0; k < 2; ++k) code_at(element, k) = static_cast<Code>(codes[k]);
    const auto vector = maps_.octahedral->vector_of(codes);
    tuple(element).value = {vector};
    tuple(element).error = static_cast<int>(largest);
  }

  Coder& coder_;
  NormalCoding coding_;
  Scalar type_;
  const ArrayMaps& maps_;
  std::span<Code> codes_;
  ResidualModel<8 * sizeof(Code)> model_;
  std::vector<SymbolModel> exponents_;
  BitModel repeat_[16][4];
  BitModel twin_[4];
  BitModel zero_[16][4];
  BitModel zero_sign_[6];
  BitModel small_sign_[16];
  BitModel side_[16];
  std::vector<uint32_t> tuple_of_;  ///< by element
  std::vector<Tuple> tuples_;       ///< the first one is of elements without any
  std::array<int, 3> even_step_{};  ///< step_at() of components whose numbers are as far apart everywhere
  // Of the element at hand.
  std::array<uint32_t, 2 * ElementStencil::most_parallelograms + 1> neighbours_;
  unsigned neighbour_count_ = 0;
  uint32_t before_ = none;
  unsigned repeated_ = 0;
  unsigned twins_ = 0;
  int error_ = 0;
  unsigned class_ = 0;
  unsigned completion_ = 0;
  Vector3 prediction_;
  Vector3 predicted_;
  Vector3 value_;
};

}  // namespace maille
