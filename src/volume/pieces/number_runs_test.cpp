#include "volume/pieces/number_runs.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>

#include "entropy/rans.h"
#include "support/cases.h"
#include "volume/pieces/border_points.h"
#include "volume/pieces/piece_layout.h"

namespace maille {
namespace {

void expect_round_trip(const PieceNumbers& numbers) {
  const std::vector<std::byte> bytes = encode_numbers(numbers);
  const auto decoded = decode_numbers(bytes, numbers.cells.size(), numbers.points.size());
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->cells, numbers.cells);
  EXPECT_EQ(decoded->points, numbers.points);
}

/// A box out of a lattice whose rows have `row` and layers `layer` points.
std::vector<uint32_t> box_of_lattice(uint32_t side, uint32_t row, uint32_t layer) {
  std::vector<uint32_t> numbers;
  for (uint32_t z = 0; z < side; ++z) {
    for (uint32_t y = 0; y < side; ++y) {
      for (uint32_t x = 0; x < side; ++x) numbers.push_back(1000 + z * layer + y * row + x);
    }
  }
  return numbers;
}

TEST(NumberRuns, ComeBackWhateverTheyAre) {
  std::mt19937 generator(1);
  const auto random = [&] { return static_cast<uint32_t>(generator()); };  // of 64 bits in libstdc++
  for (unsigned i = 0; i < testing::cases(200); ++i) {
    PieceNumbers numbers;
    for (std::vector<uint32_t>* list : {&numbers.cells, &numbers.points}) {
      const uint32_t width = 1 + random() % 9, period = 1 + random() % 5;
      uint32_t next = random() % 2 == 0 ? 0 : random() % 1000;
      for (uint32_t run = random() % 50; run > 0; --run) {
        const uint32_t length = 1 + (i % 2 == 0 ? random() % width : run % period);
        for (uint32_t k = 0; k < length; ++k) list->push_back(next++);
        next += 1 + (i % 3 == 0 ? random() % 100000 : run % period);
      }
    }
    expect_round_trip(numbers);
  }
  expect_round_trip({});
  expect_round_trip({{0}, {0xfffffffe}});
  expect_round_trip({{0xfffffffd, 0xfffffffe}, {0, 0xfffffffe}});
}

TEST(NumberRuns, OfABoxOfALatticeTakeHardlyAnyRoom) {
  const PieceNumbers numbers = {box_of_lattice(40, 100, 10000), box_of_lattice(41, 101, 10201)};
  expect_round_trip(numbers);
  EXPECT_LT(encode_numbers(numbers).size(), 600u);
}

TEST(NumberRuns, AreRefusedWhereTheyAreNotSoMany) {
  const PieceNumbers numbers = {box_of_lattice(5, 10, 100), box_of_lattice(6, 11, 121)};
  const std::vector<std::byte> bytes = encode_numbers(numbers);
  EXPECT_FALSE(decode_numbers(bytes, 124, 216));
  EXPECT_FALSE(decode_numbers(bytes, 0xffffffff, 216));
  EXPECT_FALSE(decode_numbers({}, 125, 216));
}

TEST(NumberRuns, OfDamagedBytesAreAsManyAsAskedForOrRefused) {
  std::mt19937 random(2);
  const PieceNumbers numbers = {box_of_lattice(9, 30, 700), box_of_lattice(10, 31, 731)};
  const std::vector<std::byte> bytes = encode_numbers(numbers);
  for (unsigned i = 0; i < testing::cases(2000); ++i) {
    std::vector<std::byte> damaged = bytes;
    for (unsigned k = 0; k < 3; ++k) damaged[random() % damaged.size()] = static_cast<std::byte>(random());
    damaged.resize(damaged.size() - random() % 4);
    const auto found = decode_numbers(damaged, numbers.cells.size(), numbers.points.size());
    if (!found) continue;
    ASSERT_EQ(found->cells.size(), numbers.cells.size());
    for (size_t k = 1; k < found->cells.size(); ++k) ASSERT_GE(found->cells[k], found->cells[k - 1]);
  }
}

TEST(OnSides, AreThoseOfTheBoxAroundAllNumbers) {
  Array positions = make_array("", Domain::point, Scalar::f32, 3);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> numbers = {nan, 1, 1, 0, 1, 1, 1, 1, 1, 2, 2, 2, 1, 0, 1, 1, 1, 0};
  positions.resize(6);
  std::memcpy(positions.bytes.data(), numbers.data(), positions.bytes.size());
  const std::vector<uint32_t> points = {0, 1, 2, 3, 4, 5};
  EXPECT_EQ(on_sides(positions, points), (std::vector<uint8_t>{0, 1, 0, 1, 1, 1}));
}

}  // namespace
}  // namespace maille
