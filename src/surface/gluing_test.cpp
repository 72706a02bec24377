#include "surface/gluing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "support/half_edges.h"
#include "support/random_mesh.h"

namespace maille::testing {
namespace {

/// Different dummies, one for each border loop.
size_t dummies(const GluedSurface& glued, uint32_t points) {
  std::set<uint32_t> found;
  for (const uint32_t origin : glued.half_edges.origin) {
    if (origin >= points) found.insert(origin);
  }
  return found.size();
}

size_t border_triangles(const GluedSurface& glued) {
  return (glued.half_edges.size() - glued.real_half_edges) / 3;
}

/// Half-edges of real faces that are glued to real faces.
size_t inner_half_edges(const GluedSurface& glued) {
  size_t count = 0;
  for (uint32_t h = 0; h < glued.real_half_edges; ++h)
    count += glued.half_edges.opposite[h] < glued.real_half_edges;
  return count;
}

struct Expected {
  size_t dummies;
  size_t border_triangles;
};

/// Glued wherever two faces meet, without a choice and without a flip.
void expect_plain(const Surface& surface, Expected expected) {
  const GluedSurface result = glued(surface);
  EXPECT_EQ(check_closed(result.half_edges), "");
  EXPECT_EQ(dummies(result, static_cast<uint32_t>(surface.points.size())), expected.dummies);
  EXPECT_EQ(border_triangles(result), expected.border_triangles);
  EXPECT_TRUE(result.flipped.empty());
  EXPECT_FALSE(result.chosen);
}

TEST(IsSimple, AsksForThreeDifferentCornersOrMore) {
  using Corners = std::vector<uint32_t>;
  for (const Corners& corners : {Corners{0, 1, 2}, Corners{5, 4, 3, 2, 1}}) EXPECT_TRUE(is_simple(corners));
  for (const Corners& corners : {Corners{}, Corners{0}, Corners{0, 1}, Corners{0, 1, 0}, Corners{0, 0, 1},
                                 Corners{1, 0, 0}, Corners{0, 1, 2, 3, 1}}) {
    EXPECT_FALSE(is_simple(corners));
  }
  Corners large(max_degree);
  std::iota(large.begin(), large.end(), 0u);
  EXPECT_TRUE(is_simple(large));
  large.push_back(max_degree);
  EXPECT_FALSE(is_simple(large));
}

TEST(Glue, ClosedSurfacesHaveNoBorder) {
  for (const Surface& surface :
       {shapes::tetrahedron(), shapes::cube(), shapes::torus(5, 4), shapes::sphere(7, 5), shapes::plate(2)}) {
    expect_plain(surface, {0, 0});
  }
}

TEST(Glue, EveryBorderLoopGetsADummyAndATrianglePerEdge) {
  expect_plain(shapes::grid(3, 2), {1, 10});
  expect_plain(shapes::cylinder(6, 2), {2, 12});
  expect_plain(shapes::fan(5, true), {1, 5});
  Surface with_hole = shapes::grid(3, 3);
  with_hole.faces.erase(with_hole.faces.begin() + 4);
  expect_plain(with_hole, {2, 12 + 4});
  Surface two = shapes::grid(1, 1);
  append(two, shapes::fan(3, false));
  expect_plain(two, {2, 4 + 5});
}

TEST(Glue, NothingGivesNothing) {
  const GluedSurface result = glued({});
  EXPECT_EQ(result.half_edges.size(), 0u);
  EXPECT_TRUE(result.flipped.empty());
}

TEST(Glue, FacesThatShareAPointOnlyStayApart) {
  Surface bow_tie;
  bow_tie.points.resize(5);
  bow_tie.faces = {{0, 1, 2}, {0, 3, 4}};
  expect_plain(bow_tie, {2, 6});
}

TEST(Glue, AMoebiusStripIsCutOnce) {
  const GluedSurface result = glued(shapes::moebius(8, 1));
  EXPECT_EQ(check_closed(result.half_edges), "");
  EXPECT_TRUE(result.chosen);
  // Two border edges per quad, and both sides of the cut, in one loop.
  EXPECT_EQ(dummies(result, 16), 1u);
  EXPECT_EQ(border_triangles(result), 18u);
}

TEST(Glue, AKleinBottleIsCutToo) {
  const GluedSurface result = glued(shapes::klein_bottle(6, 5));
  EXPECT_EQ(check_closed(result.half_edges), "");
  EXPECT_TRUE(result.chosen);
  EXPECT_GT(border_triangles(result), 0u);
}

TEST(Glue, FacesOnOneEdgeAreGluedInPairs) {
  for (uint32_t faces = 3; faces <= 9; ++faces) {
    const GluedSurface result = glued(shapes::book(faces));
    EXPECT_EQ(check_closed(result.half_edges), "");
    EXPECT_TRUE(result.chosen);
    EXPECT_EQ(inner_half_edges(result), faces / 2 * 2) << faces;
    // All pages run the same way along the edge: every second one had to be turned over.
    ASSERT_EQ(result.flipped.size(), faces);
    for (uint32_t face = 0; face < faces; ++face) EXPECT_EQ(result.flipped[face], face % 2 == 1) << face;
  }
}

TEST(Glue, ASheetLyingTwiceIsClosedAlongItsBorder) {
  // The copy of a border face is reached over the border, and must be turned over for it.
  Surface surface = shapes::grid(4, 3);
  const auto faces = surface.faces;
  surface.faces.insert(surface.faces.end(), faces.begin(), faces.end());
  const GluedSurface result = glued(surface);
  EXPECT_EQ(check_closed(result.half_edges), "");
  EXPECT_TRUE(result.chosen);
  EXPECT_EQ(border_triangles(result), 0u);
  EXPECT_EQ(std::count(result.flipped.begin(), result.flipped.end(), true), 12);
}

TEST(Glue, ASheetAndItsBackCloseAlongTheBorder) {
  Surface surface = shapes::grid(4, 3);
  for (size_t i = 0; i < 12; ++i)
    surface.faces.emplace_back(surface.faces[i].rbegin(), surface.faces[i].rend());
  const GluedSurface result = glued(surface);
  EXPECT_EQ(check_closed(result.half_edges), "");
  EXPECT_EQ(border_triangles(result), 0u);
  EXPECT_TRUE(result.flipped.empty());
}

TEST(Glue, AFaceTwiceIsAPillow) {
  Surface surface;
  surface.points.resize(3);
  surface.faces = {{0, 1, 2}, {0, 1, 2}};
  const GluedSurface result = glued(surface);
  EXPECT_EQ(check_closed(result.half_edges), "");
  EXPECT_EQ(border_triangles(result), 0u);
  EXPECT_EQ(result.flipped, (std::vector<bool>{false, true}));
}

TEST(Glue, FlippedFacesAreTurnedBack) {
  for (const Surface& shape :
       {shapes::cube(), shapes::torus(6, 5), shapes::sphere(8, 6), shapes::grid(5, 5)}) {
    Random random(shape.faces.size());
    Surface surface = shape;
    std::vector<bool> flipped(surface.faces.size());
    for (size_t face = 1; face < flipped.size(); ++face) {
      flipped[face] = random.chance(50);
      if (flipped[face]) std::reverse(surface.faces[face].begin(), surface.faces[face].end());
    }
    const GluedSurface result = glued(surface);
    EXPECT_EQ(check_closed(result.half_edges), "");
    EXPECT_EQ(result.flipped, flipped);
    EXPECT_FALSE(result.chosen);
    EXPECT_EQ(border_triangles(result), border_triangles(glued(shape)));
  }
}

/// The corners of face i as the surface has them, walked backwards when it was flipped.
std::vector<uint32_t> corners_of(const GluedSurface& glued, const Faces& faces, uint32_t face,
                                 uint32_t entry) {
  const bool flipped = !glued.flipped.empty() && glued.flipped[face];
  std::vector<uint32_t> corners;
  uint32_t h = entry;
  for (uint32_t i = faces.first(face); i < faces.first(face + 1); ++i) {
    corners.push_back(glued.half_edges.origin[h]);
    h = flipped ? glued.half_edges.previous(h) : glued.half_edges.next(h);
  }
  return corners;
}

RandomMeshOptions faces_only() {
  RandomMeshOptions options;
  options.arrays = options.special_values = options.any_position_type = options.several_blocks = false;
  return options;
}

TEST(Glue, ClosesAnySoupAndKeepsItsFaces) {
  for (uint64_t seed = 0; seed < 1500; ++seed) {
    const FaceList list = face_list(surface_of(random_surface(seed, faces_only())));
    const GluedSurface result = glue(list.view());
    ASSERT_EQ(check_closed(result.half_edges), "") << seed;
    for (uint32_t face = 0; face < list.view().size(); ++face) {
      const uint32_t first = list.view().first(face);
      const std::vector<uint32_t> corners(list.corners.begin() + first,
                                          list.corners.begin() + list.view().first(face + 1));
      ASSERT_EQ(corners_of(result, list.view(), face, first), corners) << seed << ", face " << face;
    }
  }
}

/// Faces in the order of a breadth-first walk, each from where it was reached: glued again, they must give
/// the same surface.
void expect_repeatable(const FaceList& list, uint64_t seed) {
  const GluedSurface once = glue(list.view());
  std::vector<uint32_t> face_of, seeds;
  for (uint32_t face = 0; face < list.view().size(); ++face) {
    face_of.resize(list.view().first(face + 1), face);
    seeds.push_back(list.view().first(face));
  }
  std::vector<bool> is_real(once.half_edges.size());
  std::fill(is_real.begin(), is_real.begin() + once.real_half_edges, true);
  const auto order = breadth_first_faces(once.half_edges, seeds, is_real);
  ASSERT_EQ(order.size(), seeds.size()) << seed;

  FaceList reordered;
  reordered.points = list.points;
  if (!list.offsets.empty()) reordered.offsets.push_back(0);
  std::vector<uint32_t> new_number(once.half_edges.size(), none);
  for (const uint32_t entry : order) {
    uint32_t h = entry;
    auto number = static_cast<uint32_t>(reordered.corners.size());
    do {
      new_number[h] = number++;
      h = once.half_edges.next(h);
    } while (h != entry);
    const auto corners = corners_of(once, list.view(), face_of[entry], entry);
    reordered.corners.insert(reordered.corners.end(), corners.begin(), corners.end());
    if (!list.offsets.empty()) reordered.offsets.push_back(static_cast<uint32_t>(reordered.corners.size()));
  }
  const GluedSurface again = glue(reordered.view());
  ASSERT_EQ(again.half_edges.size(), once.half_edges.size()) << seed;
  ASSERT_EQ(again.chosen, once.chosen) << seed;
  for (uint32_t h = 0; h < once.real_half_edges; ++h) {
    const uint32_t k = once.half_edges.opposite[h];
    const uint32_t there = again.half_edges.opposite[new_number[h]];
    ASSERT_EQ(there < again.real_half_edges, k < once.real_half_edges) << seed;
    if (k < once.real_half_edges) {
      ASSERT_EQ(there, new_number[k]) << seed;
    }
  }
}

TEST(BreadthFirstFaces, GluedInThatOrderGiveTheSameSurface) {
  for (uint64_t seed = 0; seed < 1500 && !HasFailure(); ++seed) {
    expect_repeatable(face_list(surface_of(random_surface(seed, faces_only()))), seed);
  }
}

TEST(BreadthFirstFaces, ListEveryRealFaceOnceFromWhereItWasReached) {
  const FaceList list = face_list(shapes::grid(4, 4));
  const GluedSurface result = glue(list.view());
  std::vector<bool> is_real(result.half_edges.size());
  std::fill(is_real.begin(), is_real.begin() + result.real_half_edges, true);
  const uint32_t seeds[] = {20};
  const auto order = breadth_first_faces(result.half_edges, seeds, is_real);
  EXPECT_EQ(order.size(), 16u);
  EXPECT_EQ(order[0], 20u);
  std::set<uint32_t> reached = {order[0] / 4};
  for (size_t i = 1; i < order.size(); ++i) {
    EXPECT_EQ(reached.count(result.half_edges.opposite[order[i]] / 4), 1u) << i;  // through a face before
    EXPECT_TRUE(reached.insert(order[i] / 4).second) << i;
  }
}

}  // namespace
}  // namespace maille::testing
