#include "description/element_order.h"

#include <gtest/gtest.h>

#include <numeric>

#include "support/half_edges.h"

namespace maille::testing {
namespace {

std::vector<uint32_t> random_permutation(Random& random, uint32_t count) {
  std::vector<uint32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0u);
  shuffle(numbers, random);
  return numbers;
}

ElementOrder random_order(Random& random, uint32_t points, uint32_t cells) {
  ElementOrder order{random_permutation(random, points), random_permutation(random, cells), {}};
  for (uint32_t i = 0; i < cells; ++i)
    order.rotation.push_back(random.chance(80) ? random.below(4) : random.below(70000));
  return order;
}

void expect_same(const ElementOrder& a, const ElementOrder& b) {
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.cells, b.cells);
  EXPECT_EQ(a.rotation, b.rotation);
}

TEST(ElementOrder, AnyPermutationsComeBack) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    Random random(seed);
    const ElementOrder order = random_order(random, random.below(300), random.below(300));
    const auto points = static_cast<uint32_t>(order.points.size());
    const auto cells = static_cast<uint32_t>(order.cells.size());
    const auto decoded = decode_order(encode_order(order), points, cells);
    ASSERT_TRUE(decoded) << seed << decoded.error().message;
    expect_same(*decoded, order);
  }
}

TEST(ElementOrder, TheSameOrderCostsNextToNothing) {
  ElementOrder order;
  order.points.resize(50000);
  std::iota(order.points.begin(), order.points.end(), 0u);
  order.cells = order.points;
  order.rotation.resize(50000);
  EXPECT_LT(encode_order(order).size(), 200u);
}

TEST(ElementOrder, EveryTruncationIsCorrupt) {
  Random random(1);
  const auto bytes = encode_order(random_order(random, 100, 80));
  for (size_t size = 0; size < bytes.size(); ++size) {
    const auto decoded = decode_order(Bytes(bytes).first(size), 100, 80);
    ASSERT_FALSE(decoded) << size;
    EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
  }
}

TEST(ElementOrder, NumbersThatAreNoPermutationAreCorrupt) {
  for (const std::vector<uint32_t>& points : {std::vector<uint32_t>{0, 0, 1}, {0, 1, 3}, {0, 1, none}}) {
    const auto decoded = decode_order(encode_order({points, {0}, {0}}), 3, 1);
    ASSERT_FALSE(decoded);
    EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
  }
}

TEST(ElementOrder, AnyBytesArePermutationsOrCorrupt) {
  Random random(2);
  const auto bytes = encode_order(random_order(random, 20, 20));
  for (uint64_t seed = 0; seed < 3000; ++seed) {
    Random flips(seed);
    const auto decoded = decode_order(damaged(bytes, flips), 20, 20);
    if (!decoded) continue;
    auto points = decoded->points;
    std::sort(points.begin(), points.end());
    for (uint32_t i = 0; i < 20; ++i) ASSERT_EQ(points[i], i);
  }
}

/// Two triangles and a quad in one block, named by their first point, with a number per point, cell and
/// corner.
Mesh numbered() {
  Surface surface;
  surface.points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}};
  surface.faces = {{0, 1, 2}, {2, 3, 4}, {4, 3, 1, 0}};
  Mesh mesh = to_mesh(surface);
  for (const Domain domain : {Domain::point, Domain::cell, Domain::corner}) {
    Array array = make_array(name_of(domain), domain, Scalar::u8, 1);
    array.resize(mesh.count_of(domain));
    for (size_t i = 0; i < array.bytes.size(); ++i) array.bytes[i] = static_cast<std::byte>(i);
    mesh.arrays.push_back(std::move(array));
  }
  return mesh;
}

std::vector<int> numbers_of(const Mesh& mesh, Domain domain) {
  std::vector<int> numbers;
  for (const std::byte byte : mesh.find(name_of(domain), domain)->bytes)
    numbers.push_back(static_cast<int>(byte));
  return numbers;
}

TEST(RestoreOrder, MovesPointsCellsCornersAndTheirArrays) {
  // Decoded cell 0 was cell 2, whose corner 1 it starts with; and so on.
  const ElementOrder order{{4, 3, 2, 1, 0}, {1, 2, 0}, {0, 1, 3}};
  const auto restored = restore_order(numbered(), order);
  ASSERT_TRUE(restored) << restored.error().message;
  EXPECT_TRUE(validate(*restored));
  const CellBlock& block = restored->blocks[0];
  EXPECT_EQ(block.offsets, (std::vector<uint64_t>{0, 4, 7, 10}));
  // Cell 0 is the quad 4 3 1 0, renamed to 0 1 3 4; what is its first corner was the one at place 3.
  EXPECT_EQ(block.connectivity, (std::vector<uint32_t>{1, 3, 4, 0, 4, 3, 2, 0, 2, 1}));
  EXPECT_EQ(restored->points.values<float>()[0], 4);
  EXPECT_EQ(numbers_of(*restored, Domain::point), (std::vector<int>{4, 3, 2, 1, 0}));
  EXPECT_EQ(numbers_of(*restored, Domain::cell), (std::vector<int>{2, 0, 1}));
  EXPECT_EQ(numbers_of(*restored, Domain::corner), (std::vector<int>{7, 8, 9, 6, 0, 1, 2, 5, 3, 4}));
}

TEST(RestoreOrder, RefusesWhatDoesNotFit) {
  const std::vector<uint32_t> points = {0, 1, 2, 3, 4};
  EXPECT_FALSE(restore_order(numbered(), {points, {0, 1, 2}, {3, 0, 0}}));  // turned too far
  EXPECT_TRUE(restore_order(numbered(), {points, {0, 1, 2}, {0, 0, 3}}));
  Mesh two_blocks = numbered();
  two_blocks.arrays.clear();
  two_blocks.blocks.push_back(two_blocks.blocks[0]);
  const auto moved = restore_order(two_blocks, {points, {0, 1, 3, 2, 4, 5}, std::vector<uint32_t>(6)});
  ASSERT_FALSE(moved);  // out of its block
  EXPECT_EQ(moved.error().code, ErrorCode::corrupt);
}

}  // namespace
}  // namespace maille::testing
