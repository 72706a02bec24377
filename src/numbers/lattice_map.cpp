// Maps that keep a bound: lattices, and which of them, or none, pays.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "base/chunks.h"
#include "base/result.h"
#include "numbers/fixed_log.h"
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

/// The least and the largest code.
struct Range {
  int64_t low = std::numeric_limits<int64_t>::max();
  int64_t high = std::numeric_limits<int64_t>::min();
  void add(int64_t code) {
    low = std::min(low, code);
    high = std::max(high, code);
  }
  double width() const { return low > high ? 0 : static_cast<double>(high) - static_cast<double>(low); }
};

/// The least and the largest finite number of each component; 0 and 0 if there are none.
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

/// One finite number in so many may be beyond a lattice and stand for itself: where there are more, the
/// others hardly make up for what these take. An outlier takes the bits of its type and its place in the
/// mask, say 40 to 70 bits, which is about one bit for each of the 64. An estimate, not a sweep.
constexpr size_t least_per_outlier = 64;

/// How far off the lattice point nearest to a number is; none where the lattice does not reach it.
template <class Number>
std::optional<double> lattice_error(const NumberMap& map, Scalar type, Number number) {
  const auto* const bytes = reinterpret_cast<const std::byte*>(&number);
  if (!map.reaches(type, bytes)) return {};
  auto back = number;
  map.store_number(type, map.code_of(type, bytes), reinterpret_cast<std::byte*>(&back));
  const double error = distance(back, number);
  if (map.kind != NumberMap::Kind::logarithm || error == 0) return error;
  return error / std::fabs(static_cast<double>(number));
}

/// What a lattice does to some of the numbers.
struct Measured {
  bool keeps_bound = true;
  double error = 0;
  double squares = 0;   ///< sum of squared errors
  size_t outliers = 0;  ///< exceptions that are finite
  std::vector<uint64_t> exceptions;
};

template <class Number>
Measured measure_numbers(std::span<const Number> numbers, size_t begin, size_t end, Scalar type,
                         double allowed, std::span<const NumberMap> maps) {
  Measured measured;
  for (size_t i = begin; i < end && measured.keeps_bound; ++i) {
    const std::optional<double> error = lattice_error(maps[i % maps.size()], type, numbers[i]);
    if (!error) {
      measured.exceptions.push_back(i);
      measured.outliers += std::isfinite(static_cast<double>(numbers[i]));
      continue;
    }
    if (*error > allowed && maps[0].kind == NumberMap::Kind::logarithm) {  // such as denormal numbers
      measured.exceptions.push_back(i);
      ++measured.outliers;
      continue;
    }
    measured.keeps_bound = !(*error > allowed);
    measured.error = std::max(measured.error, *error);
    measured.squares += *error * *error;
  }
  return measured;
}

/// What a tolerance comes to: the largest error of a number, and the largest mean of squared errors.
struct Allowed {
  double error = std::numeric_limits<double>::infinity();
  double mean_square = std::numeric_limits<double>::infinity();
};

/// Measures the error of a lattice on every number. False: too many are beyond it, or the bound is exceeded.
bool measure(const Array& array, const Allowed& allowed, Executor& executor, ArrayMaps& maps) {
  const size_t count = array.count() * array.components;
  std::vector<Measured> chunks(chunks_of(count));
  with_numbers(array, [&](auto numbers) {
    for_each_chunk(executor, count, [&](size_t chunk, size_t begin, size_t end) {
      chunks[chunk] = measure_numbers(numbers, begin, end, array.type, allowed.error, maps.maps);
    });
  });
  maps.maximum_error = 0;
  maps.exceptions.clear();
  size_t outliers = 0;
  double squares = 0;
  for (const Measured& chunk : chunks) {
    squares += chunk.squares;
    outliers += chunk.outliers;
    if (!chunk.keeps_bound || outliers > count / least_per_outlier) return false;
    maps.maximum_error = std::max(maps.maximum_error, chunk.error);
    maps.exceptions.insert(maps.exceptions.end(), chunk.exceptions.begin(), chunk.exceptions.end());
  }
  // Chunks have fixed ends and their sums are added in order, so the result does not depend on threads. The
  // mean is that of finite numbers: others come back exactly, and would make it smaller than it looks.
  const size_t finite = count - (maps.exceptions.size() - outliers);
  return !(squares > allowed.mean_square * static_cast<double>(finite));
}

/// Are all numbers exactly those of lattice points? Then they were decoded from that lattice and must fall on
/// it again. Numbers that no lattice holds count as such.
bool lies_on(const Array& array, const std::vector<NumberMap>& maps) {
  return with_numbers(array, [&](auto numbers) {
    for (size_t i = 0; i < numbers.size(); ++i) {
      const auto* const number = reinterpret_cast<const std::byte*>(&numbers[i]);
      const NumberMap& map = maps[i % maps.size()];
      if (!map.reaches(array.type, number)) continue;
      auto back = numbers[i];
      map.store_number(array.type, map.code_of(array.type, number), reinterpret_cast<std::byte*>(&back));
      if (std::memcmp(&back, &numbers[i], sizeof back) != 0) return false;
    }
    return true;
  });
}

/// A relative bound's step is one of 16 to the octave: decoding moves the bounding box a little, and must not
/// move the step. On average the grid gives away 1/32 of an octave, 0.03 bits a number (at most 0.06).
double relative_step(const Array& array, double largest) {
  int exponent;
  (void)std::frexp(largest, &exponent);
  int32_t index = 16 * exponent;
  while (sixteenth_of_octave(index) > largest) --index;
  // The box may have moved across a border of the grid. If all numbers lie on the lattice of a neighbour,
  // they were decoded from it.
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
  // The quotient and the product are rounded once each, so the wanted step is at most a few neighbours away.
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

/// Not for integers with a step below theirs, nor for floats so large that lattice points overflow: with an
/// absolute bound these few are exceptions, others have grown with them.
bool pays(const Array& array, const Bounds& bounds, const Tolerance& tolerance, double step) {
  if (!is_float(array.type)) return step > 1;
  const double largest =
      array.type == Scalar::f32 ? std::numeric_limits<float>::max() : std::numeric_limits<double>::max();
  double farthest = step;
  for (size_t k = 0; k < bounds.low.size() && tolerance.kind != Tolerance::Kind::absolute; ++k) {
    farthest = std::max({farthest, std::fabs(bounds.low[k]), std::fabs(bounds.high[k])});
  }
  return farthest < largest / 4;
}

/// A product of positive numbers that may be larger than a double can hold. (Sums of logarithms would do, but
/// log2 is not the same everywhere.)
class Product {
 public:
  void multiply(double factor) {
    int exponent = 0;
    fraction_ = std::frexp(fraction_ * factor, &exponent);
    exponent_ += exponent;
  }
  bool operator>(const Product& other) const {
    return exponent_ != other.exponent_ ? exponent_ > other.exponent_ : fraction_ > other.fraction_;
  }

 private:
  double fraction_ = 0.5;  ///< from 0.5 to below 1
  int64_t exponent_ = 1;
};

/// Number of tuples of codes in the box of all tuples: what maps are compared by. `exceptions`, ascending,
/// are not counted.
Product code_volume(const Array& array, const std::vector<NumberMap>& maps,
                    const std::vector<uint64_t>& exceptions, Executor& executor) {
  std::vector<Range> ranges(array.components);
  executor.parallel_for(array.components, [&](size_t k) {
    for (size_t i = k; i < array.count() * array.components; i += array.components) {
      if (!exceptions.empty() && std::binary_search(exceptions.begin(), exceptions.end(), i)) continue;
      ranges[k].add(maps[k].code_of(array.type, array.bytes.data() + i * size_of(array.type)));
    }
  });
  Product volume;
  for (const Range& range : ranges) volume.multiply(range.width() + 1);
  return volume;
}

/// What the code_volume() of lossless maps is not below, as they have a code for each number there is. Found
/// in a moment, while choosing these maps takes long (ef6ac70). Numbers are counted by their hashes, which
/// can only make fewer of them, up to 2^18: a set of bits of 32 KiB, as large as a processor's first cache.
Product least_lossless_volume(const Array& array, Executor& executor) {
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
  Product volume;
  for (const uint32_t numbers : different) volume.multiply(std::max(numbers, 1u));
  return volume;
}

/// 10^(-decibels / 20). The factors of 1/20 come from square roots, since pow() differs among machines. The
/// first loop ends at the latest when the amplitude becomes 0, after some 650 rounds; forty halvings of 10
/// decibels leave less than 10^-11 of one.
double amplitude_of(double decibels) {
  double amplitude = 1;
  double root = 0.31622776601683794;  // 10 decibels
  double part = 10;
  for (; decibels >= part && amplitude > 0; decibels -= part) amplitude *= root;
  for (int i = 0; i < 40; ++i) {
    part /= 2;
    root = std::sqrt(root);
    if (decibels < part) continue;
    decibels -= part;
    amplitude *= root;
  }
  return amplitude;
}

/// `extent`: what relative bounds are parts of.
Allowed allowed_by(const Array& array, const Tolerance& tolerance, double extent) {
  Allowed allowed;
  switch (tolerance.kind) {
    case Tolerance::Kind::absolute:
    case Tolerance::Kind::pointwise:
      allowed.error = tolerance.value;
      break;
    case Tolerance::Kind::relative:
      allowed.error = tolerance.value * extent;
      break;
    case Tolerance::Kind::norm:
      // A cube in the ball; a little less, as sums of squares are rounded.
      allowed.error = tolerance.value / std::sqrt(array.components) * (1 - 1e-12);
      break;
    case Tolerance::Kind::psnr: {
      // PSNR = 20 log10(range / root of the mean square), solved for the latter.
      const double deviation = extent * amplitude_of(tolerance.value);
      allowed.mean_square = deviation * deviation;
      break;
    }
    default:  // only the number of lattice points was asked for
      break;
  }
  return allowed;
}

/// What the file says of the error. It must be the same for a mesh that is encoded again, so it is made from
/// the step, and from what decoding leaves alone.
double promised_error(const Array& array, const Bounds& bounds, const Tolerance& tolerance, double step) {
  if (tolerance.kind == Tolerance::Kind::absolute || tolerance.kind == Tolerance::Kind::pointwise)
    return tolerance.value;
  // Steps of relative bounds are rounded down by less than a sixteenth of an octave.
  if (tolerance.kind == Tolerance::Kind::relative) return step / 2 * sixteenth_of_octave(1);
  if (tolerance.kind == Tolerance::Kind::norm) return step / 2;
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
  const Product volume = code_volume(array, maps.maps, maps.exceptions, executor);
  return volume > least_lossless_volume(array, executor) &&
         volume > code_volume(array, lossless_maps(array, executor).maps, maps.exceptions, executor);
}

Result<> check_tolerance(const Array& array, const Tolerance& tolerance) {
  if (!(tolerance.value > 0) || !std::isfinite(tolerance.value))
    return failure(ErrorCode::usage, "the error bound of \"" + array.name + "\" must be a positive number");
  if (tolerance.kind == Tolerance::Kind::bits &&
      (tolerance.value > 62 || tolerance.value != std::floor(tolerance.value)))
    return failure(ErrorCode::usage,
                   "the bits of \"" + array.name + "\" must be a whole number from 1 to 62");
  if (tolerance.kind == Tolerance::Kind::pointwise && tolerance.value >= 1)
    return failure(ErrorCode::usage,
                   "the error of \"" + array.name + "\" relative to each number must be below 1");
  return {};
}

void set_step(ArrayMaps& maps, double step) {
  maps.step = step;
  for (NumberMap& map : maps.maps) map.step = step;
}

/// The coarsest lattice that the tolerance asks for; a step of 0 where there is none.
void set_coarsest(const Array& array, const Bounds& bounds, const Tolerance& tolerance, double allowed,
                  bool again, ArrayMaps& maps) {
  maps.maps.assign(array.components, NumberMap{.kind = NumberMap::Kind::lattice});
  if (tolerance.kind == Tolerance::Kind::bits) {
    set_step(maps, step_to_the_end(array, bounds, std::ldexp(1.0, static_cast<int>(tolerance.value)) - 1));
    for (uint32_t k = 0; k < array.components; ++k)
      maps.maps[k].origin = bounds.low[k] + 0.0;  // never -0, which would decode as +0
  } else if (tolerance.kind != Tolerance::Kind::relative || !again) {
    set_step(maps, 2 * allowed);
  } else if (allowed > 0) {
    set_step(maps, relative_step(array, 2 * allowed));
  }
}

/// Finds a lattice that keeps a bound; false if none does or none pays. The first round looks for a lattice
/// on which all numbers lie already: they were decoded from it, and encoding them again must give the same
/// file. The second round takes the first lattice that keeps the bound.
bool find_lattice(const Array& array, const Tolerance& tolerance, const Allowed& allowed, bool again,
                  Executor& executor, ArrayMaps& maps) {
  const Bounds bounds = bounds_of(array);
  set_coarsest(array, bounds, tolerance, allowed.error, again, maps);
  if (!(maps.step > 0) || !pays(array, bounds, tolerance, maps.step)) return false;
  const double coarsest = maps.step;
  const bool as_allowed = tolerance.kind == Tolerance::Kind::relative && !again;
  maps.bound = as_allowed ? allowed.error : promised_error(array, bounds, tolerance, coarsest);
  // Rounding to the type can push a number over the bound; a slightly finer lattice makes up for it. The list
  // is fixed, so a decoded mesh meets the step that it was encoded with.
  for (const bool decoded_before : {true, false}) {
    for (const double finer : {1.0, 0.999, 0.99, 0.9, 0.75, 0.5}) {
      set_step(maps, coarsest * finer);
      if ((decoded_before && !lies_on(array, maps.maps)) || !measure(array, allowed, executor, maps))
        continue;
      return decoded_before || !lossless_is_smaller(array, maps, executor);
    }
  }
  return false;
}

/// The coarsest of some lattices whose errors are small enough in the mean: where many numbers fall on
/// lattice points, such as 0, it is coarser than the one that an even distribution of errors asks for. That
/// one has a mean square of step^2 / 12. Steps from three octaves above it to one below are measured, by
/// eighths of an octave: 33 passes over the numbers at most, and 4 % of the step given away on average.
bool find_lattice_of_mean(const Array& array, const Tolerance& tolerance, const Allowed& allowed,
                          Executor& executor, ArrayMaps& maps) {
  const Bounds bounds = bounds_of(array);
  const double even = std::sqrt(12 * allowed.mean_square);
  maps.maps.assign(array.components, NumberMap{.kind = NumberMap::Kind::lattice});
  constexpr int32_t octave = 16;
  for (int32_t finer = 3 * octave; finer >= -octave; finer -= 2) {
    set_step(maps, even * sixteenth_of_octave(finer));
    if (!(maps.step > 0) || !pays(array, bounds, tolerance, maps.step)) continue;
    if (!measure(array, allowed, executor, maps)) continue;
    maps.bound = promised_error(array, bounds, tolerance, maps.step);
    return !lossless_is_smaller(array, maps, executor);
  }
  return false;
}

/// The step of logarithms that keeps numbers within `part` of themselves, wherever in an octave they are; 0
/// where the type has no numbers as close as that.
double logarithmic_step(Scalar type, double part) {
  const double rounding =
      type == Scalar::f32 ? std::numeric_limits<float>::epsilon() : std::numeric_limits<double>::epsilon();
  if (!is_float(type) || !(part > 2 * rounding)) return 0;
  // The decoded number is rounded to its type, which uses up this part of the bound.
  part -= rounding;
  constexpr int places = 256;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < places; ++i) {
    const double x = 1 + static_cast<double>(i) / places;
    least = std::min(least, FixedLog::of(x * (1 + part)) - FixedLog::of(x));
  }
  return 2 * least * (1 - 1e-4);  // between the places
}

/// By component; infinity where all are 0.
std::vector<double> least_sizes(const Array& array) {
  std::vector<double> least(array.components, std::numeric_limits<double>::infinity());
  with_numbers(array, [&](auto numbers) {
    for (size_t i = 0; i < numbers.size(); ++i) {
      const double size = std::fabs(static_cast<double>(numbers[i]));
      if (size > 0 && size < least[i % array.components]) least[i % array.components] = size;
    }
  });
  return least;
}

/// Logarithms with one step for all components, each of which counts from its least number on.
bool find_logarithms(const Array& array, const Allowed& allowed, Executor& executor, ArrayMaps& maps) {
  const double step = logarithmic_step(array.type, allowed.error);
  if (step == 0) return false;
  for (const double least : least_sizes(array)) {
    NumberMap& map = maps.maps.emplace_back(NumberMap{.kind = NumberMap::Kind::logarithm});
    // The least number has code 1, since 0 is the code of zero.
    if (std::isfinite(least)) map.origin = std::floor(FixedLog::of(least) / step + 0.5) - 1;
  }
  set_step(maps, step);
  maps.bound = allowed.error;
  return measure(array, allowed, executor, maps) && !lossless_is_smaller(array, maps, executor);
}

bool may_be_octahedral(const Tolerance& tolerance) {
  using Kind = Tolerance::Kind;
  return tolerance.kind == Kind::absolute || tolerance.kind == Kind::relative || tolerance.kind == Kind::bits;
}

/// Chooses octahedral maps for normals if these keep the bound, otherwise a lattice or logarithms, and
/// lossless maps if none of these keeps the bound or is smaller. `again`: numbers that were decoded give the
/// same maps again.
Result<ArrayMaps> find_maps(const Array& array, const Tolerance& tolerance, bool are_positions, bool again,
                            Executor& executor) {
  using Kind = Tolerance::Kind;
  if (tolerance.kind == Kind::lossless) return lossless_maps(array, executor);
  MAILLE_CHECK(check_tolerance(array, tolerance));
  if (may_be_octahedral(tolerance)) {
    if (auto choice = choose_octahedral_map(array, tolerance))
      return octahedral_maps(std::move(*choice), tolerance);
  }
  const Bounds bounds = bounds_of(array);
  ArrayMaps maps;
  maps.lossless = false;
  maps.asked = tolerance;
  maps.extent = are_positions ? bounds.diagonal() : bounds.longest_side();
  const Allowed allowed = allowed_by(array, tolerance, maps.extent);
  const bool found = tolerance.kind == Kind::pointwise ? find_logarithms(array, allowed, executor, maps)
                     : tolerance.kind == Kind::psnr
                         ? find_lattice_of_mean(array, tolerance, allowed, executor, maps)
                         : find_lattice(array, tolerance, allowed, again, executor, maps);
  return found ? maps : lossless_maps(array, executor);
}

}  // namespace

std::optional<NumberMap> logarithm_of_any(Scalar type, double part) {
  NumberMap map{.kind = NumberMap::Kind::logarithm};
  map.step = logarithmic_step(type, part);
  if (map.step == 0) return std::nullopt;
  // The exponent of the smallest denormal number, so that every number but zero has a positive code.
  const double least_exponent = type == Scalar::f32 ? -149 : -1074;
  map.origin = std::floor(least_exponent / map.step) - 1;
  return map;
}

Result<ArrayMaps> choose_maps(const Array& array, const Tolerance& tolerance, bool are_positions,
                              Executor& executor) {
  return find_maps(array, tolerance, are_positions, true, executor);
}

Result<ArrayMaps> choose_maps_once(const Array& array, const Tolerance& tolerance, bool are_positions,
                                   Executor& executor) {
  return find_maps(array, tolerance, are_positions, false, executor);
}

}  // namespace maille
