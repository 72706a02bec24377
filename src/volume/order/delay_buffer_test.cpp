#include "volume/order/delay_buffer.h"

#include <maille/out_of_core.h>

#include <algorithm>
#include <map>
#include <set>

#include "mesh/mesh_as_source.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

std::vector<std::vector<uint64_t>> cells_of(const Mesh& mesh) {
  std::vector<std::vector<uint64_t>> cells;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i)
      cells.emplace_back(block.cell(i).begin(), block.cell(i).end());
  }
  return cells;
}

/// The cells of a mesh through a buffer, ends told with every third cell, and with end() for the others.
std::vector<DelayedCell> delayed(const Mesh& mesh, uint64_t delay) {
  const auto cells = cells_of(mesh);
  std::map<uint64_t, size_t> last;
  for (size_t i = 0; i < cells.size(); ++i) {
    for (const uint64_t number : cells[i]) last[number] = i;
  }
  DelayBuffer buffer(delay);
  std::vector<DelayedCell> out;
  for (size_t i = 0; i < cells.size(); ++i) {
    if (buffer.is_full()) out.push_back(buffer.take());
    DelayedCell& cell = buffer.next();
    cell.kind = kind_of(mesh.blocks[0].type_of(i));
    cell.numbers = cells[i];
    cell.last_use.assign(cells[i].size(), 0);
    for (size_t k = 0; k < cells[i].size() && i % 3 == 0; ++k) cell.last_use[k] = last[cells[i][k]] == i;
    buffer.enter();
    for (const uint64_t number : cells[i]) {
      if (i % 3 != 0 && last[number] == i) {
        EXPECT_TRUE(buffer.end(number));
      }
    }
  }
  while (!buffer.is_empty()) out.push_back(buffer.take());
  return out;
}

TEST(DelayBuffer, EveryCellComesOutOnceAndPointsEndWithTheirLastCell) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    const Mesh mesh = soup(seed, 200, 60);
    for (const uint64_t delay : {1u, 3u, 40u, 1000u}) {
      const std::vector<DelayedCell> out = delayed(mesh, delay);
      auto wanted = cells_of(mesh);
      std::vector<std::vector<uint64_t>> found;
      std::set<uint64_t> seen_behind;
      for (size_t i = out.size(); i-- > 0;) {
        found.push_back(out[i].numbers);
        for (size_t k = 0; k < out[i].numbers.size(); ++k)
          EXPECT_EQ(out[i].last_use[k] != 0, seen_behind.count(out[i].numbers[k]) == 0);
        seen_behind.insert(out[i].numbers.begin(), out[i].numbers.end());
      }
      std::sort(wanted.begin(), wanted.end());
      std::sort(found.begin(), found.end());
      EXPECT_EQ(found, wanted);
    }
  }
}

TEST(DelayBuffer, OneCellIsNoDelay) {
  const Mesh mesh = soup(3, 100, 40);
  const std::vector<DelayedCell> out = delayed(mesh, 1);
  const auto cells = cells_of(mesh);
  for (size_t i = 0; i < cells.size(); ++i) EXPECT_EQ(out[i].numbers, cells[i]);
}

/// A grid whose cells are in no order within each run of `window`.
Mesh disturbed_grid(unsigned n, size_t window) {
  Mesh mesh = grid(n, n, n);
  add_arrays(mesh, 4);
  Buffer<uint32_t>& connectivity = mesh.blocks[0].connectivity;
  const Buffer<uint32_t> before = connectivity;
  const size_t cells = connectivity.size() / 8;
  for (size_t first = 0; first < cells; first += window) {
    const std::vector<uint32_t> order =
        shuffled(std::min(window, cells - first), static_cast<unsigned>(first));
    for (size_t i = 0; i < order.size(); ++i)
      std::copy_n(&before[8 * (first + order[i])], 8, &connectivity[8 * (first + i)]);
  }
  return mesh;
}

EncodeReport compressed(const Mesh& mesh, uint64_t delay, std::vector<std::byte>& bytes) {
  EncodeOptions options = kept();
  options.order = Order::canonical;
  const auto source_in_memory = mesh_as_source(mesh);
  MeshSource& source = *source_in_memory;
  WorkingSpace space;
  space.delay = delay;
  bytes.clear();
  const auto report = encode(source, *memory_sink(bytes), options, space);
  EXPECT_TRUE(report) << report.error().message;
  return *report;
}

TEST(DelayBuffer, PutsRightWhatIsOutOfOrderWithinItsReach) {
  const Mesh mesh = disturbed_grid(20, 300);
  std::vector<std::byte> bytes;
  const uint64_t as_it_comes = compressed(mesh, 0, bytes).connectivity.coded_bytes;
  const uint64_t delayed = compressed(mesh, 1000, bytes).connectivity.coded_bytes;
  EXPECT_LT(delayed * 5, as_it_comes);
  const auto back = decode(*memory_source(Bytes(bytes)));
  ASSERT_TRUE(back) << back.error().message;
  const Comparison comparison = compare(mesh, *back, {});
  EXPECT_TRUE(comparison.equal) << (comparison.differences.empty() ? "" : comparison.differences.front());
}

TEST(DelayBuffer, BlocksOfCellsStayTogether) {
  Mesh mesh = disturbed_grid(6, 50);
  CellBlock second = mesh.blocks[0];
  second.name = "again";
  mesh.blocks.push_back(second);
  mesh.arrays.clear();
  add_arrays(mesh, 9);
  std::vector<std::byte> bytes;
  compressed(mesh, 100, bytes);
  const auto back = decode(*memory_source(Bytes(bytes)));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_TRUE(compare(mesh, *back, {}).equal);
}

TEST(DelayBuffer, NeedsThatAnyOrderWillDo) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  StreamOptions options;
  options.delay = 100;
  const auto writer = StreamWriter::begin(*sink, options);
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().code, ErrorCode::usage);
}

TEST(DelayBuffer, MemoryIsForTheFrontAndTheDelay) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  StreamOptions options;
  options.any_order = true;
  options.delay = 200;
  StreamWriter writer = *StreamWriter::begin(*sink, options);
  const auto layer = [&](uint64_t z) {
    const auto h = static_cast<float>(z);
    const std::vector<float> at = {0, 0, h, 1, 0, h, 1, 1, h, 0, 1, h};
    return writer.add_points(4 * z, std::as_bytes(std::span(at)));
  };
  ASSERT_TRUE(layer(0));
  for (uint64_t z = 0; z < 50'000; ++z) {
    ASSERT_TRUE(layer(z + 1));
    std::vector<uint64_t> cell(8);
    std::iota(cell.begin(), cell.end(), 4 * z);
    ASSERT_TRUE(writer.add_cells(CellType::hexahedron, cell));
    ASSERT_TRUE(writer.end_points(std::span(cell).first(4)));
  }
  const auto report = writer.finish();
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->cells, 50'000u);
  EXPECT_LT(report->most_live_points, 20'000u);
}

}  // namespace
}  // namespace maille
