#include "code/residual_model.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstdlib>
#include <limits>
#include <vector>

#include "entropy/rans.h"
#include "support/random.h"

namespace maille {
namespace {

using testing::Random;

struct Residual {
  int64_t value;
  ResidualContext context;
  unsigned component;
};

uint64_t size_of_residual(int64_t value) {
  return value < 0 ? -static_cast<uint64_t>(value) : static_cast<uint64_t>(value);
}

template <unsigned Bits>
std::vector<std::byte> encoded(const std::vector<Residual>& residuals) {
  RansEncoder encoder(3);
  ResidualModel<Bits> model;
  for (const Residual& r : residuals) {
    const unsigned length = bit_length(size_of_residual(r.value));
    EXPECT_EQ(model.code_length(encoder, length, r.component, r.context, r.component), length);
    model.code_value(encoder, r.value, length, r.component, r.component);
  }
  return encoder.finish();
}

/// Number of the first residual that does not come back; that of all when every one does.
template <unsigned Bits>
size_t first_difference(const std::vector<Residual>& residuals) {
  const auto bytes = encoded<Bits>(residuals);
  RansDecoder decoder(bytes, 3);
  ResidualModel<Bits> model;
  for (size_t i = 0; i < residuals.size(); ++i) {
    const Residual& r = residuals[i];
    const unsigned length = model.code_length(decoder, 0, r.component, r.context, r.component);
    const int64_t value = model.code_value(decoder, 0, length, r.component, r.component);
    // Codes of 32 bits keep the low 32 bits.
    const bool same =
        Bits == 32 ? static_cast<int32_t>(value) == static_cast<int32_t>(r.value) : value == r.value;
    if (!same || decoder.exhausted()) return i;
  }
  return residuals.size();
}

template <unsigned Bits>
std::vector<Residual> around_every_power_of_two() {
  std::vector<Residual> residuals;
  for (unsigned bit = 0; bit + 1 < Bits; ++bit) {
    for (const int64_t near : {-1, 0, 1, 5}) {
      const int64_t value = (int64_t{1} << bit) + near;
      for (const int64_t residual : {value, -value}) residuals.push_back({residual, {2 * bit, 11}, bit % 3});
    }
  }
  using Limits32 = std::numeric_limits<int32_t>;
  using Limits64 = std::numeric_limits<int64_t>;
  for (const unsigned expected : {0u, 1u, 20u, 62u, 127u}) {
    for (const int64_t extreme : {Bits == 32 ? int64_t{Limits32::min()} : Limits64::min(),
                                  Bits == 32 ? int64_t{Limits32::max()} : Limits64::max(), int64_t{0}}) {
      residuals.push_back({extreme, {expected, 0}, 0});
      residuals.push_back({extreme, {expected, 11}, 2});
    }
  }
  return residuals;
}

TEST(HalfOctaves, AreTwoToEachPowerOfTwoAndNeverFall) {
  const unsigned first[] = {0, 1, 2, 3, 4, 4, 5, 5, 6, 6, 6, 6, 7};
  for (uint64_t size = 0; size < 13; ++size) EXPECT_EQ(half_octaves(size), first[size]) << size;
  EXPECT_EQ(half_octaves(UINT64_MAX), 127u);
  for (uint64_t size = 1; size < 100000; ++size) EXPECT_GE(half_octaves(size), half_octaves(size - 1));
}

TEST(ResidualModel, BringsBackTheNeighboursOfEveryPowerOfTwoAndTheExtremes) {
  const auto narrow = around_every_power_of_two<32>();
  EXPECT_EQ(first_difference<32>(narrow), narrow.size());
  const auto wide = around_every_power_of_two<64>();
  EXPECT_EQ(first_difference<64>(wide), wide.size());
}

template <unsigned Bits>
rc::Gen<Residual> any_residual() {
  return rc::gen::apply(
      [](int64_t value, unsigned bits, unsigned expected, unsigned spread, unsigned component) {
        return Residual{value >> (64 - bits), {expected, spread}, component};
      },
      rc::gen::arbitrary<int64_t>(), rc::gen::inRange(1u, Bits + 1), rc::gen::inRange(0u, 128u),
      rc::gen::inRange(0u, 12u), rc::gen::inRange(0u, 3u));
}

RC_GTEST_PROP(ResidualModel, BringsBackAnyResidualsOf32Bits, ()) {
  const auto residuals = *rc::gen::container<std::vector<Residual>>(any_residual<32>());
  RC_ASSERT(first_difference<32>(residuals) == residuals.size());
}

RC_GTEST_PROP(ResidualModel, BringsBackAnyResidualsOf64Bits, ()) {
  const auto residuals = *rc::gen::container<std::vector<Residual>>(any_residual<64>());
  RC_ASSERT(first_difference<64>(residuals) == residuals.size());
}

TEST(ResidualModel, UsesWhatIsExpected) {
  // Two sources that are told apart by what is expected, or not.
  const auto bytes_with = [](bool told) {
    Random random(3);
    std::vector<Residual> residuals;
    for (int i = 0; i < 20000; ++i) {
      const bool large = random.chance(50);
      const auto value = static_cast<int64_t>(large ? random.between(1000, 2000) : random.below(4));
      residuals.push_back({value, {told && large ? 20u : 0u, 11}, 0});
    }
    return encoded<32>(residuals).size();
  };
  EXPECT_LT(bytes_with(true) + 20000 / 8 / 2, bytes_with(false));
}

template <unsigned Bits>
void expect_bounded_values_from_any_bytes() {
  for (uint64_t seed = 0; seed < 300; ++seed) {
    Random random(seed);
    std::vector<std::byte> bytes(random.below(80));
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random.chance(30) ? 255 : random.below(256));
    RansDecoder decoder(bytes, 3);
    ResidualModel<Bits> model;
    uint64_t count = 0;
    while (!decoder.exhausted()) {
      const unsigned component = random.below(3);
      const ResidualContext context{random.below(128), random.below(12)};
      const unsigned length = model.code_length(decoder, 0, component, context, component);
      ASSERT_LE(length, Bits);
      const int64_t value = model.code_value(decoder, 0, length, component, component);
      // Sizes beyond 2^63 wrap around.
      if (length < 64) {
        ASSERT_EQ(bit_length(size_of_residual(value)), length) << value;
      }
      ASSERT_LE(++count, 2048 * (8 * bytes.size() + 192));
    }
  }
}

TEST(ResidualModel, AnyBytesGiveValuesOfTheLengthsTheyClaim) {
  expect_bounded_values_from_any_bytes<32>();
  expect_bounded_values_from_any_bytes<64>();
}

}  // namespace
}  // namespace maille
