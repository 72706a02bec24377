// Surfaces of text and STL read in parts.
#include <maille/surface_source.h>

#include <gmock/gmock.h>

#include <cstring>

#include "io/format.h"
#include "io/line_blocks.h"
#include "io/same_mesh.h"
#include "support/random.h"
#include "support/random_mesh.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::HasSubstr;

std::unique_ptr<Source> source_of(const std::string& text, const std::string& name) {
  return memory_source(std::as_bytes(std::span(text.data(), text.size())), name);
}

Result<Mesh> mesh_in_parts(const Source& source) {
  const auto opened = open_surface_source(source);
  if (!opened) return tl::unexpected(opened.error());
  MeshSource& parts = **opened;
  const MeshDescription& description = parts.description();
  Mesh mesh;
  mesh.metadata = description.metadata;
  mesh.points = make_array("position", Domain::point, description.point_type, 3);
  mesh.points.resize(description.points);
  EXPECT_TRUE(parts.read_points(0, description.points, mesh.points.bytes));
  for (size_t i = 0; i < description.arrays.size(); ++i) {
    Array& array = mesh.arrays.emplace_back(description.arrays[i]);
    array.resize(description.count_of(array));
    EXPECT_TRUE(parts.read_array(i, 0, description.count_of(array), array.bytes));
  }
  if (description.blocks.empty()) return mesh;
  CellPiece piece;
  EXPECT_TRUE(parts.read_cells(0, description.cells, piece));
  CellBlock& block = mesh.blocks.emplace_back();
  block.type = description.blocks[0].type;
  if (nodes_of(block.type) == 0) block.offsets = piece.offsets;
  block.connectivity.assign(piece.connectivity.begin(), piece.connectivity.end());
  return mesh;
}

/// Is what is read in parts what the reader of whole files gives?
void expect_same_in_parts(const std::string& text, const std::string& name) {
  const auto source = source_of(text, name);
  const auto whole = read_mesh(*source, {.format = "", .limits = {}, .progress = {}});
  ASSERT_TRUE(whole) << whole.error().message;
  const auto parts = mesh_in_parts(*source);
  ASSERT_TRUE(parts) << parts.error().message;
  expect_same_mesh(whole->mesh, *parts);
}

Mesh plain_surface(uint64_t seed, bool arrays) {
  RandomMeshOptions options;
  options.faces = 60;
  options.several_blocks = false;
  options.degenerate_faces = false;
  Mesh mesh = random_surface(seed, options);
  for (CellBlock& block : mesh.blocks) block.name.clear();
  std::erase_if(mesh.arrays, [&](const Array& array) {
    return !arrays || array.domain == Domain::corner || array.domain == Domain::mesh;
  });
  return mesh;
}

TEST(SurfaceSource, ReadsPlyOfTextAsTheReaderOfWholeFilesDoes) {
  for (uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    expect_same_in_parts(write_text(ply_format(), plain_surface(seed, true), {"ply", true}).text, "a.ply");
  }
  expect_same_in_parts(
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty double y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 0\n"
      "property list uchar int vertex_indices\nend_header\n\n1 0.1 1e-44  1 2 255\r\n 4 5 nan 0 0 0",
      "a.ply");
}

std::string stl_of(const std::vector<std::array<float, 9>>& facets, float normal, uint16_t attribute) {
  std::string text("solid that is none");
  text.resize(80);
  const auto put = [&](const auto& value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  put(static_cast<uint32_t>(facets.size()));
  for (const auto& corners : facets) {
    put(std::array<float, 3>{0, 0, normal});
    put(corners);
    put(attribute);
  }
  return text;
}

TEST(SurfaceSource, WeldsStlAsTheReaderOfWholeFilesDoes) {
  Random random(1);
  std::vector<std::array<float, 9>> facets(3000);
  for (auto& facet : facets) {
    for (float& x : facet) x = static_cast<float>(random.below(9)) * (random.below(40) == 0 ? -0.0f : 1.0f);
  }
  expect_same_in_parts(stl_of(facets, 0, 0), "a.stl");
  expect_same_in_parts(stl_of(facets, 1, 7), "a.stl");
  expect_same_in_parts(stl_of({{0, 0, 0, 1, 0, 0, 0, 1, 0}}, 1, 0), "a.stl");
  expect_same_in_parts(stl_of({}, 1, 0), "a.stl");
}

TEST(SurfaceSource, ReadsObjAsTheReaderOfWholeFilesDoes) {
  for (uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const Mesh mesh = plain_surface(seed, false);
    const std::string text = write_text(obj_format(), mesh, {}).text;
    if (text.starts_with("o")) continue;  // a label of no name
    if (text.find("\n# maille") != std::string::npos || text.rfind("# maille", 0) == 0) continue;
    expect_same_in_parts(text, "a.obj");
  }
  expect_same_in_parts(
      "# made by hand\nmtllib x y.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0 # here\nf 1 2 3\nv 0.1234567890123 1 1\n"
      "f -1 -2 \\\n -3 -4\n",
      "a.obj");
  expect_same_in_parts(
      "v 0 0 0 1 0 0\nv 1 0 0 1 0.5 0\nv 0 1 0 1 1 1\nvn 0 0 1\nvn 0 1 0\nvn 1 0 0\n"
      "vt 0 0\nvt 1 0\nvt 0 1\nf 1/1/1 2/2/2 3/3/3\n",
      "a.obj");
}

TEST(SurfaceSource, SaysWhatItDoesNotReadInParts) {
  const auto refusal = [](const std::string& text, const std::string& name) -> std::string {
    const auto source = source_of(text, name);
    const auto mesh = mesh_in_parts(*source);
    if (mesh) return "";
    EXPECT_EQ(mesh.error().code, ErrorCode::unsupported);
    return mesh.error().message;
  };
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_THAT(refusal(points + "g a\nf 1 2 3\n", "a.obj"), HasSubstr("line 4"));
  EXPECT_THAT(refusal(points + "vt 0 0\nf 1/1 2/1 3/1\n", "a.obj"), HasSubstr("of corners"));
  EXPECT_THAT(refusal(points + "vn 0 0 1\nf 1 2 3\n", "a.obj"), HasSubstr("another number"));
  const std::string ply =
      "element vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  const std::string front = "ply\nformat ascii 1.0\n";
  const std::string comment = "comment " + std::string(1 << 20, '-') + "\n";
  EXPECT_THAT(refusal(front + ply + "0 0\n0\n1 1 1\n", "a.ply"), HasSubstr("in parts"));
  EXPECT_THAT(refusal(front + comment + comment + comment + comment + ply + "0 0 0\n1 1 1\n", "a.ply"),
              HasSubstr("in parts"));
  EXPECT_THAT(refusal("solid a\nendsolid a\n", "a.stl"), HasSubstr("text"));
  EXPECT_THAT(refusal("OFF\n0 0 0\n", "a.off"), HasSubstr("off"));
}

TEST(SurfaceSource, RefusesDamagedText) {
  const auto error = [](const std::string& text, const std::string& name) {
    const auto source = source_of(text, name);
    const auto mesh = open_surface_source(*source);
    return mesh ? std::string() : mesh.error().message;
  };
  EXPECT_THAT(error("v 0 0 0\nf 1 2 3\n", "a.obj"), HasSubstr("vertex 2 does not exist, there are 1"));
  EXPECT_THAT(error("v 0 0 x\n", "a.obj"), HasSubstr("line 1"));
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
      "end_header\n";
  EXPECT_THAT(error(header + "0 0 0\n", "a.ply"), HasSubstr("vertex 1"));
  EXPECT_THAT(error(header + "0 0 0\n0 0 0 0\n", "a.ply"), HasSubstr("vertex 1"));
}

TEST(LineBlocks, EndWhereLinesEnd) {
  std::string text;
  for (int i = 0; i < 500; ++i)
    text += std::string(static_cast<size_t>(i % 37), 'a') + (i % 5 == 0 ? "\\\n" : "\r\n");
  const auto source = source_of(text, "a");
  std::string read;
  for (LineBlocks lines(*source, 0, 16); !lines.at_end();) {
    const auto block = lines.read();
    ASSERT_TRUE(block);
    if (!lines.at_end()) {
      EXPECT_TRUE(block->ends_with("\n") && !block->ends_with("\\\n"));
    }
    read += *block;
  }
  EXPECT_EQ(read, text);
}

}  // namespace
}  // namespace maille
