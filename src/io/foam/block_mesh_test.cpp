#include "io/foam/block_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <filesystem>

#include "support/temporary_folder.h"

namespace maille {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string vertices = "vertices ((0 0 0)(1 0 0)(1 1 0)(0 1 0)(0 0 1)(1 0 1)(1 1 1)(0 1 1));\n";
const std::string blocks = "blocks (hex (0 1 2 3 4 5 6 7) (2 3 4) simpleGrading (1 2 3));\n";

Result<BlockDictionary> read(const std::string& text) {
  const auto file = parse_foam_text(text, "dict");
  if (!file) return tl::unexpected(file.error());
  return blocks_of(*file);
}

BlockDescription description(const std::string& text) {
  auto read_one = read(text);
  EXPECT_TRUE(read_one) << read_one.error().message;
  return read_one ? std::move(read_one->description) : BlockDescription{};
}

std::string error_of(const std::string& text) {
  const auto read_one = read(text);
  return read_one ? "no error" : read_one.error().message;
}

ErrorCode code_of(const std::string& text) {
  const auto read_one = read(text);
  return read_one ? ErrorCode::differs : read_one.error().code;
}

TEST(BlockMesh, ReadsVerticesAndBlocks) {
  const BlockDescription d = description("scale 0.1;" + vertices + blocks);
  ASSERT_EQ(d.vertices.size(), 8u);
  EXPECT_EQ(d.vertices[6], (Position{0.1, 0.1, 0.1}));
  ASSERT_EQ(d.blocks.size(), 1u);
  EXPECT_THAT(d.blocks[0].divisions, ElementsAre(2, 3, 4));
  EXPECT_EQ(d.blocks[0].gradings[0][0].expansion, 1);
  EXPECT_EQ(d.blocks[0].gradings[4][0].expansion, 2);
  EXPECT_EQ(d.blocks[0].gradings[11][0].expansion, 3);
  EXPECT_EQ(d.blocks[0].zone, "");
}

TEST(BlockMesh, ConvertToMetersIsTheOldScale) {
  EXPECT_EQ(description("convertToMeters 2;" + vertices + blocks).vertices[6], (Position{2, 2, 2}));
  EXPECT_EQ(description("convertToMeters 2; scale 3;" + vertices + blocks).vertices[6], (Position{3, 3, 3}));
}

TEST(BlockMesh, ReadsNamesZonesAndGradings) {
  const BlockDescription d = description(
      "vertices (name a (0 0 0) (1 0 0)(1 1 0)(0 1 0)(0 0 1)(1 0 1)(1 1 1) name h (0 1 1));"
      "g ((0.3 0.5 4)(0.7 0.5 0.25));"
      "blocks 2(name first hex (a 1 2 3 4 5 6 h) air (1 1 1) edgeGrading (1 2 3 4 5 6 7 8 9 10 11 $g)"
      " hex (0 1 2 3 4 5 6 7) (1 1 1) simpleGrading (-4 1 ((1 1 2) 3)));");
  ASSERT_EQ(d.blocks.size(), 2u);
  EXPECT_EQ(d.blocks[0].name, "first");
  EXPECT_EQ(d.blocks[0].zone, "air");
  EXPECT_EQ(d.blocks[0].corners[7], 7u);
  EXPECT_EQ(d.blocks[0].gradings[10][0].expansion, 11);
  ASSERT_EQ(d.blocks[0].gradings[11].size(), 2u);
  EXPECT_EQ(d.blocks[0].gradings[11][1].length, 0.7);
  EXPECT_EQ(d.blocks[0].gradings[11][1].expansion, 0.25);
  EXPECT_EQ(d.blocks[1].gradings[0][0].expansion, 0.25);
  EXPECT_EQ(d.blocks[1].gradings[8][1].expansion, 3);
}

TEST(BlockMesh, ReadsEdges) {
  const auto result =
      read("scale 2;" + vertices + blocks +
           "edges (arc 0 1 (0.5 -0.5 0) spline 1 2 ((1.1 0.2 0)(1.2 0.5 0)) polyLine 2 3 ((0.5 1.1 0)) "
           "BSpline 3 0 ((0 0.5 0)) bezier 4 5 ((0 0.5 1)) line 5 6 "
           "arc 4 7 90 (-1 0 0) arc 6 7 origin (0.5 0 1) arc 1 0 (0.5 0.5 0));");
  ASSERT_TRUE(result) << result.error().message;
  const BlockDescription& d = result->description;
  ASSERT_EQ(d.curves.size(), 8u);
  EXPECT_EQ(d.curves[0].points[0], (Position{1, -1, 0}));
  EXPECT_EQ(d.curves[1].kind, CurveKind::spline);
  EXPECT_EQ(d.curves[1].points.size(), 2u);
  EXPECT_NEAR(d.curves[6].points[0][2], 1 + std::sqrt(2), 1e-14);
  EXPECT_THAT(result->notes, ElementsAre(HasSubstr("edge 1 0 is given more than once")));
}

TEST(BlockMesh, ReadsPatches) {
  const BlockDescription d = description(vertices +
                                         "blocks (name box hex (0 1 2 3 4 5 6 7) (1 1 1));"
                                         "boundary (in { type patch; faces ((0 4 7 3) (box 1)); } lid { type "
                                         "wall; inGroups (walls); faces ((0 5)); }"
                                         " none { type empty; faces (); });"
                                         "defaultPatch { name rest; type symmetry; }");
  ASSERT_EQ(d.patches.size(), 3u);
  EXPECT_EQ(d.patches[0].name, "in");
  EXPECT_EQ(d.patches[0].type, "patch");
  ASSERT_EQ(d.patches[0].faces.size(), 2u);
  EXPECT_THAT(d.patches[0].faces[1], ElementsAre(1, 2, 6, 5));
  EXPECT_THAT(d.patches[1].faces[0], ElementsAre(4, 5, 6, 7));
  EXPECT_THAT(d.patches[2].faces, IsEmpty());
  EXPECT_EQ(d.default_patch.name, "rest");
  EXPECT_EQ(d.default_patch.type, "symmetry");
}

TEST(BlockMesh, ReadsOldPatches) {
  const BlockDescription d =
      description(vertices + blocks + "patches (wall lid ((4 5 6 7)) empty sides ());");
  ASSERT_EQ(d.patches.size(), 2u);
  EXPECT_EQ(d.patches[0].name, "lid");
  EXPECT_EQ(d.patches[0].type, "wall");
}

TEST(BlockMesh, RefusesWhatIsNotSupportedByName) {
  const std::string all = vertices + blocks;
  for (const std::string& text :
       {all + "edges (projectCurve 0 1 (sphere));", all + "mergePatchPairs ((a b));",
        "geometry { tube { type extrudedCircle; } }" + all + "faces (project (0 1 2 3) tube);",
        "geometry { p { type plane; planeType embeddedPoints; } }" + all + "edges (project 0 1 (p));",
        "geometry { s { type triSurfaceMesh; file \"../x.obj\"; } }" + all + "edges (project 0 1 (s));"}) {
    EXPECT_EQ(code_of(text), ErrorCode::unsupported) << text;
    EXPECT_THAT(error_of(text), HasSubstr("dict: line")) << text;
    EXPECT_THAT(error_of(text), HasSubstr("not supported")) << text;
  }
  EXPECT_EQ(code_of(all + "faces (); mergePatchPairs (); geometry { sphere { type sphere; } }"),
            ErrorCode::differs);
}

const std::string geometry =
    "geometry { ball { type searchableSphere; centre (1 2 3); radius 4; }"
    " tube { type cylinder; point1 (0 0 0); point2 (0 0 1); radius 2; }"
    " floor { type plane; planeType pointAndNormal; pointAndNormalDict { point (0 0 1); normal (0 0 2); } }"
    " crate { type box; min (0 0 0); max (1 1 1); }"
    " sheet.obj { type plate; name sheet; origin (1 1 1); span (0 2 2); } }";

TEST(BlockMesh, ReadsSurfacesAndWhatLiesOnThem) {
  const BlockDescription d = description(
      "scale 2;" + geometry +
      "vertices ((0 0 0) project (1 0 0) (ball tube) (1 1 0)(0 1 0)(0 0 1)(1 0 1)(1 1 1)(0 1 1));" + blocks +
      "edges (project 0 1 (floor)); faces (project (0 1 2 3) crate project (4 5 6 7) (sheet));");
  ASSERT_EQ(d.surfaces.size(), 5u);
  EXPECT_EQ(d.surfaces[0].kind, BlockSurface::Kind::sphere);
  EXPECT_EQ(d.surfaces[0].a, (Position{2, 4, 6}));
  EXPECT_EQ(d.surfaces[0].radius, 8);
  EXPECT_EQ(d.surfaces[1].kind, BlockSurface::Kind::cylinder);
  EXPECT_EQ(d.surfaces[1].b, (Position{0, 0, 2}));
  EXPECT_EQ(d.surfaces[2].kind, BlockSurface::Kind::plane);
  EXPECT_EQ(d.surfaces[2].a, (Position{0, 0, 2}));
  EXPECT_EQ(d.surfaces[3].kind, BlockSurface::Kind::box);
  EXPECT_EQ(d.surfaces[4].b, (Position{2, 6, 6}));
  ASSERT_EQ(d.projected_vertices.size(), 1u);
  EXPECT_EQ(d.projected_vertices[0].vertex, 1u);
  EXPECT_THAT(d.projected_vertices[0].surfaces, ElementsAre(0, 1));
  ASSERT_EQ(d.curves.size(), 1u);
  EXPECT_EQ(d.curves[0].kind, CurveKind::projected);
  EXPECT_THAT(d.curves[0].surfaces, ElementsAre(2));
  ASSERT_EQ(d.projected_faces.size(), 2u);
  EXPECT_THAT(d.projected_faces[1].corners, ElementsAre(4, 5, 6, 7));
  EXPECT_THAT(d.projected_faces[1].surfaces, ElementsAre(4));
}

TEST(BlockMesh, RefusesProjectionsToWhatIsNotThere) {
  EXPECT_THAT(error_of(geometry + vertices + blocks + "edges (project 0 1 (cube));"),
              HasSubstr("there is no surface 'cube' in 'geometry'"));
  EXPECT_THAT(error_of(geometry + vertices + blocks + "faces (project (0 1 2 3) ());"),
              HasSubstr("a projection to no surface"));
  EXPECT_THAT(error_of("geometry { s { type sphere; centre (0 0 0); } }" + vertices + blocks +
                       "edges (project 0 1 (s));"),
              HasSubstr("surface 's' has no entry 'radius'"));
  EXPECT_THAT(error_of("geometry { s { type triSurfaceMesh; file \"s.stl\"; } }" + vertices + blocks +
                       "edges (project 0 1 (s));"),
              HasSubstr("there is no 's.stl' in constant/triSurface or constant/geometry"));
}

TEST(BlockMesh, SurfacesOfTrianglesAreReadWithinTheLimits) {
  const testing::TemporaryFolder folder;
  std::filesystem::create_directories(folder.path("constant/triSurface"));
  folder.write("constant/triSurface/s.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  std::filesystem::create_directories(folder.path("system"));
  const std::string path =
      folder.write("system/blockMeshDict", "geometry { s { type triSurfaceMesh; file \"s.obj\"; } }" +
                                               vertices + blocks + "edges (project 0 1 (s));");
  const auto read = read_block_dictionary(path);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->description.surfaces[0].triangles.size(), 1u);
  const auto bounded = read_block_dictionary(path, Limits{8});
  ASSERT_FALSE(bounded);
  EXPECT_EQ(bounded.error().code, ErrorCode::memory_bound);
}

TEST(BlockMesh, NamesFileLineAndEntry) {
  EXPECT_THAT(error_of(blocks), HasSubstr("dict: no entry 'vertices'"));
  EXPECT_THAT(error_of("vertices ((0 0));" + blocks),
              HasSubstr("dict: line 1: entry 'vertices': a number expected"));
  EXPECT_THAT(error_of(vertices + "blocks (hex (0 1 2 3 4 5 6 8) (1 1 1));"),
              HasSubstr("dict: line 2: entry 'blocks': vertex 8 is too large"));
  EXPECT_THAT(error_of(vertices + "blocks (hex (0 1 2 3 4 5 6 x) (1 1 1));"),
              HasSubstr("there is no vertex 'x'"));
  EXPECT_THAT(error_of(vertices + "blocks (hex (0 1 2 3 4 5 6 7) (1 1 1) simpleGrading (1 1));"),
              HasSubstr("1, 3 or 12 expansion ratios expected, 2 found"));
  EXPECT_THAT(error_of(vertices + "blocks (hex (0 1 2 3 4 5 6 7) (1 1.5 1));"),
              HasSubstr("number of cells expected"));
  EXPECT_THAT(error_of(vertices + "blocks (hex (0 1 2 3 4 5 6 7) (1 99999999999 1));"),
              HasSubstr("too large"));
  EXPECT_THAT(error_of(vertices + "blocks (hex (0 1 2 3 4 5 6 7) (1 1 1) simpleGrading (0 1 1));"),
              HasSubstr("an expansion ratio of 0"));
  EXPECT_THAT(error_of(vertices + "blocks (tet (0 1 2 3) (1 1 1));"), HasSubstr("a 'hex' block is expected"));
  EXPECT_THAT(error_of(vertices + blocks + "edges (wave 0 1);"), HasSubstr("edges of type 'wave'"));
  EXPECT_THAT(error_of(vertices + blocks + "boundary (in { type patch; });"),
              HasSubstr("patch 'in' has no faces"));
  EXPECT_THAT(error_of(vertices + blocks + "boundary (in { type patch; faces ((0 9)); });"),
              HasSubstr("too large"));
  EXPECT_THAT(error_of(vertices + blocks + "boundary (in { type patch; faces ((7 1)); });"),
              HasSubstr("no face 1 of block 7"));
}

TEST(BlockMesh, TakesTheFirstEightOfNineVerticesAsBlockMesh) {
  const auto result = read(vertices + "blocks (hex (0 1 2 3 4 5 6 7 7) (1 1 1));");
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_THAT(result->notes, ElementsAre(HasSubstr("more than eight vertices")));
}

TEST(BlockMesh, EveryTruncationGivesAnError) {
  const std::string all = vertices + blocks +
                          "edges (arc 0 1 (0.5 -0.5 0)); boundary (in { type patch; faces ((0 4 7 3)); });"
                          "defaultPatch { name rest; type wall; }";
  // A cut between two entries can leave a whole dictionary.
  const size_t needed = (vertices + blocks).size() - 1;
  for (size_t size = 0; size < all.size(); ++size) {
    const auto result = read(all.substr(0, size));
    EXPECT_TRUE(size >= needed || !result) << size;
  }
}

}  // namespace
}  // namespace maille
