#include <algorithm>

#include "container/file_reader.h"
#include "support/cases.h"
#include "volume/cells/cell_coder.h"
#include "volume/stream/stream_layout.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

/// The cells of a mesh as a stream of their numbers, and what the decoder makes of it.
struct IndexedCells {
  std::vector<std::byte> cells, numbers;
  CodedCells out;

  explicit IndexedCells(const Mesh& mesh, Mixing mixing = Mixing::most) {
    CellCoder<RangeEncoder> coder(mixing, true, true);
    RangeEncoder topology, others;
    each_cell(mesh, [&](StreamedCell& cell) { coder.code(topology, others, cell, out); });
    cells = topology.finish();
    numbers = others.finish();
  }

  template <class Visit>
  static void each_cell(const Mesh& mesh, Visit visit) {
    std::vector<uint64_t> last(mesh.point_count());
    uint64_t time = 0;
    for (const CellBlock& block : mesh.blocks) {
      for (uint64_t i = 0; i < block.size(); ++i, ++time) {
        for (const uint32_t point : block.cell(i)) last[point] = time;
      }
    }
    time = 0;
    StreamedCell cell;
    for (const CellBlock& block : mesh.blocks) {
      for (uint64_t i = 0; i < block.size(); ++i, ++time) {
        cell.kind = kind_of(block.type_of(i));
        cell.type = block.type_of(i);
        cell.numbers.assign(block.cell(i).begin(), block.cell(i).end());
        cell.finals.assign(cell.numbers.size(), 0);
        cell.final = 0;
        for (size_t k = 0; k < cell.numbers.size(); ++k) {
          cell.finals[k] = last[cell.numbers[k]] == time;
          if (cell.kind >= shape_count) continue;
          cell.number[k] = cell.numbers[cell_shapes[cell.kind].place[k]];
          cell.final |= (last[cell.number[k]] == time ? 1u : 0u) << k;
        }
        visit(cell);
      }
    }
  }

  void expect_back(const Mesh& mesh, Mixing mixing = Mixing::most) const {
    CellCoder<RangeDecoder> coder(mixing, true, true);
    RangeDecoder topology(cells), others(numbers);
    CodedCells back;
    StreamedCell found;
    each_cell(mesh, [&](StreamedCell& cell) {
      ASSERT_TRUE(coder.code(topology, others, found, back));
      ASSERT_EQ(found.kind, cell.kind);
      const size_t nodes = cell.kind < shape_count ? cell_shapes[cell.kind].nodes : 0;
      for (size_t k = 0; k < nodes; ++k) ASSERT_EQ(found.number[k], cell.number[k]);
      if (nodes == 0) {
        ASSERT_EQ(found.numbers, cell.numbers);
      }
    });
    // What the values are predicted from is the same on both sides.
    EXPECT_EQ(back.nodes, out.nodes);
    EXPECT_EQ(back.across, out.across);
    EXPECT_EQ(back.removed, out.removed);
  }
};

/// Hexahedra that share points and no faces: seven rows of points without any order, taken in turn.
Mesh leaping_cells() {
  constexpr uint32_t cells = 3000, rows = 7;
  const std::vector<uint32_t> apart = shuffled(4000, 8);
  Mesh mesh;
  set_positions(mesh, std::vector<float>(3 * (cells + apart.size()), 0.5f));
  CellBlock block;
  block.type = CellType::hexahedron;
  for (uint32_t i = 0; i < cells; ++i) {
    for (uint32_t k = 0; k < 8; ++k) block.connectivity.push_back(i + apart[i % rows * 8 + k]);
  }
  mesh.blocks.push_back(std::move(block));
  return mesh;
}

TEST(IndexCoder, AnyCellsComeBackWithTheSameNeighbours) {
  for (unsigned seed = 0; seed < cases(20); ++seed) {
    const Mesh mesh = soup(seed, 300, 120);
    for (const Mixing mixing : {Mixing::none, Mixing::some, Mixing::most})
      IndexedCells(mesh, mixing).expect_back(mesh, mixing);
  }
}

TEST(IndexCoder, ASweepCostsNextToNothing) {
  const Mesh mesh = grid(40, 40, 20);
  const IndexedCells coded(mesh);
  coded.expect_back(mesh);
  EXPECT_LT(coded.cells.size(), 500u);
  EXPECT_LT(coded.numbers.size(), 20u);
}

TEST(IndexCoder, DamagedCellsAreRefusedOrOthers) {
  const Mesh mesh = soup(5, 200, 80);
  const IndexedCells coded(mesh);
  for (size_t cut = 0; cut < coded.cells.size(); cut += every(7)) {
    std::vector<std::byte> damaged = coded.cells;
    damaged[cut] ^= std::byte{0x5a};
    CellCoder<RangeDecoder> coder(Mixing::most, true, true);
    RangeDecoder topology(damaged), others(coded.numbers);
    CodedCells back;
    StreamedCell cell;
    unsigned cells = 0;
    while (cells < 2000 && coder.code(topology, others, cell, back) && !topology.exhausted() &&
           !others.exhausted()) {
      ++cells;
      if (back.size() < cells_per_block) continue;
      back.clear();
      coder.end_block();
    }
    EXPECT_LE(cells, 2000u);
  }
}

StreamHeader header_of(const std::vector<std::byte>& file) {
  const auto source = memory_source(Bytes(file));
  return *decode_header(*FileReader::open(*source)->read_stream({"DESC", 0, 0}));
}
bool is_indexed(const std::vector<std::byte>& file) {
  return header_of(file).indexed;
}

TEST(IndexCoder, TheWriterTakesItWhereTheNumbersFollowASimplerRuleThanTheCells) {
  const Mesh leaping = leaping_cells();
  const std::vector<std::byte> bytes = encoded(leaping, kept());
  EXPECT_TRUE(is_indexed(bytes));
  expect_round_trip(leaping);
  EncodeOptions any = kept();
  any.order = Order::canonical;
  EXPECT_FALSE(is_indexed(encoded(leaping, any)));
  EXPECT_FALSE(is_indexed(encoded(scattered_grid(12, 1), kept())));
}

TEST(IndexCoder, ADescriptionOfIndicesWithoutNumbersIsRefused) {
  StreamHeader header = header_of(encoded(leaping_cells(), kept()));
  ASSERT_TRUE(header.indexed);
  EXPECT_TRUE(decode_header(*encode_header(header)));
  header.description.any_order = true;
  EXPECT_FALSE(decode_header(*encode_header(header)));
}

}  // namespace
}  // namespace maille
