#include "numbers/number_map.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/random.h"
#include "support/random_arrays.h"

namespace maille {
namespace {

using testing::Random;
using Kind = NumberMap::Kind;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

template <class T>
Array array_of(Scalar type, const std::vector<T>& values, uint32_t components = 1) {
  Array array = make_array("numbers", Domain::point, type, components);
  array.resize(values.size() / components);
  std::copy(values.begin(), values.end(), array.values<T>().begin());
  return array;
}

/// The numbers after their way through codes, as the array coder does it: 32 bits but for numbers of eight
/// bytes, exceptions kept.
Array decoded(const Array& array, const ArrayMaps& maps) {
  Array back = array;
  const size_t size = size_of(array.type);
  for (size_t i = 0; i < array.count() * array.components; ++i) {
    const NumberMap& map = maps.maps[i % array.components];
    if (std::binary_search(maps.exceptions.begin(), maps.exceptions.end(), i)) continue;
    int64_t code = map.code_of(array.type, array.bytes.data() + i * size);
    if (size < 8) code = static_cast<int32_t>(code);
    map.store_number(array.type, code, back.bytes.data() + i * size);
  }
  return back;
}

Array decoded(const Array& array, const NumberMap& map) {
  ArrayMaps maps;
  maps.maps = {map};
  return decoded(array, maps);
}

ArrayMaps maps_of(const Array& array, const Tolerance& tolerance, bool are_positions = false) {
  const auto maps = choose_maps(array, tolerance, are_positions);
  EXPECT_TRUE(maps) << maps.error().message;
  return maps ? *maps : ArrayMaps{};
}

/// Largest |a - b| of finite numbers, exact for integers of 64 bits before it is rounded to a double.
double largest_error(const Array& a, const Array& b) {
  double largest = 0;
  for (size_t i = 0; i < a.count() * a.components; ++i) {
    const std::byte* x = a.bytes.data() + i * size_of(a.type);
    const std::byte* y = b.bytes.data() + i * size_of(b.type);
    double error = std::fabs(number_as_double(a.type, x) - number_as_double(b.type, y));
    if (a.type == Scalar::u64) {
      const auto p = load<uint64_t>(x), q = load<uint64_t>(y);
      error = static_cast<double>(p > q ? p - q : q - p);
    }
    if (a.type == Scalar::i64) {
      const auto p = load<int64_t>(x), q = load<int64_t>(y);
      error = static_cast<double>(p > q ? static_cast<uint64_t>(p) - static_cast<uint64_t>(q)
                                        : static_cast<uint64_t>(q) - static_cast<uint64_t>(p));
    }
    if (std::isfinite(error)) largest = std::max(largest, error);
  }
  return largest;
}

Array random_bits(Random& random, Scalar type, uint32_t components = 1, uint64_t tuples = 200) {
  Array array = make_array("numbers", Domain::point, type, components);
  array.resize(tuples);
  for (std::byte& byte : array.bytes) byte = static_cast<std::byte>(random.below(256));
  return array;
}

/// Numbers in a range that suits the type, with a few special ones when asked.
Array random_numbers(Random& random, Scalar type, uint32_t components, bool special, bool shifted = true) {
  Array array = make_array("numbers", Domain::point, type, components);
  array.resize(random.between(1, 60));
  const double scale = std::pow(10, random.between(0, 12) - 6.0);
  const double shift = shifted && random.chance(30) ? 1000 * scale : 0;
  const NumberMap as_is{.kind = Kind::lattice, .step = 1};
  for (size_t i = 0; i < array.count() * components; ++i) {
    const double value = scale * random.unit() + shift;
    if (type == Scalar::f32) {
      array.values<float>()[i] = static_cast<float>(value);
    } else if (type == Scalar::f64) {
      array.values<double>()[i] = value;
    } else {
      as_is.store_number(type, random.below(200) - 100, array.bytes.data() + i * size_of(type));
    }
  }
  if (special) testing::sprinkle_special_values(array, random, 10);
  return array;
}

// --- lossless

TEST(LosslessMap, BringsBackAnyBitsOfAnyType) {
  for (unsigned t = 0; t < scalar_count; ++t) {
    for (uint64_t seed = 0; seed < 50; ++seed) {
      Random random(seed);
      const Array array = random_bits(random, static_cast<Scalar>(t));
      EXPECT_TRUE(decoded(array, choose_lossless_map(array, 0)).bytes == array.bytes) << name_of(array.type);
    }
  }
}

TEST(LosslessMap, BringsBackSpecialFloatsBitForBit) {
  for (const uint32_t bits :
       {0x7fc00000u, 0xffc00001u, 0x7f800001u, 0xff812345u, 0x7fffffffu, 0x7f800000u, 0xff800000u,
        0x80000000u, 0u, 1u, 0x807fffffu, 0x00800000u, 0x7f7fffffu, 0xff7fffffu}) {
    const Array array = array_of(Scalar::f32, std::vector{0.5f, bits_as<float>(bits), 1.25f});
    Array exact = array;
    store(exact.bytes.data() + 4, bits);
    EXPECT_TRUE(decoded(exact, choose_lossless_map(exact, 0)).bytes == exact.bytes) << std::hex << bits;
  }
  for (const uint64_t bits :
       {0x7ff8000000000000u, 0xfff8000000000001u, 0x7ff0000000000001u, 0xfff0000012345678u,
        0x7fffffffffffffffu, 0x7ff0000000000000u, 0xfff0000000000000u, 0x8000000000000000u, uint64_t{0},
        uint64_t{1}, 0x800fffffffffffffu, 0x0010000000000000u, 0x7fefffffffffffffu, 0xffefffffffffffffu}) {
    Array array = array_of(Scalar::f64, std::vector{0.5, 0.0, 1.25});
    store(array.bytes.data() + 8, bits);
    EXPECT_TRUE(decoded(array, choose_lossless_map(array, 0)).bytes == array.bytes) << std::hex << bits;
  }
}

TEST(LosslessMap, BringsBackTheEndsOfIntegers) {
  EXPECT_TRUE(choose_lossless_map(array_of(Scalar::u64, std::vector<uint64_t>{1}), 0).kind == Kind::integer);
  const Array u64 = array_of(Scalar::u64, std::vector<uint64_t>{0, 1, UINT64_MAX, uint64_t{1} << 63});
  EXPECT_TRUE(decoded(u64, choose_lossless_map(u64, 0)).bytes == u64.bytes);
  const Array i64 = array_of(Scalar::i64, std::vector<int64_t>{INT64_MIN, INT64_MAX, -1, 0});
  EXPECT_TRUE(decoded(i64, choose_lossless_map(i64, 0)).bytes == i64.bytes);
  const Array u32 = array_of(Scalar::u32, std::vector<uint32_t>{0, UINT32_MAX, uint32_t{1} << 31});
  EXPECT_TRUE(decoded(u32, choose_lossless_map(u32, 0)).bytes == u32.bytes);
  const Array i8 = array_of(Scalar::i8, std::vector<int8_t>{-128, 127, 0, -1});
  EXPECT_TRUE(decoded(i8, choose_lossless_map(i8, 0)).bytes == i8.bytes);
}

TEST(LosslessMap, FindsTheDecimalsOfNumbersWrittenAsText) {
  std::vector<float> two_digits;
  std::vector<double> three_digits;
  for (int i = -500; i < 500; ++i) {
    if (i == 0) continue;
    two_digits.push_back(static_cast<float>(i * 37 / 100.0));
    three_digits.push_back(i * 7919 / 1000.0);
  }
  const Array f32 = array_of(Scalar::f32, two_digits);
  const NumberMap map = choose_lossless_map(f32, 0);
  EXPECT_EQ(map.kind, Kind::decimal);
  EXPECT_EQ(map.exponent, 2);
  EXPECT_EQ(map.code_of(Scalar::f32, f32.bytes.data()), -500 * 37);
  EXPECT_TRUE(decoded(f32, map).bytes == f32.bytes);

  const Array f64 = array_of(Scalar::f64, three_digits);
  EXPECT_EQ(choose_lossless_map(f64, 0).kind, Kind::decimal);
  EXPECT_EQ(choose_lossless_map(f64, 0).exponent, 3);
  EXPECT_TRUE(decoded(f64, choose_lossless_map(f64, 0)).bytes == f64.bytes);
}

TEST(LosslessMap, FindsBinaryLattices) {
  const Array quarters = array_of(Scalar::f32, std::vector{0.25f, -3.75f, 100.25f, 7.f});
  EXPECT_EQ(choose_lossless_map(quarters, 0).kind, Kind::binary);
  EXPECT_EQ(choose_lossless_map(quarters, 0).exponent, -2);
  const Array coarse = array_of(Scalar::f64, std::vector{4096.0, -8192.0, 4096.0 * 12345, 0.0});
  EXPECT_EQ(choose_lossless_map(coarse, 0).kind, Kind::binary);
  EXPECT_EQ(choose_lossless_map(coarse, 0).exponent, 12);
  for (const Array& array : {quarters, coarse}) {
    EXPECT_TRUE(decoded(array, choose_lossless_map(array, 0)).bytes == array.bytes);
  }
}

TEST(LosslessMap, FindsHowManyDigitsTextHad) {
  std::vector<float> floats;
  std::vector<double> doubles;
  Random random(1);
  for (int i = 0; i < 3000; ++i) {
    char text[40];
    const double number = (random.unit() - 0.5) * std::pow(10.0, random.unit() * 9 - 5);
    std::snprintf(text, sizeof text, "%.6g", number);
    floats.push_back(std::strtof(text, nullptr));
    std::snprintf(text, sizeof text, "%.13g", number);
    doubles.push_back(std::strtod(text, nullptr));
  }
  const Array f32 = array_of(Scalar::f32, floats), f64 = array_of(Scalar::f64, doubles);
  EXPECT_EQ(choose_lossless_map(f32, 0).kind, Kind::decimal_digits);
  EXPECT_EQ(choose_lossless_map(f32, 0).digits, 6u);
  EXPECT_EQ(choose_lossless_map(f64, 0).kind, Kind::decimal_digits);
  EXPECT_EQ(choose_lossless_map(f64, 0).digits, 13u);
  for (const Array& array : {f32, f64})
    EXPECT_TRUE(decoded(array, choose_lossless_map(array, 0)).bytes == array.bytes);
}

TEST(LosslessMap, SeesFloatsInDoublesAndSumsWithALargerNumber) {
  std::vector<double> widened;
  std::vector<float> shifted;
  Random random(2);
  for (int i = 0; i < 3000; ++i) {
    widened.push_back(static_cast<float>((random.unit() - 0.5) * std::pow(10.0, random.unit() * 9 - 5)));
    shifted.push_back(static_cast<float>(1.0F + static_cast<float>(random.unit())) - 1.5F);
  }
  const Array f64 = array_of(Scalar::f64, widened), f32 = array_of(Scalar::f32, shifted);
  EXPECT_EQ(choose_lossless_map(f64, 0).kind, Kind::binary_digits);
  EXPECT_EQ(choose_lossless_map(f64, 0).digits, 24u);
  // All are multiples of 2^-23, and none has more digits than that: a step is all there is.
  EXPECT_EQ(choose_lossless_map(f32, 0).kind, Kind::binary);
  EXPECT_EQ(choose_lossless_map(f32, 0).exponent, -23);
  for (const Array& array : {f32, f64})
    EXPECT_TRUE(decoded(array, choose_lossless_map(array, 0)).bytes == array.bytes);
}

TEST(LosslessMap, SeesFloatsThatWerePrintedWithDecimals) {
  std::vector<double> printed, decimals;
  Random random(3);
  for (int i = 0; i < 3000; ++i) {
    char text[40];
    const double number = (random.unit() - 0.5) * 500;
    std::snprintf(text, sizeof text, "%.6f", static_cast<double>(static_cast<float>(number)));
    printed.push_back(std::strtod(text, nullptr));
    std::snprintf(text, sizeof text, "%.6f", number);
    decimals.push_back(std::strtod(text, nullptr));
  }
  const Array floats = array_of(Scalar::f64, printed), others = array_of(Scalar::f64, decimals);
  EXPECT_EQ(choose_lossless_map(floats, 0).decimals, 6);
  EXPECT_EQ(choose_lossless_map(others, 0).kind, Kind::decimal);
  for (const Array& array : {floats, others})
    EXPECT_TRUE(decoded(array, choose_lossless_map(array, 0)).bytes == array.bytes);
}

TEST(LosslessMap, OneOddNumberLeavesTheOthersWhatTheyAreUnlessItIsNone) {
  const auto map_with = [](double odd) {
    const Array array = array_of(Scalar::f64, std::vector{0.1, 0.2, 0.5, 12.7, odd});
    EXPECT_TRUE(decoded(array, choose_lossless_map(array, 0)).bytes == array.bytes) << odd;
    return choose_lossless_map(array, 0).kind;
  };
  for (const double odd : {nan, infinity, -infinity}) EXPECT_EQ(map_with(odd), Kind::ordered);
  for (const double odd : {-0.0, 1e20}) EXPECT_EQ(map_with(odd), Kind::decimal_digits);
  for (const double odd : {1.7976931348623157e308, std::nextafter(0.1, 1.0)})
    EXPECT_EQ(map_with(odd), Kind::binary_digits);
  for (const double odd : {5e-324, 1e300, -2.2250738585072009e-308}) EXPECT_NE(map_with(odd), Kind::ordered);
}

TEST(LosslessMap, IsChosenPerComponent) {
  const Array array = array_of(Scalar::f32, std::vector{0.1f, 0.25f, 1e-30f, 0.7f, 8.75f, 3e20f}, 3);
  EXPECT_EQ(choose_lossless_map(array, 0).kind, Kind::decimal);
  EXPECT_EQ(choose_lossless_map(array, 1).kind, Kind::binary);
  EXPECT_EQ(choose_lossless_map(array, 2).kind, Kind::decimal_digits);
  EXPECT_TRUE(decoded(array, maps_of(array, {})).bytes == array.bytes);
  EXPECT_TRUE(maps_of(array, {}).lossless);
}

TEST(LosslessMap, OfATableCountsItsNumbers) {
  NumberMap map{.kind = Kind::decimal, .exponent = 1};
  map.table = {-2.5, -0.0, 0.0, 0.1, 7};
  EXPECT_TRUE(map.is_curved());
  for (size_t i = 0; i < map.table.size(); ++i) {
    double number = map.table[i];
    EXPECT_EQ(map.code_of(Scalar::f64, reinterpret_cast<const std::byte*>(&number)), static_cast<int64_t>(i));
    map.store_number(Scalar::f64, static_cast<int64_t>(i), reinterpret_cast<std::byte*>(&number));
    EXPECT_EQ(bits_as<uint64_t>(number), bits_as<uint64_t>(map.table[i]));
  }
  EXPECT_EQ(map.value_of(Scalar::f64, -1), -2.5);
  EXPECT_EQ(map.value_of(Scalar::f64, INT64_MAX), 7);
  EXPECT_EQ(map.nearest_code(Scalar::f64, 3), 3);
  EXPECT_EQ(map.nearest_code(Scalar::f64, 1e300), 4);
  EXPECT_EQ(map.nearest_code(Scalar::f64, -1e300), 0);
}

RC_GTEST_PROP(OrderedCodes, RiseWithTheirNumbers, (double x, double y, float u, float v)) {
  const NumberMap map{.kind = Kind::ordered};
  const auto code = [&](Scalar type, const auto& number) {
    return map.code_of(type, reinterpret_cast<const std::byte*>(&number));
  };
  RC_ASSERT((x < y) == (code(Scalar::f64, x) < code(Scalar::f64, y)) || x == y);
  RC_ASSERT((u < v) == (code(Scalar::f32, u) < code(Scalar::f32, v)) || u == v);
  const double negative_zero = -0.0, zero = 0.0;
  RC_ASSERT(code(Scalar::f64, negative_zero) + 1 == code(Scalar::f64, zero));
}

RC_GTEST_PROP(NumberMap, TakesAnyCode, (int64_t code)) {
  // Codes of a damaged file: whatever they are, a number comes out.
  for (unsigned t = 0; t < scalar_count; ++t) {
    const auto type = static_cast<Scalar>(t);
    const NumberMap maps[] = {{.kind = is_float(type) ? Kind::ordered : Kind::integer},
                              {.kind = Kind::decimal, .exponent = 15},
                              {.kind = Kind::binary, .exponent = 1023},
                              {.kind = Kind::binary, .exponent = -1100},
                              {.kind = Kind::binary_digits, .exponent = -1074, .digits = 53},
                              {.kind = Kind::binary_digits, .exponent = 971, .digits = 1},
                              {.kind = Kind::decimal_digits, .exponent = -340, .digits = 16},
                              {.kind = Kind::decimal_digits, .exponent = 300, .digits = 1},
                              {.kind = Kind::binary_digits, .exponent = 900, .digits = 9, .decimals = 9},
                              {.kind = Kind::decimal, .exponent = 3, .table = {-1, 0.5, 9e99}},
                              {.kind = Kind::lattice, .origin = -1e308, .step = 1e308},
                              {.kind = Kind::lattice, .origin = nan, .step = infinity}};
    for (const NumberMap& map : maps) {
      std::byte out[8] = {};
      map.store_number(type, code, out);
      const double value = number_as_double(type, out);
      if (map.kind == Kind::decimal) RC_ASSERT(std::isfinite(value));
      RC_ASSERT(map.value_of(type, code) == map.value_of(type, code));
      for (const double x : {value, nan, infinity, -1e308, 5e-324}) (void)map.nearest_code(type, x);
    }
  }
}

// --- lossy

TEST(LatticeMap, KeepsAbsoluteBoundsOnTheDecodedType) {
  for (uint64_t seed = 0; seed < 2000; ++seed) {
    Random random(seed);
    const Array array = random_numbers(random, static_cast<Scalar>(random.below(scalar_count)),
                                       random.between(1, 4), seed % 2);
    const double bound = std::pow(10, random.unit() * 14 - 9);
    const ArrayMaps maps = maps_of(array, {Tolerance::Kind::absolute, bound});
    const Array back = decoded(array, maps);
    if (maps.lossless) {
      ASSERT_TRUE(back.bytes == array.bytes) << seed;
      continue;
    }
    ASSERT_LE(largest_error(array, back), bound) << seed << ", " << name_of(array.type);
    ASSERT_EQ(largest_error(array, back), maps.maximum_error) << seed << ", " << name_of(array.type);
    ASSERT_EQ(maps.bound, bound);
    for (const NumberMap& map : maps.maps) {
      ASSERT_EQ(map.kind, Kind::lattice);
      ASSERT_EQ(map.step, maps.step);
    }
  }
}

TEST(LatticeMap, KeepsBoundsOf64BitIntegersBeyondDoubles) {
  Random random(1);
  for (const Scalar type : {Scalar::i64, Scalar::u64}) {
    for (const double bound : {1.0, 3.0, 1000.0, 1e12, 1e18}) {
      const Array array = random_bits(random, type);
      const ArrayMaps maps = maps_of(array, {Tolerance::Kind::absolute, bound});
      EXPECT_LE(largest_error(array, decoded(array, maps)), bound) << name_of(type) << " " << bound;
    }
  }
  const Array ends = array_of(Scalar::u64, std::vector<uint64_t>{0, UINT64_MAX, UINT64_MAX - 1});
  const Array back = decoded(ends, maps_of(ends, {Tolerance::Kind::absolute, 1e17}));
  EXPECT_LE(largest_error(ends, back), 1e17);
}

TEST(LatticeMap, ListsNumbersThatAreNotFinite) {
  const Array array =
      array_of(Scalar::f32, std::vector{1.f, static_cast<float>(nan), 2.f, -HUGE_VALF, 3.f, HUGE_VALF}, 2);
  const ArrayMaps maps = maps_of(array, {Tolerance::Kind::absolute, 0.1});
  ASSERT_FALSE(maps.lossless);
  EXPECT_EQ(maps.exceptions, (std::vector<uint64_t>{1, 3, 5}));
}

TEST(LatticeMap, AnOutlierStandsForItself) {
  std::vector<double> numbers;
  for (int i = 0; i < 1000; ++i) numbers.push_back(std::sin(i));
  numbers[500] = 1e30;
  const Array one = array_of(Scalar::f64, numbers);
  const ArrayMaps maps = maps_of(one, {Tolerance::Kind::absolute, 1e-4});
  ASSERT_FALSE(maps.lossless);
  EXPECT_EQ(maps.exceptions, (std::vector<uint64_t>{500}));
  EXPECT_LE(maps.maximum_error, 1e-4);
  for (size_t i = 0; i < numbers.size(); i += 20) numbers[i] = 1e30;
  EXPECT_TRUE(maps_of(array_of(Scalar::f64, numbers), {Tolerance::Kind::absolute, 1e-4}).lossless);
}

TEST(LatticeMap, IsLeftOutWhereItCannotPay) {
  const auto is_lossless = [](const Array& array, const Tolerance& tolerance) {
    return maps_of(array, tolerance).lossless;
  };
  const Array integers = array_of(Scalar::i32, std::vector<int32_t>{1, 5, 100000});
  EXPECT_TRUE(is_lossless(integers, {Tolerance::Kind::absolute, 0.5}));
  EXPECT_FALSE(is_lossless(integers, {Tolerance::Kind::absolute, 5}));
  const Array floats = array_of(Scalar::f32, std::vector{1.f, 1.5f, 1e6f});
  EXPECT_TRUE(is_lossless(floats, {Tolerance::Kind::absolute, 1e-9}));  // finer than floats of 1e6 are
  EXPECT_FALSE(is_lossless(floats, {Tolerance::Kind::absolute, 0.1}));
  const Array huge = array_of(Scalar::f32, std::vector{3e38f, -3e38f});
  EXPECT_TRUE(is_lossless(huge, {Tolerance::Kind::absolute, 1e38}));
  const Array constant = array_of(Scalar::f64, std::vector{7.0, 7.0});
  EXPECT_TRUE(is_lossless(constant, {Tolerance::Kind::relative, 0.1}));
  EXPECT_TRUE(
      is_lossless(make_array("none", Domain::point, Scalar::f32, 3), {Tolerance::Kind::relative, 0.1}));
}

/// Four codes are fewer than six, however many components there are: a double holds neither 4^600 nor 6^600.
TEST(LatticeMap, IsComparedOverAnyNumberOfComponents) {
  Random random(4);
  for (const uint32_t components : {1u, 600u}) {
    Array array = make_array("many", Domain::point, Scalar::f64, components);
    array.resize(50);
    for (double& number : array.values<double>()) number = random.below(4);
    EXPECT_TRUE(maps_of(array, {Tolerance::Kind::absolute, 0.3}).lossless) << components;
  }
}

TEST(LatticeMap, OfBitsHasTwoToTheBitsPoints) {
  Random random(2);
  for (const double bits : {1.0, 2.0, 8.0, 12.0, 16.0}) {
    const Array array = random_numbers(random, Scalar::f32, 3, false);
    const ArrayMaps maps = maps_of(array, {Tolerance::Kind::bits, bits}, true);
    ASSERT_FALSE(maps.lossless);
    int64_t lowest = INT64_MAX, highest = INT64_MIN;
    for (size_t i = 0; i < array.count() * 3; ++i) {
      const int64_t code = maps.maps[i % 3].code_of(array.type, array.bytes.data() + i * 4);
      lowest = std::min(lowest, code);
      highest = std::max(highest, code);
    }
    EXPECT_EQ(lowest, 0) << bits;
    EXPECT_EQ(highest, (int64_t{1} << static_cast<int>(bits)) - 1) << bits;
  }
}

TEST(LatticeMap, RelativeBoundsAreOfTheDiagonalOrTheRange) {
  // Sides of 3, 4 and 12, a diagonal of 13. Where it is to be found again, the step is the next sixteenth of
  // an octave below twice the bound.
  const Array box =
      array_of(Scalar::f64, std::vector<double>{.1, .1, .1, 3.1, 4.1, 12.1, 1.23, 3.45, 5.67}, 3);
  for (const bool are_positions : {true, false}) {
    const double allowed = are_positions ? 0.13 : 0.12;
    const ArrayMaps maps = maps_of(box, {Tolerance::Kind::relative, 0.01}, are_positions);
    EXPECT_LE(maps.step, 2 * allowed);
    EXPECT_GT(maps.step, 2 * allowed / sixteenth_of_octave(1));
    EXPECT_LE(largest_error(box, decoded(box, maps)), allowed);
    EXPECT_EQ(largest_error(box, decoded(box, maps)), maps.maximum_error);
    const auto once = choose_maps_once(box, {Tolerance::Kind::relative, 0.01}, are_positions);
    ASSERT_TRUE(once);
    EXPECT_NEAR(once->step, 2 * allowed, 1e-12);
    EXPECT_NEAR(once->bound, allowed, 1e-12);
    EXPECT_LE(largest_error(box, decoded(box, *once)), once->bound);
  }
}

/// Decoding and choosing again, with the tolerance as asked, must give the same lattice and the same numbers.
void expect_idempotent(const Array& array, const Tolerance& tolerance, bool are_positions, uint64_t seed) {
  const ArrayMaps maps = maps_of(array, tolerance, are_positions);
  const Array once = decoded(array, maps);
  const ArrayMaps again = maps_of(once, tolerance, are_positions);
  ASSERT_EQ(again.lossless, maps.lossless) << seed;
  EXPECT_EQ(again.step, maps.step) << seed << ", " << name_of(array.type) << " " << tolerance.value;
  for (size_t k = 0; k < maps.maps.size(); ++k) {
    ASSERT_EQ(again.maps[k].origin, maps.maps[k].origin) << seed;
  }
  EXPECT_TRUE(decoded(once, again).bytes == once.bytes) << seed;
}

TEST(LatticeMap, OfAnAbsoluteBoundIsTheSameForNumbersItDecodedTo) {
  for (uint64_t seed = 0; seed < 1500 && !::testing::Test::HasFailure(); ++seed) {
    Random random(seed);
    const auto type = static_cast<Scalar>(random.below(scalar_count));
    const Array array = random_numbers(random, type, random.between(1, 4), random.chance(20));
    expect_idempotent(array, {Tolerance::Kind::absolute, std::pow(10, -random.unit() * 5)}, false, seed);
  }
}

// Where two sides are closer than half a step, the other one can be the longest after decoding, with a step
// that differs in its last bits: hence no fewer than eight bits here.
TEST(LatticeMap, OfBitsIsTheSameForNumbersItDecodedTo) {
  for (uint64_t seed = 0; seed < 1500 && !::testing::Test::HasFailure(); ++seed) {
    Random random(seed);
    const bool are_positions = random.chance(50);
    const auto type = static_cast<Scalar>(random.below(scalar_count));
    const Array array =
        random_numbers(random, type, are_positions ? 3 : random.between(1, 4), random.chance(20));
    expect_idempotent(array, {Tolerance::Kind::bits, double(random.between(8, 20))}, are_positions, seed);
  }
}

// A relative bound moves the ends of the range it is relative to: beyond some percent, or where rounding to
// the type asks for a finer step, another step is found. Hence small bounds and floats round 0 here.
TEST(LatticeMap, OfASmallRelativeBoundIsTheSameForNumbersItDecodedTo) {
  for (uint64_t seed = 0; seed < 1500 && !::testing::Test::HasFailure(); ++seed) {
    Random random(seed);
    const bool are_positions = random.chance(50);
    const Scalar type = random.chance(50) ? Scalar::f32 : Scalar::f64;
    const uint32_t components = are_positions ? 3 : random.between(1, 4);
    const Array array = random_numbers(random, type, components, random.chance(20), false);
    const double value = 0.02 * std::pow(10, -random.unit() * 2);
    expect_idempotent(array, {Tolerance::Kind::relative, value}, are_positions, seed);
  }
}

/// The last piece of work first.
class BackwardsExecutor final : public Executor {
 public:
  void parallel_for(size_t count, const std::function<void(size_t)>& work) override {
    for (size_t i = count; i-- > 0;) work(i);
  }
};

TEST(ChooseMaps, AreTheSameInWhateverOrderChunksAreMeasured) {
  Array array = make_array("a", Domain::point, Scalar::f32, 3);
  array.resize(70000);
  const auto numbers = array.values<float>();
  for (size_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<float>(i * i % 1000003) / 7.0f;
  for (const size_t odd : {3u, 40000u, 200000u}) numbers[odd] = std::numeric_limits<float>::infinity();
  BackwardsExecutor backwards;
  const auto one = choose_maps(array, {Tolerance::Kind::absolute, 0.01}, false);
  const auto other = choose_maps(array, {Tolerance::Kind::absolute, 0.01}, false, backwards);
  ASSERT_TRUE(one && other);
  ASSERT_FALSE(one->lossless);
  EXPECT_EQ(one->exceptions, (std::vector<uint64_t>{3, 40000, 200000}));
  EXPECT_EQ(one->exceptions, other->exceptions);
  EXPECT_EQ(one->maximum_error, other->maximum_error);
  EXPECT_GT(one->maximum_error, 0);
}

TEST(ChooseMaps, RefusesTolerancesWithoutMeaning) {
  const Array array = array_of(Scalar::f32, std::vector{1.f, 2.f});
  using K = Tolerance::Kind;
  for (const Tolerance tolerance :
       {Tolerance{K::absolute, 0}, Tolerance{K::absolute, -1}, Tolerance{K::absolute, nan},
        Tolerance{K::absolute, infinity}, Tolerance{K::relative, 0}, Tolerance{K::relative, nan},
        Tolerance{K::bits, 0}, Tolerance{K::bits, 63}, Tolerance{K::bits, 1.5}, Tolerance{K::bits, -3}}) {
    const auto maps = choose_maps(array, tolerance, false);
    ASSERT_FALSE(maps) << tolerance.value;
    EXPECT_EQ(maps.error().code, ErrorCode::usage);
    EXPECT_NE(maps.error().message.find("\"numbers\""), std::string::npos) << maps.error().message;
  }
}

}  // namespace
}  // namespace maille
