#include "support/cases.h"
#include "support/random_mesh_gen.h"
#include "support/shapes.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <map>
#include <set>

namespace maille::testing {
namespace {

using Edges = std::map<std::pair<uint32_t, uint32_t>, int>;

Edges directed_edges(const Mesh& mesh) {
  Edges edges;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t f = 0; f < block.size(); ++f) {
      const auto face = block.cell(f);
      for (size_t i = 0; i < face.size(); ++i) ++edges[{face[i], face[(i + 1) % face.size()]}];
    }
  }
  return edges;
}

bool is_oriented_manifold(const Mesh& mesh) {
  const Edges edges = directed_edges(mesh);
  return std::all_of(edges.begin(), edges.end(), [](const auto& edge) { return edge.second == 1; });
}

size_t boundary_edges(const Mesh& mesh) {
  const Edges edges = directed_edges(mesh);
  return static_cast<size_t>(std::count_if(edges.begin(), edges.end(), [&](const auto& edge) {
    return edges.count({edge.first.second, edge.first.first}) == 0;
  }));
}

int64_t euler_number(const Mesh& mesh) {
  std::set<std::pair<uint32_t, uint32_t>> edges;
  for (const auto& [edge, count] : directed_edges(mesh)) edges.insert(std::minmax(edge.first, edge.second));
  return static_cast<int64_t>(mesh.point_count() + mesh.cell_count()) - static_cast<int64_t>(edges.size());
}

TEST(Shapes, ClosedOnesAreOrientedManifoldsOfTheirGenus) {
  const auto check = [](const Surface& surface, int64_t euler) {
    const Mesh mesh = to_mesh(surface);
    ASSERT_TRUE(validate(mesh));
    EXPECT_TRUE(is_oriented_manifold(mesh));
    EXPECT_EQ(boundary_edges(mesh), 0u);
    EXPECT_EQ(euler_number(mesh), euler);
  };
  check(shapes::tetrahedron(), 2);
  check(shapes::cube(), 2);
  check(shapes::sphere(8, 5), 2);
  check(shapes::torus(5, 4), 0);
  for (uint32_t genus = 0; genus < 4; ++genus) check(shapes::plate(genus), 2 - 2 * int64_t{genus});
}

TEST(Shapes, OpenOnesHaveTheirBoundary) {
  EXPECT_EQ(boundary_edges(grid(3, 2)), 10u);
  EXPECT_EQ(boundary_edges(to_mesh(shapes::cylinder(6, 2))), 12u);
  EXPECT_EQ(boundary_edges(to_mesh(shapes::fan(5, false))), 7u);
  EXPECT_TRUE(is_oriented_manifold(grid(3, 2)));
}

TEST(Shapes, OneSidedOnesCannotBeOriented) {
  EXPECT_FALSE(is_oriented_manifold(moebius(7, 1)));
  EXPECT_FALSE(is_oriented_manifold(to_mesh(shapes::klein_bottle(5, 5))));
  EXPECT_EQ(euler_number(moebius(7, 2)), 0);
  EXPECT_EQ(euler_number(to_mesh(shapes::klein_bottle(5, 5))), 0);
}

/// What a run over many seeds must have met at least so often.
struct Census {
  std::map<std::string, int> seen;

  void take(const Mesh& mesh) {
    std::map<std::pair<uint32_t, uint32_t>, int> undirected;
    std::set<std::vector<uint32_t>> faces;
    std::vector<bool> used(mesh.point_count(), false);
    std::map<std::string, bool> here;
    for (const auto& [edge, count] : directed_edges(mesh)) {
      here["edge used twice in one direction"] |= count > 1;
      here["edge from a point to itself"] |= edge.first == edge.second;
      undirected[std::minmax(edge.first, edge.second)] += count;
    }
    for (const auto& [edge, count] : undirected) here["edge of 3 or more faces"] |= count > 2;
    for (const CellBlock& block : mesh.blocks) {
      here["block of triangles"] |= block.type == CellType::triangle;
      here["mixed block"] |= block.type == CellType::mixed;
      here["named block"] |= !block.name.empty();
      for (uint64_t f = 0; f < block.size(); ++f) {
        const auto cell = block.cell(f);
        std::vector<uint32_t> face(cell.begin(), cell.end());
        here["face of " + std::to_string(std::min<size_t>(face.size(), 13)) + " corners"] = true;
        for (const uint32_t point : face) used[point] = true;
        std::sort(face.begin(), face.end());
        here["point twice in a face"] |= std::adjacent_find(face.begin(), face.end()) != face.end();
        here["duplicate face"] |= !face.empty() && !faces.insert(face).second;
      }
    }
    here["isolated point"] = std::find(used.begin(), used.end(), false) != used.end();
    here["no points"] = mesh.point_count() == 0;
    here["no faces"] = mesh.cell_count() == 0;
    here["one face"] = mesh.cell_count() == 1;
    here["several blocks"] = mesh.blocks.size() > 1;
    here[std::string("positions ") + name_of(mesh.points.type)] = true;
    for (const Array& array : mesh.arrays) {
      here[std::string(name_of(array.domain)) + " " + name_of(array.type)] = true;
      here["labels"] |= !array.labels.empty();
    }
    for (const auto& [what, is] : here) seen[what] += is ? 1 : 0;
  }
};

TEST(RandomMesh, IsValidAndTheSameForASeed) {
  for (uint64_t seed = 0; seed < cases(3000); ++seed) {
    RandomMeshOptions options;
    options.other_cells = seed % 3 == 0;
    const Mesh mesh = random_surface(seed, options);
    const auto valid = validate(mesh);
    ASSERT_TRUE(valid) << "seed " << seed << ": " << valid.error().message;
    const Mesh again = random_surface(seed, options);
    ASSERT_EQ(mesh.points.bytes, again.points.bytes);
    ASSERT_EQ(mesh.blocks.size(), again.blocks.size());
    ASSERT_TRUE(validate(shuffled(mesh, seed)));
    ASSERT_TRUE(validate(flipped(mesh, seed)));
  }
}

TEST(RandomMesh, MeetsEveryPathologyOften) {
  Census census;
  for (uint64_t seed = 0; seed < 4000; ++seed) census.take(random_surface(seed));
  std::vector<std::string> wanted = {"edge used twice in one direction",
                                     "edge from a point to itself",
                                     "edge of 3 or more faces",
                                     "block of triangles",
                                     "mixed block",
                                     "named block",
                                     "point twice in a face",
                                     "duplicate face",
                                     "isolated point",
                                     "no points",
                                     "no faces",
                                     "one face",
                                     "several blocks",
                                     "labels"};
  for (unsigned degree = 0; degree <= 13; ++degree)
    wanted.push_back("face of " + std::to_string(degree) + " corners");
  for (unsigned type = 0; type < scalar_count; ++type) {
    const char* scalar = name_of(static_cast<Scalar>(type));
    wanted.push_back(std::string("positions ") + scalar);
    for (unsigned domain = 0; domain < domain_count; ++domain) {
      wanted.push_back(std::string(name_of(static_cast<Domain>(domain))) + " " + scalar);
    }
  }
  for (const std::string& what : wanted) EXPECT_GE(census.seen[what], 20) << what;
}

TEST(RandomMesh, WithoutDegenerateFacesHasNone) {
  RandomMeshOptions options;
  options.degenerate_faces = false;
  Census census;
  for (uint64_t seed = 0; seed < 1500; ++seed) census.take(random_surface(seed, options));
  for (const char* what :
       {"point twice in a face", "face of 0 corners", "face of 1 corners", "face of 2 corners"}) {
    EXPECT_EQ(census.seen[what], 0) << what;
  }
  EXPECT_GE(census.seen["edge of 3 or more faces"], 100);
}

RC_GTEST_PROP(RandomMesh, SuitsRapidcheck, ()) {
  const Mesh mesh = *arbitrary_surface();
  RC_ASSERT(validate(mesh).has_value());
}

}  // namespace
}  // namespace maille::testing
