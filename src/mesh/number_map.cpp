#include "mesh/number_map.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/chunks.h"
#include "mesh/float_bits.h"
#include "mesh/scaled_digits.h"

namespace maille {
namespace {

/// 2^exponent, for -1074 to 1023.
double power_of_two(int32_t exponent) {
  return std::ldexp(1.0, exponent);
}

/// Calls `with` with the numbers of the array as a span of their C++ type.
template <class Function>
auto with_numbers(const Array& array, Function with) {
  switch (array.type) {
    case Scalar::i8:
      return with(array.values<int8_t>());
    case Scalar::u8:
      return with(array.values<uint8_t>());
    case Scalar::i16:
      return with(array.values<int16_t>());
    case Scalar::u16:
      return with(array.values<uint16_t>());
    case Scalar::i32:
      return with(array.values<int32_t>());
    case Scalar::u32:
      return with(array.values<uint32_t>());
    case Scalar::i64:
      return with(array.values<int64_t>());
    case Scalar::u64:
      return with(array.values<uint64_t>());
    case Scalar::f32:
      return with(array.values<float>());
    case Scalar::f64:
      break;
  }
  return with(array.values<double>());
}

/// Doubles are rounded to the type of number; out of range goes to the nearest end, NaN to 0.
template <class Number>
Number rounded_to(double value) {
  if constexpr (std::is_floating_point_v<Number>) {
    constexpr double largest = std::numeric_limits<Number>::max();
    return static_cast<Number>(std::clamp(value, -largest, largest));
  } else {
    if (!(value == value)) return 0;
    const double whole = std::floor(value + 0.5);
    // The upper ends of the 64-bit types are not doubles; the next double below them is.
    constexpr auto low = static_cast<double>(std::numeric_limits<Number>::min());
    constexpr auto high = static_cast<double>(std::numeric_limits<Number>::max());
    if (whole <= low) return std::numeric_limits<Number>::min();
    if (whole >= high) return std::numeric_limits<Number>::max();
    return static_cast<Number>(whole);
  }
}

template <class Number>
void store_as(double value, std::byte* out) {
  store(out, rounded_to<Number>(value));
}

void store_rounded(Scalar type, double value, std::byte* out) {
  switch (type) {
    case Scalar::i8:
      return store_as<int8_t>(value, out);
    case Scalar::u8:
      return store_as<uint8_t>(value, out);
    case Scalar::i16:
      return store_as<int16_t>(value, out);
    case Scalar::u16:
      return store_as<uint16_t>(value, out);
    case Scalar::i32:
      return store_as<int32_t>(value, out);
    case Scalar::u32:
      return store_as<uint32_t>(value, out);
    case Scalar::i64:
      return store_as<int64_t>(value, out);
    case Scalar::u64:
      return store_as<uint64_t>(value, out);
    case Scalar::f32:
      return store_as<float>(value, out);
    case Scalar::f64:
      return store_as<double>(value, out);
  }
}

int64_t integer_bits(Scalar type, const std::byte* number) {
  switch (size_of(type)) {
    case 1:
      return type == Scalar::u8 ? load<uint8_t>(number) : load<int8_t>(number);
    case 2:
      return type == Scalar::u16 ? load<uint16_t>(number) : load<int16_t>(number);
    case 4:
      return load<int32_t>(number);
    default:
      return load<int64_t>(number);
  }
}

void store_integer(Scalar type, int64_t code, std::byte* out) {
  switch (size_of(type)) {
    case 1:
      return store(out, static_cast<int8_t>(code));
    case 2:
      return store(out, static_cast<int16_t>(code));
    case 4:
      return store(out, static_cast<int32_t>(code));
    default:
      return store(out, code);
  }
}

int64_t lattice_code(double value, double origin, double step) {
  const double code = std::floor((value - origin) / step + 0.5);
  return std::fabs(code) < 9.0e18 ? static_cast<int64_t>(code) : 0;
}

struct Range {
  int64_t low = std::numeric_limits<int64_t>::max();
  int64_t high = std::numeric_limits<int64_t>::min();
  void add(int64_t code) {
    low = std::min(low, code);
    high = std::max(high, code);
  }
  double width() const { return low > high ? 0 : static_cast<double>(high) - static_cast<double>(low); }
};

}  // namespace

double sixteenth_of_octave(int32_t index) {
  static constexpr double steps[16] = {1.0,
                                       1.0442737824274138,
                                       1.0905077326652577,
                                       1.1387886347566916,
                                       1.189207115002721,
                                       1.241857812073484,
                                       1.2968395546510096,
                                       1.3542555469368927,
                                       1.4142135623730951,
                                       1.4768261459394993,
                                       1.5422108254079407,
                                       1.6104903319492543,
                                       1.681792830507429,
                                       1.7562521603732995,
                                       1.8340080864093424,
                                       1.9152065613971474};
  const int32_t octave = index >= 0 ? index / 16 : -((15 - index) / 16);
  return steps[index - 16 * octave] * power_of_two(octave);
}

double number_as_double(Scalar type, const std::byte* number) {
  switch (type) {
    case Scalar::u32:
      return load<uint32_t>(number);
    case Scalar::u64:
      return static_cast<double>(load<uint64_t>(number));
    case Scalar::f32:
      return load<float>(number);
    case Scalar::f64:
      return load<double>(number);
    default:
      return static_cast<double>(integer_bits(type, number));
  }
}

namespace {

ScaledDigits digits_of(const NumberMap& map) {
  return {map.kind == NumberMap::Kind::binary_digits ? 2u : 10u, map.digits, map.exponent};
}

/// The map of the floats that a factor belongs to.
NumberMap without_factor(const NumberMap& map) {
  NumberMap plain{.kind = map.kind, .exponent = map.exponent};
  plain.digits = map.digits;
  return plain;
}
double value_with_factor(const NumberMap& map, int64_t code) {
  float number;
  without_factor(map).store_number(Scalar::f32, code, reinterpret_cast<std::byte*>(&number));
  return static_cast<double>(number) * map.factor;
}
int64_t code_with_factor(const NumberMap& map, double number) {
  const auto floated = rounded_to<float>(number / map.factor);
  return without_factor(map).code_of(Scalar::f32, reinterpret_cast<const std::byte*>(&floated));
}

/// See NumberMap::decimals. Halves go to the even neighbour, as in "%f"; up to 9 decimals the product is
/// exact.
double printed_float(double number, int32_t decimals) {
  const double unit = exact_powers_of_ten[decimals];
  const double units = static_cast<double>(rounded_to<float>(number)) * unit;
  const double below = std::floor(units);
  const double half = below / 2;
  const bool up = units - below > 0.5 || (units - below == 0.5 && half != std::floor(half));
  return (up ? below + 1 : below) / unit;
}

int64_t clamped_rank(int64_t code, size_t size) {
  return std::clamp<int64_t>(code, 0, static_cast<int64_t>(size) - 1);
}

/// As std::lower_bound(), without branches: no processor can guess which half is next.
const double* first_not_below(const std::vector<double>& table, double value) {
  const double* first = table.data();
  for (size_t left = table.size(); left > 0;) {
    const size_t half = (left + 1) / 2;
    first += half * static_cast<size_t>(first[half - 1] < value);
    left -= half;
  }
  return first;
}

int64_t nearest_rank(const std::vector<double>& table, double value) {
  const auto above = table.begin() + (first_not_below(table, value) - table.data());
  if (above == table.begin()) return 0;
  if (above == table.end()) return static_cast<int64_t>(table.size()) - 1;
  return above - table.begin() - (value - above[-1] < *above - value ? 1 : 0);
}

/// Of a number in the table; -0 comes before 0.
int64_t rank_of(const std::vector<double>& table, double number) {
  auto at = std::lower_bound(table.begin(), table.end(), number);
  if (number == 0 && at != table.end() && std::signbit(*at) && !std::signbit(number)) ++at;
  return clamped_rank(at - table.begin(), table.size());
}

}  // namespace

int64_t NumberMap::code_of(Scalar type, const std::byte* number) const {
  if (!table.empty()) return rank_of(table, number_as_double(type, number));
  if (factor != 0) return code_with_factor(*this, number_as_double(type, number));
  switch (kind) {
    case Kind::integer:
      return integer_bits(type, number);
    case Kind::ordered:
      return type == Scalar::f32 ? ordered_bits(load<float>(number)) : ordered_bits(load<double>(number));
    case Kind::decimal:
      return lattice_code(number_as_double(type, number) * exact_powers_of_ten[exponent], 0, 1);
    case Kind::binary:
      return lattice_code(number_as_double(type, number) * power_of_two(-exponent), 0, 1);
    case Kind::lattice:
      break;
    case Kind::binary_digits:
    case Kind::decimal_digits:
      if (decimals >= 0) return digits_of(*this).code_of(rounded_to<float>(number_as_double(type, number)));
      return digits_of(*this).code_of(number_as_double(type, number));
  }
  return lattice_code(number_as_double(type, number), origin, step);
}

void NumberMap::store_number(Scalar type, int64_t code, std::byte* out) const {
  if (!table.empty() || factor != 0) return store_rounded(type, value_of(type, code), out);
  const auto real = static_cast<double>(code);
  switch (kind) {
    case Kind::integer:
      return store_integer(type, code, out);
    case Kind::ordered:
      if (type == Scalar::f32) return store(out, from_ordered(static_cast<int32_t>(code)));
      return store(out, from_ordered(code));
    case Kind::decimal:
      return store_rounded(type, real / exact_powers_of_ten[exponent], out);
    case Kind::binary:
      return store_rounded(type, real * power_of_two(exponent), out);
    case Kind::lattice:
      return store_rounded(type, origin + real * step, out);
    case Kind::binary_digits:
    case Kind::decimal_digits:
      if (decimals >= 0)
        return store_rounded(type, printed_float(digits_of(*this).number_of(code), decimals), out);
      return store_rounded(type, digits_of(*this).number_of(code), out);
  }
}

namespace {

/// Every number is `number_of` its code, rounded to the type.
template <class Number, class NumberOf>
void store_column(const std::byte* codes, std::byte* out, size_t stride, size_t count, NumberOf number_of) {
  using Code = std::conditional_t<sizeof(Number) == 8, int64_t, int32_t>;
  for (size_t i = 0; i < count; ++i) {
    const auto code = static_cast<double>(load<Code>(codes + i * stride * sizeof(Code)));
    store(out + i * stride * sizeof(Number), rounded_to<Number>(number_of(code)));
  }
}

}  // namespace

void NumberMap::store_numbers(Scalar type, const std::byte* codes, std::byte* out, size_t stride,
                              size_t count) const {
  // What most files hold gets loops of its own.
  const auto store_reals = [&](auto zero) {
    using Number = decltype(zero);
    if (kind == Kind::lattice) {
      store_column<Number>(codes, out, stride, count, [*this](double c) { return origin + c * step; });
    } else {
      const double unit = kind == Kind::decimal ? exact_powers_of_ten[exponent] : power_of_two(exponent);
      if (kind == Kind::decimal) {
        store_column<Number>(codes, out, stride, count, [unit](double c) { return c / unit; });
      } else {
        store_column<Number>(codes, out, stride, count, [unit](double c) { return c * unit; });
      }
    }
  };
  const bool real = kind != Kind::integer && !is_curved() && factor == 0;
  if (real && type == Scalar::f32) return store_reals(0.0f);
  if (real && type == Scalar::f64) return store_reals(0.0);
  if (kind == Kind::integer && size_of(type) == 4 && codes == out) return;
  if (kind == Kind::binary_digits && type == Scalar::f32 && table.empty()) {
    const ScaledDigits digits = digits_of(*this);
    for (size_t i = 0; i < count; ++i) {
      const auto code = load<int32_t>(codes + i * stride * sizeof(int32_t));
      store(out + i * stride * sizeof(float), rounded_to<float>(digits.number_of(code)));
    }
    return;
  }
  for (size_t i = 0; i < count; ++i) {
    const size_t code_bytes = size_of(type) == 8 ? 8 : 4;
    const std::byte* code = codes + i * stride * code_bytes;
    store_number(type, code_bytes == 8 ? load<int64_t>(code) : load<int32_t>(code),
                 out + i * stride * size_of(type));
  }
}

bool NumberMap::is_curved() const {
  return kind == Kind::ordered || kind == Kind::binary_digits || kind == Kind::decimal_digits ||
         !table.empty();
}

double NumberMap::value_of(Scalar type, int64_t code) const {
  if (!table.empty()) return table[static_cast<size_t>(clamped_rank(code, table.size()))];
  if (factor != 0) return value_with_factor(*this, code);
  if (kind == Kind::binary_digits || kind == Kind::decimal_digits) return digits_of(*this).number_of(code);
  std::byte number[8];
  store_number(type, code, number);
  const double value = number_as_double(type, number);
  return value == value ? value : 0;
}

int64_t NumberMap::nearest_code(Scalar type, double value) const {
  if (!(value == value)) value = 0;
  if (!table.empty()) return nearest_rank(table, value);
  if (factor != 0) return code_with_factor(*this, value);
  if (kind == Kind::binary_digits || kind == Kind::decimal_digits) return digits_of(*this).code_of(value);
  switch (kind) {
    case Kind::decimal:
      return lattice_code(value * exact_powers_of_ten[exponent], 0, 1);
    case Kind::binary:
      return lattice_code(value * power_of_two(-exponent), 0, 1);
    case Kind::integer:
      return lattice_code(value, 0, 1);
    case Kind::lattice:
      return lattice_code(value, origin, step);
    default:
      break;
  }
  std::byte number[8];
  store_rounded(type, value, number);
  return code_of(type, number);
}

double NumberMap::number_near(Scalar type, int64_t code) const {
  if (kind == Kind::integer && table.empty()) return static_cast<double>(code);
  const double value = value_of(type, code);
  return std::isfinite(value) ? value : 0;
}

namespace {

struct Bounds {
  std::vector<double> low;
  std::vector<double> high;
  bool any = false;

  double longest_side() const {
    double side = 0;
    for (size_t k = 0; k < low.size(); ++k) side = std::max(side, high[k] - low[k]);
    return side;
  }
  double diagonal() const {
    double sum = 0;
    for (size_t k = 0; k < low.size(); ++k) sum += (high[k] - low[k]) * (high[k] - low[k]);
    return std::sqrt(sum);
  }
};

Bounds bounds_of(const Array& array) {
  Bounds bounds;
  bounds.low.assign(array.components, std::numeric_limits<double>::infinity());
  bounds.high.assign(array.components, -std::numeric_limits<double>::infinity());
  with_numbers(array, [&](auto numbers) {
    for (size_t i = 0; i < numbers.size(); ++i) {
      const auto number = static_cast<double>(numbers[i]);
      if (!std::isfinite(number)) continue;
      double& low = bounds.low[i % array.components];
      double& high = bounds.high[i % array.components];
      low = std::min(low, number);
      high = std::max(high, number);
    }
  });
  for (uint32_t k = 0; k < array.components; ++k) {
    if (bounds.low[k] > bounds.high[k]) bounds.low[k] = bounds.high[k] = 0;
  }
  return bounds;
}

/// |a - b|, exact before it is rounded to a double.
template <class Number>
double distance(Number a, Number b) {
  if constexpr (std::is_floating_point_v<Number>) {
    return std::fabs(static_cast<double>(a) - static_cast<double>(b));
  } else {
    return static_cast<double>(a < b ? static_cast<uint64_t>(b) - static_cast<uint64_t>(a)
                                     : static_cast<uint64_t>(a) - static_cast<uint64_t>(b));
  }
}

/// What a lattice does to some of the numbers.
struct Measured {
  bool holds = true;  ///< no code is too large, and the bound is kept
  double error = 0;
  std::vector<uint64_t> exceptions;
};

template <class Number>
Measured measure_numbers(std::span<const Number> numbers, size_t begin, size_t end, Scalar type,
                         double allowed, std::span<const NumberMap> maps) {
  const double largest = sizeof(Number) == 8 ? 4503599627370496.0 : 2147483647.0;
  Measured measured;
  for (size_t i = begin; i < end && measured.holds; ++i) {
    const auto number = static_cast<double>(numbers[i]);
    if (!std::isfinite(number)) {
      measured.exceptions.push_back(i);
      continue;
    }
    const NumberMap& map = maps[i % maps.size()];
    auto back = numbers[i];
    map.store_number(type, lattice_code(number, map.origin, map.step), reinterpret_cast<std::byte*>(&back));
    const double error = distance(back, numbers[i]);
    measured.holds = std::fabs((number - map.origin) / map.step) < largest && !(error > allowed);
    measured.error = std::max(measured.error, error);
  }
  return measured;
}

/// Measures the error of a lattice on every number. False: some code is too large, or the bound is exceeded.
bool measure(const Array& array, double allowed, Executor& executor, ArrayMaps& maps) {
  const size_t count = array.count() * array.components;
  std::vector<Measured> chunks(chunks_of(count));
  with_numbers(array, [&](auto numbers) {
    for_each_chunk(executor, count, [&](size_t chunk, size_t begin, size_t end) {
      chunks[chunk] = measure_numbers(numbers, begin, end, array.type, allowed, maps.maps);
    });
  });
  maps.maximum_error = 0;
  maps.exceptions.clear();
  for (const Measured& chunk : chunks) {
    if (!chunk.holds) return false;
    maps.maximum_error = std::max(maps.maximum_error, chunk.error);
    maps.exceptions.insert(maps.exceptions.end(), chunk.exceptions.begin(), chunk.exceptions.end());
  }
  return true;
}

/// Are all numbers exactly those of lattice points? Then they were decoded from that lattice and must fall on
/// it again.
bool lies_on(const Array& array, const std::vector<NumberMap>& maps) {
  return with_numbers(array, [&](auto numbers) {
    for (size_t i = 0; i < numbers.size(); ++i) {
      const auto number = static_cast<double>(numbers[i]);
      if (!std::isfinite(number)) continue;
      const NumberMap& map = maps[i % array.components];
      auto back = numbers[i];
      map.store_number(array.type, lattice_code(number, map.origin, map.step),
                       reinterpret_cast<std::byte*>(&back));
      if (std::memcmp(&back, &numbers[i], sizeof back) != 0) return false;
    }
    return true;
  });
}

/// A relative bound's step is one of 16 to the octave: decoding moves the bounding box a little, and must not
/// move the step.
double relative_step(const Array& array, double largest) {
  int exponent;
  (void)std::frexp(largest, &exponent);
  int32_t index = 16 * exponent;
  while (sixteenth_of_octave(index) > largest) --index;
  for (const int32_t i : {index, index - 1, index + 1}) {
    const double step = sixteenth_of_octave(i);
    if (lies_on(array,
                std::vector(array.components, NumberMap{.kind = NumberMap::Kind::lattice, .step = step}))) {
      return step;
    }
  }
  return sixteenth_of_octave(index);
}

/// A step with which the last lattice point of the longest side decodes to the end of that side, so that the
/// decoded mesh has the same side and the same step.
double step_to_the_end(const Array& array, const Bounds& bounds, double steps) {
  size_t longest = 0;
  for (size_t k = 0; k < bounds.low.size(); ++k) {
    if (bounds.high[k] - bounds.low[k] > bounds.high[longest] - bounds.low[longest]) longest = k;
  }
  const double low = bounds.low[longest];
  const double high = bounds.high[longest];
  const double exact = (high - low) / steps;
  double above = exact;
  double below = exact;
  for (int i = 0; i < 4; ++i) {
    for (const double step : {above, below}) {
      const double end = low + steps * step;
      if (array.type == Scalar::f32 ? static_cast<float>(end) == static_cast<float>(high) : end == high)
        return step;
    }
    above = std::nextafter(above, std::numeric_limits<double>::infinity());
    below = std::nextafter(below, 0.0);
  }
  return exact;
}

/// Not for integers with a step below theirs, nor for floats so large that lattice points overflow.
bool pays(const Array& array, const Bounds& bounds, double step) {
  if (!is_float(array.type)) return step > 1;
  const double largest =
      array.type == Scalar::f32 ? std::numeric_limits<float>::max() : std::numeric_limits<double>::max();
  double farthest = 0;
  for (size_t k = 0; k < bounds.low.size(); ++k) {
    farthest = std::max({farthest, std::fabs(bounds.low[k]), std::fabs(bounds.high[k])});
  }
  return farthest < largest / 4 && std::isfinite(step);
}

/// Number of tuples of codes in the box of all tuples: what maps are compared by. (A product, since log2 is
/// not the same everywhere.)
double code_volume(const Array& array, const ArrayMaps& maps, Executor& executor) {
  std::vector<Range> ranges(array.components);
  executor.parallel_for(array.components, [&](size_t k) {
    for (size_t i = k; i < array.count() * array.components; i += array.components)
      ranges[k].add(maps.maps[k].code_of(array.type, array.bytes.data() + i * size_of(array.type)));
  });
  double volume = 1;
  for (const Range& range : ranges) volume *= range.width() + 1;
  return volume;
}

/// What the code_volume() of lossless maps is not below, as they have a code for each number there is. Found
/// in a moment, while choosing these maps takes long.
double least_lossless_volume(const Array& array, Executor& executor) {
  constexpr unsigned hash_bits = 18;
  std::vector<uint32_t> different(array.components);
  executor.parallel_for(array.components, [&](size_t k) {
    std::vector<bool> met(size_t{1} << hash_bits);
    for (size_t i = k; i < array.count() * array.components; i += array.components) {
      uint64_t bits = 0;
      std::memcpy(&bits, array.bytes.data() + i * size_of(array.type), size_of(array.type));
      auto hash = met[(bits * 0x9e3779b97f4a7c15) >> (64 - hash_bits)];
      different[k] += !hash;
      hash = true;
    }
  });
  double volume = 1;
  for (const uint32_t numbers : different) volume *= std::max(numbers, 1u);
  return volume;
}

/// Largest error that the tolerance allows.
double allowed_error(const Bounds& bounds, const Tolerance& tolerance, bool are_positions) {
  if (tolerance.kind == Tolerance::Kind::absolute) return tolerance.value;
  // Only the number of lattice points was asked for.
  if (tolerance.kind == Tolerance::Kind::bits) return std::numeric_limits<double>::infinity();
  return tolerance.value * (are_positions ? bounds.diagonal() : bounds.longest_side());
}

/// What the file says of the error. It must be the same for a mesh that is encoded again, so it is made from
/// the step, and from what decoding leaves alone.
double promised_error(const Array& array, const Bounds& bounds, const Tolerance& tolerance, double step) {
  if (tolerance.kind == Tolerance::Kind::absolute) return tolerance.value;
  // Steps of relative bounds are rounded down by less than a sixteenth of an octave.
  if (tolerance.kind == Tolerance::Kind::relative) return step / 2 * sixteenth_of_octave(1);
  // Half a step, and the rounding of the farthest number to its type.
  double farthest = 0;
  for (const double low : bounds.low) {
    farthest = std::max({farthest, std::fabs(low), std::fabs(low + bounds.longest_side())});
  }
  if (!is_float(array.type)) return step / 2 + 0.5;
  const double rounding = array.type == Scalar::f32 ? std::numeric_limits<float>::epsilon()
                                                    : 4 * std::numeric_limits<double>::epsilon();
  return step / 2 + farthest * rounding;
}

ArrayMaps octahedral_maps(OctahedralChoice choice, const Tolerance& tolerance) {
  ArrayMaps maps;
  maps.maps.resize(2);
  maps.octahedral = choice.map;
  maps.lossless = false;
  maps.bound = tolerance.kind == Tolerance::Kind::absolute ? tolerance.value : choice.map.bound();
  maps.maximum_error = choice.maximum_error;
  maps.step = 2 * choice.map.bound();
  maps.exceptions = std::move(choice.exceptions);
  return maps;
}

ArrayMaps lossless_maps(const Array& array, Executor& executor) {
  ArrayMaps maps;
  maps.maps.resize(array.components);
  executor.parallel_for(array.components, [&](size_t k) {
    maps.maps[k] = choose_lossless_map(array, static_cast<uint32_t>(k));
  });
  return maps;
}

/// Do the codes of the numbers as they are take fewer bits? Then an error would buy nothing.
bool lossless_is_smaller(const Array& array, const ArrayMaps& maps, Executor& executor) {
  const double volume = code_volume(array, maps, executor);
  return volume > least_lossless_volume(array, executor) &&
         volume > code_volume(array, lossless_maps(array, executor), executor);
}

}  // namespace

Result<ArrayMaps> choose_maps(const Array& array, const Tolerance& tolerance, bool are_positions,
                              Executor& executor) {
  using Kind = Tolerance::Kind;
  if (tolerance.kind == Kind::lossless) return lossless_maps(array, executor);
  if (!(tolerance.value > 0) || !std::isfinite(tolerance.value)) {
    return failure(ErrorCode::usage, "the error bound of \"" + array.name + "\" must be a positive number");
  }
  if (tolerance.kind == Kind::bits &&
      (tolerance.value > 62 || tolerance.value != std::floor(tolerance.value))) {
    return failure(ErrorCode::usage,
                   "the bits of \"" + array.name + "\" must be a whole number from 1 to 62");
  }
  if (auto choice = choose_octahedral_map(array, tolerance)) {
    return octahedral_maps(std::move(*choice), tolerance);
  }
  const Bounds bounds = bounds_of(array);
  ArrayMaps maps;
  maps.lossless = false;
  maps.maps.assign(array.components, NumberMap{.kind = NumberMap::Kind::lattice});
  const double allowed = allowed_error(bounds, tolerance, are_positions);
  if (tolerance.kind == Kind::bits) {
    maps.step = step_to_the_end(array, bounds, std::ldexp(1.0, static_cast<int>(tolerance.value)) - 1);
    for (uint32_t k = 0; k < array.components; ++k) {
      maps.maps[k].origin = bounds.low[k] + 0.0;  // never -0, which would decode as +0
    }
  } else if (tolerance.kind == Kind::absolute) {
    maps.step = 2 * allowed;
  } else if (allowed > 0) {
    maps.step = relative_step(array, 2 * allowed);
  }
  if (!(maps.step > 0) || !pays(array, bounds, maps.step)) return lossless_maps(array, executor);
  // Rounding to the type can push a number over the bound; a slightly finer lattice makes up for it.
  const double coarsest = maps.step;
  for (const bool decoded_before : {true, false}) {
    for (const double finer : {1.0, 0.999, 0.99, 0.9, 0.75, 0.5}) {
      maps.step = coarsest * finer;
      for (NumberMap& map : maps.maps) map.step = maps.step;
      if ((decoded_before && !lies_on(array, maps.maps)) || !measure(array, allowed, executor, maps))
        continue;
      if (!decoded_before && lossless_is_smaller(array, maps, executor)) break;
      maps.bound = promised_error(array, bounds, tolerance, coarsest);
      return maps;
    }
  }
  return lossless_maps(array, executor);
}

}  // namespace maille
