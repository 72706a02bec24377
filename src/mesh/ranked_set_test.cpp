#include "mesh/ranked_set.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/random.h"

namespace maille::testing {
namespace {

TEST(RankAll, GivesWhatSortingGives) {
  Random random(1);
  for (unsigned round = 0; round < 200; ++round) {
    const uint32_t base = round % 2 == 0 ? 0 : 0xffffffff - 5000;
    std::vector<uint32_t> numbers(random.below(300));
    for (uint32_t& number : numbers) number = base + static_cast<uint32_t>(random.below(5001));
    std::vector<uint32_t> sorted = numbers, ranks = numbers;
    std::sort(sorted.begin(), sorted.end());
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    ASSERT_EQ(rank_all(ranks), sorted) << round;
    for (size_t i = 0; i < numbers.size(); ++i) ASSERT_EQ(sorted[ranks[i]], numbers[i]) << round;
  }
}

}  // namespace
}  // namespace maille::testing
