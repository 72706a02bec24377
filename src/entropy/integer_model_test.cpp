#include "entropy/integer_model.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <vector>

#include "entropy/rans.h"
#include "support/random.h"

namespace maille {
namespace {

using testing::Random;

// What OffsetModel can hold: valences and degrees are far below.
constexpr int32_t largest_offset = 0x3fffffff + 8;

template <class Model, class Number>
std::vector<std::byte> encoded(const std::vector<Number>& numbers) {
  RansEncoder encoder;
  Model model;
  for (const Number number : numbers) EXPECT_EQ(model.code(encoder, number), number);
  return encoder.finish();
}

/// The numbers that come back, as many as asked for; empty when the stream was too short for them.
template <class Model, class Number>
std::vector<Number> decoded(Bytes bytes, size_t count) {
  RansDecoder decoder(bytes);
  Model model;
  std::vector<Number> numbers;
  for (size_t i = 0; i < count; ++i) numbers.push_back(model.code(decoder, Number{}));
  return decoder.exhausted() ? std::vector<Number>{} : numbers;
}

template <class Model, class Number>
bool comes_back(const std::vector<Number>& numbers) {
  return decoded<Model, Number>(encoded<Model>(numbers), numbers.size()) == numbers;
}

TEST(CountModel, BringsBackAllSmallNumbersAndEveryPowerOfTwo) {
  std::vector<uint32_t> numbers;
  for (uint32_t i = 0; i < 300; ++i) numbers.push_back(i);
  for (unsigned bit = 0; bit < 32; ++bit) {
    for (const uint32_t near : {0xffffffffu, 0u, 1u, 14u, 15u, 16u}) numbers.push_back((1u << bit) + near);
  }
  numbers.push_back(UINT32_MAX);
  EXPECT_TRUE((comes_back<CountModel, uint32_t>(numbers)));
}

RC_GTEST_PROP(CountModel, BringsBackAnyNumbers, ()) {
  const auto any_size = rc::gen::mapcat(rc::gen::inRange(0u, 33u), [](unsigned bits) {
    return rc::gen::map(rc::gen::arbitrary<uint32_t>(),
                        [bits](uint32_t x) { return bits == 0 ? 0 : x >> (32 - bits); });
  });
  const auto numbers = *rc::gen::container<std::vector<uint32_t>>(any_size);
  RC_ASSERT((comes_back<CountModel, uint32_t>(numbers)));
}

TEST(CountModel, SmallNumbersAreCheap) {
  Random random(1);
  std::vector<uint32_t> numbers;
  for (int i = 0; i < 10000; ++i) numbers.push_back(random.below(2));
  EXPECT_LT(encoded<CountModel>(numbers).size(), 10000u * 1.05 / 8);
}

TEST(OffsetModel, BringsBackSmallOffsetsAndTheExtremes) {
  std::vector<int32_t> numbers;
  for (int32_t i = -300; i <= 300; ++i) numbers.push_back(i);
  for (unsigned bit = 3; bit < 30; ++bit) {
    for (const int32_t near : {-1, 0, 1}) {
      numbers.push_back((1 << bit) + near);
      numbers.push_back(-(1 << bit) + near);
    }
  }
  numbers.push_back(largest_offset);
  numbers.push_back(-largest_offset);
  EXPECT_TRUE((comes_back<OffsetModel, int32_t>(numbers)));
}

RC_GTEST_PROP(OffsetModel, BringsBackAnyOffsets, ()) {
  const auto offset =
      rc::gen::oneOf(rc::gen::inRange(-20, 20), rc::gen::inRange(-largest_offset, largest_offset));
  const auto numbers = *rc::gen::container<std::vector<int32_t>>(offset);
  RC_ASSERT((comes_back<OffsetModel, int32_t>(numbers)));
}

TEST(IntegerModels, AnyBytesGiveNumbersAndExhaust) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    Random random(seed);
    std::vector<std::byte> bytes(random.below(60));
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random.below(256));
    RansDecoder decoder(bytes);
    CountModel count;
    OffsetModel offset;
    uint64_t operations = 0;
    for (; !decoder.exhausted(); ++operations) {
      count.code(decoder, 0);
      const int32_t found = offset.code(decoder, 0);
      ASSERT_GE(found, -largest_offset);
      ASSERT_LE(found, largest_offset);
      ASSERT_LE(operations, 2048 * (8 * bytes.size() + 64));
    }
  }
}

}  // namespace
}  // namespace maille
