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
  for (uint32_t t = 0; t < decoded.faces(); ++t) {
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
  EXPECT_EQ(decoded->faces(), triangles);
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

/// Empty when each vertex refers to earlier ones.
std::string references_differ(const FanSurface& fans) {
  for (uint32_t v = 0; v < fans.vertices; ++v) {
    if (fans.kinds[v] >= vertex_kinds) return "a kind that is not there";
    for (const uint32_t r : fans.references[v].at) {
      if (r >= std::max(v, 1u)) return "vertex " + std::to_string(v) + " refers to " + std::to_string(r);
    }
  }
  return {};
}

/// The same for faces of any degree.
struct CodedPolygons {
  GluedSurface glued;
  FaceList list;
  EncodedFans fans;

  explicit CodedPolygons(const Surface& shape) : list(face_list(shape)) {
    glued = glue(list.view());
    fans = encode_fans(glued.half_edges, glued.real_half_edges, list.points);
  }
  uint32_t faces() const { return list.view().size(); }
  uint32_t corners() const { return glued.real_half_edges; }
  Result<FanSurface> decode(Bytes bytes) const {
    return decode_polygon_fans(bytes, faces(), corners(), list.points);
  }
};

/// Is each face of the mesh there once, from the corner told, and the same on both sides?
std::string difference(const CodedPolygons& coded, const FanSurface& decoded) {
  const FanSurface& before = coded.fans.surface;
  if (decoded.corners != before.corners || decoded.offsets != before.offsets ||
      decoded.across != before.across)
    return "other faces than the encoder saw";
  if (decoded.kinds != before.kinds) return "other kinds";
  for (uint32_t v = 0; v < decoded.vertices; ++v) {
    if (decoded.references[v].at != before.references[v].at) return "other references";
  }
  if (const std::string wrong = references_differ(decoded); !wrong.empty()) return wrong;
  if (decoded.faces() != coded.faces() || decoded.vertices != coded.fans.points.size())
    return "another number";
  std::vector<bool> seen(coded.corners());
  for (uint32_t f = 0; f < decoded.faces(); ++f) {
    uint32_t h = coded.fans.half_edges[f];
    for (const uint32_t v : decoded.face(f)) {
      if (seen[h]) return "a corner twice";
      seen[h] = true;
      if (coded.fans.points[v] != coded.glued.half_edges.origin[h]) return "another point";
      h = coded.glued.half_edges.next(h);
    }
    if (h != coded.fans.half_edges[f]) return "another degree";
  }
  return {};
}

bool has_polygons(const Surface& shape) {
  return !face_list(shape).offsets.empty();
}

std::string polygons_round_trip(const Surface& shape) {
  const CodedPolygons coded(shape);
  const auto decoded = coded.decode(coded.fans.bytes);
  return decoded ? difference(coded, *decoded) : decoded.error().message;
}

std::vector<Surface> shapes_of_polygons() {
  std::vector<Surface> result;
  for (const Surface& shape : named_shapes()) {
    if (has_polygons(shape)) result.push_back(shape);
  }
  // Beside one of 40 corners, one with a chord: two edges between the same vertices.
  Surface large = shapes::grid(3, 3);
  std::vector<uint32_t> ring;
  for (uint32_t k = 0; k < 40; ++k) ring.push_back(static_cast<uint32_t>(large.points.size()) + k);
  large.points.resize(large.points.size() + 40);
  large.faces.push_back(ring);
  large.faces.push_back({ring[1], ring[0], 0, 1});
  result.push_back(large);
  Surface chord;
  chord.points.resize(6);
  chord.faces = {{0, 1, 2, 3}, {0, 3, 4}, {3, 0, 5}, {1, 0, 3, 2}, {2, 1, 4, 5}};
  result.push_back(chord);
  return result;
}

TEST(PolygonFans, ShapesComeBack) {
  for (const Surface& shape : shapes_of_polygons()) EXPECT_EQ(polygons_round_trip(shape), "");
}

TEST(PolygonFans, AnySoupComesBack) {
  RandomMeshOptions options;
  options.arrays = options.several_blocks = false;
  for (uint64_t seed = 0; seed < cases(3000); ++seed) {
    options.faces = seed % 7 == 0 ? 600 : 60;
    const Surface shape = surface_of(random_surface(seed, options));
    if (!has_polygons(shape)) continue;
    ASSERT_EQ(polygons_round_trip(shape), "") << "seed " << seed;
  }
}

TEST(PolygonFans, OfRegularSurfacesCostNextToNothing) {
  Surface quads;
  const uint32_t n = 100;
  quads.points.resize(n * n);
  for (uint32_t i = 0; i < n * n; ++i) {
    const uint32_t right = i / n * n + (i + 1) % n;
    quads.faces.push_back({i, right, (right + n) % (n * n), (i + n) % (n * n)});
  }
  EXPECT_LT(CodedPolygons(quads).fans.bytes.size(), 100u);
}

TEST(PolygonFans, EveryTruncationIsAnError) {
  for (const Surface& shape : shapes_of_polygons()) {
    const CodedPolygons coded(shape);
    for (size_t size = 0; size < coded.fans.bytes.size(); ++size) {
      const auto decoded = coded.decode(Bytes(coded.fans.bytes).first(size));
      ASSERT_FALSE(decoded) << size;
      EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
    }
  }
}

TEST(PolygonFans, DamageEndsInErrorsOrFacesOverVerticesThatAreThere) {
  std::vector<CodedPolygons> good;
  for (const Surface& shape : shapes_of_polygons()) good.emplace_back(shape);
  RandomMeshOptions options;
  options.faces = 300;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const Surface shape = surface_of(random_surface(seed, options));
    if (has_polygons(shape)) good.emplace_back(shape);
  }
  for (uint64_t seed = 0; seed < cases(20000) && !HasFailure(); ++seed) {
    Random random(seed);
    const CodedPolygons& coded = good[random.below(static_cast<uint32_t>(good.size()))];
    const auto decoded = coded.decode(damaged(coded.fans.bytes, random));
    if (!decoded) {
      EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
      continue;
    }
    EXPECT_EQ(decoded->faces(), coded.faces());
    EXPECT_EQ(decoded->corners.size(), coded.corners());
    EXPECT_LE(decoded->vertices, coded.list.points);
    for (const uint32_t v : decoded->corners) ASSERT_LT(v, decoded->vertices);
    for (uint32_t f = 0; f < decoded->faces(); ++f) ASSERT_GE(decoded->face(f).size(), 3u);
    ASSERT_EQ(references_differ(*decoded), "");
  }
}

TEST(PolygonFans, AnyBytesAreSafe) {
  for (uint64_t seed = 0; seed < cases(5000) && !HasFailure(); ++seed) {
    Random random(seed);
    std::vector<std::byte> bytes = random_bytes(random, random.below(300));
    if (bytes.size() > 3) {
      bytes[0] = static_cast<std::byte>(random.below(128));
      bytes[1] =
          static_cast<std::byte>(random.below(static_cast<uint32_t>(std::min<size_t>(bytes.size(), 128))));
    }
    const auto decoded =
        decode_polygon_fans(bytes, random.below(5000), random.below(20000), random.below(10000));
    if (!decoded) {
      EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
    }
  }
}

}  // namespace
}  // namespace maille::testing
