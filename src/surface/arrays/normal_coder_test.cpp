#include "surface/arrays/normal_coder.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/coded_mesh.h"
#include "support/half_edges.h"
#include "support/random_mesh.h"
#include "surface/front/element_walk.h"

namespace maille::testing {
namespace {

/// Hills of triangles or quads, 40 x 40.
Mesh hills(bool triangles) {
  Surface surface = shapes::grid(40, 40);
  for (auto& p : surface.points) {
    const double x = p[0], y = p[1];
    p[2] = static_cast<float>(2 * std::sin(x / 3) * std::cos(y / 4) + x * y / 50);
  }
  return to_mesh(triangles ? triangulated(surface) : surface);
}

Vector3 position(const Mesh& mesh, uint32_t point) {
  const float* at = mesh.points.values<float>().data() + size_t{3} * point;
  return {{double{at[0]}, double{at[1]}, double{at[2]}}};
}

/// Normals of triangles as an exporter computes them, for points by the angles of their faces, else by face.
Array exported_normals(const Mesh& mesh, Domain domain, bool unit) {
  Array array = make_array("normal", domain, Scalar::f32, 3, Role::normal);
  array.resize(mesh.count_of(domain));
  std::vector<Vector3> sums(array.count());
  const CellBlock& block = mesh.blocks[0];
  for (uint32_t i = 0; i < block.size(); ++i) {
    const auto cell = block.cell(i);
    for (size_t c = 0; c < 3; ++c) {
      const Vector3 u = position(mesh, cell[(c + 1) % 3]) - position(mesh, cell[c]);
      const Vector3 v = position(mesh, cell[(c + 2) % 3]) - position(mesh, cell[c]);
      const double angle = std::acos(dot(u, v) / std::sqrt(dot(u, u) * dot(v, v)));
      const Vector3 normal = unit_vector(cross(u, v));
      if (domain == Domain::point) sums[cell[c]] = sums[cell[c]] + normal * angle;
      if (domain == Domain::cell) sums[i] = normal;
      if (domain == Domain::corner) sums[3 * i + c] = normal;
    }
  }
  for (size_t i = 0; i < sums.size(); ++i) {
    const Vector3 normal = unit ? unit_vector(sums[i]) : sums[i];
    for (unsigned k = 0; k < 3; ++k) array.values<float>()[3 * i + k] = static_cast<float>(normal[k]);
  }
  return array;
}

/// Bits for each tuple, after a look at what the decoder makes of them.
double bits(const CodedMesh& patch, const Array& array, const Tolerance& tolerance = {}) {
  const auto maps = choose_maps(array, tolerance, false);
  EXPECT_TRUE(maps);
  const auto& sources = patch.sources(array);
  const auto bytes = encode_array(patch.elements(), array, *maps, sources, false);
  Array decoded = make_array(array.name, array.domain, array.type, array.components, array.role);
  const auto done = decode_array(patch.elements(), bytes, array.count(), decoded);
  EXPECT_TRUE(done) << (done ? "" : done.error().message);
  for (size_t i = 0; i < sources.size() && done; ++i) {
    for (size_t k = 0; k < array.components && sources[i] != none; ++k) {
      const float before = array.values<float>()[array.components * sources[i] + k];
      const float after = decoded.values<float>()[array.components * i + k];
      if (maps->lossless ? bits_as<uint32_t>(before) != bits_as<uint32_t>(after)
                         : !(std::fabs(before - after) <= maps->maximum_error)) {
        ADD_FAILURE() << "number " << k << " of tuple " << sources[i] << " is another one";
        return 0;
      }
    }
  }
  return 8.0 * static_cast<double>(bytes.size()) / static_cast<double>(array.count());
}

TEST(Normals, ComputedFromThePositionsCostAFewBits) {
  const CodedMesh patch(hills(true));
  for (const Domain domain : {Domain::point, Domain::cell, Domain::corner}) {
    EXPECT_LT(bits(patch, exported_normals(patch.mesh, domain, true)), 5) << name_of(domain);
  }
  EXPECT_LT(bits(patch, exported_normals(patch.mesh, Domain::point, false)), 5) << "sums";
}

TEST(Normals, OnALatticeOfTheSphereCostNextToNothingWhereTheSurfaceGivesThem) {
  const CodedMesh patch(hills(true));
  const Tolerance tolerance{Tolerance::Kind::bits, 10};
  for (const Domain domain : {Domain::point, Domain::cell})
    EXPECT_LT(bits(patch, exported_normals(patch.mesh, domain, true), tolerance), 1) << name_of(domain);
}

/// Two codes have a direction only: one that is expected to have another length cannot be told by them.
TEST(Normals, OnALatticeOfTheSphereOfAnyLengthAreRefused) {
  const CodedMesh patch(hills(true));
  const Array array = exported_normals(patch.mesh, Domain::point, true);
  const auto maps = choose_maps(array, {Tolerance::Kind::bits, 10}, false);
  ASSERT_TRUE(maps && maps->octahedral);
  std::vector<std::byte> bytes = encode_array(patch.elements(), array, *maps, patch.sources(array), false);
  for (unsigned how = 0; how <= NormalCoding::most_flags; ++how) {
    bytes[3] = static_cast<std::byte>(how);  // after coding, flags and weight
    if (NormalCoding::from(0, static_cast<uint8_t>(how)).unit) continue;
    Array decoded = make_array("normal", Domain::point, Scalar::f32, 3, Role::normal);
    const auto done = decode_array(patch.elements(), bytes, 0, decoded);
    ASSERT_FALSE(done) << how;
    EXPECT_EQ(done.error().message, "array \"normal\" is coded in an unknown way");
  }
}

TEST(Normals, UnitVectorsAtRandomCostTwoComponents) {
  const CodedMesh patch(hills(false));
  Array array = make_array("normal", Domain::point, Scalar::f32, 3, Role::normal);
  array.resize(patch.mesh.point_count());
  Random random(3);
  for (size_t i = 0; i < array.count(); ++i) {
    Vector3 v;
    for (double& x : v.x) x = 2 * random.unit() - 1;
    v = unit_vector(v);
    for (unsigned k = 0; k < 3; ++k) array.values<float>()[3 * i + k] = static_cast<float>(v[k]);
  }
  // 25 bits each would be the numbers as they are.
  EXPECT_LT(bits(patch, array), 66);
}

TEST(Normals, OfTheOtherSideCostTheSame) {
  const CodedMesh patch(hills(true));
  Array inward = exported_normals(patch.mesh, Domain::point, true);
  for (float& x : inward.values<float>()) x = -x;
  EXPECT_LT(bits(patch, inward), 5);
}

TEST(Normals, OfPointsAtTheSamePlaceAreOfAllTheirFaces) {
  Mesh mesh = hills(true);
  const Array whole = exported_normals(mesh, Domain::point, true);
  // Every face of the right half gets points of its own.
  const size_t points = mesh.point_count();
  std::vector<uint32_t> copy_of;
  auto& nodes = mesh.blocks[0].connectivity;
  for (size_t i = nodes.size() / 2; i < nodes.size(); ++i) {
    copy_of.push_back(nodes[i]);
    nodes[i] = static_cast<uint32_t>(points + copy_of.size() - 1);
  }
  Array normals = whole;
  for (const uint32_t point : copy_of) {
    for (Array* array : {&mesh.points, &normals}) {
      array->resize(array->count() + 1);
      std::memcpy(array->bytes.data() + array->bytes.size() - 12, array->bytes.data() + size_t{12} * point,
                  12);
    }
  }
  EXPECT_LT(bits(CodedMesh(mesh), normals), 10);
}

TEST(Normals, OfCreasesFollowTheFacesOfEachSide) {
  // A roof whose two sides have normals of their own at the ridge.
  Surface surface = shapes::grid(30, 30);
  for (auto& p : surface.points)
    p[2] = static_cast<float>(-std::fabs(double{p[0]} - 15) + 0.02 * p[1] * p[1]);
  const CodedMesh patch(to_mesh(surface));
  const CellBlock& block = patch.mesh.blocks[0];
  Array array = make_array("normal", Domain::corner, Scalar::f32, 3, Role::normal);
  array.resize(patch.mesh.corner_count());
  for (uint32_t i = 0; i < block.size(); ++i) {
    const auto cell = block.cell(i);
    const Vector3 n = unit_vector(cross(position(patch.mesh, cell[2]) - position(patch.mesh, cell[0]),
                                        position(patch.mesh, cell[3]) - position(patch.mesh, cell[1])));
    const double side = n[0] < 0 ? -1 : 1;
    for (size_t c = 0; c < 4; ++c) {
      const double y = position(patch.mesh, cell[c])[1];
      const Vector3 smooth = unit_vector({{side, -0.04 * y, 1}});
      for (unsigned k = 0; k < 3; ++k)
        array.values<float>()[(4 * i + c) * 3 + k] = static_cast<float>(smooth[k]);
    }
  }
  EXPECT_LT(bits(patch, array), 12);
}

TEST(Textures, StretchedAsTheSurfaceIsCostLessWithPositions) {
  Mesh mesh = hills(true);
  Random random(5);
  // Points pushed about in their plane, which no parallelogram knows.
  Array texture = make_array("uv", Domain::point, Scalar::f32, 2, Role::texture_coordinate);
  texture.resize(mesh.point_count());
  for (size_t i = 0; i < mesh.point_count(); ++i) {
    float* at = mesh.points.values<float>().data() + 3 * i;
    at[0] += static_cast<float>(0.6 * random.unit());
    at[1] += static_cast<float>(0.6 * random.unit());
    at[2] = 0;
    texture.values<float>()[2 * i] = at[0] / 64;
    texture.values<float>()[2 * i + 1] = at[1] / 64;
  }
  const Tolerance tolerance{Tolerance::Kind::bits, 12};
  CodedMesh patch(mesh);
  const double placed = bits(patch, texture, tolerance);
  patch.positions.clear();
  EXPECT_LT(placed, bits(patch, texture, tolerance) / 3);
}

TEST(ElementWalk, WedgesHoldEveryCornerOnceWhateverIsJoined) {
  for (uint64_t seed = 0; seed < 60; ++seed) {
    const CodedMesh patch(random_surface(seed, {.faces = 40, .arrays = false, .other_cells = true}));
    const auto face_of = faces_of_half_edges(patch.encoded.topology.surface, Domain::corner);
    std::vector<unsigned> seen(patch.elements().corners());
    Random random(seed);
    const PatchElements elements = patch.elements();
    ElementWalk walk(elements, face_of);
    walk.run_wedges([](uint32_t, uint32_t) { return true; },
                    [&](const CornerPair&) { return random.chance(60); },
                    [&](uint32_t element, const ElementStencil&, const Wedge& wedge) {
                      for (const uint32_t h : wedge.corners) ++seen[h];
                      if (wedge.corners.empty()) ++seen[element];
                      return true;
                    });
    const auto& sources = patch.encoded.sources.corners;
    for (size_t i = 0; i < seen.size(); ++i) ASSERT_EQ(seen[i], sources[i] == none ? 0u : 1u) << seed;
  }
}

TEST(NormalCoding, FlagsAreReadAsTheyWereWritten) {
  for (unsigned flags = 0; flags <= NormalCoding::most_flags; ++flags)
    EXPECT_EQ(NormalCoding::from(2, static_cast<uint8_t>(flags)).flags(), flags);
}

}  // namespace
}  // namespace maille::testing
