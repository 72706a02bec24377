#include "volume/values/tuple_values.h"

#include <algorithm>
#include <cmath>

#include "volume/cells/slots.h"
#include "volume/values/mixed_values.h"

namespace maille {
namespace {

/// Components of an array with least squares of their own. Arrays with more of them are rare, and fits of
/// each would take 2 KB a component before any number came (tuple_coder_bytes()). Chosen, no sweep is on
/// record.
constexpr uint32_t most_fitted = 16;
/// Neighbouring samples say much the same: in the long run one in four is enough. It saves most of the cost
/// of the fit; no figure is on record.
constexpr uint32_t most_full_samples = 16384;
/// What a candidate is held to have missed by before it was tried: a half octave more than the one before it,
/// so that of untried candidates the first is taken. Misses are bits 22 to 30 of a float, times 64: 256 is
/// that of 2.0.
constexpr int32_t first_miss = 64 * 256;
constexpr int32_t head_start = 64;

/// Calls work(0) to work(N - 1) with constants: compilers unroll such short loops only when told.
template <unsigned N, class Work>
[[gnu::always_inline]] inline void for_each_index(Work work) {
  [&]<unsigned... k>(std::integer_sequence<unsigned, k...>) {
    (work(std::integral_constant<unsigned, k>{}), ...);
  }
  (std::make_integer_sequence<unsigned, N>{});
}

/// 65536 / n, rounded up, so that a mean of up to three numbers is a product with it: exact, rounded down,
/// for sums below 2^15 (mean_size()).
constexpr std::array<int32_t, 4> reciprocals = {0, 65536, 32768, 21846};

}  // namespace

bool is_kept(const StreamedArray& array, bool logarithm, const std::byte* number, const std::byte* back,
             double& error) {
  if (std::equal(number, number + size_of(array.type), back)) return true;
  if (array.bound == 0) return false;
  const double value = number_as_double(array.type, number);
  double off = std::fabs(value - number_as_double(array.type, back));
  if (logarithm && off > 0) off /= std::fabs(value);
  if (!(off <= array.bound)) return false;
  error = std::max(error, off);
  return true;
}

bool keeps(const StreamedArray& array, const NumberSpace& space, const std::byte* number, int64_t code,
           double& error) {
  std::array<std::byte, 8> back{};
  space.store_number(code, back.data());
  return is_kept(array, space.is_logarithm(), number, back.data(), error);
}

uint64_t tuple_coder_bytes(const StreamedArray& array) {
  uint64_t tables = 0;
  for (const NumberMap& map : array.maps) tables += map.table.size() * sizeof(double);
  if (array.mixed) return mixed_coder_bytes(array) + tables;
  const uint64_t lanes = array.components == 1 ? 1 : 4;
  const uint64_t groups = array.components == 1 ? 1 : (array.components + 2) / 3;
  const uint64_t records = PointStencil::situations * 3 * uint64_t{4};
  const uint64_t fits = array.components <= most_fitted ? most_corners * uint64_t{256} : 0;
  // Those of residuals (ValueResiduals), of up to three components.
  const uint64_t models = std::min<uint64_t>(array.components, 3) * (uint64_t{28} << 10);
  return models + groups * (256 + lanes * (records + fits)) + array.components * uint64_t{64} + tables + 4096;
}

/// The maps are kept as NumberSpaces; their tables are let go of, as a table may have a million numbers.
template <class Coder, unsigned Bits, unsigned Width>
TupleValueCoder<Coder, Bits, Width>::TupleValueCoder(const StreamedArray& array)
    : array_(array),
      number_size_(size_of(array.type)),
      residuals_(array.components),
      exceptions_(array.components) {
  for (const NumberMap& map : array.maps) spaces_.emplace_back(array.type, map);
  array_.maps.clear();  // with their tables
  plain_ = Width == 4 && array.components == 3;
  for (const NumberSpace& space : spaces_) {
    exact_ = exact_ && space.exact();
    plain_ = plain_ && space.is_plain();
  }
  for (unsigned c = 0; c < array.components; c += group_size) {
    Group& group = groups_.emplace_back();
    group.first = c;
    group.count = std::min(group_size, array.components - c);
    group.floats = Bits == 32;
    for (unsigned k = 0; k < group.count; ++k) group.floats = group.floats && spaces_[c + k].is_float();
    if (array.components <= most_fitted) group.fits = std::make_unique<std::array<Fit, most_corners>>();
    for (Record& record : group.records) {
      for (unsigned i = 0; i < most_candidates; ++i)
        record[i] = Ints{} + (first_miss + static_cast<int32_t>(i) * head_start);
    }
  }
}

template <class Coder, unsigned Bits, unsigned Width>
void TupleValueCoder<Coder, Bits, Width>::code(Coder& coder, const PointStencil& stencil, uint32_t slot,
                                               std::byte* tuple) {
  for (Group& group : groups_) {
    // Slots are at most those of the hull, so the table follows the largest front.
    if (slot >= group.values.size()) group.values.resize(rows_for(slot));
    code_group(coder, stencil, group, slot, tuple + group.first * number_size_);
  }
}

/// One group of three components, in the order of docs/format.md, 16.7: candidates, choice by record,
/// contexts, exceptions, residuals, then what is learnt.
template <class Coder, unsigned Bits, unsigned Width>
void TupleValueCoder<Coder, Bits, Width>::code_group(Coder& coder, const PointStencil& stencil, Group& group,
                                                     uint32_t slot, std::byte* numbers) {
  Expectation expectation;
  expect(stencil, group, expectation);
  Doubles expected = expectation.candidate[0];
  const Record& record = group.records[stencil.situation];
  // The first of equals: only a smaller record replaces.
  Ints least = record[0];
  for (unsigned i = 1; i < expectation.count; ++i) {
    const Ints better = record[i] < least;
    least = better ? record[i] : least;
    const Longs chosen = __builtin_convertvector(better, Longs);
    expected = chosen ? expectation.candidate[i] : expected;
  }
  Guess guess;
  Ints unit;
  find_codes(group, expected, guess, unit);
  find_contexts(stencil, group, unit, guess);
  find_residuals(coder, stencil, group, slot, numbers, guess);
  code_residuals(coder, group, guess, numbers);
  Value value;
  find_value(group, expected, guess, unit, numbers, value);
  value.twist = __builtin_convertvector(value.place - expectation.candidate[0], Floats);
  learn(stencil, group, expectation, value);
  group.last = value.place;
  group.last_size = value.size;
  group.values[slot] = value;
}

/// What the numbers may be expected to be. The order of each sum is fixed, as doubles do not add up the same
/// in any other.
template <class Coder, unsigned Bits, unsigned Width>
[[gnu::always_inline]] inline void TupleValueCoder<Coder, Bits, Width>::expect(
    const PointStencil& stencil, const Group& group, Expectation& expectation) const {
  auto& candidate = expectation.candidate;
  const Value* values = group.values.data();
  if (stencil.is_full()) {
    std::array<const Value*, 7> other;
    for (unsigned k = 0; k < 7; ++k) other[k] = values + stencil.others[k];
    // The polynomial of lowest degree through seven corners, then the same with what it has missed by at
    // these.
    full_sum(other, candidate[0]);
    expectation.count = 1;
    if (!group.fits) return;
    const auto& weights = (*group.fits)[stencil.situation].weights();
    Floats correction = {};
    for (unsigned k = 0; k < 7; ++k) {
      expectation.twists[k] = other[k]->twist;
      correction += weights[k] * other[k]->twist;
    }
    candidate[1] = candidate[0] + __builtin_convertvector(correction, Doubles);
    expectation.count = 2;
    return;
  }
  for (unsigned i = 0; i < stencil.sums; ++i) {
    const PointSum& sum = stencil.sum[i];
    Doubles place = {};
    for (unsigned k = 0; k < sum.count; ++k) place += sum.weight[k] * values[sum.slot[k]].place;
    candidate[i] = place;
  }
  expectation.count = stencil.sums;
  // Nothing is known around: the number before is as good a guess as any.
  if (stencil.sums == 0) {
    candidate[0] = group.last;
    expectation.count = 1;
  }
}

/// The codes nearest to what is expected, and half octaves of the distance of codes there.
template <class Coder, unsigned Bits, unsigned Width>
[[gnu::always_inline]] inline void TupleValueCoder<Coder, Bits, Width>::find_codes(const Group& group,
                                                                                   const Doubles& expected,
                                                                                   Guess& guess,
                                                                                   Ints& unit) const {
  if (!group.floats) {
    unit = Ints{};
    for (unsigned k = 0; k < group.count; ++k) {
      const double place = expected[k];
      guess.code[k] = static_cast<Code>(spaces_[group.first + k].code_near(place));
      unit[k] = spaces_[group.first + k].unit_at(place);
    }
    return;
  }
  Ints code;
  near_floats(expected, code, unit);
  for (unsigned k = 0; k < group_size; ++k) guess.code[k] = code[k];
}

/// Infinite and NaN predictions become the largest float and 0, so that there is a code. Floats are ordered
/// as integers by turning the lower bits of negative ones over.
template <class Coder, unsigned Bits, unsigned Width>
[[gnu::always_inline]] inline void TupleValueCoder<Coder, Bits, Width>::near_floats(const Doubles& expected,
                                                                                    Ints& code, Ints& unit) {
  const Floats most = Floats{} + 3.402823466e38F;
  Floats number = __builtin_convertvector(expected, Floats);
  number = number == number ? number : Floats{};
  number = number > most ? most : number;
  number = number < -most ? -most : number;
  const Ints bits = same_bits<Ints>(number);
  code = bits ^ ((bits >> 31) & 0x7fffffff);
  Ints exponent = (bits >> 23) & 0xff;
  exponent = exponent == 0 ? Ints{} + 1 : exponent;
  // Twice the exponent of a float's last bit, in half octaves: 2 (e - 150).
  unit = 2 * exponent - 300;
}

/// Residuals of neighbours tell how large this one will be: in the same units, not in those of the last bit,
/// so that a residual near zero and one far from it can be compared.
template <class Coder, unsigned Bits, unsigned Width>
[[gnu::always_inline]] inline void TupleValueCoder<Coder, Bits, Width>::find_contexts(
    const PointStencil& stencil, const Group& group, const Ints& unit, Guess& guess) const {
  Ints mean = group.last_size, spread = {};
  if (stencil.near_count > 0) {
    Ints sum = group.values[stencil.near[0]].size;
    Ints least = sum, most = sum;
    for (unsigned i = 1; i < stencil.near_count; ++i) {
      const Ints size = group.values[stencil.near[i]].size;
      sum += size;
      least = size < least ? size : least;
      most = size > most ? size : most;
    }
    mean = mean_size(sum, stencil.near_count);
    spread = spread_class(most - least);
  }
  const Ints expected = expected_class(mean, unit);
  unsigned kind = 3;
  if (stencil.is_full())
    kind = 0;
  else if (stencil.situation >= PointStencil::partial + 4 && stencil.situation < PointStencil::between)
    kind = 1;
  else if (stencil.situation < PointStencil::alone)
    kind = 2;
  for (unsigned k = 0; k < group_size; ++k) {
    guess.context[k] = {static_cast<unsigned>(expected[k]), kind * 3 + static_cast<unsigned>(spread[k])};
  }
}

/// Codes flags of exceptions, and for an encoder the residuals of the others. An exception is a number that
/// its map does not give back within the bound, such as a NaN on a lattice.
template <class Coder, unsigned Bits, unsigned Width>
void TupleValueCoder<Coder, Bits, Width>::find_residuals(Coder& coder, const PointStencil& stencil,
                                                         const Group& group, uint32_t slot,
                                                         const std::byte* numbers, Guess& guess) {
  guess.exceptions = 0;
  const std::span near(stencil.near.data(), stencil.near_count);
  for (unsigned k = 0; k < group.count; ++k) {
    const std::byte* number = numbers + k * number_size_;
    const NumberSpace& space = spaces_[group.first + k];
    Code code = 0;
    if constexpr (encoding) code = static_cast<Code>(space.code_of(number));
    if (!exact_ && !space.exact()) {
      bool exception = false;
      if constexpr (encoding) exception = !keeps(array_, space, number, code, largest_error_);
      if (exceptions_.code(coder, exception, group.first + k, near, slot)) guess.exceptions |= 1u << k;
    }
    if (encoding && (guess.exceptions >> k & 1) == 0) guess.residual[k] = difference(code, guess.code[k]);
  }
}

template <class Coder, unsigned Bits, unsigned Width>
[[gnu::always_inline]] inline void TupleValueCoder<Coder, Bits, Width>::code_residuals(Coder& coder,
                                                                                       const Group& group,
                                                                                       Guess& guess,
                                                                                       std::byte* numbers) {
  // Models are for three components; further ones share those of the last.
  const auto model = [&](unsigned k) { return std::min(group.first + k, 2u); };
  for (unsigned k = 0; k < group.count; ++k) {
    if ((guess.exceptions >> k & 1) != 0) continue;
    guess.first[k] = residuals_.code_first(coder, guess.residual[k], model(k), guess.context[k], k);
  }
  for (unsigned k = 0; k < group.count; ++k) {
    if ((guess.exceptions >> k & 1) != 0) {
      code_bits(coder, numbers + k * number_size_);
    } else {
      guess.residual[k] =
          static_cast<Code>(residuals_.code_rest(coder, guess.residual[k], guess.first[k], model(k), k));
    }
  }
}

/// Where the numbers are, and the numbers themselves for a decoder.
template <class Coder, unsigned Bits, unsigned Width>
[[gnu::always_inline]] inline void TupleValueCoder<Coder, Bits, Width>::find_value(
    const Group& group, const Doubles& expected, const Guess& guess, const Ints& unit, std::byte* numbers,
    Value& value) const {
  Floats size = {};
  if constexpr (Bits == 32) {
    size = __builtin_convertvector(pack(guess.residual), Floats);
  } else {
    for (unsigned k = 0; k < group_size; ++k) size[k] = static_cast<float>(guess.residual[k]);
  }
  if (group.floats) {
    // Sums of lanes wrap around, as those of sum() do.
    const Uints codes = same_bits<Uints>(pack(guess.code)) + same_bits<Uints>(pack(guess.residual));
    Ints code = same_bits<Ints>(codes);
    code ^= (code >> 31) & 0x7fffffff;
    Floats number = same_bits<Floats>(code);
    if constexpr (!encoding) std::memcpy(numbers, &code, group.count * sizeof(float));
    // NaN would spread to all that is predicted from it.
    number = number == number ? number : Floats{};
    value.place = __builtin_convertvector(number, Doubles);
  } else {
    value.place = Doubles{};
    for (unsigned k = 0; k < group.count; ++k) {
      const double here = expected[k];
      if ((guess.exceptions >> k & 1) != 0) {
        // An exception stands where it was expected, so that it does not spoil what comes after.
        value.place[k] = here == here ? here : 0;
        continue;
      }
      const Code code = sum(guess.code[k], guess.residual[k]);
      const NumberSpace& space = spaces_[group.first + k];
      if constexpr (!encoding) space.store_number(code, numbers + k * number_size_);
      value.place[k] = space.place_of(code);
    }
  }
  value.size = size_class(size) + unit;
}

/// After each tuple. The miss of a candidate is the exponent and top fraction bit of the difference as a
/// float: half octaves by a shift, 0 to 511.
template <class Coder, unsigned Bits, unsigned Width>
[[gnu::always_inline]] inline void TupleValueCoder<Coder, Bits, Width>::learn(const PointStencil& stencil,
                                                                              Group& group,
                                                                              const Expectation& expectation,
                                                                              const Value& value) {
  Record& record = group.records[stencil.situation];
  for (unsigned i = 0; i < expectation.count; ++i) {
    const Floats difference = __builtin_convertvector(value.place - expectation.candidate[i], Floats);
    const Ints miss = (same_bits<Ints>(difference) >> 22) & 0x1ff;
    // A running mean times 64: record / 64 follows the last 64 misses or so.
    record[i] += miss - (record[i] >> 6);
  }
  if (expectation.count < 2 || !stencil.is_full()) return;
  if (++samples_ > most_full_samples && samples_ % 4 != 0) return;
  learn_fit((*group.fits)[stencil.situation], expectation.twists, value.twist);
}

template <class Coder, unsigned Bits, unsigned Width>
void TupleValueCoder<Coder, Bits, Width>::learn_fit(Fit& fit, const typename Fit::Features& twists,
                                                    const Floats& target) {
  // The fit wants samples of about the same size: each is weighed by the size that its neighbours had, so
  // that a shock does not outweigh all the rest.
  Floats scale = {};
  for (const Floats& twist : twists) {
    const Floats size = twist < 0 ? -twist : twist;
    scale = size > scale ? size : scale;
  }
  const Floats certainty = scale > 0 ? 1.0F / scale : Floats{};
  fit.learn(twists, target, certainty);
}

// ---- corners of hexahedra, plain numbers
// -------------------------------------------------------------------

/// Fixed brackets: the order of additions is part of the format.
template <class Coder, unsigned Bits, unsigned Width>
[[gnu::always_inline]] inline void TupleValueCoder<Coder, Bits, Width>::full_sum(const Others& other,
                                                                                 Doubles& place) {
  place = ((other[0]->place + other[1]->place) + other[2]->place) -
          ((other[3]->place + other[4]->place) + other[5]->place) + other[6]->place;
}

/// Rounded down for negative sums, too: 4096 a number is added before the multiplication and taken off after
/// it. Sizes are within -4096 to 4096, so sums of three stay within the exact range of the reciprocals.
template <class Coder, unsigned Bits, unsigned Width>
[[gnu::always_inline]] inline auto TupleValueCoder<Coder, Bits, Width>::mean_size(const Ints& sum,
                                                                                  unsigned count) -> Ints {
  return (((sum + 4096 * static_cast<int32_t>(count)) * reciprocals[count]) >> 16) - 4096;
}

template <class Coder, unsigned Bits, unsigned Width>
[[gnu::always_inline]] inline auto TupleValueCoder<Coder, Bits, Width>::expected_class(const Ints& mean,
                                                                                       const Ints& unit)
    -> Ints {
  Ints expected = mean - unit;
  expected = expected < 0 ? Ints{} : expected;
  const Ints highest = Ints{} + (2 * static_cast<int32_t>(Bits) - 1);
  return expected > highest ? highest : expected;
}

/// As find_codes().
template <class Coder, unsigned Bits, unsigned Width>
[[gnu::always_inline]] inline void TupleValueCoder<Coder, Bits, Width>::near_plain(const Doubles& expected,
                                                                                   Guess& guess, Ints& unit) {
  if constexpr (Bits == 32) {
    Ints code;
    near_floats(expected, code, unit);
    for (unsigned k = 0; k < group_size; ++k) guess.code[k] = code[k];
  } else {
    // As near_floats() for doubles, number by number.
    constexpr double most = 1.7976931348623157e308;
    unit = Ints{};
    for (unsigned k = 0; k < group_size; ++k) {
      const double place = expected[k];
      const auto exponent = static_cast<int32_t>(bits_as<uint64_t>(place) >> 52 & 0x7ff);
      unit[k] = 2 * ((exponent == 0 ? 1 : exponent) - 1023 - 52);
      guess.code[k] = ordered_bits(place == place ? (place > most    ? most
                                                     : place < -most ? -most
                                                                     : place)
                                                  : 0.0);
    }
  }
}

/// Encoder: as find_residuals().
template <class Coder, unsigned Bits, unsigned Width>
[[gnu::always_inline]] inline void TupleValueCoder<Coder, Bits, Width>::find_plain_residuals(
    const std::byte* numbers, Guess& guess) const {
  using Number = std::conditional_t<Bits == 32, int32_t, int64_t>;  // its bits
  for (unsigned k = 0; k < group_size; ++k)
    guess.residual[k] = difference(ordered(load<Number>(numbers + k * sizeof(Number))), guess.code[k]);
}

/// As find_value().
template <class Coder, unsigned Bits, unsigned Width>
[[gnu::always_inline]] inline void TupleValueCoder<Coder, Bits, Width>::place_plain(const Guess& guess,
                                                                                    std::byte* numbers,
                                                                                    Doubles& place) const {
  if constexpr (Bits == 32) {
    const Uints codes = same_bits<Uints>(pack(guess.code)) + same_bits<Uints>(pack(guess.residual));
    Ints code = same_bits<Ints>(codes);
    code ^= (code >> 31) & 0x7fffffff;
    if constexpr (!encoding) std::memcpy(numbers, &code, group_size * sizeof(float));
    const Floats number = same_bits<Floats>(code);
    place = __builtin_convertvector(number == number ? number : Floats{}, Doubles);
  } else {
    place = Doubles{};
    for (unsigned k = 0; k < group_size; ++k) {
      const int64_t bits = ordered(sum(guess.code[k], guess.residual[k]));
      if constexpr (!encoding) store(numbers + k * sizeof(double), bits);
      const auto number = bits_as<double>(bits);
      place[k] = number == number ? number : 0;
    }
  }
}

/// Only three plain components come here, so that there is one group, no exceptions and always a fit.
template <class Coder, unsigned Bits, unsigned Width>
void TupleValueCoder<Coder, Bits, Width>::code_full(Coder& coder, const uint32_t* nodes, unsigned corner,
                                                    uint32_t slot, std::byte* tuple) requires(Width == 4) {
  Group& group = groups_[0];
  if (slot >= group.values.size()) group.values.resize(rows_for(slot));
  const Value* const values = group.values.data();
  const auto& places = others_of_corner[corner];
  Others other;
  for_each_index<7>([&](auto at) { other[at] = values + nodes[places[at]]; });
  Fit& fit = (*group.fits)[corner];
  Floats correction = {};
  for_each_index<7>([&](auto at) { correction += fit.weights()[at] * other[at]->twist; });
  Doubles first;
  full_sum(other, first);
  const Doubles second = first + __builtin_convertvector(correction, Doubles);
  Record& record = group.records[PointStencil::full + corner];
  const Doubles expected = __builtin_convertvector(record[1] < record[0], Longs) ? second : first;
  Guess guess;
  Ints unit;
  near_plain(expected, guess, unit);
  const Ints a = other[0]->size, b = other[1]->size, c = other[2]->size;
  const Ints low = a < b ? a : b, high = a < b ? b : a;
  const Ints spread = spread_class((c > high ? c : high) - (c < low ? c : low));
  const Ints classes = expected_class(mean_size(a + b + c, 3), unit);
  if constexpr (encoding) find_plain_residuals(tuple, guess);
  // In two stages, as the lanes are coded side by side.
  for_each_index<group_size>([&](auto at) {
    const unsigned k = at;
    guess.first[k] =
        residuals_.code_first(coder, guess.residual[k], k,
                              {static_cast<unsigned>(classes[k]), static_cast<unsigned>(spread[k])}, k);
  });
  for_each_index<group_size>([&](auto at) {
    const unsigned k = at;
    guess.residual[k] =
        static_cast<Code>(residuals_.code_rest(coder, guess.residual[k], guess.first[k], k, k));
  });
  Floats residual = {};
  for (unsigned k = 0; k < group_size; ++k) residual[k] = static_cast<float>(guess.residual[k]);
  Value value;
  place_plain(guess, tuple, value.place);
  value.size = size_class(residual) + unit;
  value.twist = __builtin_convertvector(value.place - first, Floats);
  const Floats second_miss = __builtin_convertvector(value.place - second, Floats);
  record[0] += ((same_bits<Ints>(value.twist) >> 22) & 0x1ff) - (record[0] >> 6);
  record[1] += ((same_bits<Ints>(second_miss) >> 22) & 0x1ff) - (record[1] >> 6);
  if (++samples_ <= most_full_samples || samples_ % 4 == 0) {
    typename Fit::Features twists;
    for_each_index<7>([&](auto at) { twists[at] = other[at]->twist; });
    learn_fit(fit, twists, value.twist);
  }
  group.last = value.place;
  group.last_size = value.size;
  group.values[slot] = value;
}

template <class Coder, unsigned Bits, unsigned Width>
void TupleValueCoder<Coder, Bits, Width>::code_bits(Coder& coder, std::byte* bytes) {
  uint64_t bits = 0;
  if constexpr (encoding) std::memcpy(&bits, bytes, number_size_);
  bits = exceptions_.code_bits(coder, bits, number_size_);
  if constexpr (!encoding) std::memcpy(bytes, &bits, number_size_);
}

template class TupleValueCoder<RansEncoder, 32, 1>;
template class TupleValueCoder<RansEncoder, 32, 4>;
template class TupleValueCoder<RansEncoder, 64, 1>;
template class TupleValueCoder<RansEncoder, 64, 4>;
template class TupleValueCoder<RansDecoder, 32, 1>;
template class TupleValueCoder<RansDecoder, 32, 4>;
template class TupleValueCoder<RansDecoder, 64, 1>;
template class TupleValueCoder<RansDecoder, 64, 4>;

}  // namespace maille
