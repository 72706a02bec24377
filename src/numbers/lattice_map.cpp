// Maps that keep a bound: lattices, and which of them, or none, pays.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/chunks.h"
#include "base/result.h"
#include "numbers/lattice_code.h"
#include "numbers/number_map.h"

namespace maille {
namespace {

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

struct Range {
  int64_t low = std::numeric_limits<int64_t>::max();
  int64_t high = std::numeric_limits<int64_t>::min();
  void add(int64_t code) {
    low = std::min(low, code);
    high = std::max(high, code);
  }
  double width() const { return low > high ? 0 : static_cast<double>(high) - static_cast<double>(low); }
};

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

Result<> check_tolerance(const Array& array, const Tolerance& tolerance) {
  if (!(tolerance.value > 0) || !std::isfinite(tolerance.value))
    return failure(ErrorCode::usage, "the error bound of \"" + array.name + "\" must be a positive number");
  if (tolerance.kind == Tolerance::Kind::bits &&
      (tolerance.value > 62 || tolerance.value != std::floor(tolerance.value)))
    return failure(ErrorCode::usage,
                   "the bits of \"" + array.name + "\" must be a whole number from 1 to 62");
  return {};
}

/// The coarsest lattice that the tolerance asks for; a step of 0 where there is none.
ArrayMaps coarsest_lattice(const Array& array, const Bounds& bounds, const Tolerance& tolerance,
                           double allowed) {
  ArrayMaps maps;
  maps.lossless = false;
  maps.maps.assign(array.components, NumberMap{.kind = NumberMap::Kind::lattice});
  if (tolerance.kind == Tolerance::Kind::bits) {
    maps.step = step_to_the_end(array, bounds, std::ldexp(1.0, static_cast<int>(tolerance.value)) - 1);
    for (uint32_t k = 0; k < array.components; ++k)
      maps.maps[k].origin = bounds.low[k] + 0.0;  // never -0, which would decode as +0
  } else if (tolerance.kind == Tolerance::Kind::absolute) {
    maps.step = 2 * allowed;
  } else if (allowed > 0) {
    maps.step = relative_step(array, 2 * allowed);
  }
  return maps;
}

}  // namespace

Result<ArrayMaps> choose_maps(const Array& array, const Tolerance& tolerance, bool are_positions,
                              Executor& executor) {
  if (tolerance.kind == Tolerance::Kind::lossless) return lossless_maps(array, executor);
  MAILLE_CHECK(check_tolerance(array, tolerance));
  if (auto choice = choose_octahedral_map(array, tolerance))
    return octahedral_maps(std::move(*choice), tolerance);
  const Bounds bounds = bounds_of(array);
  const double allowed = allowed_error(bounds, tolerance, are_positions);
  ArrayMaps maps = coarsest_lattice(array, bounds, tolerance, allowed);
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
