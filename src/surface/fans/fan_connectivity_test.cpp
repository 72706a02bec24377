#include "surface/fans/fan_connectivity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "support/cases.h"
#include "support/half_edges.h"
#include "support/named_shapes.h"
#include "support/random_mesh.h"

namespace maille::testing {
namespace {

struct Coded {
  GluedSurface glued;
  uint32_t points = 0;
  EncodedFans fans;
};

Coded encode(const Surface& shape) {
  Coded result;
  const FaceList list = face_list(triangulated(shape));
  result.points = list.points;
  result.glued = glue(list.view());
  result.fans = encode_fans(result.glued.half_edges, result.glued.real_half_edges, list.points);
  return result;
}

uint32_t triangles_of(const Coded& coded) {
  return coded.glued.real_half_edges / 3;
}

/// Is each triangle of the mesh there once, from the corner told, and the same on both sides?
std::string difference(const Coded& coded, const FanSurface& decoded) {
  const FanSurface& before = coded.fans.surface;
  if (decoded.corners != before.corners) return "other corners than the encoder saw";
  if (decoded.vertices != before.vertices || decoded.vertices != coded.fans.points.size())
    return "another number of vertices";
  for (uint32_t v = 0; v < decoded.vertices; ++v) {
    if (decoded.kinds[v] != before.kinds[v] || decoded.references[v].at != before.references[v].at)
      return "other references of vertex " + std::to_string(v);
    for (const uint32_t r : decoded.references[v].at) {
      if (r >= decoded.vertices) return "a reference that is not there";
    }
  }
  std::vector<bool> seen(triangles_of(coded));
  uint32_t next = 0;
  for (uint32_t t = 0; t < decoded.triangles(); ++t) {
    uint32_t h = coded.fans.half_edges[t];
    if (seen[h / 3]) return "a triangle twice";
    seen[h / 3] = true;
    for (unsigned k = 0; k < 3; ++k, h = coded.glued.half_edges.next(h)) {
      const uint32_t v = decoded.corners[size_t{3} * t + k];
      if (coded.fans.points[v] != coded.glued.half_edges.origin[h]) return "another point";
      if (v > next) return "a vertex before its number comes up";
      next = std::max(next, v + 1);
    }
  }
  return std::find(seen.begin(), seen.end(), false) == seen.end() ? "" : "a triangle is missing";
}

std::string round_trip(const Surface& shape) {
  const Coded coded = encode(shape);
  const auto decoded = decode_fans(coded.fans.bytes, triangles_of(coded), coded.points);
  if (!decoded) return decoded.error().message;
  return difference(coded, *decoded);
}

std::vector<Surface> shapes_and_fans() {
  std::vector<Surface> all = named_shapes();
  all.push_back(shapes::book(9));
  all.push_back(shapes::fan(40, true));
  return all;
}

TEST(Fans, ShapesComeBack) {
  for (const Surface& shape : shapes_and_fans()) EXPECT_EQ(round_trip(shape), "");
}

TEST(Fans, NothingIsNothing) {
  EXPECT_EQ(round_trip({}), "");
}

TEST(Fans, SurfacesOfAnyGenusAndSizeComeBack) {
  for (uint32_t genus = 0; genus < 8; ++genus) EXPECT_EQ(round_trip(shapes::plate(genus)), "") << genus;
  for (uint32_t n = 3; n < 60; n += 7) EXPECT_EQ(round_trip(shapes::torus(n, n / 2 + 3)), "") << n;
  EXPECT_EQ(round_trip(shapes::sphere(200, 150)), "");
}

TEST(Fans, VerticesOfManyTrianglesComeBack) {
  for (const uint32_t valence : {3u, 12u, 13u, 16u, 17u, 300u}) {
    EXPECT_EQ(round_trip(shapes::fan(valence, true)), "") << valence;
    EXPECT_EQ(round_trip(shapes::fan(valence, false)), "") << valence;
  }
}

TEST(Fans, ManyFacesOnOneEdgeComeBack) {
  EXPECT_EQ(round_trip(shapes::book(500)), "");
}

TEST(Fans, ManyComponentsComeBack) {
  Surface surface;
  for (int i = 0; i < 500; ++i) append(surface, shapes::tetrahedron());
  EXPECT_EQ(round_trip(surface), "");
}

TEST(Fans, AnySoupComesBack) {
  RandomMeshOptions options;
  options.arrays = options.several_blocks = false;
  for (uint64_t seed = 0; seed < cases(3000); ++seed) {
    options.faces = seed % 7 == 0 ? 600 : 60;
    ASSERT_EQ(round_trip(surface_of(random_surface(seed, options))), "") << "seed " << seed;
  }
}

TEST(Fans, OfRegularSurfacesCostNextToNothing) {
  const Coded coded = encode(shapes::torus(100, 100));
  EXPECT_LT(coded.fans.bytes.size(), 20000u * 3 / 100);
}

TEST(Fans, EveryTruncationIsAnError) {
  for (const Surface& shape : shapes_and_fans()) {
    const Coded coded = encode(shape);
    for (size_t size = 0; size < coded.fans.bytes.size(); ++size) {
      const auto decoded =
          decode_fans(Bytes(coded.fans.bytes).first(size), triangles_of(coded), coded.points);
      ASSERT_FALSE(decoded) << size;
      EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
    }
  }
}

/// Any bytes: so many triangles over vertices that are there, or corrupt.
void expect_safe(Bytes bytes, uint32_t triangles, uint32_t most_vertices) {
  const auto decoded = decode_fans(bytes, triangles, most_vertices);
  if (!decoded) {
    EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
    return;
  }
  EXPECT_EQ(decoded->triangles(), triangles);
  EXPECT_LE(decoded->vertices, most_vertices);
  for (const uint32_t v : decoded->corners) ASSERT_LT(v, decoded->vertices);
  ASSERT_EQ(decoded->references.size(), decoded->vertices);
  for (const VertexReferences& references : decoded->references) {
    for (const uint32_t r : references.at) ASSERT_LT(r, decoded->vertices);
  }
  for (const uint8_t kind : decoded->kinds) ASSERT_LT(kind, vertex_kinds);
}

TEST(Fans, DamageEndsInErrorsOrValidTriangles) {
  auto shapes_to_damage = shapes_and_fans();
  shapes_to_damage.push_back(shapes::sphere(40, 40));
  RandomMeshOptions options;
  options.faces = 300;
  for (uint64_t seed = 0; seed < 20; ++seed)
    shapes_to_damage.push_back(surface_of(random_surface(seed, options)));
  std::vector<Coded> good;
  for (const Surface& shape : shapes_to_damage) good.push_back(encode(shape));
  for (uint64_t seed = 0; seed < cases(2000); ++seed) {
    Random random(seed);
    const Coded& coded = good[random.below(good.size())];
    expect_safe(damaged(coded.fans.bytes, random), triangles_of(coded) + random.below(2) * random.below(100),
                coded.points + random.below(2));
    if (HasFailure()) return;
  }
}

TEST(Fans, AnyBytesAreSafe) {
  for (uint64_t seed = 0; seed < cases(2000) && !HasFailure(); ++seed) {
    Random random(seed);
    std::vector<std::byte> bytes = random_bytes(random, random.below(300));
    // A count of vertices and one of bytes for the tables, so that more than the header is reached.
    if (bytes.size() > 3) {
      bytes[0] = static_cast<std::byte>(random.below(128));
      bytes[1] =
          static_cast<std::byte>(random.below(static_cast<uint32_t>(std::min<size_t>(bytes.size(), 128))));
    }
    expect_safe(bytes, random.chance(10) ? 0 : random.below(20000), random.below(10000));
  }
}

TEST(Fans, ClaimedTrianglesThatNoBytesHoldAreAnError) {
  const Coded coded = encode(shapes::tetrahedron());
  EXPECT_FALSE(decode_fans(coded.fans.bytes, 0x10000000, 0x08000000));
}

}  // namespace
}  // namespace maille::testing
