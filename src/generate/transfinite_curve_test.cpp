#include "generate/transfinite_curve.h"

#include <gtest/gtest.h>

#include "generate/transfinite_vector.h"

namespace maille {
namespace {

constexpr double pi = 3.14159265358979323846;

void expect_near(const Position& a, const Position& b, double tolerance = 1e-14) {
  EXPECT_LT(length(a - b), tolerance)
      << a[0] << " " << a[1] << " " << a[2] << " instead of " << b[0] << " " << b[1] << " " << b[2];
}

Curve curve(CurveKind kind, std::vector<Position> points, Position from = {0, 0, 0},
            Position to = {1, 0, 0}) {
  auto made = Curve::make({kind, 0, 1, std::move(points)}, from, to);
  EXPECT_TRUE(made) << made.error().message;
  return std::move(*made);
}

Position on_circle(double degrees) {
  return {std::cos(degrees * pi / 180), std::sin(degrees * pi / 180), 0};
}

// Measured: points of edges made by OpenFOAM 1912.
TEST(Curve, IsWhereBlockMeshPutsIt) {
  const std::vector<Position> points{{0.3, -0.2, 0}, {0.5, -0.1, 0.1}};
  expect_near(curve(CurveKind::polyline, points).at(0.125), {0.11701948517747031, -0.07801299011831354, 0.0});
  expect_near(curve(CurveKind::polyline, points).at(0.5),
              {0.46493601991716677, -0.11753199004141662, 0.08246800995858339});
  expect_near(curve(CurveKind::spline, points).at(0.125),
              {0.12165958636692321, -0.09193329368667225, -0.004640101189452899});
  expect_near(curve(CurveKind::spline, points).at(0.5),
              {0.44831824455150676, -0.12133422722212661, 0.09312405607116671});
  expect_near(curve(CurveKind::spline, points).at(0.875),
              {0.8566547252166554, -0.027066164840996804, 0.032409131893237256});
  expect_near(curve(CurveKind::b_spline, points).at(0.125),
              {0.11603034114595456, -0.07504555802376633, 0.0009891440315157362});
  expect_near(curve(CurveKind::b_spline, points).at(0.5),
              {0.4928893403365713, -0.11726254906092493, 0.06386240089903503});
  expect_near(curve(CurveKind::bezier, {{0.3, -0.2, 0}}).at(0.125), {0.08125, -0.043750000000000004, 0.0});
}

TEST(Curve, GoesThroughItsEndsExactly) {
  const Position from{0.1, 0.2, 0.3};
  const Position to{1.1, 0.7, -0.3};
  for (const CurveKind kind :
       {CurveKind::arc, CurveKind::polyline, CurveKind::spline, CurveKind::b_spline, CurveKind::bezier}) {
    const Curve made = curve(kind, {{0.5, 0.9, 0.1}}, from, to);
    EXPECT_EQ(made.at(0), from);
    EXPECT_EQ(made.at(1), to);
  }
}

TEST(Curve, ArcKeepsItsAngle) {
  expect_near(curve(CurveKind::arc, {on_circle(10)}, on_circle(0), on_circle(90)).at(0.5), on_circle(45));
  expect_near(curve(CurveKind::arc, {on_circle(300)}, on_circle(0), on_circle(200)).at(0.5), on_circle(280));
}

// Measured: a point behind the end or beyond half a circle.
TEST(Curve, ArcSetsOffAsBlockMeshDoes) {
  expect_near(curve(CurveKind::arc, {on_circle(150)}, on_circle(225), on_circle(195)).at(0.5),
              on_circle(210));
  expect_near(curve(CurveKind::arc, {on_circle(100)}, on_circle(0), on_circle(30)).at(0.5), on_circle(15));
  expect_near(curve(CurveKind::arc, {on_circle(200)}, on_circle(0), on_circle(30)).at(0.5), on_circle(195));
  expect_near(curve(CurveKind::arc, {on_circle(185)}, on_circle(0), on_circle(190)).at(0.5), on_circle(275));
}

TEST(Curve, RefusesAnArcOnALine) {
  EXPECT_FALSE(Curve::make({CurveKind::arc, 0, 1, {{0.5, 0, 0}}}, {0, 0, 0}, {1, 0, 0}));
}

TEST(ArcMiddle, IsOnTheCircle) {
  const Position axis{0, 0, 2};
  expect_near(*arc_middle(on_circle(0), on_circle(90), 90, axis), on_circle(45));
  expect_near(*arc_middle(on_circle(0), on_circle(200), 200, axis), on_circle(100));
  expect_near(*arc_middle(on_circle(90), on_circle(0), -90, axis), on_circle(45));
  EXPECT_FALSE(arc_middle(on_circle(0), on_circle(90), 0, axis));
  EXPECT_FALSE(arc_middle(on_circle(0), on_circle(90), 90, {1, 0, 0}));
}

TEST(ArcMiddle, AboutACentreIsBetweenBothEnds) {
  expect_near(*arc_middle_about(on_circle(0), on_circle(90), {0, 0, 0}, 1), on_circle(45));
  expect_near(*arc_middle_about(on_circle(0), 3.0 * on_circle(90), {0, 0, 0}, 1),
              (2 / std::sqrt(10.0)) * Position{1, 3, 0});
  EXPECT_FALSE(arc_middle_about(on_circle(0), on_circle(180), {0, 0, 0}, 1));
}

}  // namespace
}  // namespace maille
