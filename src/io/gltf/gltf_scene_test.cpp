#include <gtest/gtest.h>
#include <maille/gltf.h>

#include "io/same_mesh.h"

namespace maille {
namespace {

/// A triangle in the plane, with a normal, that two nodes use.
Mesh triangle(const std::string& nodes, const std::string& roots) {
  Mesh mesh;
  mesh.points.resize(3);
  const float places[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  std::copy(std::begin(places), std::end(places), mesh.points.values<float>().begin());
  mesh.blocks.push_back({"leaf", CellType::triangle, {}, {}, {0, 1, 2}});
  mesh.arrays.push_back(make_array("normal", Domain::point, Scalar::f32, 3, Role::normal));
  mesh.arrays[0].resize(3);
  for (size_t i = 2; i < 9; i += 3) mesh.arrays[0].values<float>()[i] = 1;
  mesh.arrays.push_back(make_array("material", Domain::cell, Scalar::u32, 1, Role::label));
  mesh.arrays[1].resize(1);
  mesh.metadata = {{"gltf.nodes", nodes}, {"gltf.scene", roots}, {"gltf.meshes", "[[0]]"}, {"units", "mm"}};
  return mesh;
}

std::optional<Mesh> scene_of(const Mesh& mesh) {
  std::vector<std::string> notes;
  auto scene = mesh_in_scene(mesh, notes);
  EXPECT_TRUE(scene) << scene.error().message;
  return scene ? std::move(*scene) : std::nullopt;
}

std::vector<float> floats(const Array& array) {
  const auto values = array.values<float>();
  return {values.begin(), values.end()};
}

TEST(GltfScene, TransformsOfParentsApplyToChildren) {
  const auto scene = scene_of(triangle(
      R"([{"children":[1],"translation":[10,0,0]},{"mesh":0,"scale":[2,2,2],"rotation":[0.70710678,0,0,0.70710678]}])",
      "[0]"));
  ASSERT_TRUE(scene);
  const std::vector<float> wanted = {10, 0, 0, 12, 0, 0, 10, 0, 2}, found = floats(scene->points);
  for (size_t i = 0; i < 9; ++i) EXPECT_NEAR(found[i], wanted[i], 1e-6) << i;
  EXPECT_NEAR(floats(scene->arrays[0])[1], -1, 1e-6);  // the normal was +z
  EXPECT_EQ(scene->metadata, (std::vector<std::pair<std::string, std::string>>{{"units", "mm"}}));
  EXPECT_TRUE(validate(*scene));
}

TEST(GltfScene, AMeshOfSeveralNodesIsThereForEach) {
  const auto scene =
      scene_of(triangle(R"([{"mesh":0,"name":"a"},{"mesh":0,"name":"b","translation":[0,0,5]}])", "[0,1]"));
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->blocks.size(), 2u);
  EXPECT_EQ(scene->blocks[0].name, "a");
  EXPECT_EQ(scene->blocks[1].name, "b");
  EXPECT_EQ(scene->point_count(), 6u);
  EXPECT_EQ(floats(scene->points)[11], 5.f);
  EXPECT_EQ(scene->find("material", Domain::cell)->count(), 2u);
  EXPECT_TRUE(validate(*scene));
}

TEST(GltfScene, MirrorsKeepTheOutsideOutside) {
  const auto scene = scene_of(triangle(R"([{"mesh":0,"scale":[1,1,-1]}])", "[0]"));
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->blocks[0].connectivity, (std::vector<uint32_t>{0, 2, 1}));
  EXPECT_EQ(floats(scene->arrays[0])[2], -1.f);
}

TEST(GltfScene, WhatDoesNotMoveIsLeftAlone) {
  EXPECT_FALSE(scene_of(triangle(R"([{"mesh":0}])", "[0]")));
  EXPECT_FALSE(scene_of(triangle("no JSON", "[0]")));
  EXPECT_FALSE(scene_of(triangle(R"([{"mesh":7,"scale":[2,2,2]}])", "[0]")));
  Mesh cut = triangle(R"([{"mesh":0,"scale":[2,2,2]}])", "[0]");
  cut.blocks.clear();
  cut.arrays.pop_back();
  EXPECT_FALSE(scene_of(cut));
}

TEST(GltfScene, CyclesEnd) {
  const auto scene = scene_of(
      triangle(R"([{"mesh":0,"children":[1],"scale":[2,1,1]},{"mesh":0,"children":[0,1]}])", "[0,0,1]"));
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->blocks.size(), 2u);
}

}  // namespace
}  // namespace maille
