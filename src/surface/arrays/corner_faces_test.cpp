#include "surface/arrays/corner_faces.h"

#include <gtest/gtest.h>

#include <cmath>

#include "entropy/rans.h"
#include "support/coded_mesh.h"
#include "support/random.h"
#include "support/random_mesh.h"
#include "surface/arrays/joints.h"
#include "surface/fans/fan_patch.h"
#include "surface/fans/placed_weights.h"

namespace maille::testing {
namespace {

using R = VertexReferences;

/// The faces of a mesh, coded as fans or by the front; none where nothing can be coded so.
std::vector<CornerFaces> faces_of(const Mesh& mesh) {
  std::vector<CornerFaces> all{corner_faces(CodedMesh(mesh).encoded.topology.surface)};
  const auto fans = encode_fan_patch(mesh);
  if (fans && *fans) all.push_back(corner_faces((**fans).patch.fans));
  return all;
}

TEST(CornerFaces, FacesAcrossRunTheOtherWay) {
  for (uint64_t seed = 0; seed < 100; ++seed) {
    for (const CornerFaces& faces : faces_of(random_surface(seed, {.arrays = false}))) {
      for (uint32_t c = 0; c < faces.corners(); ++c) {
        ASSERT_EQ(faces.previous(faces.next(c)), c);
        const uint32_t over = faces.opposite[c];
        if (over == none) continue;
        ASSERT_EQ(faces.opposite[over], c) << seed;
        ASSERT_EQ(faces.points[over], faces.points[faces.next(c)]) << seed;
        ASSERT_EQ(faces.points[faces.next(over)], faces.points[c]) << seed;
      }
    }
  }
}

/// Triangles share a hub and nothing else, but for the last one, which has an edge with the first: the edges
/// of all others wait at the hub before that one.
TEST(CornerFaces, LooksAtSixtyFourOpenEdgesOfAPoint) {
  for (const uint32_t open : {1u, 63u, 64u, 65u, 1000u}) {
    FanSurface fans;
    for (uint32_t i = 0; i < open; ++i) {
      for (const uint32_t point : {0u, 2 * i + 1, 2 * i + 2}) fans.corners.push_back(point);
    }
    for (const uint32_t point : {1u, 0u, 2 * open + 1}) fans.corners.push_back(point);
    fans.vertices = 2 * open + 2;
    EXPECT_EQ(corner_faces(fans).opposite[3 * open], open <= 64 ? 0 : none) << open;
  }
}

TEST(ElementReferences, ComeBeforeTheirElement) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    for (const CornerFaces& faces : faces_of(random_surface(seed, {.arrays = false}))) {
      for (const FanSurface& around :
           {element_references(faces, faces.points, faces.point_count), face_references(faces)}) {
        for (uint32_t e = 1; e < around.vertices; ++e) {
          for (const uint32_t r : around.references[e].at) ASSERT_LT(r, e) << seed;
        }
      }
    }
  }
}

TEST(ElementReferences, ParallelogramsAreExactOnFlatLattices) {
  for (const bool triangles : {false, true}) {
    const Surface shape = triangles ? triangulated(shapes::grid(9, 9)) : shapes::grid(9, 9);
    const auto fans = encode_fan_patch(to_mesh(shape));
    ASSERT_TRUE(fans && *fans);
    const CornerFaces faces = corner_faces((**fans).patch.fans);
    const FanSurface around = element_references(faces, faces.points, faces.point_count);
    unsigned parallelograms = 0;
    for (uint32_t e = 0; e < around.vertices; ++e) {
      const auto x = [&](uint32_t element, unsigned k) {
        return shape.points[(**fans).sources.points[element]][k];
      };
      const auto& at = around.references[e].at;
      const unsigned place = place_of_kind(around.kinds[e]);
      if (place == start_place || place == edge_place) continue;
      ++parallelograms;
      for (unsigned k = 0; k < 2; ++k) {
        ASSERT_EQ(x(at[R::focus], k) + x(at[R::last], k) - x(at[R::before], k), x(e, k));
        if (kind_has_late(around.kinds[e])) {
          ASSERT_EQ(x(at[R::late], k) + x(at[R::late + 1], k) - x(at[R::late + 2], k), x(e, k));
        }
        if (kind_is_last(around.kinds[e])) {
          ASSERT_EQ(x(at[R::focus], k) + x(at[R::next], k) - x(at[R::next_opposite], k), x(e, k));
        }
      }
    }
    EXPECT_GT(parallelograms, 80u) << triangles;
  }
}

TEST(Joints, BringBackWhichCornersHoldTheSame) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    Random random(seed);
    for (const CornerFaces& faces : faces_of(random_surface(seed, {.arrays = false}))) {
      const FanSurface around = element_references(faces, faces.points, faces.point_count);
      std::vector<uint32_t> values(faces.corners()), twins(random.chance(50) ? faces.corners() : 0);
      for (uint32_t& value : values) value = random.chance(80) ? 0 : random.below(3);
      for (uint32_t c = 0; c < twins.size(); ++c) twins[c] = 3 * faces.points[c] + values[c];
      RansEncoder encoder(1);
      const auto first =
          JointCoder<RansEncoder>(encoder, faces, around, twins).code([&](uint32_t a, uint32_t b) {
            return values[a] == values[b];
          });
      const auto bytes = encoder.finish();
      RansDecoder decoder(bytes, 1);
      const auto back = JointCoder<RansDecoder>(decoder, faces, around, twins).code([](uint32_t, uint32_t) {
        return false;
      });
      ASSERT_FALSE(decoder.exhausted());
      ASSERT_EQ(first, back) << seed;
      for (uint32_t c = 0; c < faces.corners(); ++c) {
        ASSERT_EQ(faces.points[first[c]], faces.points[c]) << seed;
        ASSERT_EQ(values[first[c]], values[c]) << seed;
        const uint32_t over = faces.opposite[c];
        if (over == none || values[faces.next(over)] != values[c]) continue;
        ASSERT_EQ(first[faces.next(over)], first[c]) << seed;
      }
    }
  }
}

TEST(PlacedWeights, TexturesThatKeepAnglesCostLittle) {
  // An uneven plane, turned and scaled into its texture, or mirrored.
  Surface shape = triangulated(shapes::grid(40, 40));
  Random random(4);
  for (auto& point : shape.points) {
    for (unsigned k = 0; k < 2; ++k) point[k] += 0.6 * random.unit();
    point[2] = 0;
  }
  const CodedMesh patch(to_mesh(shape));
  for (const double side : {1.0, -1.0}) {
    Array uv = make_array("uv", Domain::point, Scalar::f32, 2, Role::texture_coordinate);
    uv.resize(shape.points.size());
    for (size_t i = 0; i < shape.points.size(); ++i) {
      const double x = shape.points[i][0], y = shape.points[i][1] * side;
      uv.values<float>()[2 * i] = static_cast<float>(0.01 * (0.8 * x - 0.6 * y));
      uv.values<float>()[2 * i + 1] = static_cast<float>(0.01 * (0.6 * x + 0.8 * y));
    }
    const auto maps = choose_maps(uv, {Tolerance::Kind::bits, 14}, false);
    ASSERT_TRUE(maps);
    PatchElements elements = patch.elements();
    const size_t placed = encode_array(elements, uv, *maps, patch.sources(uv), false).size();
    elements.positions = {};
    EXPECT_LT(4 * placed, encode_array(elements, uv, *maps, patch.sources(uv), false).size()) << side;
  }
}

}  // namespace
}  // namespace maille::testing
