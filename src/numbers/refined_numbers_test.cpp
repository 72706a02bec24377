#include "numbers/refined_numbers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include "mesh/none.h"
#include "numbers/coarse_maps.h"
#include "support/random.h"

namespace maille::testing {
namespace {

Array column(const std::vector<double>& numbers) {
  Array array = make_array("numbers", Domain::point, Scalar::f64, 1);
  array.resize(numbers.size());
  std::copy(numbers.begin(), numbers.end(), array.values<double>().begin());
  return array;
}

std::vector<double> generated(const std::function<double(Random&)>& next, uint64_t seed = 1) {
  Random random(seed);
  std::vector<double> numbers(3000);
  for (double& number : numbers) number = next(random);
  return numbers;
}

double decimal(Random& random) {
  return (static_cast<double>(random.below(2000000)) - 1e6) / 1e6;
}
float single(Random& random) {
  return static_cast<float>(random.unit() * 2 - 1);
}

struct Refined {
  Array array;
  RefinedMaps maps;
  std::vector<uint32_t> source;

  explicit Refined(const std::vector<double>& numbers) : array(column(numbers)), source(numbers.size()) {
    for (uint32_t i = 0; i < source.size(); ++i) source[i] = i;
    const std::vector<NumberMap> exact = {choose_lossless_map(array, 0)};
    maps = refine_maps(array, exact, source);
  }
  std::vector<std::byte> details() const {
    ByteWriter out;
    write_exact_maps(out, maps);
    out.put_bytes(encode_details(maps, array, source));
    return out.take();
  }
  std::vector<int64_t> codes() const {
    std::vector<int64_t> codes;
    for (size_t i = 0; i < array.count(); ++i)
      codes.push_back(maps.coarse[0].code_of(Scalar::f64, array.bytes.data() + 8 * i));
    return codes;
  }
  /// Bits by which codes differ, at most.
  double bits_of_codes() const {
    int64_t low = std::numeric_limits<int64_t>::max(), high = std::numeric_limits<int64_t>::min();
    for (const int64_t code : codes()) low = std::min(low, code), high = std::max(high, code);
    return std::log2(static_cast<double>(high) - static_cast<double>(low) + 1);
  }
};

Result<std::vector<int64_t>> decoded(const Refined& refined, Bytes bytes) {
  ByteReader in(bytes);
  const auto maps = read_exact_maps(in, refined.maps.coarse);
  if (!maps) return tl::unexpected(maps.error());
  std::vector<int64_t> codes = refined.codes();
  const Bytes details = in.get_bytes(in.remaining());
  if (const auto stored = store_refined(*maps, details, codes); !stored)
    return tl::unexpected(stored.error());
  return codes;
}

void expect_round_trip(const Refined& refined) {
  const auto back = decoded(refined, refined.details());
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(std::memcmp(back->data(), refined.array.bytes.data(), refined.array.bytes.size()), 0);
}

TEST(RefinedNumbers, AveragesOfThreeDecimalsAreNearMultiplesOfAThird) {
  const Refined refined(generated([](Random& r) { return (decimal(r) + decimal(r) + decimal(r)) / 3; }));
  ASSERT_TRUE(refined.maps.any());
  EXPECT_LT(refined.bits_of_codes(), 23);
  EXPECT_LT(refined.details().size(), 3000u * 3 / 8) << "three bits each";
  expect_round_trip(refined);
}

TEST(RefinedNumbers, FloatsInOtherUnitsKeepTheirTwentyFourBits) {
  for (const double unit : {0.001, 1 / 25.4, 0.3048, 1e3 / 7}) {
    const Refined refined(generated([unit](Random& r) { return single(r) * unit; }));
    ASSERT_TRUE(refined.maps.any()) << unit;
    EXPECT_LT(refined.bits_of_codes(), 33);
    EXPECT_LT(refined.details().size(), 3000u * 2 / 8) << unit;
    expect_round_trip(refined);
  }
}

TEST(RefinedNumbers, FloatsOfDecimalsAreDecimalsInAnyUnit) {
  for (const double unit : {1.0, 0.001, 1 / 25.4}) {
    const Refined refined(
        generated([unit](Random& r) { return static_cast<double>(static_cast<float>(decimal(r))) * unit; }));
    ASSERT_TRUE(refined.maps.any()) << unit;
    EXPECT_LT(refined.bits_of_codes(), 22) << unit;
    EXPECT_LT(refined.details().size(), 3000u * 2 / 8) << unit;
    expect_round_trip(refined);
  }
}

TEST(RefinedNumbers, MultiplesOfAFloatFarOffAreMultiplesOfPowersOfTwo) {
  const Refined refined(generated([](Random& r) { return 5411932.0 + static_cast<double>(single(r)); }));
  ASSERT_TRUE(refined.maps.any());
  EXPECT_LT(refined.bits_of_codes(), 28);
  expect_round_trip(refined);
}

TEST(RefinedNumbers, FloatsPrintedWithNineDigitsAreFloats) {
  const Refined refined(generated([](Random& r) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", static_cast<double>(single(r)));
    return std::strtod(text, nullptr);
  }));
  ASSERT_TRUE(refined.maps.any());
  EXPECT_LT(refined.details().size(), 200u);
  expect_round_trip(refined);
}

TEST(RefinedNumbers, SomeOfThemMayBeFinerThanTheRest) {
  const Refined refined(generated(
      [](Random& r) { return r.below(3) == 0 ? decimal(r) / 64 : std::round(r.unit() * 1e13) / 1e13; }));
  ASSERT_TRUE(refined.maps.any());
  expect_round_trip(refined);
}

TEST(RefinedNumbers, ZerosOfBothSignsComeBack) {
  const Refined refined(generated([](Random& r) {
    const double number = (decimal(r) + decimal(r) + decimal(r)) / 3;
    return r.below(4) == 0 ? (number < 0 ? -0.0 : 0.0) : number;
  }));
  ASSERT_TRUE(refined.maps.any());
  expect_round_trip(refined);
}

TEST(RefinedNumbers, NoiseIsLeftAlone) {
  EXPECT_FALSE(Refined(generated([](Random& r) { return r.unit() - 0.3; })).maps.any());
  EXPECT_FALSE(Refined(generated([](Random& r) { return std::exp(400 * r.unit() - 200); })).maps.any());
  EXPECT_FALSE(Refined(std::vector<double>(3000, 0.1)).maps.any());
  EXPECT_FALSE(Refined(std::vector<double>(3000, 0.0)).maps.any());
  EXPECT_FALSE(Refined({}).maps.any());
}

TEST(RefinedNumbers, WhatIsNotFiniteIsNotRefined) {
  for (const double odd : {std::numeric_limits<double>::quiet_NaN(), HUGE_VAL, -HUGE_VAL}) {
    auto numbers = generated([](Random& r) { return single(r) * 0.001; });
    numbers[77] = odd;
    EXPECT_FALSE(Refined(numbers).maps.any());
  }
}

TEST(RefinedNumbers, GapsHaveNoDetails) {
  Refined refined(generated([](Random& r) { return single(r) * 0.001; }));
  ASSERT_TRUE(refined.maps.any());
  for (size_t i = 0; i < refined.source.size(); i += 5) refined.source[i] = none;
  const auto bytes = refined.details();
  ByteReader in(bytes);
  const auto maps = read_exact_maps(in, refined.maps.coarse);
  ASSERT_TRUE(maps) << maps.error().message;
  std::vector<int64_t> codes = refined.codes();
  for (size_t i = 0; i < codes.size(); i += 5) codes[i] = 0;
  ASSERT_TRUE(store_refined(*maps, in.get_bytes(in.remaining()), codes));
  for (size_t i = 0; i < codes.size(); ++i) {
    if (i % 5 == 0) continue;
    ASSERT_EQ(codes[i], load<int64_t>(refined.array.bytes.data() + 8 * i));
  }
}

TEST(RefinedNumbers, DamagedDetailsGiveNumbersOrAnError) {
  const Refined refined(generated([](Random& r) { return (decimal(r) + decimal(r) + decimal(r)) / 3; }, 5));
  const auto bytes = refined.details();
  for (size_t size = 0; size < bytes.size(); size += 1 + size / 16) {
    const auto back = decoded(refined, Bytes(bytes).first(size));
    ASSERT_FALSE(back) << size;
    EXPECT_EQ(back.error().code, ErrorCode::corrupt);
  }
  for (uint64_t seed = 0; seed < 200; ++seed) {
    Random random(seed);
    auto damaged = bytes;
    for (int i = 0; i < 3; ++i)
      damaged[random.below(static_cast<uint32_t>(i == 0 ? 16 : damaged.size()))] =
          static_cast<std::byte>(random.below(256));
    const auto back = decoded(refined, damaged);
    if (back) continue;
    EXPECT_EQ(back.error().code, ErrorCode::corrupt);
  }
}

}  // namespace
}  // namespace maille::testing
