#include "surface/fans/dictionary.h"

#include <gtest/gtest.h>

#include <set>

#include "entropy/rans.h"
#include "support/random.h"

namespace maille::testing {
namespace {

std::vector<int64_t> random_values(Random& random, unsigned count, uint64_t range) {
  std::set<int64_t> values;
  while (values.size() < count)
    values.insert(static_cast<int64_t>(random.next() % range + random.below(4)) - 1000);
  return {values.begin(), values.end()};
}

TEST(Dictionary, NearestIsTheNearestAndTheLowerOfTwo) {
  Random random(1);
  for (const uint64_t range : {uint64_t{100}, uint64_t{70000}, uint64_t{1} << 32, uint64_t{1} << 60}) {
    for (const unsigned count : {1u, 2u, 60u}) {
      const std::vector<int64_t> values = random_values(random, count, range);
      Dictionary dictionary;
      dictionary.set(values);
      for (int i = 0; i < 2000; ++i) {
        const auto code = static_cast<int64_t>(random.next() % range) - 1000;
        uint32_t best = 0;
        for (uint32_t v = 1; v < values.size(); ++v) {
          if (std::abs(values[v] - code) < std::abs(values[best] - code)) best = v;
        }
        ASSERT_EQ(dictionary.nearest(code), best) << code;
        ASSERT_EQ(dictionary.find(code) < dictionary.size(), values[best] == code);
      }
    }
  }
}

TEST(Dictionary, TablesHoldWhatIsFoundWithoutThem) {
  Random random(3);
  for (const uint64_t range : {uint64_t{5}, uint64_t{100}, uint64_t{3000}, uint64_t{60000}}) {
    for (const unsigned count : {1u, 2u, 5u, 60u}) {
      if (count > range) continue;
      Dictionary dictionary;
      dictionary.set(random_values(random, count, range));
      dictionary.tabulate();
      for (int64_t code = -1010; code < static_cast<int64_t>(range) - 980; ++code) {
        const uint32_t near = dictionary.nearest(code);
        ASSERT_EQ(dictionary.near_part(code), std::pair(near, uint32_t{dictionary.part(near, code)})) << code;
      }
    }
  }
}

TEST(Dictionary, CodesFarApartHaveNoTable) {
  for (const std::vector<int64_t>& values :
       {std::vector<int64_t>{0, 70000}, {INT64_MIN, INT64_MIN + 3}, {INT64_MAX - 3, INT64_MAX}}) {
    Dictionary dictionary;
    dictionary.set(values);
    dictionary.tabulate();
    EXPECT_EQ(dictionary.near_part(values[0]), std::pair(0u, 4u));
    EXPECT_EQ(dictionary.near_part(values[1]), std::pair(1u, 4u));
  }
}

TEST(Dictionary, ComesBack) {
  Random random(2);
  for (const uint64_t range : {uint64_t{5000}, uint64_t{1} << 32, uint64_t{1} << 60}) {
    for (const unsigned count : {0u, 1u, 2u, 900u}) {
      Dictionary before, after;
      before.set(random_values(random, count, range));
      RansEncoder encoder;
      ASSERT_TRUE(before.code(encoder));
      const auto bytes = encoder.finish();
      RansDecoder decoder(bytes);
      ASSERT_TRUE(after.code(decoder));
      ASSERT_EQ(after.size(), before.size());
      for (uint32_t i = 0; i < before.size(); ++i) EXPECT_EQ(after[i], before[i]);
    }
  }
}

}  // namespace
}  // namespace maille::testing
