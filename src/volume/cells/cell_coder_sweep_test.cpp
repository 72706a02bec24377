#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <unordered_map>

#include "volume/cells/cell_coder.h"
#include "volume/values/tuple_values.h"

namespace maille {
namespace {

/// Hexahedra as numbers of points, with a flag for each corner that is the last use of its point.
struct Hexahedra {
  std::vector<uint64_t> points;
  std::vector<uint8_t> last_use;

  size_t size() const { return points.size() / most_corners; }
  void find_last_uses() {
    std::unordered_map<uint64_t, size_t> last;
    for (size_t k = 0; k < points.size(); ++k) last[points[k]] = k / most_corners;
    last_use.resize(points.size());
    for (size_t k = 0; k < points.size(); ++k) last_use[k] = last[points[k]] == k / most_corners;
  }
};

/// A grid of which one cell in `hole` is missing, and one in `turned` begins at another corner.
Hexahedra grid_with_faults(unsigned nx, unsigned ny, unsigned nz, unsigned hole, unsigned turned,
                           unsigned seed) {
  Hexahedra cells;
  std::mt19937 random(seed);
  const auto id = [&](uint64_t x, uint64_t y, uint64_t z) { return (z * (ny + 1) + y) * (nx + 1) + x; };
  for (unsigned z = 0; z < nz; ++z) {
    for (unsigned y = 0; y < ny; ++y) {
      for (unsigned x = 0; x < nx; ++x) {
        if (hole != 0 && random() % hole == 0) continue;
        std::array<uint64_t, 8> cell;
        for (unsigned top = 0; top < 2; ++top) {
          const std::array<uint64_t, 4> face = {id(x, y, z + top), id(x + 1, y, z + top),
                                                id(x + 1, y + 1, z + top), id(x, y + 1, z + top)};
          std::copy(face.begin(), face.end(), cell.begin() + 4 * top);
        }
        if (turned != 0 && random() % turned == 0) {
          std::rotate(cell.begin(), cell.begin() + 1, cell.begin() + 4);
          std::rotate(cell.begin() + 4, cell.begin() + 5, cell.end());
        }
        if (turned != 0 && random() % (4 * turned) == 0) cell[random() % 8] = cell[random() % 8];
        cells.points.insert(cells.points.end(), cell.begin(), cell.end());
      }
    }
  }
  cells.find_last_uses();
  return cells;
}

struct Written {
  std::vector<std::byte> cells, numbers;
  CodedCells out;
  size_t swept = 0;
};

constexpr size_t per_block = 512;

Written write(const Hexahedra& cells, bool sweep, bool numbered) {
  Written written;
  CellCoder<RangeEncoder> coder(Mixing::mixed, numbered);
  RangeEncoder topology, numbers;
  StreamedCell cell;
  for (size_t i = 0; i < cells.size(); ++i) {
    if (i % per_block == 0) coder.end_block();
    if (sweep) {
      const size_t most = per_block - i % per_block;
      const size_t swept =
          coder.sweep(topology, numbers, cells.points.data() + i * 8, cells.last_use.data() + i * 8,
                      std::min(most, cells.size() - i), written.out);
      written.swept += swept;
      i += swept;
      if (i == cells.size()) break;
      if (swept == most) {
        --i;
        continue;
      }
    }
    cell.kind = hexahedron_kind;
    cell.final = 0;
    for (unsigned k = 0; k < 8; ++k) {
      cell.number[k] = cells.points[i * 8 + k];
      cell.final |= (cells.last_use[i * 8 + k] != 0 ? 1u : 0u) << k;
    }
    coder.code(topology, numbers, cell, written.out);
  }
  written.cells = topology.finish();
  written.numbers = numbers.finish();
  return written;
}

Unfilled<uint32_t> read(const Written& written, size_t count, bool sweep, bool numbered) {
  CellCoder<RangeDecoder> coder(Mixing::mixed, numbered);
  RangeDecoder topology(written.cells), numbers(written.numbers);
  CodedCells out;
  StreamedCell cell;
  for (size_t i = 0; i < count; ++i) {
    if (i % per_block == 0) coder.end_block();
    if (sweep) {
      const size_t most = std::min(per_block - i % per_block, count - i);
      const size_t swept = coder.sweep(topology, numbers, nullptr, nullptr, most, out);
      i += swept;
      if (swept == most) {
        --i;
        continue;
      }
    }
    EXPECT_TRUE(coder.code(topology, numbers, cell, out));
  }
  EXPECT_FALSE(topology.exhausted());
  return out.nodes;
}

TEST(SweptCells, HaveTheBytesThatTheyHaveOneByOne) {
  for (const bool numbered : {true, false}) {
    for (const unsigned faults : {0u, 200u, 30u, 6u, 2u}) {
      const Hexahedra cells = grid_with_faults(17, 12, 9, faults, 2 * faults, 7 + faults);
      const Written swept = write(cells, true, numbered), single = write(cells, false, numbered);
      EXPECT_EQ(swept.cells, single.cells) << faults;
      EXPECT_EQ(swept.numbers, single.numbers) << faults;
      EXPECT_EQ(swept.out.nodes, single.out.nodes);
      EXPECT_EQ(swept.out.across, single.out.across);
      EXPECT_EQ(swept.out.cell_slots, single.out.cell_slots);
      EXPECT_EQ(swept.out.removed, single.out.removed);
      ASSERT_EQ(swept.out.points.size(), single.out.points.size());
      for (size_t i = 0; i < swept.out.points.size(); ++i) {
        EXPECT_EQ(swept.out.points[i].cell, single.out.points[i].cell);
        EXPECT_EQ(swept.out.points[i].number, single.out.points[i].number);
        EXPECT_EQ(swept.out.points[i].behind, single.out.points[i].behind);
      }
      EXPECT_EQ(read(swept, cells.size(), true, numbered), swept.out.nodes);
      EXPECT_EQ(read(swept, cells.size(), false, numbered), swept.out.nodes);
    }
  }
}

TEST(SweptCells, AreNearlyAllOfAGrid) {
  const Hexahedra cells = grid_with_faults(30, 20, 20, 0, 0, 1);
  EXPECT_GT(write(cells, true, true).swept, cells.size() * 85 / 100);
}

/// Tuples of three at corners of cells whose others are any of the last points, by both ways.
template <unsigned Bits, class Number>
void expect_same_values(Scalar type) {
  StreamedArray array;
  array.type = type;
  array.components = 3;
  array.maps.assign(3, {.kind = NumberMap::Kind::ordered});
  std::mt19937 random(5);
  std::vector<std::array<Number, 3>> tuples(20000);
  Number at = 0;
  for (auto& tuple : tuples) {
    at += static_cast<Number>(0.01) + static_cast<Number>(random() % 16) / 65536;
    tuple = {at, 1 / at, -at * at};
    if (random() % 500 == 0) tuple[random() % 3] = std::numeric_limits<Number>::quiet_NaN();
    if (random() % 500 == 0) tuple[random() % 3] = -std::numeric_limits<Number>::infinity();
  }
  const auto run = [&](auto& values, auto& coder, bool full, std::vector<std::array<Number, 3>>& numbers) {
    std::mt19937 choice(9);
    PointStencil stencil;
    for (uint32_t i = 0; i < numbers.size(); ++i) {
      auto* tuple = reinterpret_cast<std::byte*>(numbers[i].data());
      CodedCells cell;
      cell.kinds = {hexahedron_kind};
      cell.begin = {0};
      for (unsigned k = 0; k < 8; ++k) cell.nodes.push_back(i < 8 ? 0 : i - 1 - choice() % 8);
      NewPoint point;
      point.cell = 0;
      point.slot = i;
      point.node = static_cast<uint8_t>(i % 8);
      point.fresh = static_cast<uint8_t>(1u << point.node);
      if (i < 8) {
        stencil.clear();
        values.code(coder, stencil, i, tuple);
      } else if (full) {
        values.code_full(coder, cell.nodes.data(), point.node, i, tuple);
      } else {
        find_stencil(point, cell, stencil);
        values.code(coder, stencil, i, tuple);
      }
    }
  };
  std::array<std::vector<std::byte>, 2> bytes;
  for (const bool full : {false, true}) {
    TupleValueCoder<RansEncoder, Bits, 4> values(array);
    EXPECT_TRUE(values.is_plain());
    RansEncoder coder(3);
    run(values, coder, full, tuples);
    bytes[full] = coder.finish();
  }
  EXPECT_EQ(bytes[0], bytes[1]);
  std::vector<std::array<Number, 3>> back(tuples.size());
  TupleValueCoder<RansDecoder, Bits, 4> values(array);
  RansDecoder coder(bytes[1], 3);
  run(values, coder, true, back);
  EXPECT_EQ(std::memcmp(back.data(), tuples.data(), tuples.size() * sizeof(tuples[0])), 0);
}

TEST(PlainValues, HaveTheBytesOfTheGeneralWay) {
  expect_same_values<32, float>(Scalar::f32);
  expect_same_values<64, double>(Scalar::f64);
}

}  // namespace
}  // namespace maille
