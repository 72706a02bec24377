// polyMesh written: comes back through the reader, keeps OpenFOAM's order of faces, and names what it cannot
// hold.

#include <gmock/gmock.h>
#include <maille/folder.h>
#include <maille/out_of_core.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "base/result.h"
#include "io/cell_faces.h"
#include "io/format.h"
#include "io/same_mesh.h"
#include "support/random.h"
#include "support/sample_mesh.h"
#include "support/temporary_folder.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

namespace fs = std::filesystem;

/// A case that is gone with the test.
class Case {
 public:
  const std::string& folder() const { return folder_; }

  Result<std::vector<std::string>> write(const Mesh& mesh, bool ascii = false) const {
    const auto sink = MAILLE_TRY(polymesh_sink(folder_));
    auto notes = MAILLE_TRY(write_mesh(mesh, *sink, {.format = "polymesh", .ascii = ascii}));
    MAILLE_CHECK(sink->commit());
    return notes;
  }
  std::string text(const std::string& name) const {
    return temporary_.read("case/constant/polyMesh/" + name);
  }
  std::string body(const std::string& name) const {
    const std::string all = text(name);
    return all.substr(all.find("}\n\n") + 3);
  }

 private:
  testing::TemporaryFolder temporary_;
  std::string folder_ = temporary_.path("case");  ///< not there at first
};

/// Any rotation of a face is the same face.
std::vector<uint32_t> rotated(std::span<const uint32_t> face) {
  std::vector<uint32_t> result(face.begin(), face.end());
  std::rotate(result.begin(), std::min_element(result.begin(), result.end()), result.end());
  return result;
}

/// What a mesh is, whichever corner its cells begin with: the type, faces and block of each cell.
std::string shape_of(const Mesh& mesh) {
  std::string shape;
  const auto put = [&](const std::vector<uint32_t>& face) {
    for (const uint32_t corner : face) shape += " " + std::to_string(corner);
    shape += ",";
  };
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      std::set<std::vector<uint32_t>> faces;
      if (for_each_linear_face(block, i,
                               [&](std::span<const uint32_t> face) { faces.insert(rotated(face)); })) {
        shape += std::to_string(static_cast<int>(block.type_of(i))) + ":";
      } else {
        shape += "face of " + block.name;
        faces.insert(rotated(block.cell(i)));
      }
      for (const auto& face : faces) put(face);
      shape += "\n";
    }
  }
  return shape;
}

/// A grid of cubes, each a hexahedron, two wedges, six pyramids, five tetrahedra or a polyhedron; faces of
/// different cells often do not fit, and are at the boundary then.
class RandomGrid {
 public:
  explicit RandomGrid(uint64_t seed) : random_(seed), n_(random_.between(1, 4)) {
    cells_.type = CellType::mixed;
    cells_.offsets = {0};
    cells_.cell_faces = {0};
    for (uint32_t i = 0; i < (n_ + 1) * (n_ + 1) * (n_ + 1); ++i)
      add_point({1.0 * (i % (n_ + 1)), 1.0 * (i / (n_ + 1) % (n_ + 1)), 1.0 * (i / (n_ + 1) / (n_ + 1))});
    for (uint32_t i = 0; i < n_ * n_ * n_; ++i) add_cube(i % n_, i / n_ % n_, i / n_ / n_);
  }

  Mesh mesh(Scalar type) {
    Mesh mesh;
    mesh.points = make_array("position", Domain::point, type, 3);
    mesh.points.resize(points_.size() / 3);
    for (size_t i = 0; i < points_.size(); ++i) {
      if (type == Scalar::f32) {
        mesh.points.values<float>()[i] = static_cast<float>(points_[i]);
      } else {
        mesh.points.values<double>()[i] = points_[i];
      }
    }
    mesh.blocks.push_back(cells_);
    return mesh;
  }

 private:
  uint32_t add_point(std::array<double, 3> at) {
    for (const double value : at) points_.push_back(value + random_.below(1000) / 9000.0);
    return static_cast<uint32_t>(points_.size() / 3 - 1);
  }
  void add(CellType type, std::initializer_list<uint32_t> nodes) {
    cells_.types.push_back(static_cast<uint8_t>(type));
    cells_.connectivity.insert(cells_.connectivity.end(), nodes.begin(), nodes.end());
    cells_.offsets.push_back(cells_.connectivity.size());
    cells_.cell_faces.push_back(cells_.face_sizes.size());
  }
  void add_cube(uint32_t x, uint32_t y, uint32_t z) {
    const auto at = [&](uint32_t a, uint32_t b, uint32_t c) {
      return ((z + c) * (n_ + 1) + y + b) * (n_ + 1) + x + a;
    };
    const uint32_t p[] = {at(0, 0, 0), at(1, 0, 0), at(1, 1, 0), at(0, 1, 0),
                          at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)};
    switch (random_.below(6)) {
      case 0:
        add(CellType::wedge, {p[0], p[2], p[1], p[4], p[6], p[5]});
        return add(CellType::wedge, {p[0], p[3], p[2], p[4], p[7], p[6]});
      case 1: {
        const uint32_t apex = add_point({x + 0.4, y + 0.4, z + 0.4});
        const FacesOfSolid& faces = faces_of(CellType::hexahedron);
        for (unsigned f = 0; f < faces.count; ++f) {
          const auto node = [&](size_t i) { return p[faces.nodes[f][i]]; };
          add(CellType::pyramid, {node(3), node(2), node(1), node(0), apex});
        }
        return;
      }
      case 2:
        add(CellType::tetrahedron, {p[0], p[1], p[2], p[5]});
        add(CellType::tetrahedron, {p[0], p[2], p[3], p[7]});
        add(CellType::tetrahedron, {p[0], p[5], p[7], p[4]});
        add(CellType::tetrahedron, {p[2], p[7], p[5], p[6]});
        return add(CellType::tetrahedron, {p[0], p[2], p[7], p[5]});
      case 3:  // the top is two triangles
        cells_.face_sizes.insert(cells_.face_sizes.end(), {4, 4, 4, 4, 4, 3, 3});
        return add(CellType::polyhedron,
                   {p[0], p[3], p[2], p[1], p[0], p[1], p[5], p[4], p[1], p[2], p[6], p[5], p[2],
                    p[3], p[7], p[6], p[3], p[0], p[4], p[7], p[4], p[5], p[6], p[4], p[6], p[7]});
      default:
        return add(CellType::hexahedron, {p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7]});
    }
  }

  Random random_;
  uint32_t n_;
  std::vector<double> points_;
  CellBlock cells_;
};

/// The rules of OpenFOAM, of the files themselves.
void expect_order(const Mesh& mesh, const Case& written) {
  const auto numbers = [&](const char* name) {
    std::istringstream in(written.body(name));
    std::vector<uint64_t> list;
    uint64_t count = 0, value = 0;
    char bracket = 0;
    for (in >> count >> bracket; list.size() < count && in >> value;) list.push_back(value);
    EXPECT_EQ(list.size(), count);
    return list;
  };
  const auto owner = numbers("owner"), neighbour = numbers("neighbour");
  ASSERT_LE(neighbour.size(), owner.size());
  for (size_t i = 0; i < neighbour.size(); ++i) {
    EXPECT_LT(owner[i], neighbour[i]);
    if (i == 0) continue;
    EXPECT_TRUE(std::pair(owner[i - 1], neighbour[i - 1]) <= std::pair(owner[i], neighbour[i])) << i;
  }
  EXPECT_EQ(*std::max_element(owner.begin(), owner.end()) < mesh.cell_count(), true);
}

TEST(PolyMeshWriter, RandomGridsOfAllCellsComeBack) {
  for (uint64_t seed = 0; seed < 24; ++seed) {
    const Mesh mesh = RandomGrid(seed).mesh(seed % 3 == 0 ? Scalar::f32 : Scalar::f64);
    const bool ascii = seed % 2 == 0;
    const Case written;
    const auto notes = written.write(mesh, ascii);
    ASSERT_TRUE(notes) << notes.error().message;
    if (ascii) expect_order(mesh, written);
    const auto back = read_mesh(written.folder());
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_THAT(back->notes, IsEmpty());
    ASSERT_EQ(back->mesh.points.count(), mesh.points.count());
    if (!ascii || mesh.points.type == Scalar::f64) {
      EXPECT_EQ(back->mesh.points.type, mesh.points.type);
      EXPECT_TRUE(back->mesh.points.bytes == mesh.points.bytes);
    }
    // The faces at the boundary come as cells behind the others.
    const std::string shape = shape_of(mesh);
    EXPECT_EQ(shape_of(back->mesh).substr(0, shape.size()), shape) << seed;
    EXPECT_EQ(back->mesh.blocks.back().name, "defaultFaces");

    // Written again, with patches now, it stays as it is.
    const auto again = written.write(back->mesh, !ascii);
    ASSERT_TRUE(again) << again.error().message;
    const auto third = read_mesh(written.folder());
    ASSERT_TRUE(third) << third.error().message;
    EXPECT_EQ(shape_of(third->mesh), shape_of(back->mesh)) << seed;
    EXPECT_EQ(third->mesh.metadata, back->mesh.metadata);

    // From here on even bytes stay.
    const std::string faces = written.text("faces"), boundary = written.text("boundary");
    ASSERT_TRUE(written.write(third->mesh, !ascii));
    EXPECT_TRUE(written.text("faces") == faces && written.text("boundary") == boundary) << seed;
  }
}

TEST(PolyMeshWriter, WhatBlockMeshMadeComesBackExactly) {
  const auto first = read_mesh(sample_path("polymesh"));
  ASSERT_TRUE(first) << first.error().message;
  for (const bool ascii : {false, true}) {
    const Case written;
    const auto notes = written.write(first->mesh, ascii);
    ASSERT_TRUE(notes) << notes.error().message;
    EXPECT_THAT(*notes, IsEmpty());
    const auto back = read_mesh(written.folder());
    ASSERT_TRUE(back) << back.error().message;
    // Empty patches, too.
    EXPECT_EQ(back->mesh.metadata, first->mesh.metadata);
    EXPECT_EQ(shape_of(back->mesh), shape_of(first->mesh));
    EXPECT_TRUE(back->mesh.points.bytes == first->mesh.points.bytes);
  }
}

Mesh two_tetrahedra() {
  Mesh mesh;
  mesh.points = make_array("position", Domain::point, Scalar::f64, 3);
  mesh.points.resize(5);
  const double positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};
  std::copy(std::begin(positions), std::end(positions), mesh.points.values<double>().begin());
  mesh.blocks.push_back({"", CellType::tetrahedron, {}, {}, {0, 1, 2, 3, 1, 2, 3, 4}, {}, {}});
  return mesh;
}

TEST(PolyMeshWriter, WritesTheFilesOfASmallCase) {
  Mesh mesh = two_tetrahedra();
  mesh.blocks.push_back({"wall of 2", CellType::triangle, {}, {}, {0, 2, 1, 4, 2, 3}, {}, {}});
  mesh.metadata = {{"openfoam.patch.none", "empty"}, {"openfoam.patch.wall of 2", "wall"}};
  const Case written;
  const auto notes = written.write(mesh, true);
  ASSERT_TRUE(notes) << notes.error().message;
  EXPECT_EQ(written.text("owner"),
            "FoamFile\n{\n    version     2.0;\n    format      ascii;\n    class       labelList;\n"
            "    note        \"nPoints:5  nCells:2  nFaces:7  nInternalFaces:1\";\n"
            "    location    \"constant/polyMesh\";\n    object      owner;\n}\n\n"
            "7\n(\n0\n0\n1\n0\n0\n1\n1\n)\n\n");
  EXPECT_EQ(written.body("neighbour"), "1\n(\n1\n)\n\n");
  EXPECT_EQ(written.body("points"), "5\n(\n(0 0 0)\n(1 0 0)\n(0 1 0)\n(0 0 1)\n(1 1 1)\n)\n\n");
  EXPECT_EQ(written.body("faces"),
            "7\n(\n3(1 2 3)\n3(0 2 1)\n3(4 2 3)\n3(0 1 3)\n3(0 3 2)\n3(1 2 4)\n3(1 4 3)\n)\n\n");
  EXPECT_EQ(written.body("boundary"),
            "3\n(\n    none\n    {\n        type            empty;\n        nFaces          0;\n"
            "        startFace       1;\n    }\n    wall_of_2\n    {\n        type            wall;\n"
            "        nFaces          2;\n        startFace       1;\n    }\n    defaultFaces\n    {\n"
            "        type            patch;\n        nFaces          4;\n        startFace       3;\n    }\n"
            ")\n\n");
}

TEST(PolyMeshWriter, NamesWhatItCannotHold) {
  Mesh mesh = two_tetrahedra();
  mesh.blocks[0].name = "fluid";
  mesh.blocks.push_back({"a", CellType::triangle, {}, {}, {0, 2, 1, 1, 2, 3, 0, 1, 4}, {}, {}});
  mesh.blocks.push_back({"b", CellType::triangle, {}, {}, {0, 2, 1}, {}, {}});
  mesh.blocks.push_back({"", CellType::line, {}, {}, {0, 2}, {}, {}});
  mesh.arrays.push_back(make_array("p", Domain::point, Scalar::f32, 1));
  mesh.arrays.back().resize(5);
  mesh.metadata = {{"openfoam.patch.a", "cyclic"}, {"comment", "x"}};
  const Case written;
  const auto notes = written.write(mesh);
  ASSERT_TRUE(notes) << notes.error().message;
  for (const char* said :
       {"1 cell left out", "1 face between two cells left out", "1 face of no volume cell left out",
        "1 face in two patches", "5 faces at the boundary", "type cyclic", "array \"p\" on points left out",
        "metadata \"comment\" left out"}) {
    EXPECT_THAT(*notes, Contains(HasSubstr(said)));
  }
}

TEST(PolyMeshWriter, KeepsOtherEntriesOfPatchesButNoDirectives) {
  Mesh mesh = two_tetrahedra();
  mesh.metadata = {{"openfoam.patch.a", "cyclic"},
                   {"openfoam.entries.a", "neighbourPatch b; separationVector ( 1 0 0 ); "},
                   {"openfoam.patch.b", "cyclic"},
                   {"openfoam.entries.b", "x #calc \"1\"; "},
                   {"openfoam.patch.defaultFaces", "patch"}};
  const Case written;
  const auto notes = written.write(mesh);
  ASSERT_TRUE(notes) << notes.error().message;
  EXPECT_THAT(*notes, Contains(HasSubstr("patch \"b\" is of type cyclic")));
  EXPECT_EQ(written.text("boundary").find('#'), std::string::npos);
  const auto back = read_mesh(written.folder());
  ASSERT_TRUE(back) << back.error().message;
  mesh.metadata.erase(mesh.metadata.begin() + 3);
  EXPECT_EQ(back->mesh.metadata, mesh.metadata);
}

TEST(PolyMeshWriter, RefusesWhatIsNoVolume) {
  const auto refused = [](const Mesh& mesh) {
    const Case written;
    const auto notes = written.write(mesh);
    EXPECT_FALSE(notes);
    EXPECT_FALSE(fs::exists(written.folder()));
    return notes ? std::string() : notes.error().message;
  };
  Mesh mesh = two_tetrahedra();
  mesh.blocks[0].connectivity = {0, 1, 2, 3, 1, 2, 3, 4, 1, 2, 3, 0};
  EXPECT_THAT(refused(mesh), HasSubstr("volume cells 0, 1 and 2 share a face"));
  mesh.blocks[0].connectivity = {0, 1, 2, 2};
  EXPECT_THAT(refused(mesh), HasSubstr("volume cell 0 has 2 faces of three points or more"));
  mesh.blocks[0] = {"", CellType::triangle, {}, {}, {0, 1, 2}, {}, {}};
  EXPECT_THAT(refused(mesh), HasSubstr("polyMesh holds volume cells, but the mesh has none"));
  mesh.blocks[0] = {
      "", CellType::polyhedron, {}, {0, 12}, {0, 1, 2, 0, 2, 1, 0, 1, 3, 0, 3, 1}, {3, 3, 3, 3}, {0, 4}};
  EXPECT_THAT(refused(mesh), HasSubstr("has the same face twice"));
}

TEST(PolyMeshWriter, CollapsedHexahedraAreWedges) {
  Mesh mesh = two_tetrahedra();
  mesh.points.resize(6);
  mesh.blocks[0] = {"", CellType::hexahedron, {}, {}, {0, 1, 2, 2, 3, 4, 5, 5}, {}, {}};
  const Case written;
  const auto notes = written.write(mesh);
  ASSERT_TRUE(notes) << notes.error().message;
  EXPECT_THAT(*notes, Contains(HasSubstr("1 cell with a point twice in a face")));
  const auto back = read_mesh(written.folder());
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->mesh.blocks[0].type, CellType::wedge);
}

TEST(PolyMeshWriter, PatchesAreNamedByLabelsOfGeneratedMeshes) {
  Mesh mesh = two_tetrahedra();
  mesh.blocks.push_back({"", CellType::triangle, {}, {}, {0, 2, 1, 4, 2, 3}, {}, {}});
  Array array = make_array("patch", Domain::cell, Scalar::u16, 1, Role::label);
  array.labels = {"fluid", "inlet", "walls"};
  array.resize(4);
  array.values<uint16_t>()[2] = 2;
  array.values<uint16_t>()[3] = 1;
  mesh.arrays.push_back(array);
  mesh.metadata = {{"patch.walls", "wall"}, {"patch.inlet", "patch"}};
  const Case written;
  ASSERT_TRUE(written.write(mesh));
  const auto back = read_mesh(written.folder());
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_THAT(back->mesh.metadata, ElementsAre(std::pair("openfoam.patch.walls", "wall"),
                                               std::pair("openfoam.patch.inlet", "patch"),
                                               std::pair("openfoam.patch.defaultFaces", "patch"),
                                               std::pair("openfoam.cellZone.fluid", "cellZone")));
}

/// The files of a mesh by name.
std::map<std::string, std::string> files_of(const Case& written) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(written.folder() + "/constant/polyMesh")) {
    const std::string name = entry.path().filename().string();
    files[name] = written.text(name);
  }
  return files;
}

std::unique_ptr<Source> packed(const Mesh& mesh) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  EncodeOptions options;
  options.mode = Mode::stream;
  options.order = Order::keep;
  EXPECT_TRUE(encode(mesh, *sink, options));
  return memory_source(std::move(bytes), "packed");
}

TEST(PolyMeshSink, WritesInPartsTheBytesOfTheWriterInMemory) {
  for (uint64_t seed = 0; seed < 12; ++seed) {
    const bool ascii = seed % 3 == 0;
    const Case written;
    ASSERT_TRUE(written.write(RandomGrid(seed).mesh(Scalar::f64)));
    // With patches, and on odd turns faces in none beside one that is called like those.
    Mesh mesh = read_mesh(written.folder())->mesh;
    if (seed % 2 != 0) {
      CellBlock& patch = mesh.blocks.back();
      const uint64_t kept = patch.size() / 2;
      patch.connectivity.resize(static_cast<size_t>(patch.cell(kept).data() - patch.connectivity.data()));
      if (!patch.offsets.empty()) patch.offsets.resize(kept + 1);
      mesh.metadata = {{"openfoam.patch.defaultFaces", "patch"}, {"openfoam.patch.wall", "wall"}};
    }
    const auto source = packed(mesh);
    const auto whole = decode(*source);
    ASSERT_TRUE(whole) << whole.error().message;
    const auto notes = written.write(*whole, ascii);
    ASSERT_TRUE(notes) << notes.error().message;
    const auto expected = files_of(written);

    // So little memory that what is sorted goes to files many times.
    const auto parts = mesh_sink(written.folder(), "polymesh", *describe(*source),
                                 {.ascii = ascii, .folder = {}, .memory = 4096});
    ASSERT_TRUE(parts) << parts.error().message;
    const auto done = decode(*source, **parts);
    ASSERT_TRUE(done) << done.error().message;
    EXPECT_EQ((*parts)->notes(), *notes);
    EXPECT_TRUE(files_of(written) == expected) << seed;
  }
}

TEST(PolyMeshSink, LeavesNothingWhereTheMeshIsRefused) {
  Mesh mesh = two_tetrahedra();
  mesh.blocks[0].connectivity = {0, 1, 2, 3, 1, 2, 3, 4, 1, 2, 3, 0};
  const auto source = packed(mesh);
  const Case written;
  {
    const auto parts = mesh_sink(written.folder(), "polymesh", *describe(*source));
    ASSERT_TRUE(parts) << parts.error().message;
    const auto done = decode(*source, **parts);
    ASSERT_FALSE(done);
    EXPECT_THAT(done.error().message, HasSubstr("share a face"));
  }
  EXPECT_FALSE(fs::exists(written.folder()));
}

Mesh with_zones() {
  Mesh mesh = two_tetrahedra();
  mesh.blocks[0].name = "fluid";
  mesh.blocks.push_back({"wall", CellType::triangle, {}, {}, {0, 2, 1}, {}, {}});
  // Between the two, seen from the second; and the wall again.
  mesh.blocks.push_back({"faceZone:cut", CellType::triangle, {}, {}, {1, 3, 2, 0, 2, 1}, {}, {}});
  Array points = make_array("pointZone", Domain::point, Scalar::u8, 1, Role::label);
  points.labels = {"", "tips"};
  points.resize(5);
  points.values<uint8_t>()[0] = points.values<uint8_t>()[4] = 1;
  mesh.arrays.push_back(points);
  mesh.metadata = {{"openfoam.cellZone.none", "cellZone"}};
  return mesh;
}

TEST(PolyMeshSink, LeavesNothingWhereTheProcessIsStopped) {
  const testing::TemporaryFolder folder;
  const auto sink = polymesh_sink(folder.path("a/case"));
  ASSERT_TRUE(sink) << sink.error().message;
  for (const char* name : {"points", "faces"}) {
    ASSERT_TRUE((*sink)->begin_file(name));
    ASSERT_TRUE((*sink)->write(std::as_bytes(std::span("text", 4))));
  }
  EXPECT_FALSE(folder.names().empty());
  remove_unfinished_files();
  EXPECT_TRUE(folder.names().empty());
}

TEST(PolyMeshWriter, WritesZones) {
  const Case written;
  const auto notes = written.write(with_zones(), true);
  ASSERT_TRUE(notes) << notes.error().message;
  EXPECT_THAT(*notes, ElementsAre(HasSubstr("5 faces at the boundary")));
  EXPECT_EQ(written.body("cellZones"),
            "2\n(\nnone\n{\n    type cellZone;\n    cellLabels 0;\n}\n"
            "fluid\n{\n    type cellZone;\n    cellLabels List<label> \n2\n(\n0\n1\n);\n}\n)\n\n");
  EXPECT_EQ(written.body("faceZones"),
            "1\n(\ncut\n{\n    type faceZone;\n    faceLabels List<label> \n2\n(\n0\n1\n);\n"
            "    flipMap List<bool> \n2\n(\n1\n0\n);\n}\n)\n\n");
  EXPECT_EQ(written.body("pointZones"),
            "1\n(\ntips\n{\n    type pointZone;\n    pointLabels List<label> \n2\n(\n0\n4\n);\n}\n)\n\n");
}

TEST(PolyMeshWriter, ZonesComeBack) {
  for (const bool ascii : {false, true}) {
    const Case written;
    ASSERT_TRUE(written.write(with_zones(), ascii));
    const auto back = read_mesh(written.folder());
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_THAT(back->notes, IsEmpty());
    ASSERT_EQ(back->mesh.blocks.size(), 4u);
    EXPECT_EQ(back->mesh.blocks[0].name, "fluid");
    EXPECT_EQ(back->mesh.blocks[3].name, "faceZone:cut");
    EXPECT_EQ(rotated(back->mesh.blocks[3].cell(0)), (std::vector<uint32_t>{1, 3, 2}));
    ASSERT_EQ(back->mesh.arrays.size(), 1u);
    EXPECT_EQ(back->mesh.arrays[0].bytes, with_zones().arrays[0].bytes);
    const auto files = files_of(written);
    ASSERT_TRUE(written.write(back->mesh, ascii));
    EXPECT_TRUE(files_of(written) == files);
  }
}

TEST(PolyMeshWriter, ZonesThatTopoSetMadeComeBack) {
  const auto first = read_mesh(sample_path("polymesh_zones"));
  ASSERT_TRUE(first) << first.error().message;
  // Zones of cells overlap: what is in two has the second in another array.
  const Array* const zones = first->mesh.find("cellZone", Domain::cell);
  const Array* const others = first->mesh.find("cellZone:2", Domain::cell);
  ASSERT_TRUE(zones != nullptr && others != nullptr);
  EXPECT_THAT(zones->labels, ElementsAre("", "left", "right", "middle"));
  const auto count = [](const Array& array, uint8_t value) {
    const auto values = array.values<uint8_t>();
    return std::count(values.begin(), values.end(), value);
  };
  EXPECT_EQ(count(*zones, 1), 27);
  EXPECT_EQ(count(*zones, 2), 27);
  EXPECT_EQ(count(*others, 3), 27);
  const auto named = [&](const char* name) {
    uint64_t cells = 0;
    for (const CellBlock& block : first->mesh.blocks) cells += block.name == name ? block.size() : 0;
    return cells;
  };
  EXPECT_EQ(named("faceZone:slab"), 9u);
  EXPECT_EQ(named("faceZone:slab2"), 9u);
  EXPECT_EQ(count(*first->mesh.find("pointZone", Domain::point), 1), 16);

  const Case written;
  const auto notes = written.write(first->mesh);
  ASSERT_TRUE(notes) << notes.error().message;
  EXPECT_THAT(*notes, IsEmpty());
  const auto back = read_mesh(written.folder());
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(shape_of(back->mesh), shape_of(first->mesh));
  EXPECT_EQ(back->mesh.metadata, first->mesh.metadata);
  ASSERT_EQ(back->mesh.arrays.size(), first->mesh.arrays.size());
  for (size_t i = 0; i < back->mesh.arrays.size(); ++i)
    EXPECT_EQ(back->mesh.arrays[i].bytes, first->mesh.arrays[i].bytes);
}

TEST(PolyMeshSink, ReplacesTheMeshOnlyAndOnlyWhole) {
  const Case written;
  ASSERT_TRUE(written.write(two_tetrahedra()));
  const fs::path folder = fs::path(written.folder()) / "constant/polyMesh";
  for (const char* name : {"cellZones", "points.gz", "notes.txt"}) std::ofstream(folder / name) << "x";
  const auto entries = [](const fs::path& of) {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(of)) names.insert(entry.path().filename().string());
    return names;
  };
  const auto before = entries(folder);
  {
    const auto sink = polymesh_sink(folder.string());
    ASSERT_TRUE(sink);
    ASSERT_TRUE(write_mesh(RandomGrid(1).mesh(Scalar::f64), **sink, {.format = "polymesh"}));
  }
  EXPECT_EQ(entries(folder), before);
  EXPECT_THAT(entries(folder.parent_path()), ElementsAre("polyMesh"));
  ASSERT_TRUE(written.write(RandomGrid(1).mesh(Scalar::f64)));
  EXPECT_THAT(entries(folder), ElementsAre("boundary", "faces", "neighbour", "notes.txt", "owner", "points"));
  EXPECT_THAT(entries(folder.parent_path()), ElementsAre("polyMesh"));
  EXPECT_EQ(read_mesh(written.folder())->mesh.point_count(), RandomGrid(1).mesh(Scalar::f64).point_count());
}

TEST(PolyMeshSink, FindsTheFolderTheReaderFinds) {
  EXPECT_EQ(polymesh_folder("case"), "case/constant/polyMesh");
  EXPECT_EQ(polymesh_folder("case/"), "case/constant/polyMesh");
  EXPECT_EQ(polymesh_folder("a/polyMesh"), "a/polyMesh");
  EXPECT_EQ(polymesh_folder("a/case.foam"), "a/constant/polyMesh");
  EXPECT_EQ(polymesh_folder("case.foam"), "constant/polyMesh");
}

TEST(PolyMeshSink, OtherSinksSayThatTheyAreOneFile) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  const auto written = write_mesh(two_tetrahedra(), *sink, {.format = "polymesh"});
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, HasSubstr("a polyMesh is a folder of files"));
}

}  // namespace
}  // namespace maille
