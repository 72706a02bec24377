#include "volume/stream/mesh_stream.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/result.h"
#include "numbers/number_space.h"

namespace maille {
namespace {

/// Fewer digits than a float has, if nearly all numbers of a sample (127 of 128, docs/encoder.md) are written
/// with so few, and if that beats decimal fractions with the same number of places everywhere by a tenth of a
/// digit a number.
NumberMap with_digits(const Array& array, uint32_t component, const NumberMap& map) {
  const bool ordered = map.kind == NumberMap::Kind::ordered;
  if (!is_float(array.type) || (!ordered && map.kind != NumberMap::Kind::decimal) || array.count() == 0)
    return map;
  // About 20,000 numbers evenly over the array; the step depends on the count alone, so that the same mesh
  // gives the same file.
  const uint64_t stride = array.count() / 20000 + 1;
  // FLT_DIG and DBL_DIG: a decimal of so many digits survives the way through the type.
  const int most = array.type == Scalar::f32 ? 6 : 15;
  for (int digits = 3; digits <= most; ++digits) {
    NumberMap candidate = {.kind = NumberMap::Kind::ordered};
    candidate.exponent = digits;
    const NumberSpace space(array.type, candidate);
    const SignificantDigits places(digits);
    uint64_t sample = 0, kept = 0;
    int64_t finer = 0;
    // The look ends as soon as too many are missed: most arrays fail at their first numbers.
    const uint64_t most_missed = array.count() / stride / 128 + 1;
    for (uint64_t i = 0; i < array.count() && sample <= kept + most_missed; i += stride) {
      const std::byte* number = array.bytes.data() + i * array.tuple_size() + component * size_of(array.type);
      std::array<std::byte, 8> back{};
      space.store_number(space.code_of(number), back.data());
      const double value = number_as_double(array.type, number);
      ++sample;
      kept += std::equal(number, number + size_of(array.type), back.data());
      const double size = value < 0 ? -value : value;
      if (size > 1e-6 && size < 1e15) finer += map.exponent - (digits - 1 - places.exponent_of(size));
    }
    if (kept < sample - sample / 128) continue;
    const bool pays = ordered || finer * 10 > static_cast<int64_t>(sample);
    return pays ? candidate : map;
  }
  return map;
}

/// Floats that nearly all are written with so many decimals, if that saves a tenth of a bit a number: half
/// octaves saved * 5 > numbers is a mean of 0.2 half octaves, or 0.1 bits.
NumberMap with_decimals(const Array& array, uint32_t component, const NumberMap& map) {
  if (array.type != Scalar::f32 || map.kind != NumberMap::Kind::ordered || map.exponent != 0) return map;
  const uint64_t stride = array.count() / 20000 + 1;
  for (int decimals = 1; decimals <= DecimalFloats::most_decimals; ++decimals) {
    NumberMap candidate = {.kind = NumberMap::Kind::ordered};
    candidate.exponent = -decimals;
    const NumberSpace space(array.type, candidate), as_bits(array.type, {.kind = NumberMap::Kind::ordered});
    uint64_t sample = 0, kept = 0;
    int64_t saved = 0;  // half bits
    const uint64_t most_missed = array.count() / stride / 128 + 1;
    for (uint64_t i = 0; i < array.count() && sample <= kept + most_missed; i += stride) {
      const std::byte* number = array.bytes.data() + i * array.tuple_size() + component * size_of(array.type);
      std::array<std::byte, 8> back{};
      space.store_number(space.code_of(number), back.data());
      ++sample;
      kept += std::equal(number, number + 4, back.begin());
      const double value = number_as_double(array.type, number);
      // Numbers near zero save most; at most 20 bits of each are counted.
      if (value != 0) saved += std::clamp(space.unit_at(value) - as_bits.unit_at(value), 0, 40);
    }
    if (sample == 0 || kept < sample - sample / 128) continue;
    return saved * 5 > static_cast<int64_t>(sample) ? candidate : map;
  }
  return map;
}

/// Whether floats have no map but their bits: 4,096 tuples tell that of all, at a tenth of the time. Where
/// the sample has another map, all numbers are looked at.
bool sample_is_ordered(const Array& array) {
  constexpr uint64_t tuples = 4096;
  if (!is_float(array.type) || array.count() < 4 * tuples) return false;
  Array sample = make_array(array.name, array.domain, array.type, array.components, array.role);
  const size_t size = array.tuple_size();
  const uint64_t stride = array.count() / tuples;
  sample.resize(tuples);
  for (uint64_t i = 0; i < tuples; ++i)
    std::copy_n(array.bytes.data() + i * stride * size, size, sample.bytes.data() + i * size);
  const auto maps = choose_maps(sample, {}, false);
  if (!maps) return false;
  return std::all_of(maps->maps.begin(), maps->maps.end(), [](const NumberMap& map) {
    return map.kind == NumberMap::Kind::ordered || map.kind > NumberMap::Kind::lattice;
  });
}

/// The maps of numbers that are to be kept bit for bit.
std::vector<NumberMap> exact_maps(const Array& array) {
  std::vector<NumberMap> maps(array.components, {.kind = NumberMap::Kind::ordered});
  if (!sample_is_ordered(array)) maps = choose_maps(array, {}, false)->maps;
  for (uint32_t c = 0; c < array.components; ++c) {
    // Streams count digits in their own way, with exceptions, so that one odd number does not decide for all.
    if (maps[c].kind > NumberMap::Kind::lattice) maps[c] = {.kind = NumberMap::Kind::ordered};
    maps[c] = with_decimals(array, c, with_digits(array, c, maps[c]));
  }
  return maps;
}

// Doubles that are floats are given maps of floats, with factor 1, by which they are known to be such.
std::vector<NumberMap> lossless_maps(const Array& array) {
  const std::optional<Array> floats = as_floats(array);
  if (!floats) return exact_maps(array);
  std::vector<NumberMap> maps = exact_maps(*floats);
  for (NumberMap& map : maps) map.factor = 1;
  return maps;
}

// The maps of one array, with the bound that holds and the extent that relative bounds are parts of.
Result<> add_maps(const Array& array, const Tolerance& tolerance, bool are_positions, ArrayMapsList& list) {
  if (tolerance.kind == Tolerance::Kind::lossless) {
    list.maps.push_back(lossless_maps(array));
    list.bounds.push_back(0);
    list.extents.push_back(0);
    return {};
  }
  // Octahedral maps are of whole tuples, streams code numbers one by one: normals are treated as plain
  // vectors.
  Array plain;
  if (array.role == Role::normal) {
    plain = array;
    plain.role = Role::none;
  }
  ArrayMaps maps =
      MAILLE_TRY(choose_maps_once(array.role == Role::normal ? plain : array, tolerance, are_positions));
  list.maps.push_back(maps.lossless ? lossless_maps(array) : std::move(maps.maps));
  list.bounds.push_back(maps.lossless ? 0 : maps.bound);
  list.extents.push_back(maps.extent);
  return {};
}

}  // namespace

/// None as soon as more than one in 128 is no float, so that most arrays are left after a few numbers.
std::optional<Array> as_floats(const Array& array) {
  if (array.type != Scalar::f64 || array.count() == 0) return {};
  const auto numbers = array.values<double>();
  Array floats = make_array(array.name, array.domain, Scalar::f32, array.components, array.role);
  floats.resize(array.count());
  const auto out = floats.values<float>();
  size_t left = numbers.size() / 128;
  for (size_t i = 0; i < numbers.size(); ++i) {
    const uint32_t bits = narrowed_bits(numbers[i]);
    store(&out[i], bits);
    if (widened_bits(bits) == bits_as<uint64_t>(numbers[i])) continue;
    if (left-- == 0) return {};
  }
  return floats;
}

// The largest error is the one that was met while coding, not the bound.
void add_error(const ArrayMapsList& maps, const StreamReport& stream, const Tolerance& asked, size_t i,
               ArrayReport& report) {
  report.bound = maps.bounds[i];
  report.lossless = report.bound == 0;
  if (report.lossless) return;
  report.asked = asked;
  report.extent = maps.extents[i];
  report.step = maps.maps[i][0].step;
  report.maximum_error = stream.errors[i];
}

double declared_width(const StreamArray& array) {
  return array.range ? array.range->second - array.range->first : 0;
}

Result<std::vector<NumberMap>> declared_maps(const StreamArray& array, double diagonal, double& bound) {
  using Kind = Tolerance::Kind;
  const Tolerance& tolerance = array.tolerance;
  bound = 0;
  const NumberMap exact = {.kind =
                               is_float(array.type) ? NumberMap::Kind::ordered : NumberMap::Kind::integer};
  if (tolerance.kind == Kind::lossless) return std::vector<NumberMap>(array.components, exact);
  if (!(tolerance.value > 0) || !std::isfinite(tolerance.value)) {
    return failure(ErrorCode::usage, "the error bound of \"" + array.name + "\" must be a positive number");
  }
  if (tolerance.kind == Kind::psnr) {
    return failure(ErrorCode::usage,
                   "a bound of \"" + array.name + "\" in decibels needs all of its values at once");
  }
  if (tolerance.kind == Kind::pointwise) {
    const auto map = logarithm_of_any(array.type, tolerance.value);
    bound = map ? tolerance.value : 0;
    return std::vector<NumberMap>(array.components, map.value_or(exact));
  }
  if ((tolerance.kind == Kind::relative || tolerance.kind == Kind::bits) && !array.range) {
    return failure(ErrorCode::usage,
                   "a bound of \"" + array.name + "\" in bits, or relative, needs the range of its values");
  }
  double step = 2 * tolerance.value;
  const double width = array.range ? array.range->second - array.range->first : 0;
  if (tolerance.kind == Kind::norm) step /= std::sqrt(array.components);
  if (tolerance.kind == Kind::relative) step = 2 * tolerance.value * diagonal;
  if (tolerance.kind == Kind::bits)
    step = width / (std::ldexp(1.0, static_cast<int>(std::min(tolerance.value, 52.0))) - 1);
  // A declared range without width: all numbers are kept as they are.
  if (!(step > 0) || !std::isfinite(step)) return std::vector<NumberMap>(array.components, exact);
  bound = step / 2;
  const double origin = array.range ? array.range->first : 0;
  // Rounding to the type takes a little of the bound: a thousandth of the step is set aside. What still
  // exceeds the bound is coded as it is.
  const NumberMap lattice = {
      .kind = NumberMap::Kind::lattice, .exponent = 0, .origin = origin, .step = step * 0.999};
  return std::vector<NumberMap>(array.components, lattice);
}

// Arrays of `options` are those of the mesh on points and cells, in its order.
Result<ArrayMapsList> choose_stream_maps(const Mesh& mesh, const StreamOptions& options) {
  ArrayMapsList list;
  MAILLE_CHECK(add_maps(mesh.points, options.positions.tolerance, true, list));
  size_t next = 0;
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::mesh) continue;
    MAILLE_CHECK(add_maps(array, options.arrays[next++].tolerance, false, list));
  }
  return list;
}

}  // namespace maille
