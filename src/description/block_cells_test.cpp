#include "description/block_cells.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <optional>

namespace maille {
namespace {

std::vector<uint64_t> numbers_of(const std::vector<BlockCells>& cells, uint64_t blocks) {
  std::vector<uint64_t> numbers;
  put_block_cells(cells, blocks, [&](uint64_t number) { numbers.push_back(number); });
  return numbers;
}

/// By block; nothing where the numbers make no sense.
std::optional<std::vector<uint64_t>> cells_of(const std::vector<uint64_t>& numbers, uint64_t blocks) {
  std::vector<uint64_t> cells(blocks);
  size_t next = 0;
  bool ok = true;
  const auto get = [&] {
    ok = ok && next < numbers.size();
    return ok ? numbers[next++] : 0;
  };
  const auto add = [&](uint32_t block, uint64_t count) {
    cells.at(block) = count;
    return true;
  };
  if (!get_block_cells(
          blocks, get, [&] { return ok; }, add) ||
      next != numbers.size())
    return std::nullopt;
  return cells;
}

RC_GTEST_PROP(BlockCells, ComeBackWhateverBlocksAreEmpty, ()) {
  const auto count = rc::gen::weightedOneOf<uint64_t>(
      {{3, rc::gen::just(uint64_t{0})}, {2, rc::gen::inRange(uint64_t{1}, uint64_t{5000000000})}});
  const auto cells = *rc::gen::container<std::vector<uint64_t>>(count);
  std::vector<BlockCells> some;
  for (uint32_t b = 0; b < cells.size(); ++b) {
    if (cells[b] > 0) some.push_back({b, cells[b]});
  }
  RC_ASSERT(cells_of(numbers_of(some, cells.size()), cells.size()) == cells);
}

TEST(BlockCells, TakeTwoNumbersForAnyRunOfEmptyBlocks) {
  EXPECT_EQ(numbers_of({}, 1000), (std::vector<uint64_t>{0, 999}));
  EXPECT_EQ(numbers_of({{500, 7}}, 1000), (std::vector<uint64_t>{0, 499, 7, 0, 498}));
  EXPECT_EQ(numbers_of({{0, 7}}, 1), (std::vector<uint64_t>{7}));
  EXPECT_TRUE(numbers_of({}, 0).empty());
}

TEST(BlockCells, EndWhereMoreBlocksAreSkippedThanThereAre) {
  EXPECT_FALSE(cells_of({0, 3}, 3));
  EXPECT_FALSE(cells_of({5, 0, 2}, 3));
  EXPECT_FALSE(cells_of({0, UINT64_MAX}, 3));
  EXPECT_TRUE(cells_of({5, 0, 1}, 3));
}

TEST(BlockCells, EndWhereTheNumbersDo) {
  EXPECT_FALSE(cells_of({}, 3));
  EXPECT_FALSE(cells_of({5}, 3));
  EXPECT_FALSE(cells_of({5, 0}, 3));
}

}  // namespace
}  // namespace maille
