#include <map>

#include "volume/cells/cell_coder.h"
#include "volume/order/gate_order.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

/// Cells of a soup as the coder takes them, in any order, with the ends of their points. Not those given by
/// faces, which no gated stream has.
std::vector<StreamedCell> cells_of(const Mesh& mesh, std::vector<uint32_t> order) {
  std::erase_if(order, [&](uint32_t i) { return kind_of(mesh.blocks[0].type_of(i)) == face_cell; });
  std::vector<uint32_t> last(mesh.point_count());
  for (size_t i = 0; i < order.size(); ++i) {
    for (const uint32_t point : mesh.blocks[0].cell(order[i])) last[point] = static_cast<uint32_t>(i);
  }
  std::vector<StreamedCell> cells;
  for (size_t i = 0; i < order.size(); ++i) {
    const auto nodes = mesh.blocks[0].cell(order[i]);
    StreamedCell cell;
    cell.type = mesh.blocks[0].type_of(order[i]);
    cell.kind = kind_of(cell.type);
    cell.numbers.assign(nodes.begin(), nodes.end());
    for (const uint32_t node : nodes) cell.finals.push_back(last[node] == i);
    for (size_t k = 0; k < nodes.size() && cell.kind < shape_count; ++k) {
      const unsigned place = cell_shapes[cell.kind].place[k];
      cell.number[k] = nodes[place];
      const auto before = cell.number.begin() + static_cast<ptrdiff_t>(k);
      const bool again = std::find(cell.number.begin(), before, nodes[place]) != before;
      cell.final |= (last[nodes[place]] == i && !again ? 1u : 0u) << k;
    }
    cells.push_back(cell);
  }
  return cells;
}

struct Coded {
  std::vector<std::byte> topology, numbers;
};

Coded coded(const std::vector<StreamedCell>& cells, const std::vector<uint8_t>& borders) {
  CellCoder<RangeEncoder> coder(Mixing::none, false);
  coder.use_gates(&borders);
  RangeEncoder topology, numbers;
  CodedCells out;
  for (size_t i = 0; i < cells.size(); ++i) {
    StreamedCell cell = cells[i];
    EXPECT_TRUE(coder.code(topology, numbers, cell, out));
    if (i % 64 == 63) {
      out.clear();
      coder.end_block();
    }
  }
  return {topology.finish(), numbers.finish()};
}

/// Whether the same cells come back, with points by any names.
void expect_back(const std::vector<StreamedCell>& cells, const Coded& bytes) {
  RangeDecoder topology{Bytes(bytes.topology)}, numbers{Bytes(bytes.numbers)};
  CellCoder<RangeDecoder> coder(Mixing::none, false);
  coder.use_gates(nullptr);
  CodedCells out;
  StreamedCell cell;
  std::map<uint64_t, uint64_t> names;
  const auto same_point = [&](uint64_t back, uint64_t given) {
    return names.emplace(back, given).first->second == given;
  };
  for (size_t i = 0; i < cells.size(); ++i) {
    RC_ASSERT(coder.code(topology, numbers, cell, out));
    RC_ASSERT(cell.kind == cells[i].kind);
    if (cell.kind < shape_count) {
      for (unsigned k = 0; k < cell_shapes[cell.kind].nodes; ++k)
        RC_ASSERT(same_point(cell.number[k], cells[i].number[k]));
      RC_ASSERT(cell.final == cells[i].final);
    } else {
      RC_ASSERT(cell.numbers.size() == cells[i].numbers.size());
      for (size_t k = 0; k < cell.numbers.size(); ++k)
        RC_ASSERT(same_point(cell.numbers[k], cells[i].numbers[k]));
    }
    if (i % 64 != 63) continue;
    out.clear();
    coder.end_block();
  }
}

RC_GTEST_PROP(CellsAtGates, ComeBackFromAnySoupInAnyOrderWithAnyBorders, ()) {
  const Mesh mesh =
      soup(*rc::gen::arbitrary<unsigned>(), *rc::gen::inRange(1u, 300u), *rc::gen::inRange(1u, 90u));
  std::vector<uint32_t> order(mesh.blocks[0].size());
  std::iota(order.begin(), order.end(), 0u);
  if (*rc::gen::arbitrary<bool>()) order = shuffled(order.size(), *rc::gen::arbitrary<unsigned>());
  const std::vector<StreamedCell> cells = cells_of(mesh, order);
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  const unsigned some = *rc::gen::inRange(0u, 64u);
  std::vector<uint8_t> borders(cells.size());
  for (uint8_t& border : borders) border = static_cast<uint8_t>(random() & some);
  expect_back(cells, coded(cells, borders));
}

/// A tetrahedron that stays, whose gate waits for ever, and others that come and go at points of their own.
TEST(CellsAtGates, AreNotHeldWhenTheyAreClosed) {
  Hull hull;
  Gates gates;
  const unsigned tetrahedron = kind_of(CellType::tetrahedron);
  for (uint32_t ordinal = 1; ordinal <= 100000; ++ordinal) {
    std::array<uint32_t, most_corners> corner{};
    for (unsigned i = 0; i < 4; ++i) gates.enter_point(hull, corner[i] = hull.add_point(ordinal));
    const uint32_t slot = hull.add_cell(tetrahedron, corner.data(), 0, ordinal);
    gates.enter(hull, slot, {}, 0, 15);
    if (ordinal == 1) continue;
    EXPECT_NE(gates.next(hull).cell, no_slot);
    for (unsigned i = 0; i < 4; ++i) hull.remove_point(corner[i]);
    hull.free_points();
  }
  EXPECT_LT(gates.held(), 100000u);
}

TEST(CellsAtGates, OfAnyBytesDecodeOrAreRefused) {
  std::mt19937 random(1);
  for (unsigned round = 0; round < 400; ++round) {
    std::vector<std::byte> topology(200), numbers(100);
    for (std::byte& byte : topology) byte = static_cast<std::byte>(random() >> (round % 3 == 0 ? 6 : 0));
    RangeDecoder cells{Bytes(topology)}, names{Bytes(numbers)};
    CellCoder<RangeDecoder> coder(Mixing::none, false);
    coder.use_gates(nullptr);
    CodedCells out;
    StreamedCell cell;
    for (unsigned i = 0; i < 5000; ++i) {
      if (!coder.code(cells, names, cell, out) || cells.exhausted()) break;
      if (i % 64 == 63) {
        out.clear();
        coder.end_block();
      }
    }
  }
}

TEST(CellsAtGates, OfDamagedMeshesDecodeOrAreRefused) {
  const Mesh mesh = soup(11, 400, 90);
  const std::vector<StreamedCell> cells = cells_of(mesh, shuffled(mesh.blocks[0].size(), 3));
  const Coded right = coded(cells, std::vector<uint8_t>(cells.size(), 5));
  std::mt19937 random(2);
  for (unsigned round = 0; round < 600; ++round) {
    std::vector<std::byte> topology = right.topology;
    topology[random() % topology.size()] ^= static_cast<std::byte>(1u << random() % 8);
    RangeDecoder decoder{Bytes(topology)}, names{Bytes(right.numbers)};
    CellCoder<RangeDecoder> coder(Mixing::none, false);
    coder.use_gates(nullptr);
    StreamedCell cell;
    CodedCells out;
    for (unsigned i = 0; i < 1000; ++i) {
      if (!coder.code(decoder, names, cell, out) || decoder.exhausted()) break;
    }
  }
}

TEST(CellsAtGates, AreHowTheFastLevelsWriteScatteredSolids) {
  const Mesh mesh = scattered_grid(12, 3);
  for (const int effort : {1, 2, 3}) {
    EncodeOptions options = kept(effort);
    options.order = Order::canonical;
    const std::vector<std::byte> bytes = encoded(mesh, options);
    const auto back = decode(*memory_source(Bytes(bytes)));
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_TRUE(compare(mesh, *back).equal);
    expect_round_trip(mesh, effort);
  }
}

TEST(CellsAtGates, TakeLittleMoreThanTheirTurns) {
  Mesh mesh = scattered_grid(20, 1);
  mesh.arrays.clear();
  std::vector<std::byte> bytes;
  EncodeOptions options = kept(1);
  options.order = Order::canonical;
  const auto report = encode(mesh, *memory_sink(bytes), options);
  ASSERT_TRUE(report);
  EXPECT_LT(report->connectivity.coded_bytes * 8, mesh.cell_count() / 4);
}

TEST(GateOrder, HasEachCellOnceAndTheFacesOfOneCellAsBorders) {
  const Mesh mesh = scattered_grid(5, 2);
  const GateOrder found = gate_order(mesh, false);
  ASSERT_EQ(found.cells.size(), 1u);
  std::vector<uint64_t> cells = found.cells[0];
  std::sort(cells.begin(), cells.end());
  for (size_t i = 0; i < cells.size(); ++i) EXPECT_EQ(cells[i], i);
  unsigned borders = 0;
  for (const uint8_t border : found.borders) borders += bits_in(border);
  EXPECT_EQ(cells.size(), 125u);
  EXPECT_EQ(borders, 6u * 25u);
}

}  // namespace
}  // namespace maille
