#include "volume/order/mesh_order.h"

#include "volume/order/cell_order.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

TEST(MeshOrder, IsApartForScatteredCellsOnly) {
  EXPECT_TRUE(is_apart(encoded(scattered_grid(12, 3), kept())));
  EXPECT_FALSE(is_apart(encoded(grid(12, 12, 12), kept())));
}

TEST(MeshOrder, IsNotLostOnReadersOfPieces) {
  const std::vector<std::byte> bytes = encoded(scattered_grid(12, 3), kept());
  const auto source = memory_source(Bytes(bytes));
  const auto reader = StreamReader::open(source_stream(*source));
  ASSERT_FALSE(reader);
  EXPECT_EQ(reader.error().code, ErrorCode::unsupported);
}

TEST(MeshOrder, GivesScatteredCellsBackWhereTheyWere) {
  for (const unsigned n : {2u, 5u, 12u}) {
    expect_round_trip(scattered_grid(n, n));
    expect_round_trip(scattered_grid(n, n), 1);
  }
}

TEST(MeshOrder, CostsLittleMoreThanThePermutations) {
  const Mesh mesh = scattered_grid(20, 1);
  std::vector<std::byte> bytes;
  const auto report = encode(mesh, *memory_sink(bytes), kept());
  ASSERT_TRUE(report);
  const double cells = static_cast<double>(mesh.cell_count());
  // log2(8000!) / 8000 is 11.5.
  EXPECT_LT(static_cast<double>(report->connectivity.coded_bytes) * 8 / cells, 12.5);
  EXPECT_LT(static_cast<double>(report->order_bytes) * 8 / cells, 14.5);
}

TEST(MeshOrder, FollowsPointsThatCellsGoAlong) {
  Mesh mesh = scattered_grid(20, 1);
  CellBlock& block = mesh.blocks[0];
  std::vector<std::array<uint32_t, 8>> cells(block.size());
  for (size_t i = 0; i < cells.size(); ++i)
    std::copy_n(block.connectivity.begin() + static_cast<ptrdiff_t>(8 * i), 8, cells[i].begin());
  std::sort(cells.begin(), cells.end(), [](const auto& a, const auto& b) { return a[3] < b[3]; });
  for (size_t i = 0; i < cells.size(); ++i)
    std::copy_n(cells[i].begin(), 8, block.connectivity.begin() + static_cast<ptrdiff_t>(8 * i));
  std::vector<std::byte> bytes;
  const auto report = encode(mesh, *memory_sink(bytes), kept());
  ASSERT_TRUE(report);
  EXPECT_LT(static_cast<double>(report->connectivity.coded_bytes) * 8, 4 * static_cast<double>(cells.size()));
  expect_round_trip(mesh);
}

Mesh soup_of_shapes(unsigned seed, unsigned cells, unsigned points) {
  Mesh mesh = soup(seed, cells, points);
  CellBlock some;
  some.type = CellType::mixed;
  some.offsets.push_back(0);
  for (uint64_t i = 0; i < mesh.blocks[0].size(); ++i) {
    if (kind_of(mesh.blocks[0].type_of(i)) >= shape_count) continue;
    const auto nodes = mesh.blocks[0].cell(i);
    some.connectivity.insert(some.connectivity.end(), nodes.begin(), nodes.end());
    some.offsets.push_back(some.connectivity.size());
    some.types.push_back(mesh.blocks[0].types[i]);
  }
  mesh.blocks[0] = some;
  return mesh;
}

/// The mesh as a stream would give it back: cells in that order, points numbered as they come up.
Mesh in_coded_order(const Mesh& mesh, const CellOrders& orders) {
  Mesh coded = mesh;
  CellBlock& block = coded.blocks[0];
  block.connectivity.clear();
  std::vector<uint32_t> number(mesh.point_count(), 0xffffffff);
  std::vector<uint32_t> from;
  for (size_t i = 0; i < orders[0].size(); ++i) {
    const auto nodes = mesh.blocks[0].cell(orders[0][i]);
    block.types[i] = mesh.blocks[0].types[orders[0][i]];
    const CellShape& shape = cell_shapes[kind_of(block.type_of(i))];
    for (unsigned k = 0; k < shape.nodes; ++k) {
      uint32_t& of = number[nodes[shape.place[k]]];
      if (of != 0xffffffff) continue;
      of = static_cast<uint32_t>(from.size());
      from.push_back(nodes[shape.place[k]]);
    }
    for (const uint32_t node : nodes) block.connectivity.push_back(number[node]);
    block.offsets[i + 1] = block.connectivity.size();
  }
  for (uint32_t point = 0; point < number.size(); ++point) {
    if (number[point] == 0xffffffff) from.push_back(point);
  }
  for (size_t i = 0; i < from.size(); ++i)
    std::copy_n(mesh.points.bytes.data() + size_t{12} * from[i], 12, coded.points.bytes.data() + 12 * i);
  return coded;
}

CodedOrder encoded_order(const Mesh& mesh, const CellOrders& orders, bool plain) {
  const CellTurns turns(mesh.blocks.size());
  return plain ? encode_plain_order(mesh, orders, turns, false)
               : encode_order(mesh, orders, turns, Mixing::mixed, false);
}

RC_GTEST_PROP(MeshOrder, GivesAnySoupOfShapesBackFromAnyOrder, ()) {
  const Mesh mesh = soup_of_shapes(*rc::gen::arbitrary<unsigned>(), *rc::gen::inRange(1u, 200u),
                                   *rc::gen::inRange(1u, 90u));
  const std::vector<uint32_t> order = shuffled(mesh.blocks[0].size(), *rc::gen::arbitrary<unsigned>());
  const CellOrders orders = {{order.begin(), order.end()}};
  const bool plain = *rc::gen::arbitrary<bool>();
  const CodedOrder bytes = encoded_order(mesh, orders, plain);
  Mesh back = in_coded_order(mesh, orders);
  const auto joined = split_order(join_order(bytes));
  RC_ASSERT(joined.has_value());
  RC_ASSERT(restore_order(back, *joined));
  RC_ASSERT(back.blocks[0].connectivity == mesh.blocks[0].connectivity);
  RC_ASSERT(back.blocks[0].types == mesh.blocks[0].types);
  RC_ASSERT(back.points.bytes == mesh.points.bytes);
}

RC_GTEST_PROP(MeshOrder, MakesSomeOrderOrNoneOfDamagedBytes, ()) {
  const Mesh mesh = soup_of_shapes(*rc::gen::arbitrary<unsigned>(), 60, 40);
  const std::vector<uint32_t> order = shuffled(mesh.blocks[0].size(), 1);
  const CellOrders orders = {{order.begin(), order.end()}};
  const bool plain = *rc::gen::arbitrary<bool>();
  CodedOrder bytes = encoded_order(mesh, orders, plain);
  for (auto* part : {&bytes.points, &bytes.cells}) {
    if (part->empty()) continue;
    (*part)[*rc::gen::inRange<size_t>(0, part->size())] ^= static_cast<std::byte>(*rc::gen::inRange(1, 256));
    if (*rc::gen::arbitrary<bool>()) part->resize(*rc::gen::inRange<size_t>(0, part->size()));
  }
  Mesh back = in_coded_order(mesh, orders);
  if (restore_order(back, bytes)) RC_ASSERT(validate(back).has_value());
}

TEST(MeshOrder, CellsWithOneFaceAreNeighboursInPairs) {
  CellBlock block;
  block.type = CellType::tetrahedron;
  block.connectivity = {0, 1, 2, 3, 0, 2, 1, 4, 1, 0, 2, 5};  // the last face of each is that of 0, 1 and 2
  const Neighbours found = neighbours_of(block);
  EXPECT_EQ(found[0][3], 1u);
  EXPECT_EQ(found[1][3], 0u);
  EXPECT_EQ(found[2][3], no_cell);
}

}  // namespace
}  // namespace maille
