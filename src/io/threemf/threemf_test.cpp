#include <gmock/gmock.h>
#include <maille/gltf.h>

#include "base/bytes.h"
#include "io/same_mesh.h"
#include "io/threemf/threemf.h"
#include "io/zip.h"
#include "support/cases.h"
#include "support/random.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

using Files = std::vector<std::pair<std::string, std::string>>;

std::string archive(const Files& files) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  ZipWriter zip(*sink);
  for (const auto& [path, text] : files) {
    EXPECT_TRUE(
        zip.add(path, [&text = text](Sink& file) { return file.write(std::as_bytes(std::span(text))); }));
  }
  EXPECT_TRUE(zip.finish());
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

std::string package(const std::string& model) {
  return archive({{threemf_model_path, model}});
}

const std::string triangle_mesh =
    "<mesh><vertices><vertex x='0' y='0' z='0'/><vertex x='1.5' y='0' z='0'/><vertex x='0' y='2' z='0.1'/>"
    "</vertices><triangles><triangle v1='0' v2='1' v3='2'/></triangles></mesh>";

std::string model_of(const std::string& resources, const std::string& build) {
  return "<model xmlns='http://schemas.microsoft.com/3dmanufacturing/core/2015/02'><resources>" + resources +
         "</resources><build>" + build + "</build></model>";
}

std::string one_object(const std::string& mesh = triangle_mesh) {
  return model_of("<object id='1' name='leaf'>" + mesh + "</object>", "<item objectid='1'/>");
}

ReadResult read_good(const std::string& text) {
  return read_good_text(threemf_format(), text, "x.3mf");
}

/// Two triangles of two materials that share an edge, and one apart.
Mesh three_triangles() {
  Mesh mesh;
  mesh.points.resize(7);
  const float places[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0.1f, 5, 5, 5, 6, 5, 5, 5, 6, 1e-7f};
  std::copy(std::begin(places), std::end(places), mesh.points.values<float>().begin());
  mesh.blocks.push_back({"plate & <co>", CellType::triangle, {}, {}, {0, 1, 2, 2, 1, 3}});
  mesh.blocks.push_back({"apart", CellType::triangle, {}, {}, {4, 5, 6}});
  Array material = make_array("material", Domain::cell, Scalar::u32, 1, Role::label);
  material.labels = {"PLA", "\"PETG\"", ""};
  material.resize(3);
  material.values<uint32_t>()[0] = 1;
  material.values<uint32_t>()[2] = 2;
  mesh.arrays.push_back(material);
  mesh.metadata = {{"3mf.unit", "inch"},
                   {"3mf.metadata.Title", "a < b"},
                   {"3mf.displaycolor", "#ff0000 #00FF0080 #000000"}};
  return mesh;
}

std::string written(const Mesh& mesh, std::vector<std::string>* notes = nullptr) {
  std::vector<std::byte> bytes;
  const auto said = write_threemf(mesh, *memory_sink(bytes), {});
  EXPECT_TRUE(said) << said.error().message;
  if (said && notes != nullptr) *notes = *said;
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

TEST(ThreeMf, ComesBackAsItWasWritten) {
  const Mesh mesh = three_triangles();
  const ReadResult result = read_good(written(mesh));
  expect_same_mesh(mesh, result.mesh);
  EXPECT_THAT(result.notes, ElementsAre("lengths are in the unit inch"));
}

TEST(ThreeMf, CountsInMillimetresWhereItSaysNothing) {
  const auto metadata = read_good(package(one_object())).mesh.metadata;
  EXPECT_THAT(metadata, ElementsAre(std::pair<std::string, std::string>{"3mf.unit", "millimeter"}));
}

TEST(ThreeMf, TellsOtherFormatsOfTitlesAndUnits) {
  const std::vector<std::string> notes = write_text(off_format(), three_triangles()).notes;
  EXPECT_TRUE(has_note(notes, "that lengths are in the unit inch left out"));
  EXPECT_TRUE(has_note(notes, "metadata \"3mf.metadata.Title\" left out"));
}

TEST(ThreeMf, KeepsDoublesWhereOneIsMoreThanAFloat) {
  Mesh mesh = three_triangles();
  mesh.points = make_array("position", Domain::point, Scalar::f64, 3);
  mesh.points.resize(7);
  for (size_t i = 0; i < 21; ++i) mesh.points.values<double>()[i] = 0.1 + static_cast<double>(i) / 3;
  expect_same_mesh(mesh, read_good(written(mesh)).mesh);
}

TEST(ThreeMf, JoinsBlocksThatSharePoints) {
  Mesh mesh = three_triangles();
  mesh.blocks = {{"a", CellType::triangle, {}, {}, {0, 1, 2}},
                 {"b", CellType::triangle, {}, {}, {4, 5, 6}},
                 {"c", CellType::triangle, {}, {}, {2, 1, 3}}};
  std::vector<std::string> notes;
  const ReadResult result = read_good(written(mesh, &notes));
  ASSERT_EQ(result.mesh.blocks.size(), 2u);
  EXPECT_EQ(result.mesh.blocks[0].size(), 2u);
  EXPECT_EQ(result.mesh.point_count(), 7u);
  EXPECT_THAT(notes, ElementsAre("the names of 1 block left out"));
}

TEST(ThreeMf, SaysWhatItCannotHold) {
  Mesh mesh = three_triangles();
  mesh.blocks = {{"", CellType::polygon, {}, {0, 4, 7}, {0, 1, 3, 2, 4, 4, 5}},
                 {"", CellType::line, {}, {}, {0, 1}}};
  mesh.arrays[0] = make_array("height", Domain::point, Scalar::f32, 1);
  mesh.arrays[0].resize(7);
  std::vector<std::string> notes;
  EXPECT_EQ(read_good(written(mesh, &notes)).mesh.cell_count(), 2u);
  EXPECT_THAT(notes,
              ElementsAre("1 cell that are not faces of 3 corners or more left out",
                          "1 polygon cut into triangles (fans)",
                          "1 triangle with a corner twice left out: 3MF does not allow them",
                          "3 points that no triangle uses left out", "array \"height\" on points left out"));
  mesh.points.values<float>()[3] = std::numeric_limits<float>::infinity();
  std::vector<std::byte> bytes;
  const auto refused = write_threemf(mesh, *memory_sink(bytes), {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::usage);
}

/// As slicers write it: objects in files of their own, turned and moved by components and by the build.
std::string assembly() {
  const std::string root =
      "<model unit='millimeter' xmlns:p='http://schemas.microsoft.com/3dmanufacturing/production/2015/06'>"
      "<metadata name='slicer:Version'>1</metadata><resources>"
      "<m:colorgroup id='9'/><object id='2'><components>"
      "<component objectid='1' p:path='/3D/Objects/leaf.model'/>"
      "<component objectid='1' p:path='/3D/Objects/leaf.model' transform='0 1 0 -1 0 0 0 0 1 10 0 0'/>"
      "</components></object><object id='3'>" +
      triangle_mesh +
      "</object></resources><build><item objectid='2' transform='1 0 0 0 1 0 0 0 1 0 0 5'/></build></model>";
  return archive({{"_rels/.rels",
                   "<Relationships><Relationship Type='http://schemas.microsoft.com/3dmanufacturing/2013/01/"
                   "3dmodel' Target='/3D/main.model'/></Relationships>"},
                  {"3D/main.model", root},
                  {"3D/Objects/leaf.model", one_object()},
                  {"Metadata/thumbnail.png", "..."}});
}

TEST(ThreeMf, PlacesComponentsOfOtherFilesAsTheBuildSays) {
  const ReadResult result = read_good(assembly());
  ASSERT_EQ(result.mesh.blocks.size(), 1u);
  EXPECT_TRUE(has_note(result.notes, "1 object that the build does not use left out"));
  EXPECT_TRUE(has_note(result.notes, "left out: colorgroup, metadata of a slicer"));
  EXPECT_TRUE(has_note(result.notes, "1 other file of the package"));
  std::vector<std::string> notes;
  const auto scene = mesh_in_scene(result.mesh, notes);
  ASSERT_TRUE(scene && *scene);
  const auto places = (*scene)->points.values<float>();
  // The second point (1.5, 0, 0) is moved up, and where it was turned lies along y.
  EXPECT_THAT(std::vector<float>(places.begin() + 3, places.begin() + 6), ElementsAre(1.5f, 0, 5));
  EXPECT_THAT(std::vector<float>(places.begin() + 12, places.begin() + 15), ElementsAre(10, 1.5f, 5));
  // Written again it is placed in the same way.
  expect_same_mesh(result.mesh, read_good(written(result.mesh)).mesh);
}

TEST(ThreeMf, RefusesWhatNamesNothing) {
  const auto error = [](const std::string& text) { return error_of_text(threemf_format(), text, "x.3mf"); };
  EXPECT_THAT(error("PK"), HasSubstr("no list of files at its end"));
  EXPECT_THAT(error(archive({{"word/document.xml", "<w/>"}})), HasSubstr("no \"3D/3dmodel.model\" in it"));
  EXPECT_THAT(error(package("<model>")), HasSubstr("not well-formed XML"));
  EXPECT_THAT(error(package("<mesh/>")), HasSubstr("no element \"model\""));
  EXPECT_THAT(error(package(model_of("", "<item objectid='1'/>"))), HasSubstr("no object 1"));
  std::string mesh = triangle_mesh;
  mesh.replace(mesh.find("v3='2'"), 6, "v3='3'");
  EXPECT_THAT(error(package(one_object(mesh))),
              HasSubstr("object 1: triangle 0: its v3 is none of the 3 vertices"));
  mesh = triangle_mesh;
  mesh.replace(mesh.find("1.5"), 3, "1,5");
  EXPECT_THAT(error(package(one_object(mesh))), HasSubstr("object 1: a vertex has no number as its x"));
}

TEST(ThreeMf, EndsWhereObjectsAreComponentsOfEachOther) {
  const auto component = [](int id, int inner) {
    const std::string one = "<component objectid='" + std::to_string(inner) + "'/>";
    return "<object id='" + std::to_string(id) + "'><components>" + one + one + "</components></object>";
  };
  std::string doubling;
  for (int id = 2; id < 30; ++id) doubling += component(id, id - 1);
  for (const std::string& objects :
       {component(29, 29), doubling + "<object id='1'>" + triangle_mesh + "</object>"}) {
    const auto result = read_text(threemf_format(), package(model_of(objects, "<item objectid='29'/>")));
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::unsupported);
  }
}

TEST(ThreeMf, RefusesEveryCut) {
  const std::string whole = package(one_object());
  for (size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(read_text(threemf_format(), whole.substr(0, size)));
}

TEST(ThreeMf, SurvivesChangedModels) {
  for (uint64_t seed = 0; seed < testing::cases(300); ++seed) {
    testing::Random random(seed);
    std::string model = model_of(
        "<basematerials id='5'><base name='PLA'/></basematerials><object id='1' pid='5' pindex='0'>" +
            triangle_mesh + "</object>",
        "<item objectid='1' transform='1 0 0 0 1 0 0 0 1 0 0 5'/>");
    for (uint32_t change = random.between(1, 4); change > 0; --change) {
      const size_t at = random.below(model.size());
      if (random.chance(50)) {
        model[at] = "0123456789<>/'= "[random.below(16)];
      } else {
        model.erase(at, random.below(20));
      }
    }
    const auto result = read_text(threemf_format(), package(model));  // checks the mesh
    if (result) written(result->mesh);
  }
}

TEST(Zip, ReadsLongSizesOfShortFiles) {
  std::string text = archive({{"a", "some text"}});
  const size_t list = text.find("PK\x01\x02"), end = text.find("PK\x05\x06");
  const auto put = [&](size_t at, auto value) { std::memcpy(text.data() + at, &value, sizeof value); };
  const auto packed = load<uint32_t>(text.data() + list + 20), size = load<uint32_t>(text.data() + list + 24);
  std::string extra(20, '\0');
  const uint64_t sizes[] = {size, packed};
  extra[0] = 1;
  extra[2] = 16;
  std::memcpy(extra.data() + 4, sizes, 16);
  put(list + 20, UINT32_MAX);
  put(list + 24, UINT32_MAX);
  put(list + 30, uint16_t{20});
  put(end + 12, static_cast<uint32_t>(end - list + 20));
  text.insert(end, extra);
  const auto zip = ZipReader::open(std::as_bytes(std::span(text)), "x.zip");
  ASSERT_TRUE(zip) << zip.error().message;
  ASSERT_NE(zip->find("/A"), nullptr);
  const auto read = zip->read(*zip->find("/A"), 100);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->size(), 9u);
  EXPECT_EQ(zip->read(*zip->find("a"), 8).error().code, ErrorCode::memory_bound);
}

TEST(Zip, NeverGivesBytesWhoseSumIsWrong) {
  const std::string whole = archive({{"a", std::string(300, 'x') + "some text that is not so short"}});
  for (size_t at = 0; at < whole.size(); ++at) {
    std::string text = whole;
    text[at] = static_cast<char>(text[at] ^ 0x10);
    const auto zip = ZipReader::open(std::as_bytes(std::span(text)), "x.zip");
    const ZipEntry* const entry = zip ? zip->find("a") : nullptr;
    const auto read = entry != nullptr ? zip->read(*entry, 1 << 20) : Result<std::vector<std::byte>>();
    if (read && !read->empty()) {
      EXPECT_EQ(read->size(), 330u) << at;
    }
  }
}

}  // namespace
}  // namespace maille
