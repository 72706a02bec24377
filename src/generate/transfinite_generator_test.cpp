#include <maille/compare.h>
#include <maille/generate.h>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <bit>
#include <numeric>

#include "generate/transfinite_topology.h"
#include "generate/transfinite_vector.h"

namespace maille {
namespace {

using ::testing::HasSubstr;

HexBlock block(std::array<uint32_t, 8> corners, std::array<uint32_t, 3> divisions, double x = 1, double y = 1,
               double z = 1) {
  HexBlock made;
  made.corners = corners;
  made.divisions = divisions;
  for (unsigned e = 0; e < 12; ++e) made.gradings[e] = {{1, 1, e < 4 ? x : e < 8 ? y : z}};
  return made;
}

std::vector<Position> cube_vertices() {
  return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
}

BlockDescription cube(std::array<uint32_t, 3> divisions) {
  BlockDescription d;
  d.vertices = cube_vertices();
  d.blocks.push_back(block({0, 1, 2, 3, 4, 5, 6, 7}, divisions));
  return d;
}

// A pipe of five blocks, z upwards.
BlockDescription pipe(uint32_t across, uint32_t along) {
  BlockDescription d;
  for (const double z : {0.0, 9.0}) {
    for (const double r : {0.3, 0.7}) {
      for (const auto& xy : {std::pair(-r, -r), std::pair(r, -r), std::pair(r, r), std::pair(-r, r)}) {
        d.vertices.push_back({xy.first, xy.second, z});
      }
    }
  }
  d.blocks.push_back(block({0, 1, 2, 3, 8, 9, 10, 11}, {across, across, along}));
  for (uint32_t i = 0; i < 4; ++i) {
    const uint32_t next = (i + 1) % 4;
    d.blocks.push_back(block({4 + i, 4 + next, next, i, 12 + i, 12 + next, 8 + next, 8 + i},
                             {across, across, along}, 1, 0.5));
    const double angle = (static_cast<double>(i) - 1) * 3.14159265358979323846 / 2;
    for (const uint32_t level : {0u, 8u}) {
      d.curves.push_back({CurveKind::arc,
                          level + 4 + i,
                          level + 4 + next,
                          {{std::cos(angle), std::sin(angle), level == 0 ? 0.0 : 9.0}}});
    }
  }
  return d;
}

// Blocks fill a grid of 2 x 2 x 2, each turned in one of 24 ways; some are left out.
BlockDescription turned_blocks() {
  BlockDescription d;
  for (unsigned i = 0; i < 27; ++i) {
    d.vertices.push_back({i % 3 * 1.0, i / 3 % 3 * 1.1, i / 9 * 1.3 + 0.05 * (i % 2)});
  }
  const auto divisions = *rc::gen::container<std::array<std::array<uint32_t, 2>, 3>>(
      rc::gen::container<std::array<uint32_t, 2>>(rc::gen::inRange<uint32_t>(1, 5)));
  for (unsigned i = 0; i < 8; ++i) {
    if (*rc::gen::inRange(0, 4) == 0) continue;
    const std::array<unsigned, 3> at{i & 1, i >> 1 & 1, i >> 2};
    std::array<unsigned, 3> axis{0, 1, 2};
    std::array<unsigned, 3> mirrored{};
    for (int n = *rc::gen::inRange(0, 6); n > 0; --n) std::next_permutation(axis.begin(), axis.end());
    const bool odd = (axis[0] > axis[1]) != ((axis[0] > axis[2]) != (axis[1] > axis[2]));
    const auto bits = *rc::gen::inRange(0u, 8u);
    for (unsigned a = 0; a < 3; ++a) mirrored[a] = bits >> a & 1;
    if ((std::popcount(bits) & 1) != (odd ? 1 : 0)) mirrored[0] ^= 1;
    HexBlock b;
    for (unsigned c = 0; c < 8; ++c) {
      std::array<unsigned, 3> corner{(c & 1) ^ (c >> 1 & 1), c >> 1 & 1, c >> 2};
      unsigned vertex = 0;
      for (unsigned a = 0; a < 3; ++a) {
        constexpr unsigned weight[3] = {1, 3, 9};
        vertex += weight[axis[a]] * (at[axis[a]] + (corner[a] ^ mirrored[a]));
      }
      b.corners[c] = vertex;
    }
    for (unsigned a = 0; a < 3; ++a) b.divisions[a] = divisions[axis[a]][at[axis[a]]];
    b.gradings.fill({GradingSection{}});
    d.blocks.push_back(b);
  }
  if (d.blocks.empty()) d.blocks.push_back(block({0, 1, 4, 3, 9, 10, 13, 12}, {1, 1, 1}));
  return d;
}

/// Holds the generator to what it promises.
class Watcher final : public GeneratedOutput {
 public:
  Result<> begin(const GeneratedSize& given) override {
    size = given;
    return {};
  }
  Result<> points(uint64_t first, std::span<const double> coordinates) override {
    EXPECT_EQ(first, uses.size());
    uses.resize(uses.size() + coordinates.size() / 3);
    most_alive = std::max(most_alive, uses.size() - finalised);
    return {};
  }
  Result<> faces(uint32_t patch, CellType type, std::span<const uint64_t> nodes) override {
    EXPECT_LT(patch, size.patches.size());
    EXPECT_TRUE(type == CellType::triangle || type == CellType::quad);
    for (const uint64_t node : nodes) use(node);
    faces_seen += nodes.size() / nodes_of(type);
    return {};
  }
  Result<> cells(uint32_t, CellType type, std::span<const uint64_t> nodes,
                 std::span<const uint8_t> last_use) override {
    EXPECT_EQ(nodes.size() % nodes_of(type), 0u);
    EXPECT_EQ(nodes.size(), last_use.size());
    const size_t each = nodes_of(type);
    for (size_t first = 0; first < nodes.size(); first += each) {
      for (size_t k = first; k < first + each; ++k) {
        use(nodes[k]);
        if (last_use[k] == 0) continue;
        ++finalised;
        uses[nodes[k]].finalised = true;
      }
    }
    cells_seen += nodes.size() / each;
    return {};
  }

  void expect_complete() const {
    EXPECT_EQ(uses.size(), size.points);
    EXPECT_EQ(cells_seen, size.cells);
    EXPECT_EQ(finalised, size.points);
    EXPECT_EQ(used_after, 0u);
  }

  struct Use {
    bool finalised = false;
  };
  GeneratedSize size;
  std::vector<Use> uses;
  uint64_t cells_seen = 0;
  uint64_t faces_seen = 0;
  uint64_t finalised = 0;
  uint64_t used_after = 0;
  uint64_t most_alive = 0;

 private:
  void use(uint64_t node) {
    ASSERT_LT(node, uses.size()) << "a node before its point";
    used_after += uses[node].finalised ? 1 : 0;
  }
};

Watcher watched(const BlockDescription& description, bool streaming) {
  Watcher watcher;
  const auto done = generate(description, {1, streaming}, watcher);
  EXPECT_TRUE(done) << done.error().message;
  watcher.expect_complete();
  return watcher;
}

Mesh mesh_of(const BlockDescription& description, bool streaming = false) {
  auto mesh = generate_mesh(description, {1, streaming});
  EXPECT_TRUE(mesh) << mesh.error().message;
  if (!mesh) return {};
  EXPECT_TRUE(validate(*mesh));
  return std::move(*mesh);
}

void expect_sound(const BlockDescription& description) {
  watched(description, false);
  watched(description, true);
  const auto comparison = compare(mesh_of(description), mesh_of(description, true));
  EXPECT_TRUE(comparison.equal) << comparison.differences.front();
}

std::string error_of(const BlockDescription& description, uint32_t refine = 1) {
  Watcher watcher;
  const auto done = generate(description, {refine, false}, watcher);
  return done ? "no error" : done.error().message;
}

Position point(const Mesh& mesh, uint64_t i) {
  const auto x = mesh.points.values<double>();
  return {x[3 * i], x[3 * i + 1], x[3 * i + 2]};
}

// Six times the volume of a tetrahedron whose fourth node is on the inner side of the others.
double volume(const Mesh& mesh, std::span<const uint32_t> n, std::array<unsigned, 4> corner) {
  const Position a = point(mesh, n[corner[0]]);
  return dot(cross(point(mesh, n[corner[1]]) - a, point(mesh, n[corner[2]]) - a),
             point(mesh, n[corner[3]]) - a);
}

TEST(Generate, NumbersPointsAndCellsAsBlockMesh) {
  const Mesh mesh = mesh_of(cube({2, 1, 1}));
  ASSERT_EQ(mesh.point_count(), 12u);
  EXPECT_EQ(point(mesh, 1), (Position{0.5, 0, 0}));
  EXPECT_EQ(point(mesh, 3), (Position{0, 1, 0}));
  EXPECT_EQ(point(mesh, 6), (Position{0, 0, 1}));
  ASSERT_EQ(mesh.blocks.size(), 2u);
  EXPECT_EQ(mesh.blocks[0].type, CellType::hexahedron);
  EXPECT_THAT(std::vector<uint32_t>(mesh.blocks[0].cell(1).begin(), mesh.blocks[0].cell(1).end()),
              ::testing::ElementsAre(1, 2, 5, 4, 7, 8, 11, 10));
  EXPECT_EQ(mesh.blocks[1].name, "defaultFaces");
  EXPECT_EQ(mesh.blocks[1].size(), 10u);
}

// Measured: points of a block made by OpenFOAM 1912, all twelve edges spaced differently, one an arc.
TEST(Generate, InterpolatesAsBlockMesh) {
  BlockDescription d;
  d.vertices = {{0, 0, 0}, {1, 0, 0},   {1.2, 1.1, 0}, {0, 1, 0},
                {0, 0, 1}, {1, 0.1, 1}, {1, 1, 1.3},   {0, 1, 1}};
  d.blocks.push_back(block({0, 1, 2, 3, 4, 5, 6, 7}, {4, 3, 2}));
  for (unsigned e = 0; e < 12; ++e) d.blocks[0].gradings[e] = {{1, 1, e + 1.0}};
  d.curves.push_back({CurveKind::arc, 0, 1, {{0.5, -0.2, 0}}});
  const Mesh mesh = mesh_of(d);
  ASSERT_EQ(mesh.point_count(), 60u);
  EXPECT_LT(length(point(mesh, 6) - Position{0.22839302553677926, -0.010156943235708607, 0}), 1e-15);
  EXPECT_LT(
      length(point(mesh, 26) - Position{0.21736531852824986, 0.00099167569166298819, 0.096786989742107754}),
      1e-15);
  EXPECT_LT(
      length(point(mesh, 33) - Position{0.75769564352237107, 0.31202574572134767, 0.094871874260784625}),
      1e-15);
  EXPECT_LT(length(point(mesh, 58) - Position{0.6011875779597341, 1, 1.1803562733879203}), 1e-15);
}

TEST(Generate, KeepsItsPromisesForOneBlock) {
  for (const auto& n : {std::array<uint32_t, 3>{1, 1, 1}, {1, 1, 4}, {3, 1, 1}, {1, 4, 2}, {3, 4, 5}}) {
    expect_sound(cube(n));
  }
}

RC_GTEST_PROP(Generate, KeepsItsPromisesForBlocksTurnedAnyWay, ()) {
  const BlockDescription d = turned_blocks();
  expect_sound(d);
}

// Vertices made one, neighbours or not: prisms, pyramids, and much that is no mesh.
RC_GTEST_PROP(Generate, KeepsItsPromisesOrRefusesWhateverIsCollapsed, ()) {
  BlockDescription d = turned_blocks();
  for (int n = *rc::gen::inRange(1, 4); n > 0; --n) {
    const auto& corners = d.blocks[*rc::gen::inRange<size_t>(0, d.blocks.size())].corners;
    const uint32_t from = corners[*rc::gen::inRange<size_t>(0, 8)];
    const uint32_t to = corners[*rc::gen::inRange<size_t>(0, 8)];
    for (HexBlock& b : d.blocks) std::replace(b.corners.begin(), b.corners.end(), from, to);
  }
  Watcher watcher;
  const auto done = generate(d, {}, watcher);
  if (done) {
    expect_sound(d);
  } else {
    RC_ASSERT(!done.error().message.empty());
  }
}

TEST(Generate, JoinsBlocksByTheirFaces) {
  const Mesh mesh = mesh_of(pipe(3, 4));
  // A square of 4 x 4 points, three rings of 12 around it, five layers.
  EXPECT_EQ(mesh.point_count(), (16u + 3 * 12) * 5);
  expect_sound(pipe(3, 4));
}

TEST(Generate, BlocksThatShareAnEdgeOnlyAreNotJoined) {
  BlockDescription d = cube({1, 1, 2});
  for (const double z : {0.0, 1.0}) {
    for (const auto& xy : {std::pair(2.0, 1.0), std::pair(2.0, 2.0), std::pair(1.0, 2.0)}) {
      d.vertices.push_back({xy.first, xy.second, z});
    }
  }
  d.blocks.push_back(block({2, 8, 9, 10, 6, 11, 12, 13}, {1, 1, 2}));
  EXPECT_EQ(mesh_of(d).point_count(), 24u);  // as blockMesh
}

TEST(Generate, StreamingOrderKeepsACrossSection) {
  const uint64_t section = 16 * 16 + 15 * 60;
  EXPECT_LT(watched(pipe(15, 100), true).most_alive, section * 3 / 2);
  EXPECT_GT(watched(pipe(15, 100), false).most_alive, 5 * section);
}

TEST(Generate, StreamingOrderFollowsABentPipe) {
  // Two cubes of different orientation, one behind the other.
  BlockDescription d = cube({4, 4, 50});
  for (const double y : {0.0, 1.0}) {
    for (const double z : {0.0, 1.0}) d.vertices.push_back({5, y, z});
  }
  d.blocks.push_back(block({1, 8, 10, 2, 5, 9, 11, 6}, {60, 4, 50}));
  expect_sound(d);
}

TEST(Generate, RefinesAllDivisions) {
  auto mesh = generate_mesh(cube({1, 2, 3}), {3, false});
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->blocks[0].size(), 3u * 6 * 9);
}

TEST(Generate, MakesWedgesWhereAFaceIsCollapsed) {
  BlockDescription d;
  d.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}};
  d.blocks.push_back(block({0, 1, 2, 0, 3, 4, 5, 3}, {2, 2, 1}));
  expect_sound(d);
  const Mesh mesh = mesh_of(d);
  EXPECT_EQ(mesh.point_count(), 14u);  // as blockMesh
  ASSERT_EQ(mesh.blocks[0].type, CellType::mixed);
  unsigned wedges = 0;
  for (uint64_t i = 0; i < mesh.blocks[0].size(); ++i) {
    if (static_cast<CellType>(mesh.blocks[0].types[i]) != CellType::wedge) continue;
    ++wedges;
    // The base, seen from outside, goes around to the left: the other triangle is behind it.
    EXPECT_LT(volume(mesh, mesh.blocks[0].cell(i), {0, 1, 2, 3}), 0);
  }
  EXPECT_EQ(wedges, 2u);
}

TEST(Generate, VerticesAtOnePlaceCollapseTheirEdge) {
  BlockDescription d;
  d.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 0, 1}};
  d.blocks.push_back(block({0, 1, 2, 3, 4, 5, 6, 7}, {2, 2, 1}));
  EXPECT_EQ(mesh_of(d).point_count(), 14u);
  expect_sound(d);
}

TEST(Generate, MakesPyramidsBelowAnApex) {
  BlockDescription d;
  d.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 1}};
  d.blocks.push_back(block({0, 1, 2, 3, 4, 4, 4, 4}, {2, 2, 2}));
  expect_sound(d);
  const Mesh mesh = mesh_of(d);
  EXPECT_EQ(mesh.point_count(), 19u);
  for (uint64_t i = 0; i < mesh.blocks[0].size(); ++i) {
    if (static_cast<CellType>(mesh.blocks[0].types[i]) != CellType::pyramid) continue;
    EXPECT_GT(volume(mesh, mesh.blocks[0].cell(i), {0, 1, 2, 4}), 0);
  }
}

TEST(Generate, KeepsRepeatedNodesOfOtherCells) {
  BlockDescription d;
  d.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}};
  d.blocks.push_back(block({0, 1, 2, 3, 4, 5, 6, 6}, {2, 2, 2}));
  expect_sound(d);
  const Mesh mesh = mesh_of(d);
  EXPECT_EQ(mesh.point_count(), 25u);  // as blockMesh
  EXPECT_EQ(mesh.blocks[0].type, CellType::hexahedron);
}

TEST(Generate, PutsOuterFacesIntoPatches) {
  BlockDescription d = cube({2, 3, 4});
  d.blocks[0].zone = "fluid";
  d.patches = {{"in", "patch", {{0, 3, 7, 4}}}, {"nothing", "wall", {}}};
  d.default_patch = {"walls", "wall", {}};
  const Mesh mesh = mesh_of(d);
  ASSERT_EQ(mesh.blocks.size(), 3u);
  EXPECT_EQ(mesh.blocks[0].name, "fluid");
  EXPECT_EQ(mesh.blocks[1].name, "in");
  EXPECT_EQ(mesh.blocks[1].size(), 12u);
  EXPECT_EQ(mesh.blocks[2].name, "walls");
  EXPECT_EQ(mesh.blocks[2].size(), 2u * (12 + 8 + 6) - 12);
  EXPECT_THAT(mesh.metadata,
              ::testing::ElementsAre(std::pair("patch.in", "patch"), std::pair("patch.nothing", "wall"),
                                     std::pair("patch.walls", "wall")));
}

TEST(Generate, OuterFacesLookOutwards) {
  const Mesh mesh = mesh_of(cube({1, 1, 1}));
  double volumes = 0;
  for (uint64_t i = 0; i < 6; ++i) {
    const auto face = mesh.blocks[1].cell(i);
    volumes += dot(point(mesh, face[0]), cross(point(mesh, face[1]), point(mesh, face[2]))) +
               dot(point(mesh, face[0]), cross(point(mesh, face[2]), point(mesh, face[3])));
  }
  EXPECT_DOUBLE_EQ(volumes, 6);
}

TEST(Generate, NamesWhatIsWrong) {
  BlockDescription d = pipe(2, 2);
  d.blocks[2].divisions[2] = 3;
  d.blocks[2].name = "east";
  EXPECT_THAT(error_of(d), HasSubstr("has 2 cells along an edge where block 2 (east) has 3"));
  d = pipe(2, 2);
  for (unsigned e = 8; e < 12; ++e) d.blocks[2].gradings[e] = {{1, 1, 5}};
  EXPECT_THAT(error_of(d), HasSubstr("spaces the cells of an edge it shares"));
  d = pipe(2, 2);
  d.blocks.push_back(d.blocks[0]);
  EXPECT_THAT(error_of(d), HasSubstr("share one face"));
  d = cube({1, 1, 1});
  d.blocks[0].corners = {0, 3, 2, 1, 4, 7, 6, 5};
  EXPECT_THAT(error_of(d), HasSubstr("inside out"));
  d = cube({1, 1, 1});
  d.blocks[0].corners[3] = 8;
  EXPECT_THAT(error_of(d), HasSubstr("vertex 8 does not exist"));
  d = cube({1, 1, 1});
  d.vertices[2][1] = NAN;
  EXPECT_THAT(error_of(d), HasSubstr("not finite"));
  d = cube({1, 0, 1});
  EXPECT_THAT(error_of(d), HasSubstr("no cells along y"));
  EXPECT_THAT(error_of(cube({1u << 20, 1, 1}), 8), HasSubstr("at most"));
  d = cube({1, 1, 1});
  d.blocks[0].corners = {0, 1, 2, 3, 0, 1, 2, 3};
  EXPECT_THAT(error_of(d), HasSubstr("no thickness along z"));
  d = cube({1, 1, 1});
  d.patches.push_back({"lid", "wall", {{0, 1, 2, 4}}});
  EXPECT_THAT(error_of(d), HasSubstr("patch lid: (0 1 2 4) is no face of a block"));
  d = cube({1, 1, 1});
  d.blocks[0].gradings[3] = {{1, 1, -2}};
  EXPECT_THAT(error_of(d), HasSubstr("not positive"));
  EXPECT_THAT(error_of({}), HasSubstr("no blocks"));
}

TEST(GenerateMesh, RefusesWhatDoesNotFitIntoMemory) {
  const auto mesh = generate_mesh(cube({1000, 1000, 1000}), {}, {uint64_t{1} << 20});
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, ErrorCode::memory_bound);
}

/// Two cubes side by side within a ball, with everything outside on it.
BlockDescription ball() {
  BlockDescription d;
  for (const double z : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      for (const double x : {-1.0, 0.0, 1.0}) d.vertices.push_back({x, y, z});
    }
  }
  d.blocks.push_back(block({0, 1, 4, 3, 6, 7, 10, 9}, {3, 4, 5}, 2));
  d.blocks.push_back(block({1, 2, 5, 4, 7, 8, 11, 10}, {3, 4, 5}));
  BlockSurface sphere;
  sphere.radius = 2;
  d.surfaces.push_back(sphere);
  for (uint32_t v = 0; v < 12; ++v) d.projected_vertices.push_back({v, {0}});
  const auto edge = [&](uint32_t a, uint32_t b) {
    BlockCurve curve;
    curve.kind = CurveKind::projected;
    curve.from = a;
    curve.to = b;
    curve.surfaces = {0};
    d.curves.push_back(curve);
  };
  for (const uint32_t v : {0u, 1u, 3u, 4u, 6u, 7u, 9u, 10u}) edge(v, v + 1);
  for (const uint32_t v : {0u, 1u, 2u, 6u, 7u, 8u}) edge(v, v + 3);
  for (uint32_t v = 0; v < 6; ++v) edge(v, v + 6);
  d.projected_faces = {{{0, 3, 9, 6}, {0}},  {{0, 1, 7, 6}, {0}},   {{3, 4, 10, 9}, {0}},
                       {{0, 1, 4, 3}, {0}},  {{6, 7, 10, 9}, {0}},  {{2, 5, 11, 8}, {0}},
                       {{1, 2, 8, 7}, {0}},  {{4, 5, 11, 10}, {0}}, {{1, 2, 5, 4}, {0}},
                       {{7, 8, 11, 10}, {0}}};
  return d;
}

TEST(Generate, ProjectsVerticesEdgesAndFaces) {
  const auto mesh = generate_mesh(ball(), {});
  ASSERT_TRUE(mesh) << mesh.error().message;
  std::vector<bool> outside(mesh->point_count());
  for (const CellBlock& cells : mesh->blocks) {
    if (!is_face(cells.type)) continue;
    for (const uint32_t point : cells.connectivity) outside[point] = true;
  }
  const auto positions = mesh->points.values<double>();
  size_t inside = 0;
  for (size_t i = 0; i < outside.size(); ++i) {
    const double far = length({positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]});
    if (outside[i]) {
      EXPECT_NEAR(far, 2, 1e-12) << i;
    } else {
      EXPECT_LT(far, 1.9) << i;
    }
    inside += outside[i] ? 0 : 1;
  }
  EXPECT_EQ(inside, 5u * 3 * 4);
}

TEST(Generate, RefusesAProjectedFaceThatNoBlockHas) {
  BlockDescription d = ball();
  d.projected_faces.push_back({{0, 1, 2, 3}, {0}});
  const auto mesh = generate_mesh(d, {});
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().message, "the projected face (0 1 2 3) is no face of a block");
}

TEST(Generate, ProjectedMeshesAreTheSameInStreamingOrder) {
  GenerateOptions streaming;
  streaming.streaming_order = true;
  const auto mesh = generate_mesh(ball(), {}), other = generate_mesh(ball(), streaming);
  ASSERT_TRUE(mesh && other);
  EXPECT_TRUE(compare(*mesh, *other).equal);
}

TEST(Generate, ProjectedEdgesAreSpacedByLength) {
  BlockDescription d = cube({4, 1, 1});
  BlockSurface cylinder;
  cylinder.kind = BlockSurface::Kind::cylinder;
  cylinder.a = {0.5, -9, 0};
  cylinder.b = {0.5, 9, 0};
  cylinder.radius = 0.5;
  d.surfaces.push_back(cylinder);
  BlockCurve curve;
  curve.kind = CurveKind::projected;
  curve.from = 4;
  curve.to = 5;
  curve.surfaces = {0};
  d.curves.push_back(curve);
  d.vertices[4] = {0.5 - 0.5 * std::cos(0.5), 0, 0.5 * std::sin(0.5)};
  d.vertices[5] = {0.5 + 0.5 * std::cos(0.5), 0, 0.5 * std::sin(0.5)};
  const auto mesh = generate_mesh(d, {});
  ASSERT_TRUE(mesh) << mesh.error().message;
  const auto positions = mesh->points.values<double>();
  const auto angle = [&](size_t i) { return std::atan2(positions[3 * i + 2], 0.5 - positions[3 * i]); };
  const double pi = 3.14159265358979323846;
  for (size_t i = 0; i <= 4; ++i)
    EXPECT_NEAR(angle(10 + i), 0.5 + (pi - 1) * static_cast<double>(i) / 4, 1e-3) << i;
}

}  // namespace
}  // namespace maille
