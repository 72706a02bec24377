// Levels 1 to 6: fans; positions of triangles for speed at 1, for fewer bytes from 2 on.
#include "support/codec.h"
#include "support/random.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

#include <gtest/gtest.h>
#include <maille/file.h>

#include <algorithm>
#include <numeric>

namespace maille::testing {
namespace {

/// The cells of a mesh as triangles where they have more corners, with numbers on cells and corners to follow
/// them; arrays of points and of the mesh stay.
Mesh in_triangles(const Mesh& mesh, bool with_numbers) {
  Mesh result = mesh;
  result.arrays.clear();
  for (CellBlock& block : result.blocks) {
    if (!is_face(block.type)) continue;
    CellBlock triangles;
    triangles.name = block.name;
    triangles.type = block.type == CellType::triangle ? CellType::triangle : CellType::polygon;
    if (block.size() > 0 && triangles.type == CellType::polygon) triangles.offsets.push_back(0);
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto cell = block.cell(i);
      if (cell.size() < 3) {
        triangles.connectivity.insert(triangles.connectivity.end(), cell.begin(), cell.end());
        triangles.offsets.push_back(triangles.connectivity.size());
      }
      for (size_t k = 2; k < cell.size(); ++k) {
        for (const size_t corner : {size_t{0}, k - 1, k}) triangles.connectivity.push_back(cell[corner]);
        if (triangles.type == CellType::polygon) triangles.offsets.push_back(triangles.connectivity.size());
      }
    }
    // A block of nothing but triangles is of that type most of the time.
    const bool uniform = triangles.type == CellType::polygon && block.size() % 4 != 0 &&
                         triangles.connectivity.size() == 3 * triangles.size();
    if (uniform) {
      bool all = true;
      for (uint64_t i = 0; i < triangles.size(); ++i) all = all && triangles.cell(i).size() == 3;
      if (all) {
        triangles.type = CellType::triangle;
        triangles.offsets.clear();
      }
    }
    block = std::move(triangles);
  }
  for (const Array& array : mesh.arrays) {
    if (with_numbers && (array.domain == Domain::point || array.domain == Domain::mesh))
      result.arrays.push_back(array);
  }
  for (const Domain domain : {Domain::cell, Domain::corner}) {
    if (!with_numbers) break;
    Array numbers = make_array(std::string("number of ") + name_of(domain), domain, Scalar::u32, 1);
    numbers.resize(result.count_of(domain));
    std::iota(numbers.values<uint32_t>().begin(), numbers.values<uint32_t>().end(), 0);
    result.arrays.push_back(numbers);
  }
  return result;
}

std::string round_trip(const Mesh& mesh, const EncodeOptions& options) {
  const auto encoded = encode_bytes(mesh, options);
  if (!encoded) return "encode: " + encoded.error().message;
  const auto decoded = decode_bytes(encoded->bytes);
  if (!decoded) return "decode: " + decoded.error().message;
  const auto valid = validate(*decoded);
  if (!valid) return "decoded: " + valid.error().message;
  return differences_between(mesh, *decoded, options.order == Order::keep);
}

EncodeOptions fast(int effort = 2) {
  EncodeOptions options;
  options.mode = Mode::single;
  options.effort = effort;
  return options;
}

/// The same at both kinds of levels; empty when both come back.
std::string round_trips(const Mesh& mesh, Order order = Order::canonical) {
  for (const int effort : {2, 5}) {
    EncodeOptions options = fast(effort);
    options.order = order;
    const std::string wrong = round_trip(mesh, options);
    if (!wrong.empty()) return "effort " + std::to_string(effort) + ": " + wrong;
  }
  return {};
}

bool is_fan_coded(const std::vector<std::byte>& bytes, const std::string& type, uint32_t coding = 1) {
  const auto info = inspect(*memory_source(bytes));
  EXPECT_TRUE(info);
  return info && std::any_of(info->chunks.begin(), info->chunks.end(), [&](const ChunkInfo& chunk) {
           return chunk.type == type && chunk.id == coding;
         });
}

class FastLevel : public ::testing::TestWithParam<int> {
 protected:
  static constexpr uint64_t seeds = 400;
  uint64_t first() const { return 7000000 + static_cast<uint64_t>(GetParam()) * 100000; }
};
INSTANTIATE_TEST_SUITE_P(Shard, FastLevel, ::testing::Range(0, 4));

TEST_P(FastLevel, TrianglesOfAnyTopologyComeBack) {
  const auto property = [](const Mesh& mesh) { return round_trips(in_triangles(mesh, false)); };
  EXPECT_EQ(check_random_surfaces(first(), seeds, {}, property), "");
  RandomMeshOptions options;
  options.several_blocks = options.degenerate_faces = options.special_values = false;
  options.faces = 300;
  EXPECT_EQ(check_random_surfaces(first() + 10000, seeds, options, property), "");
}

TEST_P(FastLevel, ArraysFollowTheirElements) {
  const auto property = [](const Mesh& mesh) { return round_trips(in_triangles(mesh, true)); };
  EXPECT_EQ(check_random_surfaces(first() + 20000, seeds, {}, property), "");
}

TEST_P(FastLevel, OrderIsKeptOnRequest) {
  const auto property = [](const Mesh& mesh) {
    return round_trips(in_triangles(mesh, mesh.point_count() % 2 == 0), Order::keep);
  };
  EXPECT_EQ(check_random_surfaces(first() + 30000, seeds, {}, property), "");
}

TEST_P(FastLevel, AnyMeshComesBack) {
  RandomMeshOptions options;
  options.other_cells = true;
  const auto property = [](const Mesh& mesh) { return round_trips(mesh); };
  EXPECT_EQ(check_random_surfaces(first() + 40000, seeds, options, property), "");
}

TEST(FastLevels, CodeTrianglesAndPolygonsAsFans) {
  for (const int effort : {1, 2, 3}) {
    EncodeOptions options;
    options.mode = Mode::single;
    options.effort = effort;
    const auto triangles = encode_bytes(in_triangles(sphere(9, 6), false), options);
    ASSERT_TRUE(triangles);
    EXPECT_TRUE(is_fan_coded(triangles->bytes, "TOPO"));
    EXPECT_TRUE(is_fan_coded(triangles->bytes, "POSI", 1));
    const auto quads = encode_bytes(cube(), options);
    ASSERT_TRUE(quads);
    EXPECT_TRUE(is_fan_coded(quads->bytes, "TOPO", 2));
  }
}

TEST(DefaultLevels, CodeTrianglesAndPolygonsAsFans) {
  for (const int effort : {4, 5, 6}) {
    const auto triangles = encode_bytes(in_triangles(sphere(9, 6), false), fast(effort));
    ASSERT_TRUE(triangles);
    EXPECT_TRUE(is_fan_coded(triangles->bytes, "TOPO", 1));
    EXPECT_TRUE(is_fan_coded(triangles->bytes, "POSI", 1));
    const auto quads = encode_bytes(cube(), fast(effort));
    ASSERT_TRUE(quads);
    EXPECT_TRUE(is_fan_coded(quads->bytes, "TOPO", 2));
  }
  const auto best = encode_bytes(in_triangles(sphere(9, 6), false), fast(7));
  ASSERT_TRUE(best);
  EXPECT_TRUE(is_fan_coded(best->bytes, "TOPO", 0));
}

TEST(DefaultLevels, DecodedTrianglesGiveTheSameFileAgain) {
  for (const Mesh& mesh : {sphere(9, 6), torus(40, 30), grid(20, 12), moebius(9, 2)}) {
    for (const int effort : {2, 5}) {
      const auto once = encode_bytes(in_triangles(mesh, true), fast(effort));
      ASSERT_TRUE(once);
      const auto decoded = decode_bytes(once->bytes);
      ASSERT_TRUE(decoded);
      const auto twice = encode_bytes(*decoded, fast(effort));
      ASSERT_TRUE(twice);
      EXPECT_EQ(once->bytes, twice->bytes) << "effort " << effort;
    }
  }
}

/// A bumpy surface whose points have one coordinate off the planes of a lattice, as those of voxels do.
Mesh on_planes() {
  Mesh mesh = in_triangles(torus(60, 50), false);
  Random random(3);
  auto values = mesh.points.values<float>();
  for (size_t i = 0; i < values.size(); ++i) {
    const float off = i % 3 == i / 3 % 3 ? static_cast<float>(random.below(5000)) / 65536 : 0;
    values[i] =
        static_cast<float>(static_cast<int>(values[i] * 16 + static_cast<float>(16 * random.below(2)))) / 13 +
        off;
  }
  return mesh;
}

TEST(DefaultLevels, CoordinatesThatComeAgainCostLittle) {
  const Mesh mesh = on_planes();
  EXPECT_EQ(round_trips(mesh), "");
  // With a bound, as lossless positions have tables at all levels.
  EncodeOptions coarse = fast(1), options = fast(5);
  coarse.positions = options.positions = {Tolerance::Kind::bits, 18};
  const auto fast_file = encode_bytes(mesh, coarse), file = encode_bytes(mesh, options);
  ASSERT_TRUE(fast_file && file);
  EXPECT_LT(10 * file->bytes.size(), 9 * fast_file->bytes.size());
}

TEST(FastLevels, FacesThatLieTwiceCostLittle) {
  Mesh once = in_triangles(torus(40, 30), false);
  Mesh twice = once;
  Buffer<uint32_t>& corners = twice.blocks[0].connectivity;
  for (size_t i = 0, count = corners.size(); i < count; i += 3) {
    for (const size_t k : {i + 1, i, i + 2}) corners.push_back(corners[k]);
  }
  if (twice.blocks[0].type == CellType::polygon) {
    twice.blocks[0].offsets.clear();
    for (size_t i = 0; i <= corners.size(); i += 3) twice.blocks[0].offsets.push_back(i);
  }
  ASSERT_TRUE(validate(twice));
  EXPECT_EQ(round_trip(twice, fast()), "");
  const auto a = encode_bytes(once, fast()), b = encode_bytes(twice, fast());
  ASSERT_TRUE(a && b);
  EXPECT_LT(b->bytes.size(), a->bytes.size() + 60);
}

TEST(Levels, TheSmallOnesAreNeverLargerThanTheDefault) {
  const auto size_at = [](const Mesh& mesh, int effort) {
    EncodeOptions options;
    options.mode = Mode::single;
    options.effort = effort;
    const auto encoded = encode_bytes(mesh, options);
    EXPECT_TRUE(encoded) << encoded.error().message;
    const EncodeReport& report = encoded->report;
    uint64_t size = report.connectivity.coded_bytes + report.positions.coded_bytes;
    for (const ArrayReport& array : report.arrays) size += array.coded_bytes;
    return size;
  };
  for (uint64_t seed = 0; seed < 60; ++seed) {
    const Mesh mesh = seed == 0 ? grid(60, 40) : seed == 1 ? cube() : random_surface(seed, {.faces = 200});
    const uint64_t smallest = size_at(mesh, 9);
    ASSERT_LE(smallest, size_at(mesh, 6)) << seed;
    ASSERT_EQ(smallest, size_at(mesh, 7)) << seed;
  }
}

}  // namespace
}  // namespace maille::testing
