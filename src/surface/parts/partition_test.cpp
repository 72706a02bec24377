#include "surface/parts/partition.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "support/random_mesh.h"
#include "support/shapes.h"
#include "surface/parts/coded_parts.h"
#include "surface/parts/mesh_parts.h"

namespace maille::testing {
namespace {

std::vector<float> float_positions(const Mesh& mesh) {
  const auto values = mesh.points.values<float>();
  return {values.begin(), values.end()};
}

std::vector<size_t> cells_by_part(const std::vector<uint32_t>& part_of) {
  std::vector<size_t> count;
  for (const uint32_t part : part_of) {
    if (part >= count.size()) count.resize(part + 1);
    ++count[part];
  }
  return count;
}

/// The corners of each cell as positions, sorted, by part: what does not depend on any order.
std::vector<std::multiset<std::vector<std::array<float, 3>>>> cells_as_places(
    const Mesh& mesh, const std::vector<uint32_t>& part_of) {
  std::vector<std::multiset<std::vector<std::array<float, 3>>>> parts(cells_by_part(part_of).size());
  const auto values = mesh.points.values<float>();
  uint32_t cell = 0;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i, ++cell) {
      std::vector<std::array<float, 3>> corners;
      for (const uint32_t p : block.cell(i))
        corners.push_back({values[3 * p], values[3 * p + 1], values[3 * p + 2]});
      std::sort(corners.begin(), corners.end());
      parts[part_of[cell]].insert(corners);
    }
  }
  return parts;
}

TEST(Partition, HalvesUntilNoPartHasMoreCellsThanAsked) {
  const Mesh mesh = grid(40, 30);
  const auto part_of = partition_cells(mesh, float_positions(mesh), 200);
  const auto sizes = cells_by_part(part_of);
  EXPECT_EQ(sizes.size(), 8u);
  for (const size_t size : sizes) EXPECT_EQ(size, 150u);
}

TEST(Partition, SmallMeshesAreOnePart) {
  const Mesh mesh = grid(10, 10);
  EXPECT_EQ(partition_cells(mesh, float_positions(mesh), 100), std::vector<uint32_t>(100, 0));
}

TEST(Partition, DependsOnTheSetOfCellsAlone) {
  const Mesh mesh = torus(30, 20);
  const Mesh other = shuffled(mesh, 7);
  EXPECT_EQ(cells_as_places(mesh, partition_cells(mesh, float_positions(mesh), 50)),
            cells_as_places(other, partition_cells(other, float_positions(other), 50)));
}

TEST(Partition, CellsInOnePlaceStayTogether) {
  Surface surface = shapes::grid(4, 1);
  for (int copy = 0; copy < 50; ++copy) surface.faces.push_back(surface.faces[2]);
  const Mesh mesh = to_mesh(surface);
  const auto part_of = partition_cells(mesh, float_positions(mesh), 10);
  for (size_t i = 4; i < part_of.size(); ++i) EXPECT_EQ(part_of[i], part_of[2]);
  EXPECT_GT(cells_by_part(part_of).size(), 1u);
}

std::vector<MeshPart> take_all(const Mesh& mesh, const std::vector<uint32_t>& part_of) {
  MeshParts parts(mesh, part_of, serial_executor());
  std::vector<MeshPart> taken;
  for (size_t i = 0; i < parts.count(); ++i) taken.push_back(parts.take(i));
  return taken;
}

TEST(MeshParts, HoldEachCellOnceWithItsPoints) {
  for (uint64_t seed = 0; seed < 60; ++seed) {
    const Mesh mesh = random_surface(seed);
    std::mt19937 random(static_cast<unsigned>(seed));
    std::vector<uint32_t> part_of(mesh.cell_count());
    for (uint32_t& part : part_of) part = static_cast<uint32_t>(random() % 3);
    const std::vector<MeshPart> parts = take_all(mesh, part_of);
    std::vector<unsigned> met(mesh.cell_count());
    for (uint32_t p = 0; p < parts.size(); ++p) {
      const MeshPart& part = parts[p];
      ASSERT_EQ(part.numbers.points.size(), part.mesh.point_count());
      ASSERT_EQ(part.numbers.cells.size(), part.mesh.cell_count());
      uint32_t next = 0;
      ASSERT_EQ(part.block_numbers.size(), part.mesh.blocks.size());
      EXPECT_TRUE(std::is_sorted(part.block_numbers.begin(), part.block_numbers.end()));
      for (size_t own = 0; own < part.block_numbers.size(); ++own) {
        const size_t b = part.block_numbers[own];
        EXPECT_GT(part.mesh.blocks[own].size(), 0u);
        for (uint64_t i = 0; i < part.mesh.blocks[own].size(); ++i, ++next) {
          const uint32_t cell = part.numbers.cells[next];
          EXPECT_EQ(part_of[cell], p);
          ++met[cell];
          uint32_t corner = part.numbers.first_corner[next];
          uint64_t before = 0;
          for (size_t k = 0; k < b; ++k) before += mesh.blocks[k].connectivity.size();
          for (const uint32_t point : part.mesh.blocks[own].cell(i)) {
            EXPECT_EQ(part.numbers.points[point], mesh.blocks[b].connectivity[corner++ - before]);
          }
        }
      }
    }
    EXPECT_TRUE(std::all_of(met.begin(), met.end(), [](unsigned count) { return count == 1; }));
  }
}

TEST(Partition, LargeMeshesAreCutOnceAtLeast) {
  EXPECT_EQ(most_cells_per_part({}, 400'000), 400'000u);
  EXPECT_EQ(most_cells_per_part({}, 400'001), 400'000u);
  EXPECT_EQ(most_cells_per_part({}, 10'000'000), 600'000u);
}

TEST(Partition, ModelsThatLearnGetTheWholeMeshUnlessToldOtherwise) {
  EncodeOptions options;
  options.effort = 6;
  EXPECT_LT(most_cells_per_part(options, 1'000'000), 1'000'000u);
  options.effort = 7;
  EXPECT_GT(most_cells_per_part(options, 100'000'000), 100'000'000u);
  options.most_cells_per_part = 9;
  EXPECT_EQ(most_cells_per_part(options, 10), 9u);
}

}  // namespace
}  // namespace maille::testing
