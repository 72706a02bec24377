#include "io/plain_threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace maille {
namespace {

class PlainThreadsTest : public ::testing::TestWithParam<unsigned> {};

TEST_P(PlainThreadsTest, DoesEachPieceOnce) {
  PlainThreads threads(GetParam());
  for (const size_t count : {size_t{0}, size_t{1}, size_t{2}, size_t{1000}}) {
    std::vector<std::atomic<int>> done(count);
    threads.parallel_for(count, [&](size_t i) { ++done[i]; });
    for (const auto& times : done) EXPECT_EQ(times, 1);
  }
}

TEST_P(PlainThreadsTest, DoesWorkWithinWork) {
  PlainThreads threads(GetParam());
  std::atomic<int> done = 0;
  threads.parallel_for(10, [&](size_t) { threads.parallel_for(10, [&](size_t) { ++done; }); });
  EXPECT_EQ(done, 100);
}

TEST_P(PlainThreadsTest, ThrowsInTheCallersThreadAndWorksOnAfterwards) {
  PlainThreads threads(GetParam());
  const auto fail_at_seven = [](size_t i) {
    if (i == 7) throw std::runtime_error("seven");
  };
  EXPECT_THROW(threads.parallel_for(1000, fail_at_seven), std::runtime_error);
  std::atomic<int> done = 0;
  threads.parallel_for(3, [&](size_t) { ++done; });
  EXPECT_EQ(done, 3);
}

INSTANTIATE_TEST_SUITE_P(Counts, PlainThreadsTest, ::testing::Values(0u, 1u, 2u, 5u, 100000u));

}  // namespace
}  // namespace maille
