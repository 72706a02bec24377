#include "numbers/number_maps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/bytes.h"
#include "support/random.h"

namespace maille::testing {
namespace {

using Kind = NumberMap::Kind;

std::vector<std::byte> written(const NumberMap& map) {
  ByteWriter out;
  write_map(out, map);
  return out.take();
}

Result<NumberMap> read(Bytes bytes, Scalar type) {
  ByteReader in(bytes);
  return read_map(in, type);
}

Array column(const std::vector<float>& numbers) {
  Array array = make_array("numbers", Domain::point, Scalar::f32, 1);
  array.resize(numbers.size());
  std::copy(numbers.begin(), numbers.end(), array.values<float>().begin());
  return array;
}

/// Ten thousand numbers, of which `distinct` differ.
std::vector<float> few_numbers(size_t distinct, uint64_t seed) {
  Random random(seed);
  std::vector<float> few, numbers;
  for (size_t i = 0; i < distinct; ++i) few.push_back(static_cast<float>(random.unit() * 2 - 1));
  for (size_t i = 0; i < 10000; ++i) numbers.push_back(few[random.below(static_cast<uint32_t>(distinct))]);
  return numbers;
}

NumberMap map_of(const Array& array) {
  std::vector<uint32_t> source(array.count());
  for (uint32_t i = 0; i < source.size(); ++i) source[i] = i;
  return with_tables(array, {choose_lossless_map(array, 0)}, source)[0];
}

TEST(NumberTable, IsMadeWhereNumbersComeAgain) {
  EXPECT_EQ(map_of(column(few_numbers(500, 1))).table.size(), 500u);
  EXPECT_TRUE(map_of(column(few_numbers(10000, 2))).table.size() < 10000);
  std::vector<float> all;
  Random random(3);
  for (int i = 0; i < 10000; ++i) all.push_back(static_cast<float>(random.unit()));
  EXPECT_TRUE(map_of(column(all)).table.empty());
  EXPECT_TRUE(map_of(column(std::vector<float>(100, 1.5F))).table.empty()) << "one number needs none";
  EXPECT_TRUE(map_of(column({})).table.empty());
}

TEST(NumberTable, ComesBackWithZerosOfBothSignsAndDenormals) {
  std::vector<float> numbers = few_numbers(300, 4);
  for (size_t i = 0; i < numbers.size(); i += 7) numbers[i] = -0.0F;
  for (size_t i = 1; i < numbers.size(); i += 7) numbers[i] = 0.0F;
  for (size_t i = 2; i < numbers.size(); i += 70) numbers[i] = std::numeric_limits<float>::denorm_min();
  for (size_t i = 3; i < numbers.size(); i += 70) numbers[i] = std::numeric_limits<float>::lowest();
  const Array array = column(numbers);
  const NumberMap map = map_of(array);
  ASSERT_FALSE(map.table.empty());
  const auto back = read(written(map), Scalar::f32);
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_EQ(back->table.size(), map.table.size());
  for (size_t i = 0; i < map.table.size(); ++i)
    EXPECT_EQ(bits_as<uint64_t>(back->table[i]), bits_as<uint64_t>(map.table[i]));
  for (size_t i = 0; i < numbers.size(); ++i) {
    const int64_t code = map.code_of(Scalar::f32, array.bytes.data() + 4 * i);
    float number;
    back->store_number(Scalar::f32, code, reinterpret_cast<std::byte*>(&number));
    ASSERT_EQ(bits_as<uint32_t>(number), bits_as<uint32_t>(numbers[i]));
  }
}

TEST(NumberTable, IsNotMadeOfWhatIsNoNumber) {
  for (const float odd : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    std::vector<float> numbers = few_numbers(100, 5);
    numbers[17] = odd;
    EXPECT_TRUE(map_of(column(numbers)).table.empty());
  }
}

TEST(NumberTable, KeepsToWhatIsCoded) {
  const std::vector<float> numbers = few_numbers(200, 6);
  const Array array = column(numbers);
  std::vector<uint32_t> source(5000, 0xffffffff);
  for (uint32_t i = 0; i < source.size(); i += 2) source[i] = i;
  const NumberMap map = with_tables(array, {choose_lossless_map(array, 0)}, source)[0];
  EXPECT_LE(map.table.size(), 200u);
  EXPECT_FALSE(map.table.empty());
}

TEST(NumberTable, TellsNumbersOfBothSignsOnce) {
  for (const auto kind : {Kind::ordered, Kind::binary}) {
    std::vector<double> one_side;
    Random random(8);
    for (uint32_t i = 1; i <= 2000; ++i) one_side.push_back(i * 1000 + random.below(1000));
    NumberMap map{.kind = kind, .table = one_side};
    const size_t half = written(map).size();
    for (const double number : one_side) map.table.push_back(-number);
    map.table.push_back(0);
    std::sort(map.table.begin(), map.table.end());
    const auto bytes = written(map);
    EXPECT_LT(bytes.size(), half + half / 8);
    const auto back = read(bytes, Scalar::f64);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->table, map.table);
  }
}

TEST(NumberTable, OfAStreamIsRefusedIfItIsLong) {
  for (const size_t size : {most_streamed_numbers, most_streamed_numbers + 1}) {
    NumberMap map{.kind = Kind::binary};
    for (size_t i = 0; i < size; ++i) map.table.push_back(static_cast<double>(i));
    ByteWriter out, tables;
    write_map(out, map, &tables);
    ByteReader in(out.bytes()), in_tables(tables.bytes());
    EXPECT_EQ(read_map(in, Scalar::f32, &in_tables).has_value(), size == most_streamed_numbers);
    EXPECT_TRUE(read(written(map), Scalar::f32)) << "elsewhere";
  }
}

TEST(NumberMaps, OnlyOfStreamsHaveBitsOfFloatsAFactor) {
  NumberMap map{.kind = Kind::ordered};
  map.factor = 1;
  const auto bytes = written(map);
  EXPECT_FALSE(read(bytes, Scalar::f64));
  ByteReader in(bytes), tables(Bytes{});
  const auto back = read_map(in, Scalar::f64, &tables);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->factor, 1);
}

TEST(NumberMaps, TruncatedOrDamagedGiveAMapOrAnError) {
  const auto bytes = written(map_of(column(few_numbers(400, 7))));
  for (size_t size = 0; size < bytes.size(); ++size) {
    const auto map = read(Bytes(bytes).first(size), Scalar::f32);
    ASSERT_FALSE(map) << size;
    EXPECT_EQ(map.error().code, ErrorCode::corrupt);
  }
  for (uint64_t seed = 0; seed < 3000; ++seed) {
    Random random(seed);
    auto damaged = bytes;
    for (int i = 0; i < 3; ++i)
      damaged[random.below(static_cast<uint32_t>(i < 2 ? 16 : damaged.size()))] =
          static_cast<std::byte>(random.below(256));
    for (const Scalar type : {Scalar::f32, Scalar::f64, Scalar::i32}) {
      const auto map = read(damaged, type);
      if (!map) continue;
      for (size_t i = 1; i < map->table.size(); ++i) ASSERT_LE(map->table[i - 1], map->table[i]);
    }
  }
}

TEST(NumberMaps, RefusesDigitsThatCodesCannotHold) {
  const auto with = [](Kind kind, uint32_t digits, int32_t exponent, Scalar type, int32_t decimals = -1) {
    NumberMap map{.kind = kind, .exponent = exponent};
    map.digits = digits;
    map.decimals = decimals;
    return read(written(map), type).has_value();
  };
  EXPECT_TRUE(with(Kind::binary_digits, 24, -149, Scalar::f32));
  EXPECT_TRUE(with(Kind::decimal_digits, 16, -340, Scalar::f64));
  EXPECT_TRUE(with(Kind::decimal_digits, 7, -9, Scalar::f64, 9));
  EXPECT_FALSE(with(Kind::decimal_digits, 7, -9, Scalar::f64, 10));
  EXPECT_FALSE(with(Kind::decimal_digits, 7, -9, Scalar::f64, -2));
  EXPECT_FALSE(with(Kind::decimal_digits, 7, -9, Scalar::f32, 6));
  EXPECT_FALSE(with(Kind::binary_digits, 25, -149, Scalar::f32));
  EXPECT_FALSE(with(Kind::binary_digits, 0, -149, Scalar::f32));
  EXPECT_FALSE(with(Kind::decimal_digits, 8, -9, Scalar::f32));
  EXPECT_FALSE(with(Kind::decimal_digits, 17, -9, Scalar::f64));
  EXPECT_FALSE(with(Kind::decimal_digits, 6, -341, Scalar::f64));
  EXPECT_FALSE(with(Kind::decimal_digits, 6, 301, Scalar::f64));
  EXPECT_FALSE(with(Kind::binary_digits, 6, 972, Scalar::f64));
  EXPECT_FALSE(with(Kind::decimal_digits, 6, 0, Scalar::i32));
}

}  // namespace
}  // namespace maille::testing
