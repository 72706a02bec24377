#include "generate/surfaces.h"

#include <gtest/gtest.h>
#include <cmath>
#include <limits>

#include "generate/transfinite_vector.h"

namespace maille {
namespace {

using Kind = BlockSurface::Kind;

BlockSurface surface(Kind kind, Position a, Position b = {}, double radius = 0) {
  BlockSurface made;
  made.name = "s";
  made.kind = kind;
  made.a = a;
  made.b = b;
  made.radius = radius;
  return made;
}

Position projected(const std::vector<BlockSurface>& all, const Position& at) {
  BlockDescription description;
  description.surfaces = all;
  const auto surfaces = Surfaces::make(description);
  EXPECT_TRUE(surfaces) << surfaces.error().message;
  std::vector<uint32_t> numbers;
  for (uint32_t i = 0; i < all.size(); ++i) numbers.push_back(i);
  return surfaces ? surfaces->project(at, numbers) : Position{};
}

void expect_near(const Position& found, const Position& wanted) {
  for (unsigned k = 0; k < 3; ++k) EXPECT_NEAR(found[k], wanted[k], 1e-12) << k;
}

TEST(Surfaces, TakePointsToTheNearestOne) {
  expect_near(projected({surface(Kind::sphere, {1, 0, 0}, {}, 2)}, {1, 3, 0}), {1, 2, 0});
  const BlockSurface cylinder = surface(Kind::cylinder, {0, 0, -4}, {0, 0, 4}, 2);
  expect_near(projected({cylinder}, {3, 0, 1}), {2, 0, 1});
  expect_near(projected({cylinder}, {1, 0, 1}), {2, 0, 1});
  expect_near(projected({cylinder}, {1, 0, 3.9}), {1, 0, 4});  // the end cap is nearer than the side
  expect_near(projected({cylinder}, {1, 0, 5}), {1, 0, 4});
  expect_near(projected({cylinder}, {3, 0, 5}), {2, 0, 4});
  expect_near(projected({surface(Kind::plane, {0, 0, 2}, {0, 0, 5})}, {7, 8, 900}), {7, 8, 2});
  const BlockSurface box = surface(Kind::box, {2, 2, 2}, {0, 0, 0});
  expect_near(projected({box}, {1, 1, 3}), {1, 1, 2});
  expect_near(projected({box}, {1, 1.75, 1}), {1, 2, 1});
  expect_near(projected({surface(Kind::box, {1, 0, 0}, {1, 9, 9})}, {3, 4, 5}), {1, 4, 5});
}

TEST(Surfaces, TakePointsToTheNearestTriangleExactly) {
  BlockSurface corner;
  corner.kind = Kind::triangles;
  corner.points = {{0, 0, 0.1}, {4, 0, 0.1}, {0, 4, 0.1}, {0, 0, 4.1}};
  corner.triangles = {{0, 1, 2}, {0, 2, 3}};
  expect_near(projected({corner}, {1, 1, 0.3}), {1, 1, 0.1});
  expect_near(projected({corner}, {0.2, 1, 1}), {0, 1, 1});
  expect_near(projected({corner}, {-1, -1, 0}), {0, 0, 0.1});
  expect_near(projected({corner}, {3, 3, 0.1}), {2, 2, 0.1});
}

TEST(Surfaces, TakePointsToTheNearestTriangleFarFromTheOrigin) {
  const double far = 1e7;
  BlockSurface stairs;
  stairs.kind = Kind::triangles;
  for (uint32_t i = 0; i < 9; ++i) {
    const double z = far + 0.125 * i;
    stairs.points.insert(stairs.points.end(), {{far, far, z}, {far + 1, far, z}, {far, far + 1, z}});
    stairs.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  expect_near(projected({stairs}, {far + 0.25, far + 0.25, far + 0.3}), {far + 0.25, far + 0.25, far + 0.25});
}

TEST(Surfaces, MeetInAPointOfAllOfThem) {
  const Position at = projected({surface(Kind::cylinder, {0, 0, -9}, {0, 0, 9}, 1),
                                 surface(Kind::cylinder, {-9, 0, 0}, {9, 0, 0}, 1.5)},
                                {0.9, 0.9, 1});
  EXPECT_NEAR(std::hypot(at[0], at[1]), 1, 1e-12);
  EXPECT_NEAR(std::hypot(at[1], at[2]), 1.5, 1e-12);
}

TEST(Surfaces, LeavePointsThatAreFartherAwayThanTheirSize) {
  BlockSurface square;
  square.kind = Kind::triangles;
  square.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  square.triangles = {{0, 1, 2}, {0, 2, 3}};
  expect_near(projected({square}, {0.5, 0.5, 1.4}), {0.5, 0.5, 0});
  expect_near(projected({square}, {0.5, 0.5, 1.42}), {0.5, 0.5, 1.42});
}

TEST(Surfaces, PointsWithoutADirectionStillComeToTheSurface) {
  const Position ball = projected({surface(Kind::sphere, {1, 2, 3}, {}, 2)}, {1, 2, 3});
  EXPECT_NEAR(length(ball - Position{1, 2, 3}), 2, 1e-12);
  const Position tube = projected({surface(Kind::cylinder, {0, 0, -9}, {0, 0, 9}, 1)}, {0, 0, 1});
  EXPECT_NEAR(std::hypot(tube[0], tube[1]), 1, 1e-12);
}

TEST(Surfaces, RefuseWhatIsNoSurface) {
  const auto message_of = [](const BlockSurface& given) {
    BlockDescription description;
    description.surfaces = {given};
    const auto made = Surfaces::make(description);
    return made ? std::string("none") : made.error().message;
  };
  EXPECT_EQ(message_of(surface(Kind::sphere, {}, {}, 0)), "surface 's': its radius is not positive");
  EXPECT_EQ(message_of(surface(Kind::cylinder, {}, {}, 1)), "surface 's': its axis has no length");
  EXPECT_EQ(message_of(surface(Kind::plane, {})), "surface 's': its normal has no direction");
  EXPECT_EQ(message_of(surface(Kind::triangles, {})), "surface 's': it has no triangles");
  EXPECT_EQ(message_of(surface(Kind::box, {std::numeric_limits<double>::quiet_NaN(), 0, 0})),
            "surface 's': a number is not finite");
  BlockSurface loose = surface(Kind::triangles, {});
  loose.points = {{0, 0, 0}};
  loose.triangles = {{0, 0, 1}};
  EXPECT_EQ(message_of(loose), "surface 's': a triangle has a point that does not exist");
}

TEST(Surfaces, RefuseProjectionsToNothing) {
  BlockDescription description;
  description.vertices = {{0, 0, 0}};
  description.projected_vertices = {{0, {0}}};
  EXPECT_EQ(Surfaces::make(description).error().message,
            "a vertex is projected to a surface that does not exist");
  description.projected_vertices = {{0, {}}};
  EXPECT_EQ(Surfaces::make(description).error().message, "a vertex is projected to nothing");
  description.surfaces = {surface(Kind::sphere, {}, {}, 1)};
  description.projected_vertices = {{1, {0}}};
  EXPECT_EQ(Surfaces::make(description).error().message, "a vertex that is projected does not exist");
}

}  // namespace
}  // namespace maille
