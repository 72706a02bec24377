// What the volume formats have in common: files of others, real files, round trips, damage. MEDIT, Gmsh, SU2,
// .hedra.

#include <gmock/gmock.h>

#include <fstream>
#include <map>
#include <sstream>

#include "io/cell_faces.h"
#include "io/format.h"
#include "io/same_mesh.h"
#include "support/data.h"
#include "support/random.h"
#include "support/random_volume.h"
#include "support/sample_mesh.h"
#include "support/temporary_folder.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;

using Metadata = std::vector<std::pair<std::string, std::string>>;

/// meshio writes the nodes of wedges as they are, though the triangle 0 1 2 is seen from outside in VTK and
/// from inside in MEDIT and Gmsh.
Mesh sample_of_meshio() {
  Mesh mesh = sample_mesh_by_type();
  mesh.blocks[3].connectivity = {2, 5, 13, 8, 11, 14};
  return mesh;
}

TEST(MeditReader, ReadsWhatMeshioWrote) {
  for (const auto& [format, name] :
       {std::pair(&medit_format(), "ascii.mesh"), {&meditb_format(), "binary.meshb"}}) {
    const auto result = read_file(*format, sample_path(name));
    ASSERT_TRUE(result) << result.error().message;
    Mesh expected = sample_of_meshio();
    expected.arrays.erase(expected.arrays.begin(), expected.arrays.begin() + 2);
    expected.arrays[0].name = "medit:ref";
    // meshio gives every point the reference 1.
    expected.arrays.insert(expected.arrays.begin(), make_array("medit:ref", Domain::point, Scalar::i32, 1));
    expected.arrays[0].resize(16);
    for (int32_t& reference : expected.arrays[0].values<int32_t>()) reference = 1;
    expect_same_mesh(result->mesh, expected);
  }
}

TEST(MeditWriter, NamesTagsThatItsReferencesCannotHold) {
  Mesh mesh = sample_mesh_by_type();
  mesh.arrays = {make_array("medit:ref", Domain::point, Scalar::u32, 1),
                 make_array("gmsh:physical", Domain::cell, Scalar::i64, 1)};
  mesh.arrays[0].resize(mesh.point_count());
  mesh.arrays[0].values<uint32_t>()[3] = 4'000'000'000;
  mesh.arrays[1].resize(mesh.cell_count());
  mesh.arrays[1].values<int64_t>()[2] = int64_t{1} << 31;
  EXPECT_THAT(write_text(medit_format(), mesh).notes,
              IsSupersetOf({HasSubstr("medit:ref"), HasSubstr("gmsh:physical")}));
}

TEST(MeditReader, KeepsCornersRidgesAndTwoDimensions) {
  const auto result = read_text(medit_format(), R"(MeshVersionFormatted 2
Dimension 2  # flat
Vertices 3
0 0 1
1 0 0
0 1.5 0
Edges 2
1 2 7
2 3 0
Corners 1
3
Ridges 1
2
Banana 1
5 6 7
End)");
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  EXPECT_EQ(mesh.points.values<float>()[7], 1.5f);
  EXPECT_THAT(values_of<uint8_t>(mesh, "medit:corner", Domain::point), ElementsAre(0, 0, 1));
  EXPECT_THAT(values_of<uint8_t>(mesh, "medit:ridge", Domain::cell), ElementsAre(0, 1));
  EXPECT_THAT(values_of<int32_t>(mesh, "medit:ref", Domain::point), ElementsAre(1, 0, 0));
  EXPECT_THAT(result->notes, ElementsAre("section Banana left out"));
  EXPECT_EQ(mesh.metadata, (Metadata{{"medit.dimension", "2"}}));
}

TEST(MeditReader, TakesVersionsWithoutEndOnASmallStack) {
  std::string text = "MeshVersionFormatted 2\n";
  for (int i = 0; i < 200000; ++i) text += "MeshVersionFormatted 2\n";
  const auto result = read_text(medit_format(), text);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.point_count(), 0u);
  EXPECT_LT(result->notes.size(), 20u);
}

TEST(GmshReader, ReadsWhatMeshioWrote) {
  for (const char* name : {"ascii_22.msh", "binary_22.msh"}) {
    const auto result = read_file(gmsh_format(), sample_path(name));
    ASSERT_TRUE(result) << result.error().message;
    const Mesh& mesh = result->mesh;
    const Mesh expected = sample_of_meshio();
    ASSERT_EQ(mesh.blocks.size(), 5u);
    const char* const names[] = {"bottom", "gas", "the solid", "the solid", "the solid"};
    for (size_t b = 0; b < 5; ++b) {
      EXPECT_EQ(mesh.blocks[b].name, names[b]);
      EXPECT_EQ(mesh.blocks[b].type, expected.blocks[b].type);
      EXPECT_EQ(mesh.blocks[b].connectivity, expected.blocks[b].connectivity);
    }
    EXPECT_TRUE(mesh.points.bytes == expected.points.bytes);
    EXPECT_TRUE(mesh.find("velocity", Domain::point)->bytes == expected.arrays[1].bytes);
    EXPECT_THAT(values_of<double>(mesh, "id", Domain::cell), ElementsAre(1, 2, 7, 8, 3, 4, 5, 6));
    EXPECT_THAT(values_of<int32_t>(mesh, "gmsh:physical", Domain::cell), ElementsAre(4, 4, 1, 1, 2, 2, 2, 2));
  }
}

/// Written by hand after the format's description: entities carry the groups, nodes are not numbered from one
/// on.
constexpr const char* gmsh_41 = R"($MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
1 5 "left side"
2 7 "plate"
$EndPhysicalNames
$Entities
1 1 1 0
1 0 0 0 0
1 0 0 0 1 1 0 1 5 2 1 -1
3 0 0 0 1 1 0 1 7 1 1
$EndEntities
$Nodes
2 4 10 40
1 1 0 2
10
20
0 0 0
0 1 0
2 3 1 2
40
30
1 1 0 .5 .5
1 0 0 .5 .25
$EndNodes
$Elements
2 3 1 9
1 1 1 1
1 10 20
2 3 2 2
5 10 30 40
9 10 40 20
$EndElements
$Periodic
0
$EndPeriodic
$NodeData
1
"T"
1
0.5
3
0
1
2
10 1.25
40 -2
$EndNodeData
)";

TEST(GmshReader, ReadsVersion41) {
  const auto result = read_text(gmsh_format(), gmsh_41);
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  ASSERT_EQ(mesh.blocks.size(), 2u);
  EXPECT_EQ(mesh.blocks[0].name, "left side");
  EXPECT_EQ(mesh.blocks[1].name, "plate");
  EXPECT_THAT(mesh.blocks[1].connectivity, ElementsAre(0, 3, 2, 0, 2, 1));
  EXPECT_THAT(values_of<int64_t>(mesh, "gmsh:node", Domain::point), ElementsAre(10, 20, 40, 30));
  EXPECT_THAT(values_of<int64_t>(mesh, "gmsh:element", Domain::cell), ElementsAre(1, 5, 9));
  EXPECT_THAT(values_of<int32_t>(mesh, "gmsh:physical", Domain::cell), ElementsAre(5, 7, 7));
  EXPECT_THAT(values_of<int32_t>(mesh, "gmsh:geometrical", Domain::cell), ElementsAre(1, 3, 3));
  const auto temperature = values_of<double>(mesh, "T", Domain::point);
  EXPECT_EQ(temperature[0], 1.25);
  EXPECT_EQ(temperature[2], -2);
  EXPECT_NE(temperature[1], temperature[1]);
  EXPECT_EQ(result->notes.size(), 2u);
}

TEST(GmshReader, ElementsOfPartitionsHaveTheirGroups) {
  // The entities of a mesh that was partitioned: elements are of those of the partitions.
  std::string text = gmsh_41;
  const auto put = [&](const std::string& what, const std::string& by) {
    text.replace(text.find(what), what.size(), by);
  };
  put("$Nodes", R"($PartitionedEntities
2
1
9 2
0 1 1 0
8 1 1 1 2 0 0 0 1 1 0 1 5 0
9 2 3 2 1 2 0 0 0 1 1 0 1 7 1 8
$EndPartitionedEntities
$Nodes)");
  put("1 1 1 1\n", "1 8 1 1\n");
  put("2 3 2 2\n", "2 9 2 2\n");
  const auto result = read_text(gmsh_format(), text);
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  ASSERT_EQ(mesh.blocks.size(), 2u);
  EXPECT_EQ(mesh.blocks[0].name, "left side");
  EXPECT_EQ(mesh.blocks[1].name, "plate");
  EXPECT_THAT(values_of<int32_t>(mesh, "gmsh:physical", Domain::cell), ElementsAre(5, 7, 7));
  EXPECT_EQ(result->notes.size(), 3u);
}

TEST(GmshReader, SaysWhatElseAnMshFileMayBe) {
  const auto old = read_text(gmsh_format(), "$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n0\n$ENDELM\n");
  ASSERT_FALSE(old);
  EXPECT_EQ(old.error().code, ErrorCode::unsupported);
  EXPECT_THAT(old.error().message, HasSubstr("version 1 of Gmsh's format"));
  const auto fluent = read_text(gmsh_format(), "(0 \"a comment\")\n(2 3)\n");
  ASSERT_FALSE(fluent);
  EXPECT_EQ(fluent.error().code, ErrorCode::unsupported);
  EXPECT_THAT(fluent.error().message, HasSubstr("ANSYS Fluent"));
}

TEST(GmshWriter, KeepsNumbersGroupsAndVersion) {
  for (const bool ascii : {true, false}) {
    const auto first = read_text(gmsh_format(), gmsh_41);
    ASSERT_TRUE(first);
    Mesh mesh = first->mesh;
    if (!ascii) {
      std::erase_if(mesh.metadata, [](const auto& entry) { return entry.first == "gmsh.periodic"; });
      mesh.points.type = Scalar::f64;
      mesh.points.resize(4);
    }
    WriteOptions options;
    options.ascii = ascii;
    const auto back = read_text(gmsh_format(), write_text(gmsh_format(), mesh, options).text);
    ASSERT_TRUE(back) << back.error().message;
    // The time of data is not written.
    std::erase_if(mesh.metadata, [](const auto& entry) { return entry.first == "gmsh.time.T"; });
    std::sort(mesh.metadata.begin(), mesh.metadata.end());
    Mesh other = back->mesh;
    std::sort(other.metadata.begin(), other.metadata.end());
    expect_same_mesh(other, mesh);
  }
}

/// Second-order elements whose nodes lie where they belong, so that a wrong order shows.
TEST(GmshTypes, NodesOfSecondOrderLieBetweenTheirCorners) {
  // After Gmsh's description: element type and, for each node beyond the corners, the corners it lies
  // between.
  const std::vector<std::pair<int, std::vector<std::vector<int>>>> elements = {
      {11, {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {2, 3}, {1, 3}}},
      {17, {{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 5}, {2, 3}, {2, 6}, {3, 7}, {4, 5}, {4, 7}, {5, 6}, {6, 7}}},
      {18, {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 4}, {2, 5}, {3, 4}, {3, 5}, {4, 5}}},
      {19, {{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 4}, {2, 3}, {2, 4}, {3, 4}}}};
  // After VTK's.
  const std::vector<std::vector<std::vector<int>>> vtk = {
      {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}},
      {{0, 1}, {1, 2}, {2, 3}, {0, 3}, {4, 5}, {5, 6}, {6, 7}, {4, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}},
      {{0, 1}, {1, 2}, {0, 2}, {3, 4}, {4, 5}, {3, 5}, {0, 3}, {1, 4}, {2, 5}},
      {{0, 1}, {1, 2}, {2, 3}, {0, 3}, {0, 4}, {1, 4}, {2, 4}, {3, 4}}};
  const int corners[] = {4, 8, 6, 5};
  for (size_t e = 0; e < elements.size(); ++e) {
    const auto nodes = static_cast<size_t>(corners[e]) + vtk[e].size();
    std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + std::to_string(nodes) + "\n";
    for (size_t i = 0; i < nodes; ++i) text += std::to_string(i + 1) + " 0 0 0\n";
    text += "$EndNodes\n$Elements\n1\n1 " + std::to_string(elements[e].first) + " 0";
    for (size_t i = 0; i < nodes; ++i) text += " " + std::to_string(i + 1);
    const auto result = read_text(gmsh_format(), text + "\n$EndElements\n");
    ASSERT_TRUE(result) << result.error().message;
    const auto cell = result->mesh.blocks.at(0).cell(0);
    for (size_t i = 0; i < vtk[e].size(); ++i) {
      const size_t node = cell[static_cast<size_t>(corners[e]) + i] - static_cast<size_t>(corners[e]);
      // Corners may have other places, too.
      std::vector<int> between = vtk[e][i];
      for (int& corner : between) corner = static_cast<int>(cell[static_cast<size_t>(corner)]);
      std::sort(between.begin(), between.end());
      EXPECT_EQ(elements[e].second[node], between) << elements[e].first << " node " << i;
    }
  }
}

TEST(Su2Reader, MarkersZonesAndWhatElseThereIs) {
  const auto result = read_text(su2_format(), R"(% a comment
NDIME= 2
NELEM= 2
5 0 1 2 0
9 0 1 2 3 1
NPOIN= 4
0 0 0
1 0 1
1 1 2
0 0.5 3
NMARK= 2
MARKER_TAG= wall
MARKER_ELEMS= 1
3 0 1
MARKER_TAG= far field
MARKER_ELEMS= 2
3 1 2
3 2 3
FFD_NBOX= 1
FFD_CORNER_POINTS= 2
0 0 0
1 1 1
)");
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  ASSERT_EQ(mesh.blocks.size(), 4u);
  EXPECT_EQ(mesh.blocks[2].name, "wall");
  EXPECT_EQ(mesh.blocks[3].name, "far field");
  EXPECT_THAT(mesh.blocks[3].connectivity, ElementsAre(1, 2, 2, 3));
  EXPECT_EQ(mesh.metadata, (Metadata{{"su2.dimension", "2"},
                                     {"su2.other", "FFD_NBOX= 1\nFFD_CORNER_POINTS= 2\n0 0 0\n1 1 1\n"}}));
  const std::string text = write_text(su2_format(), mesh).text;
  EXPECT_THAT(text, HasSubstr("MARKER_TAG= far%20field\nMARKER_ELEMS= 2\n"));
  EXPECT_THAT(text, HasSubstr("FFD_NBOX= 1\n"));
}

TEST(Su2Reader, LeavesOutHalosOfPartitions) {
  const auto result = read_text(su2_format(), R"(NDIME= 2
NELEM= 1
5 0 1 2 0
NPOIN= 3 3
0 0 0
1 0 1
1 1 2
NMARK= 2
MARKER_TAG= SEND_RECEIVE
MARKER_ELEMS= 2
SEND_TO= 2
1 0 0
1 1 0
MARKER_TAG= wall
MARKER_ELEMS= 1
3 0 1
)");
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->mesh.blocks.size(), 2u);
  EXPECT_EQ(result->mesh.blocks[1].name, "wall");
  EXPECT_EQ(result->mesh.metadata, (Metadata{{"su2.dimension", "2"}}));
  ASSERT_EQ(result->notes.size(), 1u);
  EXPECT_THAT(result->notes[0], HasSubstr("SEND_RECEIVE left out"));
}

TEST(HedraReader, TurnsFacesOver) {
  const auto result =
      read_text(hedra_format(), "4 2 2\n0 0 0 1 0 0 0 1 0 0 0 1\n3 1 2 3\n3 2 3 4\n2 1 -2\n1 2\n");
  ASSERT_TRUE(result) << result.error().message;
  const CellBlock& block = result->mesh.blocks.at(0);
  EXPECT_THAT(block.connectivity, ElementsAre(0, 1, 2, 1, 3, 2, 1, 2, 3));
  EXPECT_THAT(block.cell_faces, ElementsAre(0, 2, 3));
  EXPECT_EQ(write_text(hedra_format(), result->mesh).text,
            "4 2 2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 1 2 3\n3 2 4 3\n2 1 2\n1 -2\n");
}

TEST(HedraWriter, OtherCellsBecomePolyhedraThatShareFaces) {
  Mesh mesh = sample_mesh_by_type();
  mesh.blocks[3].connectivity = {2, 5, 13, 8, 11, 14};
  const auto written = write_text(hedra_format(), mesh);
  // Two hexahedra, two tetrahedra, a wedge and a pyramid: 12 + 8 + 5 + 5 faces, of which 1 + 1 + 1 + 1 + 1
  // are shared.
  EXPECT_EQ(written.text.substr(0, 8), "16 24 6\n");
  EXPECT_FALSE(written.notes.empty());
}

/// What OpenFOAM's blockMesh made of two hexahedra and a wedge, in text and in binary with one file packed.
TEST(PolyMeshReader, RecognisesCellsAndNamesPatches) {
  for (const char* path : {"polymesh", "polymesh_binary", "polymesh/faces", "polymesh_binary/owner.gz"}) {
    const auto result = read_mesh(sample_path(path));
    ASSERT_TRUE(result) << result.error().message;
    const Mesh& mesh = result->mesh;
    EXPECT_EQ(mesh.point_count(), 14u);
    ASSERT_EQ(mesh.blocks.size(), 5u);
    EXPECT_EQ(mesh.blocks[0].type, CellType::hexahedron);
    EXPECT_EQ(mesh.blocks[0].size(), 2u);
    EXPECT_EQ(mesh.blocks[1].type, CellType::wedge);
    EXPECT_EQ(mesh.blocks[2].name, "inlet");
    EXPECT_EQ(mesh.blocks[3].type, CellType::polygon);
    EXPECT_EQ(mesh.blocks[4].name, "outlet");
    EXPECT_EQ(mesh.metadata[1], (std::pair<std::string, std::string>("openfoam.patch.walls", "wall")));
    // Each cell has its six or five faces, and faces in common are the same points: the mesh is closed.
    std::map<std::vector<uint32_t>, int> faces;
    for (const CellBlock& block : mesh.blocks) {
      for (uint64_t i = 0; i < block.size(); ++i) {
        const auto add = [&](std::span<const uint32_t> corners) {
          std::vector<uint32_t> sorted(corners.begin(), corners.end());
          std::sort(sorted.begin(), sorted.end());
          ++faces[sorted];
        };
        if (!for_each_linear_face(block, i, add)) add(block.cell(i));
      }
    }
    for (const auto& [corners, count] : faces) EXPECT_EQ(count, 2);
  }
}

TEST(PolyMeshReader, OtherCellsArePolyhedra) {
  const testing::TemporaryFolder folder;
  const auto write = [&](const std::string& name, const std::string& text) {
    folder.write(name, "FoamFile { format ascii; class x; } // comment\n" + text);
  };
  // Two cells, each a triangle twice, with one triangle in common.
  write("points", "3((0 0 0) (1 0 0) (0 1 0))");
  write("faces", "3(3(0 1 2) 3(0 2 1) 3(1 0 2))");
  write("owner", "3(0 0 1)");
  write("neighbour", "1{1}");
  write("boundary", "1( wall { type wall; inGroups 1(wall); nFaces 2; startFace 1; } )");
  const auto result = read_mesh(folder.path());
  ASSERT_TRUE(result) << result.error().message;
  const CellBlock& block = result->mesh.blocks.at(0);
  EXPECT_EQ(block.type, CellType::polyhedron);
  EXPECT_THAT(block.connectivity, ElementsAre(0, 1, 2, 0, 2, 1, 0, 2, 1, 1, 0, 2));
  EXPECT_THAT(block.face_sizes, ElementsAre(3, 3, 3, 3));
  for (const auto& [name, text] : {std::pair("owner", "3(0 0 9)"),
                                   {"owner", "2(0 0)"},
                                   {"faces", "3(3(0 1 2) 3(0 2 1) 3(1 0 3))"},
                                   {"boundary", "1( wall { nFaces 2; startFace 2; } )"},
                                   {"points", "3((0 0 0) (1 0 0)"},
                                   {"neighbour", "900000000000{1}"}}) {
    const std::string kept = folder.read(name);
    write(name, text);
    EXPECT_FALSE(read_mesh(folder.path())) << name;
    folder.write(name, kept);
  }
}

/// Two hexahedra and a wedge, as scipy's netCDF writes them.
TEST(ExodusReader, ReadsBlocksSetsAndTheLastStep) {
  const auto result = read_file(exodus_format(), sample_path("small.e"));
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  ASSERT_EQ(mesh.blocks.size(), 3u);
  EXPECT_EQ(mesh.blocks[0].name, "pipe");
  EXPECT_EQ(mesh.blocks[0].connectivity, sample_mesh_by_type().blocks[2].connectivity);
  EXPECT_EQ(mesh.blocks[1].name, "block 20");
  EXPECT_EQ(mesh.blocks[1].connectivity, sample_of_meshio().blocks[3].connectivity);
  EXPECT_EQ(mesh.blocks[2].name, "inlet");
  EXPECT_EQ(mesh.blocks[2].type, CellType::mixed);
  EXPECT_THAT(mesh.blocks[2].connectivity, ElementsAre(0, 6, 9, 3, 8, 14, 11));
  EXPECT_TRUE(mesh.points.bytes == sample_mesh().points.bytes);
  EXPECT_EQ(values_of<uint8_t>(mesh, "fixed", Domain::point)[15], 1);
  EXPECT_EQ(values_of<double>(mesh, "T", Domain::point)[3], 6);
  const auto pressure = values_of<double>(mesh, "p", Domain::cell);
  EXPECT_EQ(pressure[1], 1.25);
  EXPECT_NE(pressure[2], pressure[2]);
  EXPECT_THAT(values_of<double>(mesh, "TimeValue", Domain::mesh), ElementsAre(1.5));
  EXPECT_THAT(result->notes, ElementsAre("variables are those of the last of 2 time steps"));
}

TEST(ExodusReader, ReadsTheTableOfVariablesOfOlderFiles) {
  const auto result = read_file(exodus_format(), sample_path("table_of_variables.e"));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_THAT(values_of<double>(result->mesh, "heat", Domain::point), ElementsAre(10, 11, 12, 13));
  EXPECT_THAT(values_of<double>(result->mesh, "load", Domain::point), ElementsAre(14, 15, 16, 17));
  EXPECT_THAT(result->notes, ElementsAre("variables are those of the last of 2 time steps"));
}

TEST(ExodusReader, SurvivesRandomDamageAndCuts) {
  const std::string text = text_of_file(sample_path("small.e"));
  Random random(5);
  for (int trial = 0; trial < 3000; ++trial) {
    std::string damaged = text.substr(0, random.chance(30) ? random.below(text.size()) : text.size());
    for (uint32_t i = random.between(0, 4); i > 0 && !damaged.empty(); --i) {
      damaged[random.below(damaged.size())] =
          static_cast<char>(random.chance(50) ? random.below(4) : random.below(256));
    }
    read_text(exodus_format(), damaged);  // checks that what is read is valid
  }
}

struct Trip {
  const Format* format;
  std::vector<CellType> types;
  bool mixed;
};

std::vector<Trip> trips() {
  const std::vector<CellType> linear = {CellType::triangle,   CellType::quad,  CellType::tetrahedron,
                                        CellType::hexahedron, CellType::wedge, CellType::pyramid,
                                        CellType::line};
  std::vector<CellType> gmsh = linear;
  for (const CellType type :
       {CellType::vertex, CellType::quadratic_tetrahedron, CellType::quadratic_hexahedron,
        CellType::quadratic_wedge, CellType::quadratic_pyramid, CellType::triquadratic_hexahedron,
        CellType::biquadratic_quadratic_wedge, CellType::biquadratic_quad, CellType::quadratic_triangle})
    gmsh.push_back(type);
  return {{&medit_format(), linear, false},
          {&meditb_format(), linear, false},
          {&gmsh_format(), gmsh, true},
          {&su2_format(), linear, true},
          {&hedra_format(), {CellType::polyhedron}, false}};
}

/// Types, points and connectivity, cell by cell; not how cells are grouped into blocks.
std::string cells_as_text(const Mesh& mesh) {
  std::string text;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      text += std::to_string(static_cast<int>(block.type_of(i))) + ":";
      for (const uint32_t node : block.cell(i)) text += " " + std::to_string(node);
      for (const uint32_t size : block.faces(i)) text += " f" + std::to_string(size);
      text += "\n";
    }
  }
  return text;
}

/// Arrays that a mesh without them gets when it is written.
size_t gmsh_tags(const Mesh& mesh) {
  return static_cast<size_t>(std::count_if(mesh.arrays.begin(), mesh.arrays.end(), [](const Array& array) {
    return array.name.starts_with("gmsh:");
  }));
}

TEST(VolumeFormats, GiveBackCellsAndPositions) {
  for (const Trip& trip : trips()) {
    for (uint64_t seed = 0; seed < 60; ++seed) {
      RandomVolumeOptions random;
      random.types = trip.types;
      random.mixed = trip.mixed;
      random.several_blocks = trip.mixed;
      random.special_values = false;
      random.corner_arrays = false;
      random.arrays = trip.format == &gmsh_format();
      Mesh mesh = random_volume(seed, random);
      std::erase_if(mesh.arrays, [](const Array& array) { return array.domain == Domain::mesh; });
      if (trip.format == &su2_format()) {
        // Volumes first, boundaries behind them.
        std::stable_sort(mesh.blocks.begin(), mesh.blocks.end(),
                         [](const auto& a, const auto& b) { return a.name < b.name; });
        if (mesh.blocks.size() > 1 || mesh.blocks[0].type == CellType::mixed) continue;
      }
      WriteOptions options;
      options.ascii = seed % 2 == 0;
      const auto back = read_text(*trip.format, write_text(*trip.format, mesh, options).text);
      ASSERT_TRUE(back) << trip.format->info.name << " " << seed << ": " << back.error().message;
      EXPECT_EQ(cells_as_text(back->mesh), cells_as_text(mesh)) << trip.format->info.name << " " << seed;
      ASSERT_EQ(back->mesh.points.count(), mesh.points.count());
      if (back->mesh.points.type == mesh.points.type) {
        EXPECT_TRUE(back->mesh.points.bytes == mesh.points.bytes);
      }
      if (trip.format == &gmsh_format()) {
        EXPECT_EQ(back->mesh.arrays.size(), mesh.arrays.size() + gmsh_tags(back->mesh));
      }
    }
  }
}

TEST(VolumeFormats, SurviveRandomDamageAndCuts) {
  for (const Trip& trip : trips()) {
    for (uint64_t seed = 0; seed < 12; ++seed) {
      RandomVolumeOptions random;
      random.types = trip.types;
      random.special_values = false;
      WriteOptions options;
      options.ascii = seed % 2 == 0;
      const std::string text = write_text(*trip.format, random_volume(seed, random), options).text;
      Random dice(seed);
      for (int trial = 0; trial < 60; ++trial) {
        std::string damaged = text.substr(0, dice.chance(30) ? dice.below(text.size()) : text.size());
        for (uint32_t i = dice.between(0, 4); i > 0 && !damaged.empty(); --i) {
          const size_t range = dice.chance(50) ? std::min<size_t>(damaged.size(), 200) : damaged.size();
          damaged[dice.below(range)] = static_cast<char>(
              dice.chance(50) ? '0' + static_cast<int>(dice.below(10)) : static_cast<int>(dice.below(256)));
        }
        const auto source = memory_source(std::as_bytes(std::span(damaged.data(), damaged.size())), "x");
        ReadOptions read;
        read.limits.mesh_bytes = uint64_t{1} << 26;
        read.format = trip.format->info.name;
        const auto result = read_mesh(*source, read);
        EXPECT_TRUE(result || result.error().message.starts_with("x: ")) << result.error().message;
      }
    }
  }
}

TEST(VolumeFormats, NameWhatIsWrong) {
  const auto expect = [](const Format& format, const std::string& text, const std::string& message) {
    const auto result = read_text(format, text);
    ASSERT_FALSE(result) << text;
    EXPECT_THAT(result.error().message, HasSubstr(message));
  };
  expect(medit_format(), "MeshVersionFormatted 1\nDimension 3\nVertices 1\n0 0 0 0\nEdges 1\n1 2 0\n",
         "Edges, element 1 uses vertex 2");
  expect(medit_format(), "MeshVersionFormatted 1\nDimension 3\nVertices 2\n0 0 0 0\n1 x",
         "line 5: there should be a coordinate of vertex 2, but found \"x\"");
  expect(medit_format(), "MeshVersionFormatted 1\nDimension 4\n", "the dimension, 2 or 3");
  expect(medit_format(), "", "begins with MeshVersionFormatted");
  expect(medit_format(), "Vertices 0\n", "begins with MeshVersionFormatted");
  expect(su2_format(), "% nothing\n", "none of the keys of SU2");
  expect(su2_format(), "COLOUR= red\n", "none of the keys of SU2");
  expect(gmsh_format(), "$MeshFormat\n4.0 0 8\n$EndMeshFormat\n", "save it again with gmsh -format msh41");
  expect(gmsh_format(), "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n9000000000\n", "2^32 nodes");
  expect(gmsh_format(),
         "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n1 15 0 "
         "2\n$EndElements\n",
         "element 1 uses node 2, which is not there");
  expect(gmsh_format(), "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n2 0 0 0\n$EndNodes\n",
         "the section is longer than it says");
  expect(su2_format(), "NDIME= 3\nNELEM= 1\n5 0 1 2\nNPOIN= 1\n0 0 0\n",
         "uses point 1, but there are 1 points");
  expect(su2_format(), "NDIME= 3\nNELEM= 1\n6 0 1 2\n", "line 3: SU2 has no element type 6");
  expect(su2_format(), "NDIME= 2\nNELEM= 1\n105 0 1 2 3 4 5\n", "type 105 are of higher order (2)");
  expect(hedra_format(), "1 1 1\n0 0 0\n1 2\n", "face 1 uses point 2");
  expect(hedra_format(), "1 1 1\n0 0 0\n1 1\n1 2\n", "cell 1 uses face 2");
}

struct Entry {
  std::string file, counts;
  uint64_t points = 0;
};

std::vector<Entry> manifest() {
  std::vector<Entry> list;
  if (data_folder().empty()) return list;
  std::ifstream file(data_folder() + "/manifest.tsv");
  for (std::string line; std::getline(file, line);) {
    std::istringstream fields(line);
    Entry entry;
    std::string kind, elements;
    std::getline(fields, entry.file, '\t');
    std::getline(fields, kind, '\t');
    if (kind != "hex" && kind != "tet" && kind != "mixed") continue;
    fields >> entry.points >> elements;
    if (!std::ifstream(data_folder() + "/" + entry.file)) continue;
    list.push_back(entry);
  }
  return list;
}

TEST(RealVolumes, ComeBackThroughVtuAndTheirOwnFormat) {
  const auto entries = manifest();
  if (entries.empty()) GTEST_SKIP() << "the shared meshes and their manifest are not on this machine";
  EXPECT_GE(entries.size(), 5u);  // of all sizes, or those that sanitizers have time for
  for (const Entry& entry : entries) {
    const auto first = read_mesh(data_folder() + "/" + entry.file);
    ASSERT_TRUE(first) << first.error().message;
    // The manifest counts nodes of Exodus files once for each block, as VTK does.
    if (!entry.file.ends_with(".e")) {
      EXPECT_EQ(first->mesh.point_count(), entry.points) << entry.file;
    }
    const auto own = format_of(entry.file);
    ASSERT_TRUE(own);
    for (const std::string& format : {std::string("vtu"), *own}) {
      if (format == "exodus") continue;  // is not written
      // Written again, it has one zone.
      if (format == "su2" && first->mesh.find("su2:zone", Domain::cell) != nullptr) continue;
      WriteOptions write;
      write.format = format;
      std::vector<std::byte> bytes;
      const auto sink = memory_sink(bytes);
      ASSERT_TRUE(write_mesh(first->mesh, *sink, write)) << entry.file;
      ReadOptions read;
      read.format = format;
      const auto second = read_mesh(*memory_source(Bytes(bytes)), read);
      ASSERT_TRUE(second) << entry.file << ": " << second.error().message;
      EXPECT_TRUE(cells_as_text(first->mesh) == cells_as_text(second->mesh)) << entry.file << " " << format;
      if (first->mesh.points.type == second->mesh.points.type) {
        EXPECT_TRUE(first->mesh.points.bytes == second->mesh.points.bytes) << entry.file << " " << format;
      }
      EXPECT_EQ(first->mesh.arrays.size(), second->mesh.arrays.size()) << entry.file << " " << format;
      ASSERT_EQ(first->mesh.blocks.size(), second->mesh.blocks.size()) << entry.file << " " << format;
      for (size_t b = 0; b < first->mesh.blocks.size(); ++b) {
        EXPECT_EQ(first->mesh.blocks[b].name, second->mesh.blocks[b].name) << entry.file << " " << format;
      }
    }
  }
}

}  // namespace
}  // namespace maille
