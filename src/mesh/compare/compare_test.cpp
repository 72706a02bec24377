#include <maille/compare.h>

#include "support/cases.h"
#include "support/random.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace maille::testing {
namespace {

using ::testing::HasSubstr;
using Faces = std::vector<std::vector<uint32_t>>;

std::string text_of(const Comparison& comparison) {
  std::string text = comparison.equal ? "equal" : "different";
  for (const std::string& difference : comparison.differences) text += "\n  " + difference;
  return text;
}

#define EXPECT_SAME(...) EXPECT_EQ(text_of(compare(__VA_ARGS__)), "equal")
#define EXPECT_DIFFERENT(what, ...) EXPECT_THAT(text_of(compare(__VA_ARGS__)), HasSubstr(what))

/// All points at the origin: only the faces tell them apart.
Mesh faces_only(uint32_t points, const Faces& faces) {
  Surface surface;
  surface.points.resize(points, {0, 0, 0});
  surface.faces = faces;
  return to_mesh(surface);
}

Mesh without_positions(Mesh mesh) {
  std::fill(mesh.points.bytes.begin(), mesh.points.bytes.end(), std::byte{0});
  return mesh;
}

/// Undirected graphs as two-corner faces: (a b) and (b a) are rotations of each other.
Mesh graph(uint32_t points, const Faces& edges) {
  return faces_only(points, edges);
}

template <class T>
Array array_of(std::string name, Domain domain, Scalar type, uint32_t components,
               const std::vector<T>& values) {
  Array array = make_array(std::move(name), domain, type, components);
  array.resize(values.size() / components);
  std::memcpy(array.bytes.data(), values.data(), array.bytes.size());
  return array;
}

TEST(Compare, EmptyMeshesAreEqual) {
  EXPECT_SAME(Mesh{}, Mesh{});
  EXPECT_SAME(Mesh{}, faces_only(0, {}));
  EXPECT_DIFFERENT("A has 0 points, B 1", Mesh{}, faces_only(1, {}));
}

TEST(Compare, FindsShuffledMeshesEqual) {
  for (const Mesh& mesh : {cube(), tetrahedron(), grid(7, 4), torus(8, 5), sphere(9, 6), moebius(11, 2)}) {
    for (uint64_t seed = 0; seed < 10; ++seed) EXPECT_SAME(mesh, shuffled(mesh, seed));
  }
}

TEST(Compare, FindsShuffledMeshesWithoutPositionsEqual) {
  for (const Mesh& mesh :
       {cube(), tetrahedron(), grid(7, 4), torus(8, 5), torus(6, 6), sphere(9, 6), moebius(11, 2)}) {
    for (uint64_t seed = 0; seed < 10; ++seed) {
      EXPECT_SAME(without_positions(mesh), without_positions(shuffled(mesh, seed)));
    }
  }
}

TEST(Compare, TellsAFlippedFaceApart) {
  const Mesh a = grid(3, 3);
  Mesh b = a;
  std::reverse(b.blocks[0].connectivity.begin() + 4, b.blocks[0].connectivity.begin() + 8);
  EXPECT_DIFFERENT("quad 1 (points 1 2 6 5)", a, b);
  EXPECT_FALSE(compare(without_positions(a), without_positions(b)).equal);
  EXPECT_FALSE(compare(without_positions(cube()), without_positions(flipped(cube(), 3))).equal);
}

TEST(Compare, FlippingAllFacesOfASymmetricMeshIsARenaming) {
  // A cube is its own mirror image when its points have no positions; with positions it is inside out.
  EXPECT_SAME(without_positions(cube()), without_positions(flipped(cube(), 1, 100)));
  EXPECT_FALSE(compare(cube(), flipped(cube(), 1, 100)).equal);
}

TEST(Compare, AMoebiusStripIsNoCylinder) {
  const Mesh strip = without_positions(to_mesh(shapes::moebius(8, 1)));
  const Mesh ring = without_positions(to_mesh(shapes::cylinder(8, 1)));
  EXPECT_FALSE(compare(strip, ring).equal);
}

TEST(Compare, AKleinBottleIsNoTorus) {
  EXPECT_FALSE(
      compare(without_positions(to_mesh(shapes::klein_bottle(6, 6))), without_positions(torus(6, 6))).equal);
}

TEST(Compare, TwoIdenticalComponentsMayBeSwapped) {
  Surface two = shapes::cube();
  append(two, shapes::cube());
  EXPECT_SAME(to_mesh(two), shuffled(to_mesh(two), 5));
  Surface mixed = shapes::cube();
  append(mixed, shapes::torus(4, 2));
  EXPECT_FALSE(compare(without_positions(to_mesh(two)), without_positions(to_mesh(mixed))).equal);
}

TEST(Compare, ManyIdenticalComponentsAreMatchedQuickly) {
  Surface many;
  for (int i = 0; i < 4000; ++i) append(many, shapes::tetrahedron());
  for (int i = 0; i < 4000; ++i) many.points.push_back({0, 0, 0});
  const Mesh a = to_mesh(many);
  EXPECT_SAME(a, shuffled(a, 1));
  EXPECT_SAME(without_positions(a), without_positions(shuffled(a, 1)));
  Mesh b = shuffled(a, 1);
  std::swap(b.blocks[0].connectivity[0], b.blocks[0].connectivity[1]);
  EXPECT_FALSE(compare(without_positions(a), without_positions(b)).equal);
}

TEST(Compare, ALongStripWithoutPositionsIsNotQuadratic) {
  const Mesh a = without_positions(grid(30000, 1));
  EXPECT_SAME(a, shuffled(a, 1));
  EXPECT_SAME(without_positions(to_mesh(shapes::cylinder(30000, 1))),
              shuffled(without_positions(to_mesh(shapes::cylinder(30000, 1))), 2));
}

TEST(Compare, TellsRegularGraphsApartThatRefinementCannot) {
  // Every point has two edges: a ring of six against two rings of three.
  const Mesh ring = graph(6, {{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}, {5, 0}});
  const Mesh rings = graph(6, {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}});
  EXPECT_SAME(ring, shuffled(ring, 2));
  EXPECT_DIFFERENT("all were tried", ring, rings);

  const Mesh petersen = graph(10, {{0, 1},
                                   {1, 2},
                                   {2, 3},
                                   {3, 4},
                                   {4, 0},
                                   {5, 7},
                                   {7, 9},
                                   {9, 6},
                                   {6, 8},
                                   {8, 5},
                                   {0, 5},
                                   {1, 6},
                                   {2, 7},
                                   {3, 8},
                                   {4, 9}});
  const Mesh prism = graph(10, {{0, 1},
                                {1, 2},
                                {2, 3},
                                {3, 4},
                                {4, 0},
                                {5, 6},
                                {6, 7},
                                {7, 8},
                                {8, 9},
                                {9, 5},
                                {0, 5},
                                {1, 6},
                                {2, 7},
                                {3, 8},
                                {4, 9}});
  for (uint64_t seed = 0; seed < 20; ++seed) EXPECT_SAME(petersen, shuffled(petersen, seed));
  EXPECT_DIFFERENT("all were tried", petersen, prism);
}

/// Shrikhande's graph and the 4 x 4 rook's graph: strongly regular with the same parameters.
Mesh four_by_four(bool shrikhande) {
  Faces edges;
  const auto number = [](uint32_t x, uint32_t y) { return (x % 4) + 4 * (y % 4); };
  for (uint32_t x = 0; x < 4; ++x) {
    for (uint32_t y = 0; y < 4; ++y) {
      if (shrikhande) {
        edges.push_back({number(x, y), number(x + 1, y)});
        edges.push_back({number(x, y), number(x, y + 1)});
        edges.push_back({number(x, y), number(x + 1, y + 1)});
      } else {
        for (uint32_t k = x + 1; k < 4; ++k) edges.push_back({number(x, y), number(k, y)});
        for (uint32_t k = y + 1; k < 4; ++k) edges.push_back({number(x, y), number(x, k)});
      }
    }
  }
  return graph(16, edges);
}

TEST(Compare, TellsStronglyRegularGraphsApart) {
  EXPECT_SAME(four_by_four(true), shuffled(four_by_four(true), 9));
  EXPECT_SAME(four_by_four(false), shuffled(four_by_four(false), 9));
  EXPECT_DIFFERENT("all were tried", four_by_four(true), four_by_four(false));
}

TEST(Compare, AHiddenDifferenceDoesNotMultiplyWithSymmetricComponents) {
  // 30 rings that match one another, and one that does not: trying all matchings would never end.
  Surface a, b;
  for (int i = 0; i < 30; ++i) {
    append(a, shapes::torus(3, 3));
    append(b, shapes::torus(3, 3));
  }
  const Faces ring = {{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}, {5, 0}},
              rings = {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}};
  append(a, {std::vector<std::array<double, 3>>(6), ring});
  append(b, {std::vector<std::array<double, 3>>(6), rings});
  EXPECT_FALSE(compare(without_positions(to_mesh(a)), without_positions(to_mesh(b))).equal);
}

TEST(Compare, FlapsOnOnePointAreMatchedOneByOne) {
  Faces faces;
  for (uint32_t i = 0; i < 3000; ++i) faces.push_back({0, 2 * i + 1, 2 * i + 2});
  const Mesh a = faces_only(6001, faces);
  EXPECT_SAME(a, shuffled(a, 3));
}

TEST(Compare, TwinsInAChainNest) {
  Faces edges;
  for (uint32_t i = 0; i + 3 < 400; i += 2) {
    for (uint32_t from = i; from < i + 2; ++from) {
      edges.push_back({from, i + 2});
      edges.push_back({from, i + 3});
    }
  }
  const Mesh a = graph(400, edges);
  EXPECT_SAME(a, shuffled(a, 4));
}

TEST(Compare, FarTooSymmetricMeshesAreCalledUndecidedNotEqual) {
  Faces edges;
  for (uint32_t i = 0; i + 3 < 6000; i += 2) {
    for (uint32_t from = i; from < i + 2; ++from) {
      edges.push_back({from, i + 2});
      edges.push_back({from, i + 3});
    }
  }
  const Mesh a = graph(6000, edges);
  const Comparison comparison = compare(a, shuffled(a, 4));
  if (comparison.equal) return;
  EXPECT_THAT(text_of(comparison), HasSubstr("could not be decided"));
}

// A choice of one pair can pair all others at once; the faces among them then have no point left to speak for
// them.
TEST(Compare, AChoiceThatSettlesAllPointsMustFitTheFacesToo) {
  const Mesh mesh = faces_only(4, {{2, 1, 0}, {1, 3, 0, 2}, {2, 0, 3}, {0, 1, 3}, {2, 3, 1}});
  for (uint64_t seed = 0; seed < 200; ++seed) EXPECT_SAME(mesh, shuffled(mesh, seed)) << seed;
  RandomMeshOptions options{.faces = 120, .arrays = false, .special_values = false};
  options.any_position_type = options.several_blocks = false;
  const Mesh larger = random_surface(310391, options);
  for (uint64_t seed = 0; seed < 200; ++seed) EXPECT_SAME(larger, shuffled(larger, seed)) << seed;
}

TEST(Compare, FewPointsUnderManyFacesAreMatchedOrToldApart) {
  for (uint64_t seed = 0; seed < cases(3000); ++seed) {
    Random random(seed);
    const uint32_t points = random.between(3, 7);
    Faces faces;
    for (uint32_t i = random.between(3, 9); i > 0; --i) {
      std::vector<uint32_t> face;
      for (uint32_t k = 0; k < points; ++k) face.push_back(k);
      shuffle(face, random);
      face.resize(std::min(points, random.between(2, 4)));
      faces.push_back(face);
    }
    const Mesh mesh = faces_only(points, faces);
    for (uint64_t i = 0; i < 4; ++i) EXPECT_SAME(mesh, shuffled(mesh, seed + i)) << seed;
    std::reverse(faces[0].begin(), faces[0].end());
    const Comparison turned = compare(mesh, faces_only(points, faces));
    for (const std::string& difference : turned.differences) {
      EXPECT_EQ(difference.find("could not be decided"), std::string::npos) << seed;
    }
  }
}

TEST(Compare, CountsDuplicatePoints) {
  Surface a = shapes::tetrahedron(), b = a;
  a.points.push_back(a.points[0]);
  b.points.push_back(b.points[1]);
  EXPECT_SAME(to_mesh(a), shuffled(to_mesh(a), 1));
  EXPECT_DIFFERENT("1 point of A has no partner in B and 1 of B none in A", to_mesh(a), to_mesh(b));
  EXPECT_DIFFERENT("point 0 (0 0 0), 2 times in A, 1 times in B", to_mesh(a), to_mesh(b));
}

TEST(Compare, DuplicatePointsAreToldApartByTheirFaces) {
  // Points 0 and 1 are at one place, as are 2 and 3; the faces use one of each.
  const Mesh a = faces_only(4, {{0, 2, 3}, {1, 2, 3}});
  const Mesh b = faces_only(4, {{0, 2, 3}, {1, 3, 2}});
  const Mesh c = faces_only(4, {{0, 2, 3}, {0, 2, 3}});
  EXPECT_FALSE(compare(a, b).equal);
  EXPECT_FALSE(compare(a, c).equal);
  EXPECT_SAME(a, faces_only(4, {{2, 0, 1}, {3, 0, 1}}));
}

TEST(Compare, CountsDuplicateFaces) {
  Surface a = shapes::grid(2, 1), b = a;
  a.faces = {a.faces[0], a.faces[0], a.faces[1]};
  b.faces = {b.faces[0], b.faces[1], b.faces[1]};
  EXPECT_SAME(to_mesh(a), shuffled(to_mesh(a), 1));
  EXPECT_DIFFERENT("quad 0 (points 0 1 4 3), 2 times in A, 1 times in B", to_mesh(a), to_mesh(b));
}

TEST(Compare, DegenerateFacesKeepTheirCyclicOrder) {
  const auto with_face = [](std::vector<uint32_t> face) {
    Surface surface = shapes::grid(2, 1);
    surface.faces.push_back(std::move(face));
    return to_mesh(surface);
  };
  EXPECT_SAME(with_face({0, 1, 0, 2, 0, 3}), with_face({0, 2, 0, 3, 0, 1}));
  EXPECT_FALSE(compare(with_face({0, 1, 0, 2, 0, 3}), with_face({0, 2, 0, 1, 0, 3})).equal);
  EXPECT_SAME(with_face({1, 1, 2}), with_face({1, 2, 1}));
  EXPECT_FALSE(compare(with_face({1, 1, 2}), with_face({1, 2, 2})).equal);
  EXPECT_SAME(with_face({}), with_face({}));
}

TEST(Compare, PositionsCountByBits) {
  Mesh a = tetrahedron(), b = a, c = a;
  const auto set = [](Mesh& mesh, uint32_t bits) { std::memcpy(&mesh.points.bytes[0], &bits, 4); };
  set(a, 0x80000000);
  EXPECT_DIFFERENT("no partner", a, b);
  set(b, 0x80000000);
  EXPECT_SAME(a, shuffled(b, 1));
  set(a, 0x7fc00001);
  set(b, 0x7fc00001);
  set(c, 0x7fc00002);
  EXPECT_SAME(a, shuffled(b, 1));
  EXPECT_FALSE(compare(a, c).equal);
  EXPECT_DIFFERENT("positions are f32 in A, f64 in B", tetrahedron(),
                   to_mesh(shapes::tetrahedron(), Scalar::f64));
}

TEST(Compare, ArraysFollowTheirElements) {
  for (const Domain domain : {Domain::point, Domain::corner, Domain::cell}) {
    Mesh a = grid(4, 4);
    Array array = make_array("x", domain, Scalar::u16, 1);
    array.resize(a.count_of(domain));
    for (size_t i = 0; i < array.count(); ++i) array.values<uint16_t>()[i] = static_cast<uint16_t>(i / 3);
    a.arrays.push_back(array);
    EXPECT_SAME(a, shuffled(a, 1));
    Mesh b = a;
    std::swap(b.arrays[0].bytes[0], b.arrays[0].bytes[20]);
    EXPECT_DIFFERENT(std::string(name_of(domain)) + " array \"x\"", a, b);
    EXPECT_DIFFERENT(std::string(name_of(domain)) + " array \"x\"", without_positions(a),
                     without_positions(b));
    EXPECT_SAME(a, b, {.compare_arrays = false});
  }
}

TEST(Compare, CornerArraysRotateWithTheFaceOnly) {
  Mesh a = faces_only(3, {{0, 1, 2}});
  a.arrays.push_back(array_of<uint8_t>("c", Domain::corner, Scalar::u8, 1, {1, 2, 3}));
  Mesh b = a;
  b.arrays[0] = array_of<uint8_t>("c", Domain::corner, Scalar::u8, 1, {2, 3, 1});
  EXPECT_SAME(a, b);
  b.arrays[0] = array_of<uint8_t>("c", Domain::corner, Scalar::u8, 1, {3, 2, 1});
  EXPECT_DIFFERENT("corner array \"c\"", a, b);
}

TEST(Compare, DuplicateFacesAreMatchedByTheirValues) {
  Mesh a = faces_only(3, {{0, 1, 2}, {0, 1, 2}});
  a.arrays.push_back(array_of<uint8_t>("c", Domain::corner, Scalar::u8, 1, {1, 1, 1, 2, 2, 2}));
  a.arrays.push_back(array_of<uint8_t>("f", Domain::cell, Scalar::u8, 1, {7, 8}));
  Mesh b = a;
  b.arrays[0] = array_of<uint8_t>("c", Domain::corner, Scalar::u8, 1, {2, 2, 2, 1, 1, 1});
  EXPECT_DIFFERENT("not together", a, b);
  b.arrays[1] = array_of<uint8_t>("f", Domain::cell, Scalar::u8, 1, {8, 7});
  EXPECT_SAME(a, b);
}

TEST(Compare, NamesArraysOfOneSideAndOtherDescriptions) {
  Mesh a = tetrahedron(), b = a;
  a.arrays.push_back(array_of<float>("t", Domain::point, Scalar::f32, 1, {1, 2, 3, 4}));
  EXPECT_DIFFERENT("point array \"t\" is only in A", a, b);
  EXPECT_DIFFERENT("point array \"t\" is only in B", b, a);
  b.arrays.push_back(array_of<double>("t", Domain::point, Scalar::f64, 1, {1, 2, 3, 4}));
  EXPECT_DIFFERENT("point array \"t\" is f32 x 1 in A, f64 x 1 in B", a, b);
}

TEST(Compare, OrderOfArraysDoesNotMatter) {
  Mesh a = tetrahedron();
  a.arrays.push_back(array_of<float>("t", Domain::point, Scalar::f32, 1, {1, 2, 3, 4}));
  a.arrays.push_back(array_of<float>("u", Domain::point, Scalar::f32, 1, {4, 3, 2, 1}));
  Mesh b = a;
  std::swap(b.arrays[0], b.arrays[1]);
  EXPECT_SAME(a, shuffled(b, 1));
}

TEST(Compare, MeshArraysKeepTheirOrder) {
  Mesh a = tetrahedron();
  a.arrays.push_back(array_of<int32_t>("m", Domain::mesh, Scalar::i32, 1, {1, 2, 3}));
  Mesh b = a;
  EXPECT_SAME(a, shuffled(b, 1));
  b.arrays[0] = array_of<int32_t>("m", Domain::mesh, Scalar::i32, 1, {1, 3, 2});
  EXPECT_DIFFERENT("mesh array \"m\": 2 of 3 tuples differ; first: tuple 1, (2) in A, (3) in B", a, b);
  b.arrays[0].resize(2);
  EXPECT_DIFFERENT("3 tuples in A, 2 in B", a, b);
}

TEST(Compare, LabelsCountByText) {
  Mesh a = faces_only(4, {{0, 1, 2}, {1, 2, 3}});
  a.arrays.push_back(array_of<uint8_t>("material", Domain::cell, Scalar::u8, 1, {0, 1}));
  a.arrays[0].role = Role::label;
  a.arrays[0].labels = {"wood", "steel"};
  Mesh b = a;
  b.arrays[0] = array_of<uint32_t>("material", Domain::cell, Scalar::u32, 1, {2, 0});
  b.arrays[0].role = Role::label;
  b.arrays[0].labels = {"steel", "unused", "wood"};
  EXPECT_SAME(a, b);
  EXPECT_SAME(a, b, {.same_order = true});
  b.arrays[0].labels[0] = "glass";
  EXPECT_DIFFERENT("cell array \"material\"", a, b);
  EXPECT_DIFFERENT("(\"steel\") in A, (\"glass\") in B", a, b, {.same_order = true});
  b.arrays[0].labels.clear();
  EXPECT_DIFFERENT("u8 x 1 with labels in A, u32 x 1 in B", a, b);
}

TEST(Compare, LabelsWithoutTextCountByNumber) {
  Mesh a = faces_only(3, {{0, 1, 2}});
  a.arrays.push_back(array_of<int8_t>("l", Domain::cell, Scalar::i8, 1, {-1}));
  a.arrays[0].labels = {"x"};
  Mesh b = a;
  EXPECT_SAME(a, b);
  b.arrays[0] = array_of<int8_t>("l", Domain::cell, Scalar::i8, 1, {5});
  b.arrays[0].labels = {"x"};
  EXPECT_FALSE(compare(a, b).equal);
}

CellBlock block_of(CellType type, std::vector<uint32_t> nodes, std::string name = "") {
  CellBlock block;
  block.name = std::move(name);
  block.type = type;
  if (nodes_of(type) == 0) block.offsets = {0, nodes.size()};
  block.connectivity = std::move(nodes);
  return block;
}

Mesh with_blocks(std::vector<CellBlock> blocks) {
  Mesh mesh = grid(3, 3);
  mesh.blocks = std::move(blocks);
  return mesh;
}

TEST(Compare, TrianglesAndQuadsEqualPolygonsOfTheirDegree) {
  CellBlock polygons = block_of(CellType::polygon, {0, 1, 2, 4, 5, 6, 7});
  polygons.offsets = {0, 3, 7};
  const Mesh a = with_blocks({polygons});
  EXPECT_SAME(a,
              with_blocks({block_of(CellType::triangle, {0, 1, 2}), block_of(CellType::quad, {4, 5, 6, 7})}));
  EXPECT_SAME(a,
              with_blocks({block_of(CellType::quad, {5, 6, 7, 4}), block_of(CellType::triangle, {1, 2, 0})}));
  CellBlock mixed = polygons;
  mixed.type = CellType::mixed;
  mixed.types = {5, 7};
  EXPECT_SAME(a, with_blocks({mixed}));
  mixed.types = {5, 10};
  EXPECT_FALSE(compare(a, with_blocks({mixed})).equal);
}

TEST(Compare, NodesOfOtherCellsKeepTheirOrder) {
  for (const CellType type :
       {CellType::tetrahedron, CellType::pixel, CellType::poly_line, CellType::poly_vertex}) {
    const Mesh a = with_blocks({block_of(type, {0, 1, 2, 3})});
    EXPECT_SAME(a, shuffled(a, 1));
    EXPECT_DIFFERENT(name_of(type), a, with_blocks({block_of(type, {1, 2, 3, 0})}));
  }
  EXPECT_FALSE(compare(with_blocks({block_of(CellType::line, {0, 1})}),
                       with_blocks({block_of(CellType::line, {1, 0})}))
                   .equal);
}

TEST(Compare, FacesOfPolyhedraCount) {
  CellBlock cell = block_of(CellType::polyhedron, {0, 1, 2, 3, 4, 5, 6});
  cell.cell_faces = {0, 2};
  cell.face_sizes = {3, 4};
  const Mesh a = with_blocks({cell, cell});
  EXPECT_SAME(a, shuffled(a, 1));
  Mesh b = a;
  b.blocks[1].face_sizes = {4, 3};
  EXPECT_DIFFERENT("polyhedron", a, b);
}

TEST(Compare, BlockNamesCountPerCell) {
  const Mesh a = with_blocks({block_of(CellType::triangle, {0, 1, 2, 3, 4, 5}, "left"),
                              block_of(CellType::triangle, {6, 7, 8}, "right")});
  const Mesh b = with_blocks(
      {block_of(CellType::triangle, {8, 6, 7}, "right"), block_of(CellType::triangle, {3, 4, 5}, "left"),
       block_of(CellType::quad, {}, "empty"), block_of(CellType::polygon, {0, 1, 2}, "left")});
  const Mesh c = with_blocks({block_of(CellType::triangle, {0, 1, 2}, "left"),
                              block_of(CellType::triangle, {3, 4, 5, 6, 7, 8}, "right")});
  EXPECT_SAME(a, b);
  EXPECT_DIFFERENT(
      "names of blocks: 1 cell of A has no partner in B and 1 of B none in A: triangle 1 (points 3 4 5) of "
      "block \"left\"",
      a, c);
}

TEST(Compare, SameOrderAsksForOrderAndFirstCorner) {
  const Mesh a = grid(3, 3);
  const CompareOptions in_order = {.same_order = true};
  EXPECT_SAME(a, a, in_order);
  EXPECT_DIFFERENT("positions: ", a, shuffled(a, 1), in_order);
  Mesh rotated = a;
  auto& nodes = rotated.blocks[0].connectivity;
  std::rotate(nodes.begin() + 4, nodes.begin() + 5, nodes.begin() + 8);
  EXPECT_SAME(a, rotated);
  EXPECT_DIFFERENT(
      "cells: 1 of 9 cells differ; first: cell 1, quad 1 (points 1 2 6 5) in A, quad 1 (points 2 6 5 1) in B",
      a, rotated, in_order);
}

TEST(Compare, ToleranceIsForPositionsInOrder) {
  Mesh a = grid(2, 2), b = a;
  b.points.values<float>()[4] += 0.25f;
  EXPECT_DIFFERENT("1 of 9 points differ; first: point 1, (1 0 0.295520216) in A, (1 0.25 0.295520216) in B",
                   a, b, {.same_order = true, .tolerance = 0.2499});
  EXPECT_SAME(a, b, {.same_order = true, .tolerance = 0.25});
  EXPECT_DIFFERENT("needs both meshes in the same order", a, b, {.tolerance = 0.25});
  a.points.values<float>()[0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(compare(a, b, {.same_order = true, .tolerance = 1e9}).equal);
  b.points.values<float>()[0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_SAME(a, b, {.same_order = true, .tolerance = 0.25});
  b.points.values<float>()[0] = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(compare(a, b, {.same_order = true, .tolerance = 1e9}).equal);
}

TEST(Compare, MetadataAndRolesCountOnRequest) {
  Mesh a = tetrahedron(), b = a;
  a.metadata = {{"unit", "mm"}};
  EXPECT_SAME(a, b);
  EXPECT_DIFFERENT("metadata: entry 0 is \"unit\": \"mm\" in A, missing in B", a, b,
                   {.compare_metadata = true});
}

TEST(Compare, RefusesInvalidMeshes) {
  Mesh broken = tetrahedron();
  broken.blocks[0].connectivity[0] = 99;
  EXPECT_DIFFERENT("B is no valid mesh", tetrahedron(), broken);
}

TEST(Compare, ReportsAtMostADozenDifferences) {
  Mesh a = tetrahedron();
  for (int i = 0; i < 40; ++i) {
    a.arrays.push_back(array_of<float>("t" + std::to_string(i), Domain::point, Scalar::f32, 1, {1, 2, 3, 4}));
  }
  EXPECT_EQ(compare(a, tetrahedron()).differences.size(), 12u);
}

TEST(Compare, FindsRandomMeshesEqualToTheirShuffles) {
  for (uint64_t seed = 0; seed < cases(3000); ++seed) {
    RandomMeshOptions options;
    options.other_cells = seed % 2 == 0;
    Mesh mesh = random_surface(seed, options);
    if (seed % 3 == 0) mesh = without_positions(mesh);
    ASSERT_EQ(text_of(compare(mesh, shuffled(mesh, seed))), "equal") << "seed " << seed;
    ASSERT_EQ(text_of(compare(mesh, mesh, {.same_order = true, .compare_metadata = true})), "equal")
        << "seed " << seed;
  }
}

/// One change that no renaming can undo, counting values and cells.
bool change(Mesh& mesh, Random& random) {
  std::vector<Array*> arrays = {&mesh.points};
  for (Array& array : mesh.arrays) {
    if (array.labels.empty()) arrays.push_back(&array);
  }
  Array& array = *arrays[random.below(arrays.size())];
  if (array.bytes.empty()) return false;
  array.bytes[random.below(array.bytes.size())] ^= std::byte{1};
  return true;
}

TEST(Compare, FindsOneChangedByteInRandomMeshes) {
  for (uint64_t seed = 0; seed < cases(3000); ++seed) {
    const Mesh mesh = random_surface(seed);
    Random random(seed);
    Mesh other = shuffled(mesh, seed);
    if (!change(other, random)) continue;
    ASSERT_FALSE(compare(mesh, other).equal) << "seed " << seed;
  }
}

/// Tries all renamings: the definition itself, for up to six points.
bool equal_by_trying_all(const Mesh& a, const Mesh& b) {
  const auto cells_of = [](const Mesh& mesh, const std::vector<uint32_t>& names) {
    Faces cells;
    for (uint64_t f = 0; f < mesh.blocks[0].size(); ++f) {
      Faces rotations;
      const auto cell = mesh.blocks[0].cell(f);
      std::vector<uint32_t> face;
      for (const uint32_t point : cell) face.push_back(names[point]);
      rotations.push_back(face);
      for (size_t i = 1; i < face.size(); ++i) {
        std::rotate(face.begin(), face.begin() + 1, face.end());
        rotations.push_back(face);
      }
      cells.push_back(*std::min_element(rotations.begin(), rotations.end()));
    }
    std::sort(cells.begin(), cells.end());
    return cells;
  };
  std::vector<uint32_t> names(a.point_count());
  for (uint32_t i = 0; i < names.size(); ++i) names[i] = i;
  const Faces wanted = cells_of(b, names);
  do {
    if (cells_of(a, names) == wanted) return true;
  } while (std::next_permutation(names.begin(), names.end()));
  return false;
}

TEST(Compare, AgreesWithTryingAllRenamings) {
  Random random(7);
  int equal = 0;
  for (int i = 0; i < 1500; ++i) {
    const uint32_t points = random.between(1, 5), faces = random.between(1, 5), degree = random.between(2, 4);
    Mesh pair[2];
    for (Mesh& mesh : pair) {
      Faces list(faces);
      for (auto& face : list) {
        face.resize(degree);
        for (uint32_t& point : face) point = random.below(points);
      }
      mesh = faces_only(points, list);
    }
    const bool expected = equal_by_trying_all(pair[0], pair[1]);
    equal += expected ? 1 : 0;
    ASSERT_EQ(compare(pair[0], pair[1]).equal, expected) << i;
  }
  EXPECT_GT(equal, 100);
  EXPECT_LT(equal, 1400);
}

TEST(DifferencesByOrder, MeasuresEveryArray) {
  Mesh a = tetrahedron();
  a.arrays.push_back(array_of<uint64_t>("big", Domain::point, Scalar::u64, 1, {~uint64_t{0}, 5, 0, 0}));
  a.arrays.push_back(
      array_of<float>("t", Domain::cell, Scalar::f32, 1, {1, 2, std::numeric_limits<float>::infinity(), 4}));
  Mesh b = a;
  b.points.values<float>()[3] += 2;
  b.points.values<float>()[4] -= 1;
  b.arrays[0].values<uint64_t>()[0] -= 3;
  b.arrays[1].values<float>()[2] = 3;
  const auto differences = differences_by_order(a, b);
  ASSERT_TRUE(differences);
  ASSERT_EQ(differences->size(), 3u);
  EXPECT_EQ((*differences)[0].name, "position");
  EXPECT_EQ((*differences)[0].maximum, 2);
  EXPECT_EQ((*differences)[0].unequal, 1u);
  EXPECT_DOUBLE_EQ((*differences)[0].root_mean_square, std::sqrt(5.0 / 12));
  EXPECT_EQ((*differences)[1].maximum, 3);
  EXPECT_EQ((*differences)[1].unequal, 1u);
  EXPECT_EQ((*differences)[2].maximum, 0) << "only finite components count";
  EXPECT_EQ((*differences)[2].unequal, 1u);
}

TEST(DifferencesByOrder, RefusesMeshesThatDoNotCorrespond) {
  Mesh a = tetrahedron();
  EXPECT_EQ(differences_by_order(a, cube()).error().code, ErrorCode::differs);
  a.arrays.push_back(array_of<float>("t", Domain::point, Scalar::f32, 1, {1, 2, 3, 4}));
  EXPECT_THAT(differences_by_order(a, tetrahedron()).error().message, HasSubstr("only in A"));
  EXPECT_THAT(differences_by_order(tetrahedron(), a).error().message, HasSubstr("only in B"));
}

}  // namespace
}  // namespace maille::testing
