#include "surface/front/connectivity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "entropy/integer_model.h"
#include "entropy/mixing.h"
#include "support/cases.h"
#include "support/half_edges.h"
#include "support/named_shapes.h"
#include "support/random_mesh.h"

namespace maille::testing {
namespace {

struct Coded {
  GluedSurface before;
  HalfEdges surface;  ///< with origins as coded
  CodedConnectivity coded;
};

Coded encode(const Surface& shape) {
  Coded result;
  const FaceList list = face_list(shape);
  result.before = glue(list.view());
  result.surface = result.before.half_edges;
  result.coded = encode_connectivity(result.surface, result.before.real_half_edges, list.points);
  return result;
}

Result<DecodedConnectivity> decode(const Coded& coded, Bytes bytes) {
  return decode_connectivity(coded.coded.header, bytes, coded.surface.size(), coded.surface.size());
}

/// What differs between the surface decoded and the one encoded, face by face in coded order; empty: nothing.
std::string difference(const Coded& coded, const DecodedConnectivity& decoded) {
  const HalfEdges& a = coded.surface;
  const HalfEdges& b = decoded.surface;
  if (a.size() != b.size()) return "another number of half-edges";
  std::vector<uint32_t> there(a.size(), none);
  uint32_t next = 0;
  for (const uint32_t first : coded.coded.first_half_edges) {
    const uint32_t base = next;
    if (a.degree(first) != b.degree(base)) return "another degree";
    uint32_t h = first;
    do {
      if (there[h] != none) return "a face twice";
      there[h] = next++;
      h = a.next(h);
    } while (h != first);
  }
  if (next != a.size()) return "faces are missing";
  for (uint32_t h = 0; h < a.size(); ++h) {
    if (a.origin[h] != b.origin[there[h]]) return "another origin";
    if (there[a.opposite[h]] != b.opposite[there[h]]) return "glued in another way";
    if (there[a.next(h)] != b.next(there[h])) return "another order in a face";
  }
  if (coded.coded.vertices.size() != decoded.vertices.size()) return "another number of vertices";
  for (uint32_t v = 0; v < decoded.vertices.size(); ++v) {
    if (there[coded.coded.vertices.corner[v]] != decoded.vertices.corner[v])
      return "another corner of a vertex";
  }
  return {};
}

std::string round_trip(const Surface& shape) {
  const Coded coded = encode(shape);
  const auto decoded = decode(coded, coded.coded.bytes);
  if (!decoded) return decoded.error().message;
  const std::string closed = check_closed(decoded->surface);
  return closed.empty() ? difference(coded, *decoded) : closed;
}

Surface prism(uint32_t n) {
  Surface surface;
  surface.points.resize(2 * n);
  std::vector<uint32_t> bottom, top;
  for (uint32_t i = 0; i < n; ++i) {
    surface.faces.push_back({i, (i + 1) % n, n + (i + 1) % n, n + i});
    bottom.push_back(n - 1 - i);
    top.push_back(n + i);
  }
  surface.faces.push_back(bottom);
  surface.faces.push_back(top);
  return surface;
}

std::vector<Surface> shapes_and_a_prism() {
  std::vector<Surface> all = named_shapes();
  all.push_back(prism(5));
  return all;
}

TEST(Connectivity, ComesBackHalfEdgeByHalfEdge) {
  for (const Surface& shape : shapes_and_a_prism()) {
    EXPECT_EQ(round_trip(shape), "");
    EXPECT_EQ(round_trip(triangulated(shape)), "");
  }
}

TEST(Connectivity, FacesOfEveryDegreeComeBack) {
  for (uint32_t degree = 3; degree <= 12; ++degree) EXPECT_EQ(round_trip(prism(degree)), "") << degree;
  for (const uint32_t degree : {50u, 255u, 256u, 5000u, max_degree})
    EXPECT_EQ(round_trip(prism(degree)), "") << degree;
  Surface all;
  for (uint32_t degree = 3; degree <= 12; ++degree) append(all, prism(degree));
  EXPECT_EQ(round_trip(all), "");
}

TEST(Connectivity, VerticesOfManyEdgesComeBack) {
  for (const uint32_t edges : {3u, 7u, 100u, 5000u}) {
    EXPECT_EQ(round_trip(shapes::fan(edges, true)), "") << edges;
    EXPECT_EQ(round_trip(shapes::fan(edges, false)), "") << edges;
    EXPECT_EQ(round_trip(shapes::sphere(edges, 3)), "") << edges;
  }
}

TEST(Connectivity, KeepsTheGenus) {
  // A surface without handles has a characteristic of two: any other one needs a front that met itself.
  for (uint32_t genus = 0; genus <= 4; ++genus) {
    const Coded coded = encode(shapes::plate(genus));
    const auto decoded = decode(coded, coded.coded.bytes);
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(euler_characteristic(decoded->surface), 2 - 2 * int64_t{genus});
  }
}

TEST(Connectivity, NumbersOriginsAsTheirPoints) {
  for (const Surface& shape : shapes_and_a_prism()) {
    const Coded coded = encode(shape);
    const auto points = static_cast<uint32_t>(shape.points.size());
    for (uint32_t h = 0; h < coded.surface.size(); ++h) {
      const uint32_t before = coded.before.half_edges.origin[h], vertex = coded.surface.origin[h];
      ASSERT_EQ(before >= points, vertex >= first_dummy);
      if (vertex < first_dummy) {
        ASSERT_EQ(coded.coded.points[vertex], before);
      }
    }
  }
}

TEST(Connectivity, NothingIsNothing) {
  const Coded coded = encode({});
  EXPECT_EQ(coded.coded.header.components, 0u);
  EXPECT_EQ(round_trip({}), "");
}

RandomMeshOptions faces_only() {
  RandomMeshOptions options;
  options.arrays = options.special_values = options.any_position_type = options.several_blocks = false;
  return options;
}

TEST(Connectivity, AnySoupComesBack) {
  for (uint64_t seed = 0; seed < cases(2000); ++seed)
    ASSERT_EQ(round_trip(surface_of(random_surface(seed, faces_only()))), "") << seed;
}

TEST(Connectivity, OfRegularSurfacesCostsNextToNothing) {
  const Surface quads = shapes::torus(100, 100);
  EXPECT_LT(encode(quads).coded.bytes.size(), 100u);
  EXPECT_LT(encode(triangulated(quads)).coded.bytes.size(), 100u);
  EXPECT_EQ(round_trip(quads), "");
}

TEST(Connectivity, OfFlippedFacesCostsNoMore) {
  Surface surface = shapes::sphere(40, 30);
  const size_t before = encode(surface).coded.bytes.size();
  for (size_t i = 1; i < surface.faces.size(); i += 2)
    std::reverse(surface.faces[i].begin(), surface.faces[i].end());
  EXPECT_EQ(encode(surface).coded.bytes.size(), before);
}

TEST(Connectivity, EveryTruncationIsAnError) {
  for (const Surface& shape : shapes_and_a_prism()) {
    const Coded coded = encode(shape);
    for (size_t size = 0; size < coded.coded.bytes.size(); ++size) {
      const auto decoded = decode(coded, Bytes(coded.coded.bytes).first(size));
      ASSERT_FALSE(decoded) << size;
      EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
    }
  }
}

/// What the decoder says about a first face with these valences and nothing behind it.
std::string error_of_first_face(const std::vector<uint32_t>& valences, uint32_t most_half_edges) {
  ConnectivityHeader header;
  header.components = 1;
  header.regular_degree = static_cast<uint32_t>(valences.size());
  header.regular_valence = 3;
  header.uniform_degree = true;
  RangeEncoder encoder;
  OffsetModel model;
  for (const uint32_t valence : valences) model.code(encoder, static_cast<int32_t>(valence) - 3);
  const auto decoded = decode_connectivity(header, encoder.finish(), most_half_edges, most_half_edges);
  return decoded ? std::string() : decoded.error().message;
}

TEST(Connectivity, FacesOfTwoEdgesAreRefused) {
  EXPECT_EQ(error_of_first_face({2, 2, 2}, 100), "");  // two triangles back to back
  // The second triangle leaves two vertices without free edges: between them is room for a face of two edges.
  EXPECT_NE(error_of_first_face({3, 3, 2}, 100).find("does not fit its gate"), std::string::npos);
}

TEST(Connectivity, MoreVerticesThanAClosedSurfaceCanHaveAreRefused) {
  const std::vector<uint32_t> valences(1000, 2);
  EXPECT_EQ(error_of_first_face(valences, 2000), "");
  EXPECT_NE(error_of_first_face(valences, 1998).find("more vertices"), std::string::npos);
}

/// Any bytes: a closed surface of at most so many half-edges, or corrupt.
void expect_safe(const ConnectivityHeader& header, Bytes bytes, uint32_t most) {
  const auto decoded = decode_connectivity(header, bytes, most, most);
  if (!decoded) {
    EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
    return;
  }
  EXPECT_EQ(check_closed(decoded->surface), "");
  EXPECT_LE(decoded->surface.size(), most);
}

TEST(Connectivity, DamageEndsInErrorsOrClosedSurfaces) {
  std::vector<Coded> good;
  for (const Surface& shape : shapes_and_a_prism()) good.push_back(encode(shape));
  for (uint64_t seed = 0; seed < cases(3000); ++seed) {
    Random random(seed);
    const Coded& coded = good[random.below(good.size())];
    expect_safe(coded.coded.header, damaged(coded.coded.bytes, random), coded.surface.size());
    if (HasFailure()) return;
  }
}

TEST(Connectivity, AnyHeaderOverAnyBytesIsSafe) {
  for (uint64_t seed = 0; seed < cases(5000) && !HasFailure(); ++seed) {
    Random random(seed);
    ConnectivityHeader header;
    header.components = random.chance(20) ? none : random.below(5);
    header.regular_valence = random.chance(20) ? random.below(65536) : random.below(10);
    header.regular_degree = random.chance(20) ? random.below(65536) : random.below(10);
    header.uniform_degree = random.chance(50);
    header.has_border = random.chance(50);
    const uint32_t most = random.chance(10) ? 0 : random.below(100000);
    expect_safe(header, random_bytes(random, random.below(100)), most);
  }
}

}  // namespace
}  // namespace maille::testing
