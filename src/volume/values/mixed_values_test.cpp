#include "volume/values/mixed_values.h"
#include "base/bytes.h"
#include "support/cases.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <random>

namespace maille {
namespace {

/// Point i of a row of points: what lies one and two before it is known, and from the second row on one of
/// the row before.
PointStencil stencil_of(uint32_t i, uint32_t row) {
  PointStencil stencil;
  const auto near = [&](uint32_t slot) { stencil.near[stencil.near_count++] = slot; };
  if (i >= row) near(i - row);
  if (i % row >= 1) near(i - 1);
  if (i >= row && i % row >= 1) {
    PointSum& sum = stencil.add_sum();
    sum.add(i - row, 1);
    sum.add(i - 1, 1);
    sum.add(i - row - 1, -1);
  }
  if (stencil.near_count > 0) {
    PointSum& mean = stencil.add_sum();
    for (unsigned k = 0; k < stencil.near_count; ++k) mean.add(stencil.near[k], 1.0 / stencil.near_count);
    stencil.situation =
        static_cast<uint8_t>(PointStencil::partial + 4 * (stencil.sums - 1) + stencil.near_count);
  }
  if (i % 64 == 63 && i > 80) {
    for (unsigned k = 0; k < 7; ++k) stencil.others[k] = i - 1 - k * 11;
    for (unsigned k = 0; k < 3; ++k) stencil.near[k] = stencil.others[k];
    stencil.near_count = 3;
    stencil.situation = static_cast<uint8_t>(i / 64 % 8);
  }
  return stencil;
}

/// `before`: as many bytes, if the array follows these.
template <unsigned Bits, class Coder>
void code_all(Coder& coder, const StreamedArray& array, uint32_t row, std::span<std::byte> bytes,
              Bytes before = {}) {
  MixedValueCoder<Coder, Bits> values(array);
  const size_t size = array.tuple_size();
  for (uint32_t i = 0; i < bytes.size() / size; ++i) {
    PointStencil stencil = stencil_of(i, row);
    if (array.follows) stencil.before = values.places_before(before.data() + i * size);
    values.code(coder, stencil, i, bytes.data() + i * size);
  }
}

/// What the numbers take; they must come back.
template <class Number>
size_t code_numbers(const StreamedArray& array, std::vector<Number> numbers, uint32_t row = 32,
                    Bytes step_before = {}) {
  constexpr unsigned bits = sizeof(Number) == 8 ? 64 : 32;
  const std::vector<Number> before = numbers;
  RansEncoder encoder;
  code_all<bits>(encoder, array, row, std::as_writable_bytes(std::span(numbers)), step_before);
  const std::vector<std::byte> bytes = encoder.finish();
  std::fill(numbers.begin(), numbers.end(), Number{});
  RansDecoder decoder(bytes);
  code_all<bits>(decoder, array, row, std::as_writable_bytes(std::span(numbers)), step_before);
  EXPECT_FALSE(decoder.exhausted());
  EXPECT_TRUE(std::ranges::equal(std::as_bytes(std::span(before)), std::as_bytes(std::span(numbers))));
  return bytes.size();
}

StreamedArray array_of(Scalar type, uint32_t components, NumberMap map) {
  StreamedArray array;
  array.type = type;
  array.components = components;
  array.maps.assign(components, map);
  array.mixed = true;
  return array;
}

const NumberMap as_bits = {.kind = NumberMap::Kind::ordered};
/// Significant ones, or minus the number of decimals.
NumberMap with_digits(int digits) {
  NumberMap map = as_bits;
  map.exponent = digits;
  return map;
}

RC_GTEST_PROP(MixedValues, GiveBackAnyBits, ()) {
  const auto wide = *rc::gen::container<std::vector<uint64_t>>(rc::gen::arbitrary<uint64_t>());
  std::vector<float> floats;
  std::vector<double> doubles;
  std::vector<uint32_t> integers;
  for (uint64_t bits : wide) {
    bits <<= bits & 31;
    doubles.push_back(bits_as<double>(bits));
    floats.push_back(bits_as<float>(static_cast<uint32_t>(bits >> 32)));
    integers.push_back(static_cast<uint32_t>(bits));
  }
  const auto components = *rc::gen::inRange(1u, 5u);
  doubles.resize(doubles.size() / components * components);
  floats.resize(doubles.size());
  integers.resize(doubles.size());
  code_numbers(array_of(Scalar::f32, components, as_bits), floats);
  code_numbers(array_of(Scalar::f64, components, as_bits), doubles);
  code_numbers(array_of(Scalar::u32, components, {.kind = NumberMap::Kind::integer}), integers);
}

RC_GTEST_PROP(MixedValues, GiveBackNumbersOfFewDigitsAndOthersAmongThem, ()) {
  const auto digits = *rc::gen::container<std::vector<int>>(rc::gen::inRange(-2'000'000, 2'000'000));
  std::vector<double> numbers;
  std::vector<float> floats;
  for (const int each : digits) {
    numbers.push_back(each % 7 == 0 ? each / 3.0 : each / 1000.0);
    floats.push_back(static_cast<float>(numbers.back()));
  }
  NumberMap decimal = {.kind = NumberMap::Kind::decimal};
  decimal.exponent = 3;
  code_numbers(array_of(Scalar::f64, 1, decimal), numbers);
  code_numbers(array_of(Scalar::f32, 1, with_digits(6)), floats);
  code_numbers(array_of(Scalar::f32, 1, with_digits(-3)), floats);
}

StreamedArray following(StreamedArray array) {
  array.follows = true;
  return array;
}

RC_GTEST_PROP(MixedValues, ThatFollowAnyBitsComeBack, (std::vector<uint64_t> wide, uint64_t seed)) {
  std::vector<uint64_t> before = wide;
  for (size_t i = 0; i < before.size(); ++i) {
    if ((seed >> i % 61 & 1) != 0) before[i] = seed * (i + 1) << i % 64;
  }
  std::vector<double> doubles;
  for (const uint64_t bits : wide) doubles.push_back(bits_as<double>(bits));
  const std::vector<float> floats(doubles.begin(), doubles.end());
  const Bytes step_before = std::as_bytes(std::span(before));
  code_numbers(following(array_of(Scalar::f64, 1, as_bits)), doubles, 32, step_before);
  code_numbers(following(array_of(Scalar::f32, 1, as_bits)), floats, 32, step_before);
  code_numbers(following(array_of(Scalar::f32, 1, with_digits(6))), floats, 32, step_before);
  code_numbers(following(array_of(Scalar::u64, 1, {.kind = NumberMap::Kind::integer})), wide, 32,
               step_before);
}

TEST(MixedValues, ThatFollowNoiseTakeLittleIfThatOnlyGrows) {
  std::mt19937 random(4);
  std::vector<float> before, now;
  for (int i = 0; i < 20000; ++i) {
    before.push_back(static_cast<float>(random() % 65536));
    now.push_back(before.back() * 1.25F);
  }
  const StreamedArray array = array_of(Scalar::f32, 1, as_bits);
  const size_t alone = code_numbers(array, now);
  const size_t bytes = code_numbers(following(array), now, 32, std::as_bytes(std::span(before)));
  EXPECT_LT(bytes * 2, alone);
}

TEST(DecimalFloats, AreCountedWithoutGapsThatNumbersDoNotNeed) {
  const NumberSpace space(Scalar::f32, with_digits(-6));
  int64_t before = 0;
  for (int i = 1; i < 40'000'000; i += 1 + i / 16) {
    const auto number = static_cast<float>(i / 1e6);
    const auto* bytes = reinterpret_cast<const std::byte*>(&number);
    const int64_t code = space.code_of(bytes);
    std::array<std::byte, 8> back{};  // room for a double: a compiler sees that branch, too
    space.store_number(code, back.data());
    EXPECT_EQ(load<float>(back.data()), number);
    EXPECT_GT(code, before);
    EXPECT_EQ(space.code_near(space.place_of(code)), code);
    EXPECT_EQ(space.code_near(-space.place_of(code)), -code);
    before = code;
  }
  // Up to 8 there are 8,000,000 decimal fractions, from there to 40 fewer than 20,000,000 floats.
  EXPECT_LT(before, 28'000'000);
}

TEST(MixedValues, OfAPolynomialWithNoiseTakeHardlyMoreThanTheNoise) {
  std::mt19937 random(1);
  std::vector<int32_t> numbers;
  for (int i = 0; i < 20000; ++i)
    numbers.push_back(i / 32 * 1000 + i % 32 * 77 + static_cast<int>(random() % 16));
  const size_t bytes = code_numbers(array_of(Scalar::i32, 1, {.kind = NumberMap::Kind::integer}), numbers);
  // Four bits each, and what three noisy neighbours add: the sum of four has a deviation twice as large.
  EXPECT_LT(bytes, 20000 * 11 / 16);
}

TEST(MixedValues, ThatComeAgainInTheNextRowTakeLittle) {
  std::mt19937 random(2);
  std::vector<float> row, numbers;
  for (int i = 0; i < 3 * 200; ++i) row.push_back(static_cast<float>(random()) * 1e-6F);
  for (int layer = 0; layer < 50; ++layer) numbers.insert(numbers.end(), row.begin(), row.end());
  const size_t bytes = code_numbers(array_of(Scalar::f32, 3, as_bits), numbers, 200);
  EXPECT_LT(bytes, row.size() * 4 + numbers.size() / 16);
}

template <unsigned Bits>
std::vector<std::byte> decoded(const StreamedArray& array, Bytes bytes) {
  std::vector<std::byte> numbers(24 * 1000), before(numbers.size());
  for (size_t i = 0; i < before.size(); ++i) before[i] = bytes[i * 7 % bytes.size()];
  RansDecoder decoder(bytes);
  code_all<Bits>(decoder, array, 32, numbers, before);
  return numbers;
}

TEST(MixedValues, OfDamagedBytesAreTheSameEachTime) {
  std::mt19937 random(3);
  for (uint64_t run = 0; run < testing::cases(10); ++run) {
    std::vector<std::byte> bytes(2000);
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
    const StreamedArray wide = array_of(Scalar::f64, 3, as_bits);
    const StreamedArray digits = array_of(Scalar::f32, 1, with_digits(6));
    const StreamedArray decimals = array_of(Scalar::f32, 3, with_digits(-6));
    EXPECT_EQ(decoded<64>(wide, bytes), decoded<64>(wide, bytes));
    EXPECT_EQ(decoded<32>(digits, bytes), decoded<32>(digits, bytes));
    EXPECT_EQ(decoded<32>(decimals, bytes), decoded<32>(decimals, bytes));
    NumberMap lattice = {.kind = NumberMap::Kind::lattice, .origin = -1e300, .step = 1e-300};
    NumberMap logarithm = {.kind = NumberMap::Kind::logarithm, .origin = -3, .step = 1e-9};
    for (const NumberMap& map : {as_bits, lattice, logarithm}) {
      const StreamedArray array = following(array_of(Scalar::f64, 3, map));
      EXPECT_EQ(decoded<64>(array, bytes), decoded<64>(array, bytes));
    }
    for (const StreamedArray& array : {following(digits), following(decimals)})
      EXPECT_EQ(decoded<32>(array, bytes), decoded<32>(array, bytes));
  }
}

}  // namespace
}  // namespace maille
