#include <maille/out_of_core.h>

#include <algorithm>
#include <random>
#include <thread>

#include "mesh/mesh_as_source.h"
#include "volume/pieces/bisection.h"
#include "volume/pieces/cut_rules.h"
#include "volume/pieces/number_cut.h"
#include "volume/pieces/packed_cells.h"
#include "volume/pieces/scratch_lists.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

EncodeOptions into_pieces(uint64_t cells, Order order, int effort = 2) {
  EncodeOptions options = kept(effort);
  options.order = order;
  options.most_cells_per_part = cells;
  return options;
}

/// So little that points go in many ranges, and pages are thrown out.
const WorkingSpace little = {.memory = 1, .limit = ~uint64_t{0}, .folder = {}};

std::vector<std::byte> encoded_from_parts(const Mesh& mesh, const EncodeOptions& options) {
  const auto source = mesh_as_source(mesh);
  std::vector<std::byte> bytes;
  const auto report = encode(*source, *memory_sink(bytes), options, little);
  EXPECT_TRUE(report) << report.error().message;
  EXPECT_EQ(report ? report->file_bytes : 0, bytes.size());
  return bytes;
}

class Threads final : public Executor {
 public:
  void parallel_for(size_t count, const std::function<void(size_t)>& work) override {
    std::vector<std::thread> threads;
    for (size_t i = 0; i < count; ++i) threads.emplace_back([&, i] { work(i); });
    for (std::thread& thread : threads) thread.join();
  }
};

Mesh blocks_with_arrays() {
  Mesh mesh = grid(17, 12, 15);
  CellBlock sides;
  sides.name = "sides";
  sides.type = CellType::quad;
  for (uint32_t i = 0; i < 40; ++i)
    sides.connectivity.insert(sides.connectivity.end(), {i, i + 1, i + 19, i + 18});
  CellBlock empty;
  empty.name = "empty";
  empty.type = CellType::wedge;
  mesh.blocks = {empty, mesh.blocks[0], sides, empty};
  add_arrays(mesh, 3);
  return mesh;
}

TEST(PiecesOutOfCore, AreTheBytesOfTheMeshInMemory) {
  const Mesh mesh = blocks_with_arrays();
  for (const Order order : {Order::keep, Order::canonical}) {
    EncodeOptions options = into_pieces(200, order);
    EXPECT_EQ(encoded(mesh, options), encoded_from_parts(mesh, options));
    Threads threads;
    options.executor = &threads;
    EXPECT_EQ(encoded(mesh, options), encoded_from_parts(mesh, options));
  }
}

/// Slabs of it are the best pieces, and its cells come slab after slab.
Mesh bar() {
  Mesh mesh = grid(5, 6, 60);
  add_arrays(mesh, 3);
  return mesh;
}

TEST(PiecesOutOfCore, ByNumberAreTheBytesOfTheMeshInMemory) {
  const Mesh mesh = bar();
  for (const Order order : {Order::keep, Order::canonical}) {
    const EncodeOptions options = into_pieces(270, order);
    EXPECT_EQ(encoded(mesh, options), encoded_from_parts(mesh, options));
  }
}

TEST(NumberCut, KnowsThePieceOfEachCell) {
  for (const uint64_t cells : {1u, 7u, 100u, 1001u}) {
    for (uint64_t pieces = 1; pieces <= std::min<uint64_t>(cells, 50); ++pieces) {
      const NumberCut cut = {cells, pieces};
      EXPECT_EQ(cut.begin(0), 0u);
      EXPECT_EQ(cut.begin(pieces), cells);
      for (uint64_t cell = 0; cell < cells; ++cell) {
        const uint64_t piece = cut.piece_of(cell);
        EXPECT_TRUE(cut.begin(piece) <= cell && cell < cut.begin(piece + 1)) << cell << " of " << cells;
      }
    }
  }
}

/// Whether pieces are stretches of numbers.
bool is_by_number(const Mesh& mesh, uint64_t target, bool kept) {
  uint32_t next = 0;
  for (const auto& piece : cut_into_pieces(mesh, target, kept, serial_executor())) {
    for (const uint32_t cell : piece) {
      if (cell != next++) return false;
    }
  }
  return true;
}

TEST(NumberCut, IsTakenWhereItSharesNoMorePointsThanPlanes) {
  EXPECT_TRUE(is_by_number(bar(), 270, true));
  EXPECT_TRUE(is_by_number(bar(), 270, false));
  const Mesh cube = grid(24, 24, 24);
  EXPECT_FALSE(is_by_number(cube, 216, true));
  EXPECT_FALSE(is_by_number(cube, 216, false));
  EXPECT_FALSE(is_by_number(scattered_grid(12, 1), 216, true));
}

TEST(NumberCut, MayShareSomeMorePointsWhereTheOrderIsKept) {
  const MeshSize mesh = {.cells = 1000, .points = 1000};
  const LookedAt planes = {1000, 1050};
  EXPECT_TRUE(is_better({1000, 1050}, planes, mesh, false));
  EXPECT_FALSE(is_better({1000, 1060}, planes, mesh, false));
  EXPECT_TRUE(is_better({1000, 1060}, planes, mesh, true));
  EXPECT_FALSE(is_better({1000, 1100}, planes, mesh, true));
  EXPECT_FALSE(is_better({1000, 1060, 1}, planes, mesh, true)) << "faces apart from their solids";
  EXPECT_THAT(pieces_looked_at(16), ::testing::ElementsAre(0, 2, 4, 6, 8, 10, 12, 15));
  EXPECT_THAT(pieces_looked_at(1), ::testing::ElementsAre(0));
}

TEST(PiecesOutOfCore, LossyPositionsAreJoinedAsInMemory) {
  Mesh mesh = grid(12, 9, 10);
  EncodeOptions options = into_pieces(60, Order::keep);
  options.positions = {Tolerance::Kind::absolute, 0.001};
  EXPECT_EQ(encoded(mesh, options), encoded_from_parts(mesh, options));
  options.positions.value = 0.3;  // points fall together
  const auto bytes = encoded_from_parts(mesh, options);
  const auto back = decode(*memory_source(Bytes(bytes)));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->point_count(), mesh.point_count());
  EXPECT_EQ(back->blocks[0].connectivity, mesh.blocks[0].connectivity);
}

RC_GTEST_PROP(PiecesOutOfCore, AnyCellsOverAnyPointsComeBack, ()) {
  const auto seed = *rc::gen::arbitrary<unsigned>();
  const auto cells = *rc::gen::inRange(8u, 200u), points = *rc::gen::inRange(1u, 150u);
  Mesh mesh = soup(seed, cells, points);
  mesh.blocks[0].name = "any";
  add_arrays(mesh, seed);
  const auto bytes = encoded_from_parts(mesh, into_pieces(*rc::gen::inRange<uint64_t>(1, 80), Order::keep));
  const auto back = decode(*memory_source(Bytes(bytes)));
  RC_ASSERT(back.has_value());
  expect_same(mesh, *back);
}

TEST(PiecesOutOfCore, MeshesWithoutCellsOrPointsComeBack) {
  Mesh mesh;
  set_positions(mesh, {});
  for (unsigned points = 0; points < 3; ++points) {
    const auto bytes = encoded_from_parts(mesh, into_pieces(10, Order::keep));
    const auto back = decode(*memory_source(Bytes(bytes)));
    ASSERT_TRUE(back) << back.error().message;
    expect_same(mesh, *back);
    set_positions(mesh, std::vector<float>(size_t{points} * 3 + 3, 1.5f));
  }
}

TEST(PiecesOutOfCore, ALimitThatOnePieceExceedsIsRefusedBeforeTheWork) {
  const Mesh mesh = grid(40, 40, 40);
  const auto source = mesh_as_source(mesh);
  std::vector<std::byte> bytes;
  WorkingSpace space;
  space.limit = WorkingSpace::of_process + (1 << 20);
  const auto report = encode(*source, *memory_sink(bytes), into_pieces(50'000, Order::keep), space);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::memory_bound);
  EXPECT_TRUE(bytes.empty());
}

/// The middles of cells of a lattice, a little beside it.
std::vector<Middle> lattice(uint32_t side) {
  std::mt19937 random(3);
  std::vector<Middle> middles;
  const auto near = [&](uint32_t at) {
    return static_cast<float>(at) + 1e-4f * static_cast<float>(random() % 3);
  };
  for (uint32_t i = 0; i < side * side * side; ++i)
    middles.push_back({{near(i % side), near(i / side % side), near(i / side / side)}, i});
  return middles;
}

TEST(Bisection, TellsTheSamePieceOfEveryCellThatItWasMadeOf) {
  std::vector<Middle> middles = lattice(9);
  for (unsigned i = 0; i < 50; ++i) middles.push_back({{4, 4, 4}, static_cast<uint32_t>(middles.size())});
  const Bisection cuts = bisect(middles, {1, 1, 1}, 40, serial_executor());
  EXPECT_EQ(cuts.ends.size(), 40u);
  for (size_t piece = 0, i = 0; piece < cuts.ends.size(); ++piece) {
    for (; i < cuts.ends[piece]; ++i) EXPECT_EQ(cuts.piece_of(middles[cuts.places[i]]), piece);
  }
}

TEST(Bisection, OfASampleCutsALatticeBetweenItsLayers) {
  const std::vector<Middle> all = lattice(24);
  std::mt19937 random(5);
  std::vector<Middle> sample;
  for (const Middle& middle : all) {
    if (random() % 40 == 0) sample.push_back(middle);
  }
  const Bisection cuts = bisect(sample, {1, 1, 1}, 8, serial_executor());
  for (const Bisection::Cut& cut : cuts.cuts) {
    const float beside = cut.value - std::floor(cut.value);
    EXPECT_GT(beside, 0.001f);
    EXPECT_LT(beside, 0.999f);
  }
  std::vector<unsigned> sizes(cuts.ends.size());
  for (const Middle& middle : all) ++sizes[cuts.piece_of(middle)];
  EXPECT_GT(*std::min_element(sizes.begin(), sizes.end()), all.size() / 16);
  EXPECT_LT(*std::max_element(sizes.begin(), sizes.end()), all.size() / 5);
}

TEST(PackedCells, ComeBack) {
  std::mt19937 random(1);
  std::vector<PackedCell> cells;
  ByteWriter out;
  CellPacker packer;
  uint64_t number = 0;
  for (unsigned i = 0; i < 1000; ++i) {
    PackedCell cell;
    number += random() % 3 == 0 ? 1 + random() % 1000 : 1;
    cell.number = number;
    cell.block = i / 300;
    cell.type = static_cast<uint8_t>(random() % 2);
    cell.nodes.resize(random() % 9);
    for (uint64_t& node : cell.nodes) node = random() % 2 == 0 ? i : uint64_t{random()} << random() % 32;
    cell.faces.resize(random() % 3);
    for (uint32_t& size : cell.faces) size = static_cast<uint32_t>(random());
    packer.pack(cell.number, cell.block, cell.type, cell.nodes, cell.faces, out);
    cells.push_back(cell);
  }
  ByteReader in(out.bytes());
  CellUnpacker unpacker;
  for (const PackedCell& cell : cells) {
    const PackedCell& back = unpacker.unpack(in);
    EXPECT_EQ(back.number, cell.number);
    EXPECT_EQ(back.block, cell.block);
    EXPECT_EQ(back.type, cell.type);
    EXPECT_EQ(back.nodes, cell.nodes);
    EXPECT_EQ(back.faces, cell.faces);
  }
  EXPECT_TRUE(in.ok());
  EXPECT_EQ(in.remaining(), 0u);
}

TEST(ScratchLists, GrowSideBySideAndComeBackWholeOrInParts) {
  auto lists = ScratchLists::create({}, 7, 1);
  ASSERT_TRUE(lists);
  std::mt19937 random(2);
  std::vector<std::vector<uint32_t>> numbers(7);
  std::vector<RisingWriter> writers;
  for (size_t i = 0; i < 7; ++i) writers.emplace_back(*lists, i, 1 + random() % 2000);
  for (unsigned i = 0; i < 20000; ++i) {
    const size_t list = random() % 6;  // the last one stays empty
    const uint32_t next = numbers[list].empty() ? 0 : numbers[list].back() + 1;
    numbers[list].push_back(next + static_cast<uint32_t>(random() % (random() % 50 == 0 ? 100000 : 3)));
    ASSERT_TRUE(writers[list].add(numbers[list].back()));
  }
  for (RisingWriter& writer : writers) ASSERT_TRUE(writer.finish());
  for (size_t i = 0; i < 7; ++i) EXPECT_EQ(*read_rising(*lists, i), numbers[i]);
  ASSERT_TRUE(lists->finish());
  for (size_t i = 0; i < 7; ++i) {
    EXPECT_EQ(*read_rising(*lists, i), numbers[i]);
    RisingCursor cursor(*lists, i, 16 + random() % 100);
    for (const uint32_t number : numbers[i]) {
      ASSERT_TRUE(*cursor.next());
      ASSERT_EQ(cursor.number(), number);
    }
    EXPECT_FALSE(*cursor.next());
  }
}

TEST(MeshSpool, GivesBackInPartsWhatCameOnce) {
  const Mesh mesh = blocks_with_arrays();
  const auto source = mesh_as_source(mesh);
  const MeshDescription& described = source->description();
  StreamOptions options;
  options.positions.type = described.point_type;
  for (const Array& array : described.arrays)
    options.arrays.push_back(
        {array.name, array.domain, array.type, array.components, array.role, {}, {}, {}});
  auto spool = MeshSpool::create(options);
  ASSERT_TRUE(spool);
  // Values of some elements, by domain.
  const auto values = [&](Domain domain, uint64_t first, uint64_t count) {
    std::vector<std::vector<std::byte>> all;
    for (size_t i = 0; i < described.arrays.size(); ++i) {
      if (described.arrays[i].domain != domain) continue;
      EXPECT_TRUE(
          source->read_array(i, first, count, all.emplace_back(count * described.arrays[i].tuple_size())));
    }
    return all;
  };
  const auto as_bytes = [](const std::vector<std::vector<std::byte>>& all) {
    return std::vector<Bytes>(all.begin(), all.end());
  };
  constexpr uint64_t at_once = 700;
  for (uint64_t end = described.points; end > 0; end -= std::min(end, at_once)) {  // the last ones first
    const uint64_t first = end - std::min(end, at_once);
    std::vector<std::byte> positions((end - first) * 12);
    ASSERT_TRUE(source->read_points(first, end - first, positions));
    const auto of_points = values(Domain::point, first, end - first);
    ASSERT_TRUE(spool->add_points(first, positions, as_bytes(of_points)));
  }
  uint64_t cell = 0;
  for (const auto& block : described.blocks) {
    ASSERT_TRUE(spool->begin_block(block.name, block.type));
    CellPiece cells;
    ASSERT_TRUE(source->read_cells(cell, block.cells, cells));
    const auto of_cells = values(Domain::cell, cell, block.cells);
    if (block.cells > 0) {
      ASSERT_TRUE(spool->add_cells(block.type, cells.connectivity, {}, as_bytes(of_cells)));
    }
    cell += block.cells;
  }
  const auto back = spool->finish();
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ((*back)->description().corners, described.corners);
  std::vector<std::byte> one(described.points * 12), other(one.size());
  ASSERT_TRUE(source->read_points(0, described.points, one));
  ASSERT_TRUE((*back)->read_points(0, described.points, other));
  EXPECT_EQ(one, other);
  for (uint64_t first = 0; first < described.cells; first += 1111) {
    const uint64_t count = std::min<uint64_t>(1500, described.cells - first);
    CellPiece a, b;
    ASSERT_TRUE(source->read_cells(first, count, a));
    ASSERT_TRUE((*back)->read_cells(first, count, b));
    EXPECT_EQ(a.types, b.types);
    EXPECT_EQ(a.offsets, b.offsets);
    EXPECT_EQ(a.connectivity, b.connectivity);
  }
  CellPiece none;
  EXPECT_FALSE((*back)->read_cells(described.cells, 1, none));
}

TEST(MeshSpool, RefusesNumbersWithGaps) {
  auto spool = MeshSpool::create({});
  ASSERT_TRUE(spool);
  const std::vector<std::byte> position(12);
  ASSERT_TRUE(spool->add_points(0, position));
  ASSERT_TRUE(spool->add_points(2, position));
  EXPECT_FALSE(spool->finish());
}

}  // namespace
}  // namespace maille
