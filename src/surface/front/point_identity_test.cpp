#include "surface/front/point_identity.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/half_edges.h"
#include "support/random_mesh.h"

namespace maille::testing {
namespace {

struct Coded {
  HalfEdges surface;
  CodedConnectivity coded;
  std::vector<uint32_t> point_of;
  uint32_t point_count = 0;
  std::vector<std::byte> bytes;
};

Coded encode(const Surface& shape) {
  Coded result;
  GluedSurface glued = testing::glued(shape);
  result.surface = std::move(glued.half_edges);
  result.coded =
      encode_connectivity(result.surface, glued.real_half_edges, static_cast<uint32_t>(shape.points.size()));
  result.bytes = encode_point_identity(result.surface, result.coded.vertices, result.coded.points,
                                       result.point_of, result.point_count);
  return result;
}

std::string round_trip(const Coded& coded) {
  std::vector<uint32_t> point_of;
  uint32_t point_count = 0;
  const auto done =
      decode_point_identity(coded.surface, coded.coded.vertices, coded.bytes, point_of, point_count);
  if (!done) return done.error().message;
  if (point_count != coded.point_count) return "another number of points";
  return point_of == coded.point_of ? "" : "another point of a vertex";
}

Surface bow_tie() {
  Surface surface;
  surface.points.resize(5);
  surface.faces = {{0, 1, 2}, {0, 3, 4}};
  return surface;
}

TEST(PointIdentity, CostsNothingWhereEveryVertexIsItsOwnPoint) {
  for (const Surface& shape : {shapes::cube(), shapes::torus(5, 5), shapes::grid(4, 4), Surface{}}) {
    const Coded coded = encode(shape);
    EXPECT_TRUE(coded.bytes.empty());
    EXPECT_TRUE(coded.point_of.empty());
    EXPECT_EQ(coded.point_count, coded.coded.vertices.size());
    EXPECT_EQ(round_trip(coded), "");
  }
}

TEST(PointIdentity, FansThatMeetInAPointShareIt) {
  const Coded coded = encode(bow_tie());
  EXPECT_EQ(coded.coded.vertices.size(), 6u);
  EXPECT_EQ(coded.point_count, 5u);
  EXPECT_FALSE(coded.bytes.empty());
  EXPECT_EQ(round_trip(coded), "");
  // Points are numbered by their first vertices, so one number comes twice and none is left out.
  std::vector<uint32_t> sorted = coded.point_of;
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  EXPECT_EQ(sorted, (std::vector<uint32_t>{0, 1, 2, 3, 4}));
}

TEST(PointIdentity, ManyFansOnOnePointComeBack) {
  Surface surface;
  surface.points.resize(1);
  for (uint32_t i = 0; i < 300; ++i) {
    surface.points.resize(surface.points.size() + 2);
    surface.faces.push_back({0, 2 * i + 1, 2 * i + 2});
  }
  const Coded coded = encode(surface);
  EXPECT_EQ(coded.point_count, 601u);
  EXPECT_EQ(round_trip(coded), "");
}

TEST(PointIdentity, AnySoupComesBackWithThePointsItHad) {
  RandomMeshOptions options;
  options.arrays = options.special_values = options.any_position_type = options.several_blocks = false;
  for (uint64_t seed = 0; seed < 1500; ++seed) {
    const Coded coded = encode(surface_of(random_surface(seed, options)));
    ASSERT_EQ(round_trip(coded), "") << seed;
    // Two vertices share a coded point exactly when they shared one of the mesh.
    std::vector<uint32_t> original(coded.point_count, none);
    for (uint32_t v = 0; v < coded.coded.vertices.size() && !coded.point_of.empty(); ++v) {
      uint32_t& point = original[coded.point_of[v]];
      if (point == none) point = coded.coded.points[v];
      ASSERT_EQ(point, coded.coded.points[v]) << seed;
    }
  }
}

TEST(PointIdentity, DamageGivesPointsThatAreThereOrAnError) {
  Surface surface = bow_tie();
  append(surface, shapes::book(7));
  append(surface, shapes::voxels({true, false, false, true, false, true, true, false}, 2, 2, 2));
  const Coded coded = encode(surface);
  for (uint64_t seed = 0; seed < 3000; ++seed) {
    Random random(seed);
    const auto bytes =
        random.chance(50) ? damaged(coded.bytes, random) : random_bytes(random, random.below(40));
    std::vector<uint32_t> point_of;
    uint32_t point_count = 0;
    const auto done =
        decode_point_identity(coded.surface, coded.coded.vertices, bytes, point_of, point_count);
    if (!done) {
      EXPECT_EQ(done.error().code, ErrorCode::corrupt);
      continue;
    }
    EXPECT_LE(point_count, coded.coded.vertices.size());
    for (const uint32_t point : point_of) ASSERT_LT(point, point_count) << seed;
    EXPECT_TRUE(point_of.empty() || point_of.size() == coded.coded.vertices.size());
  }
}

TEST(PointIdentity, EveryTruncationButToNothingIsAnError) {
  Surface surface = bow_tie();
  append(surface, shapes::book(9));
  const Coded coded = encode(surface);
  // The last byte carries nothing.
  for (size_t size = 1; size + 1 < coded.bytes.size(); ++size) {
    std::vector<uint32_t> point_of;
    uint32_t point_count = 0;
    EXPECT_FALSE(decode_point_identity(coded.surface, coded.coded.vertices, Bytes(coded.bytes).first(size),
                                       point_of, point_count))
        << size;
  }
}

}  // namespace
}  // namespace maille::testing
