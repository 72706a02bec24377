#include "io/gltf/gltf.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "base/bytes.h"
#include "io/base64.h"
#include "io/format.h"
#include "io/same_mesh.h"
#include "support/data.h"
#include "support/random.h"
#include "support/random_mesh.h"
#include "support/temporary_folder.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

Result<ReadResult> read(std::string_view text) {
  return read_text(gltf_format(), text, "test.glb");
}

std::string error_of(std::string_view text) {
  const auto result = read(text);
  return result ? "no error" : result.error().message;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

template <class T>
std::string raw(const std::vector<T>& values) {
  return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

std::string word(uint32_t value) {
  return raw<uint32_t>({value});
}

std::string glb(std::string json, std::string binary) {
  while (json.size() % 4 != 0) json += ' ';
  while (binary.size() % 4 != 0) binary += '\0';
  const std::string body = word(static_cast<uint32_t>(json.size())) + "JSON" + json +
                           word(static_cast<uint32_t>(binary.size())) + std::string("BIN\0", 4) + binary;
  return "glTF" + word(2) + word(static_cast<uint32_t>(12 + body.size())) + body;
}

/// Four points 0..47, shorts at 48..55, indices (bytes) at 56..61, two of 72 bytes free.
std::string small_binary() {
  return raw<float>({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0.1f}) + raw<uint16_t>({1, 2, 3, 65535}) +
         raw<uint8_t>({0, 1, 2, 0, 2, 3}) + std::string(10, '\0');
}

/// One mesh of one primitive. %A: more accessors; %P: more in the primitive; %T: more at the top.
std::string small_json(const std::string& more_accessors = "",
                       const std::string& in_primitive = "\"indices\":1", const std::string& attributes = "",
                       const std::string& top = "") {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"buffers":[{"byteLength":72}],
"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":8},
{"buffer":0,"byteOffset":56,"byteLength":6},{"buffer":0,"byteLength":72,"byteStride":16}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":2,"componentType":5121,"count":6,"type":"SCALAR"})" +
         more_accessors + R"(],
"meshes":[{"name":"tree","primitives":[{"attributes":{"POSITION":0)" +
         attributes + "}," + in_primitive + "}]}]" + top + "}";
}

TEST(GltfReader, ReadsOnePrimitiveWithByteIndices) {
  const auto result = read(glb(small_json(), small_binary()));
  ASSERT_TRUE(result) << result.error().message;
  Mesh expected;
  expected.points =
      array_of<float>("position", Domain::point, Scalar::f32, 3, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0.1f});
  expected.blocks.push_back({"tree", CellType::triangle, {}, {}, {0, 1, 2, 0, 2, 3}});
  expected.metadata = {{"gltf.asset", R"({"version":"2.0"})"}};
  expect_same_mesh(result->mesh, expected);
  EXPECT_TRUE(result->notes.empty());
}

TEST(GltfReader, ReadsTextWithDataUri) {
  const std::string binary = small_binary();
  const std::string uri = "\"byteLength\":72,\"uri\":\"data:application/octet-stream;base64," +
                          to_base64(std::as_bytes(std::span(binary.data(), binary.size()))) + "\"";
  const auto result = read("  " + replaced(small_json(), "\"byteLength\":72", uri));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.blocks.at(0).connectivity, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3}));
  EXPECT_EQ(result->mesh.points.values<float>()[11], 0.1f);
}

TEST(GltfReader, ModesBecomeCells) {
  const auto cells = [](const std::string& mode) {
    const auto result = read(glb(small_json("", mode), small_binary()));
    EXPECT_TRUE(result) << result.error().message;
    return result ? result->mesh.blocks.at(0) : CellBlock{};
  };
  using List = std::vector<uint32_t>;
  EXPECT_EQ(cells("\"mode\":5").connectivity, (List{0, 1, 2, 1, 3, 2}));
  EXPECT_EQ(cells("\"mode\":6").connectivity, (List{1, 2, 0, 2, 3, 0}));
  EXPECT_EQ(cells("\"mode\":5,\"indices\":1").connectivity, (List{0, 1, 2, 1, 0, 2, 2, 0, 2, 0, 3, 2}));
  EXPECT_EQ(cells("\"mode\":0").type, CellType::vertex);
  EXPECT_EQ(cells("\"mode\":1").connectivity, (List{0, 1, 2, 3}));
  EXPECT_EQ(cells("\"mode\":1").type, CellType::line);
  EXPECT_EQ(cells("\"mode\":2").connectivity, (List{0, 1, 2, 3, 0}));
  EXPECT_EQ(cells("\"mode\":3").type, CellType::poly_line);
  EXPECT_EQ(cells("\"mode\":3").offsets, (std::vector<uint64_t>{0, 4}));
}

TEST(GltfReader, AttributesKeepTheirTypesNamesAndRoles) {
  const std::string accessors =
      R"(,{"bufferView":1,"componentType":5121,"count":4,"type":"VEC2","normalized":true},
{"bufferView":1,"componentType":5123,"count":4,"type":"SCALAR"},
{"bufferView":3,"byteOffset":4,"componentType":5126,"count":4,"type":"VEC2"},
{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"})";
  const auto result = read(
      glb(small_json(accessors, "\"indices\":1", R"(,"TEXCOORD_1":2,"_BATCH":3,"TEXCOORD_0":4,"NORMAL":5)"),
          small_binary()));
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  ASSERT_EQ(mesh.arrays.size(), 4u);
  const Array* second = mesh.find("texcoord_1", Domain::point);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->type, Scalar::u8);
  EXPECT_EQ(second->components, 2u);
  EXPECT_EQ(second->role, Role::texture_coordinate);
  EXPECT_EQ(mesh.find("BATCH", Domain::point)->values<uint16_t>()[3], 65535);
  EXPECT_EQ(mesh.find("normal", Domain::point)->role, Role::normal);
  const auto strided = mesh.find("texcoord", Domain::point)->values<float>();
  EXPECT_EQ(strided[2], 0.f);  // byte 20: the sixth float of the positions
  EXPECT_EQ(strided[4], 0.f);
  EXPECT_EQ(strided[1], 0.f);
  EXPECT_EQ(mesh.metadata.at(1),
            (std::pair<std::string, std::string>("gltf.normalized", R"(["texcoord_1"])")));
}

TEST(GltfReader, SparseAccessorsChangeTheirBaseOrZeros) {
  const std::string accessors =
      R"(,{"bufferView":1,"componentType":5123,"count":4,"type":"SCALAR","sparse":{"count":1,
"indices":{"bufferView":2,"byteOffset":2,"componentType":5121},"values":{"bufferView":1,"byteOffset":6}}},
{"componentType":5123,"count":4,"type":"SCALAR","sparse":{"count":2,
"indices":{"bufferView":2,"byteOffset":1,"componentType":5121},"values":{"bufferView":1,"byteOffset":0}}})";
  const auto result = read(glb(small_json(accessors, "\"indices\":1", R"(,"_A":2,"_B":3)"), small_binary()));
  ASSERT_TRUE(result) << result.error().message;
  const auto a = result->mesh.find("A", Domain::point)->values<uint16_t>();
  EXPECT_EQ(std::vector<uint16_t>(a.begin(), a.end()), (std::vector<uint16_t>{1, 2, 65535, 65535}));
  const auto b = result->mesh.find("B", Domain::point)->values<uint16_t>();
  EXPECT_EQ(std::vector<uint16_t>(b.begin(), b.end()), (std::vector<uint16_t>{0, 1, 2, 0}));
}

/// Two meshes, three primitives: two share points, the third has its own and no _Q; materials.
std::string scene_json(const std::string& nodes) {
  return R"({"asset":{"version":"2.0","copyright":"me"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":)" +
         nodes +
         R"(,"buffers":[{"byteLength":72}],
"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":8},
{"buffer":0,"byteOffset":56,"byteLength":6}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":2,"componentType":5121,"count":6,"type":"SCALAR"},
{"bufferView":2,"byteOffset":3,"componentType":5121,"count":3,"type":"SCALAR"},
{"bufferView":1,"componentType":5123,"count":4,"type":"SCALAR"},
{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}],
"materials":[{"name":"bark"},{}],"textures":[{}],
"meshes":[{"name":"tree","primitives":[{"attributes":{"POSITION":0,"_Q":3},"indices":1,"material":0},
{"attributes":{"POSITION":0},"indices":2,"material":1}]},
{"primitives":[{"attributes":{"POSITION":4},"indices":2}]}]})";
}

TEST(GltfReader, PrimitivesShareOrAppendPointsAndBecomeNamedBlocks) {
  const auto result = read(glb(scene_json(R"([{"mesh":0,"children":[1]},{"mesh":1}])"), small_binary()));
  ASSERT_TRUE(result) << result.error().message;
  const Mesh& mesh = result->mesh;
  EXPECT_EQ(mesh.point_count(), 8u);
  ASSERT_EQ(mesh.blocks.size(), 3u);
  EXPECT_EQ(mesh.blocks[0].name, "tree/0");
  EXPECT_EQ(mesh.blocks[1].name, "tree/1");
  EXPECT_EQ(mesh.blocks[1].connectivity, (std::vector<uint32_t>{0, 2, 3}));
  EXPECT_EQ(mesh.blocks[2].name, "");
  EXPECT_EQ(mesh.blocks[2].connectivity, (std::vector<uint32_t>{4, 6, 7}));
  const Array* material = mesh.find("material", Domain::cell);
  ASSERT_TRUE(material);
  EXPECT_EQ(material->labels, (std::vector<std::string>{"bark", "material 1", ""}));
  const auto values = material->values<uint32_t>();
  EXPECT_EQ(std::vector<uint32_t>(values.begin(), values.end()), (std::vector<uint32_t>{0, 0, 1, 2}));
  const auto q = mesh.find("Q", Domain::point)->values<uint16_t>();
  EXPECT_EQ(std::vector<uint16_t>(q.begin(), q.end()), (std::vector<uint16_t>{1, 2, 3, 65535, 0, 0, 0, 0}));
  EXPECT_EQ(mesh.metadata.back(), (std::pair<std::string, std::string>("gltf.only", R"({"Q":[0]})")));
  EXPECT_TRUE(has_note(result->notes, "1 of 3 primitives have the array \"Q\""));
  EXPECT_TRUE(has_note(result->notes, "1 texture"));
}

TEST(GltfReader, PositionsOfWhichOnlySomeAreNormalizedAreRefused) {
  const auto accessor = [](const std::string& normalized) {
    return R"(,{"bufferView":3,"componentType":5122,"count":4,"type":"VEC3","normalized":)" + normalized +
           "}";
  };
  const auto read_both = [&](const std::string& first, const std::string& second) {
    return read(
        glb(replaced(small_json(accessor(first) + accessor(second)),
                     R"({"attributes":{"POSITION":0},"indices":1})",
                     R"({"attributes":{"POSITION":2},"mode":0},{"attributes":{"POSITION":3},"mode":0})"),
            small_binary()));
  };
  EXPECT_TRUE(read_both("true", "true"));
  EXPECT_TRUE(read_both("false", "false"));
  const auto mixed = read_both("true", "false");
  ASSERT_FALSE(mixed);
  EXPECT_EQ(mixed.error().code, ErrorCode::unsupported);
  EXPECT_THAT(mixed.error().message, HasSubstr("some positions are normalized integers, some are not"));
}

TEST(GltfReader, TransformsAreKeptAsMetadataAndMeshesComeOnce) {
  const std::string nodes =
      R"([{"children":[1,2,3],"scale":[2,2,2]},{"mesh":0},{"mesh":0,"translation":[1,2,3.5]},{"mesh":1}])";
  const auto result = read(glb(scene_json(nodes), small_binary()));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.blocks.size(), 3u);
  EXPECT_TRUE(has_note(result->notes, "used by several nodes"));
  EXPECT_EQ(result->mesh.points.values<float>()[3], 1.f);
  bool found = false;
  for (const auto& [key, value] : result->mesh.metadata) {
    found = found || (key == "gltf.nodes" && value.find("[1,2,3.5]") != std::string::npos);
  }
  EXPECT_TRUE(found);
}

TEST(GltfReader, OnlyTheDefaultSceneIsRead) {
  const auto result = read(glb(scene_json(R"([{"mesh":1},{"mesh":0}])"), small_binary()));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.blocks.size(), 1u);
  EXPECT_TRUE(has_note(result->notes, "1 mesh outside of the default scene left out"));
}

TEST(GltfReader, CyclesOfNodesEnd) {
  const auto result =
      read(glb(scene_json(R"([{"mesh":0,"children":[1]},{"mesh":1,"children":[0,1]}])"), small_binary()));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.blocks.size(), 3u);
}

TEST(GltfReader, RefusesCompressionByNameAndSaysWhatToDo) {
  for (const std::string name : {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "VENDOR_odd"}) {
    const auto result = read(glb(
        small_json("", "\"indices\":1", "", ",\"extensionsRequired\":[\"" + name + "\"]"), small_binary()));
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::unsupported);
    EXPECT_NE(result.error().message.find(name), std::string::npos) << result.error().message;
  }
  EXPECT_TRUE(
      read(glb(small_json("", "\"indices\":1", "", ",\"extensionsRequired\":[\"KHR_texture_basisu\"]"),
               small_binary())));
}

TEST(GltfReader, NamesWhatIsWrong) {
  const auto expect = [](const std::string& what, const std::string& by, const std::string& message) {
    const std::string error = error_of(glb(replaced(small_json(), what, by), small_binary()));
    EXPECT_EQ(error.find("test.glb: "), 0u) << error;
    EXPECT_NE(error.find(message), std::string::npos) << error;
  };
  expect("\"count\":4", "\"count\":5", "buffer view 0: 5 elements of 12 bytes do not fit its 48 bytes");
  expect("\"count\":4", "\"count\":3", "index 5 is vertex 3, but there are 3");
  expect("\"count\":4", "\"count\":18446744073709551615", "2^32 points");
  expect("\"count\":4", "\"count\":4000000000", "far beyond");
  expect("\"count\":6", "\"count\":5", "5 indices are no whole number of triangles");
  expect("\"count\":6", "\"count\":-6", "count");
  expect("\"byteLength\":48", "\"byteLength\":73", "goes beyond the 72 bytes");
  expect("\"byteOffset\":56", "\"byteOffset\":18446744073709551615", "goes beyond");
  expect("\"byteLength\":72}", "\"byteLength\":7200}", "buffer 0 should have 7200 bytes");
  expect("\"POSITION\":0", "\"POSITION\":9", "uses accessor 9, but there are 2");
  expect("\"POSITION\":0", "\"POSITION\":-1", "uses accessor -1");
  expect("\"mesh\":0", "\"mesh\":1", "node 0 uses mesh 1");
  expect("\"VEC3\"", "\"VEC2\"", "is not VEC3");
  expect("\"indices\":1", "\"indices\":0", "indices are not unsigned integers");
  expect("\"indices\":1", "\"indices\":1,\"mode\":7", "unknown mode 7");
  expect("\"indices\":1", "\"indices\":1,\"material\":0", "uses material 0, but there are 0");
  expect("\"version\":\"2.0\"", "\"version\":\"1.0\"", "only version 2");
  expect("\"buffers\":[", "\"buffers\":", "neither binary glTF nor well-formed JSON");
  expect("\"asset\"", "\"a\":" + std::string(300, '[') + std::string(300, ']') + ",\"asset\"", "nested");
}

TEST(GltfReader, EveryTruncationIsAnError) {
  const std::string file = glb(scene_json(R"([{"mesh":0,"children":[1]},{"mesh":1}])"), small_binary());
  ASSERT_TRUE(read(file));
  for (size_t size = 0; size < file.size(); ++size) EXPECT_FALSE(read(file.substr(0, size))) << size;
}

TEST(GltfReader, RandomDamageIsAnErrorOrAValidMesh) {
  const std::string accessors =
      R"(,{"bufferView":1,"componentType":5123,"count":4,"type":"SCALAR","sparse":{"count":1,
"indices":{"bufferView":2,"byteOffset":2,"componentType":5121},"values":{"bufferView":1,"byteOffset":6}}})";
  const std::string files[] = {
      glb(scene_json(R"([{"mesh":0,"children":[1]},{"mesh":1,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,0,0,1]}])"),
          small_binary()),
      glb(small_json(accessors, "\"mode\":5,\"indices\":1", ",\"_A\":2"), small_binary())};
  Random random(3);
  for (int trial = 0; trial < 6000; ++trial) {
    std::string file = files[trial % 2];
    for (uint32_t i = random.between(1, 3); i > 0; --i) {
      // Half of the damage goes to digits, which keeps the JSON well-formed.
      size_t at = random.below(file.size());
      if (random.chance(50)) {
        while (at < file.size() && (file[at] < '0' || file[at] > '9')) ++at;
        if (at == file.size()) continue;
        file[at] = static_cast<char>('0' + random.below(10));
      } else {
        file[at] = static_cast<char>(random.below(256));
      }
    }
    read(file);
  }
}

class GltfFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_ / "in" / "sub dir");
    put(folder_ / "in" / "sub dir" / "b.bin", small_binary());
    put(folder_ / "outside.bin", small_binary());
  }

  static void put(const std::filesystem::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
  }
  Result<ReadResult> read_with(const std::string& uri) {
    const auto path = folder_ / "in" / "a.gltf";
    put(path, replaced(small_json(), "\"byteLength\":72}", "\"byteLength\":72,\"uri\":\"" + uri + "\"}"));
    return read_file(gltf_format(), path.string());
  }

  testing::TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path();
};

TEST_F(GltfFolder, BuffersMayBeFilesBesideIt) {
  const auto result = read_with("sub%20dir/b.bin");
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->mesh.point_count(), 4u);
}

TEST_F(GltfFolder, BuffersOutsideOfTheFolderAreRefused) {
  for (const std::string uri : {"../outside.bin", "sub dir/../../outside.bin", "%2e%2e/outside.bin",
                                "/etc/passwd", "http://example.org/b.bin", "file:b.bin"}) {
    const auto result = read_with(uri);
    ASSERT_FALSE(result) << uri;
    EXPECT_EQ(result.error().code, ErrorCode::unsupported) << uri;
  }
}

TEST_F(GltfFolder, MissingFilesAreNamed) {
  const auto result = read_with("none.bin");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::cannot_read);
  EXPECT_NE(result.error().message.find("none.bin"), std::string::npos);
}

Mesh round_trip(const Mesh& mesh, const WriteOptions& options = {}) {
  const Written written = write_text(gltf_format(), mesh, options);
  auto back = read(written.text);
  EXPECT_TRUE(back) << back.error().message;
  return back ? std::move(back->mesh) : Mesh{};
}

/// A scene as the reader gives it, without its asset, which names the writer.
Mesh scene_mesh() {
  const std::string nodes =
      R"([{"children":[1,2,3],"scale":[2,2,2]},{"mesh":0},{"mesh":0,"translation":[1,2,3.5]},{"mesh":1}])";
  auto result = read(glb(replaced(scene_json(nodes), ",\"copyright\":\"me\"", ""), small_binary()));
  EXPECT_TRUE(result);
  result->mesh.metadata.erase(result->mesh.metadata.begin());
  return std::move(result->mesh);
}

TEST(GltfWriter, IsTheInverseOfTheReader) {
  const Mesh mesh = scene_mesh();
  for (const bool text : {false, true})
    expect_same_mesh(round_trip(mesh, {text ? "gltf" : "glb", false, false}), mesh);
}

TEST(GltfWriter, KeepsTheAssetAsItWas) {
  for (const std::string asset :
       {R"({"copyright":"me","generator":"Blender","minVersion":"2.0","version":"2.0"})",
        R"({"extras":{"title":"t"},"version":"2.0"})"}) {
    const auto first = read(glb(replaced(small_json(), R"({"version":"2.0"})", asset), small_binary()));
    ASSERT_TRUE(first) << first.error().message;
    EXPECT_EQ(first->mesh.metadata.at(0).second, asset);
    expect_same_mesh(round_trip(first->mesh), first->mesh);
  }
}

TEST(GltfWriter, MetadataNestedWithoutEndAreAsIfNotThere) {
  const std::string deep =
      R"({"version":"2.0","extras":)" + std::string(1'000'000, '[') + std::string(1'000'000, ']') + "}";
  Mesh mesh = scene_mesh(), plain = mesh;
  mesh.metadata.emplace_back("gltf.asset", deep);
  EXPECT_EQ(write_text(gltf_format(), mesh).text, write_text(gltf_format(), plain).text);
}

TEST(GltfWriter, KeepsIntegerTypesRangesAndOwnMetadata) {
  Mesh mesh;
  mesh.points = array_of<int16_t>("position", Domain::point, Scalar::i16, 3,
                                  {-32768, 0, 0, 1, 0, 0, 1, 32767, 0, 0, 1, 5});
  mesh.blocks.push_back({"points", CellType::vertex, {}, {}, {3}});
  mesh.blocks.push_back({"path", CellType::poly_line, {}, {0, 3}, {0, 1, 2}});
  mesh.arrays.push_back(array_of<uint8_t>("colour", Domain::point, Scalar::u8, 3,
                                          {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, Role::colour));
  mesh.arrays.push_back(
      array_of<uint16_t>("joints", Domain::point, Scalar::u16, 4, std::vector<uint16_t>(16, 3)));
  mesh.arrays.push_back(array_of<float>("texcoord", Domain::point, Scalar::f32, 2, {0, 1, 2, 3, 4, 5, 6, 7},
                                        Role::texture_coordinate));
  mesh.arrays.push_back(array_of<uint16_t>("texcoord_1", Domain::point, Scalar::u16, 2,
                                           {0, 1, 2, 3, 4, 5, 6, 7}, Role::texture_coordinate));
  mesh.arrays.push_back(array_of<int8_t>("odd", Domain::point, Scalar::i8, 1, {-1, -2, -3, -4}));
  mesh.metadata = {{"unit", "mm"}, {"gltf.normalized", R"(["colour"])"}};
  expect_same_mesh(round_trip(mesh), mesh);
}

TEST(GltfWriter, NumbersBeyondGltfAreSaid) {
  Mesh mesh;
  mesh.points = array_of<double>("position", Domain::point, Scalar::f64, 3, {0, 0, 0, 1, 0, 0, 0.1, 1, 0});
  mesh.blocks.push_back({"", CellType::triangle, {}, {}, {0, 1, 2}});
  mesh.arrays.push_back(array_of<uint32_t>("id", Domain::point, Scalar::u32, 1, {1, 2, 16777216}));
  mesh.arrays.push_back(array_of<uint8_t>("five", Domain::point, Scalar::u8, 5, std::vector<uint8_t>(15)));
  mesh.arrays.push_back(array_of<float>("p", Domain::cell, Scalar::f32, 1, {1}));
  mesh.arrays.push_back(array_of<float>("m", Domain::mesh, Scalar::f32, 1, {1}));
  const Written written = write_text(gltf_format(), mesh);
  EXPECT_TRUE(has_note(
      written.notes, "\"position\" is written as f32, glTF has no f64: 1 value rounded, by up to 1.49e-09"));
  EXPECT_TRUE(has_note(written.notes, "\"id\" is written as f32, glTF has no u32: all values are exact"));
  EXPECT_TRUE(has_note(written.notes, "\"five\" left out"));
  EXPECT_TRUE(has_note(written.notes, "\"p\" left out: glTF has no arrays on cells"));
  EXPECT_TRUE(has_note(written.notes, "\"m\" left out: glTF has no arrays on meshes"));
  EXPECT_EQ(read(written.text)->mesh.points.values<float>()[6], 0.1f);
}

TEST(GltfWriter, NormalsOfOtherFormatsGetUnitLength) {
  Mesh mesh;
  mesh.points.resize(3);
  mesh.points.values<float>()[3] = mesh.points.values<float>()[7] = 1;
  mesh.blocks.resize(1);
  mesh.blocks[0] = {
      .name = "", .type = CellType::triangle, .types = {}, .offsets = {}, .connectivity = {0, 1, 2}};
  mesh.arrays.push_back(make_array("normal", Domain::point, Scalar::f32, 3, Role::normal));
  mesh.arrays[0].resize(3);
  mesh.arrays[0].values<float>()[0] = 8;     // too long
  mesh.arrays[0].values<float>()[4] = 1.0f;  // good; the third has no direction
  const Written written = write_text(gltf_format(), mesh);
  EXPECT_THAT(written.notes, Contains(HasSubstr("1 normal made as long as glTF wants")));
  const Mesh back = read_text(gltf_format(), written.text)->mesh;
  EXPECT_THAT(values_of<float>(back, "normal", Domain::point), ElementsAre(1, 0, 0, 0, 1, 0, 0, 0, 0));
}

TEST(GltfWriter, PolygonsBecomeFansAndMaterialsPrimitives) {
  Mesh mesh;
  mesh.points = array_of<float>("position", Domain::point, Scalar::f32, 3, std::vector<float>(15, 1));
  mesh.blocks.push_back({"house", CellType::polygon, {}, {0, 4, 9, 11}, {0, 1, 2, 3, 4, 3, 2, 1, 0, 0, 1}});
  Array material = array_of<uint8_t>("material", Domain::cell, Scalar::u8, 1, {1, 0, 1}, Role::label);
  material.labels = {"roof", "wall"};
  mesh.arrays.push_back(material);
  const Written written = write_text(gltf_format(), mesh);
  EXPECT_TRUE(has_note(written.notes, "2 polygons cut into fans"));
  EXPECT_TRUE(has_note(written.notes, "1 face of fewer than 3 corners left out"));
  const auto back = read(written.text);
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_EQ(back->mesh.blocks.size(), 2u);
  EXPECT_EQ(back->mesh.blocks[0].name, "house/0");
  EXPECT_EQ(back->mesh.blocks[0].connectivity, (std::vector<uint32_t>{4, 3, 2, 4, 2, 1, 4, 1, 0}));
  EXPECT_EQ(back->mesh.blocks[1].connectivity, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3}));
  EXPECT_EQ(back->mesh.find("material", Domain::cell)->labels, material.labels);
}

TEST(GltfWriter, PointsAreSplitOnlyWhereCornersDiffer) {
  Mesh mesh;
  mesh.points = array_of<float>("position", Domain::point, Scalar::f32, 3,
                                {0, 0, 0, 9, 9, 9, 1, 0, 0, 1, 1, 0, 0, 1, 0});
  mesh.blocks.push_back({"", CellType::triangle, {}, {}, {0, 2, 3, 0, 3, 4}});
  mesh.arrays.push_back(array_of<float>("texcoord", Domain::corner, Scalar::f32, 2,
                                        {0, 0, 1, 0, 1, 1, 5, 5, 1, 1, 0, 1}, Role::texture_coordinate));
  mesh.arrays.push_back(array_of<uint8_t>("c", Domain::point, Scalar::u8, 1, {10, 11, 12, 13, 14}));
  const Written written = write_text(gltf_format(), mesh);
  EXPECT_TRUE(has_note(written.notes, "1 point added"));
  const auto back = read(written.text);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->mesh.point_count(), 6u);
  EXPECT_EQ(back->mesh.blocks[0].connectivity, (std::vector<uint32_t>{0, 3, 4, 1, 4, 5}));
  const auto uv = back->mesh.find("texcoord", Domain::point)->values<float>();
  EXPECT_EQ(std::vector<float>(uv.begin(), uv.end()),
            (std::vector<float>{0, 0, 5, 5, 0, 0, 1, 0, 1, 1, 0, 1}));
  const auto c = back->mesh.find("c", Domain::point)->values<uint8_t>();
  EXPECT_EQ(std::vector<uint8_t>(c.begin(), c.end()), (std::vector<uint8_t>{10, 10, 11, 12, 13, 14}));
}

TEST(GltfWriter, StatesBoundsOfPositions) {
  Mesh mesh;
  mesh.points =
      array_of<float>("position", Domain::point, Scalar::f32, 3, {-1, NAN, 2, 0.5f, 1, 3, 0, 4, INFINITY});
  mesh.blocks.push_back({"", CellType::triangle, {}, {}, {0, 1, 2}});
  const std::string text = write_text(gltf_format(), mesh).text;
  EXPECT_NE(text.find(R"("min":[-1.0,1.0,2.0],"max":[0.5,4.0,3.0])"), std::string::npos);
}

TEST(GltfWriter, RandomMeshesGiveTheSameTriangles) {
  RandomMeshOptions options;
  options.other_cells = true;
  for (uint64_t seed = 0; seed < 200; ++seed) {
    const Mesh mesh = random_surface(seed, options);
    std::vector<std::byte> bytes;
    const auto notes = gltf_format().write(mesh, *memory_sink(bytes), {});
    if (!notes) {
      EXPECT_EQ(notes.error().code, ErrorCode::usage);
      continue;
    }
    const auto back = read(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    ASSERT_TRUE(back) << seed << ": " << back.error().message;
    uint64_t triangles = 0, read_triangles = 0;
    for (const CellBlock& block : mesh.blocks) {
      for (uint64_t i = 0; i < block.size(); ++i) {
        const CellType type =
            block.type == CellType::mixed ? static_cast<CellType>(block.types[i]) : block.type;
        const bool area = is_face(type) || type == CellType::pixel || type == CellType::triangle_strip;
        if (area && block.cell(i).size() > 2) triangles += block.cell(i).size() - 2;
      }
    }
    for (const CellBlock& block : back->mesh.blocks)
      read_triangles += block.type == CellType::triangle ? block.size() : 0;
    EXPECT_EQ(read_triangles, triangles) << seed;
  }
}

TEST(GltfReader, ReadsRealFilesAndTheirCopies) {
  if (data_folder().empty()) GTEST_SKIP() << "real meshes are not on this machine";
  const struct {
    const char* name;
    uint64_t points, triangles;
    std::vector<std::string> arrays;
  } files[] = {{"scallop.glb", 60002, 120000, {"colour", "normal"}},
               {"SheenCloth.glb", 58081, 115200, {"normal", "tangent", "texcoord"}},
               {"usd-shaderball-ball.glb", 36112, 63856, {"colour", "colour_1", "normal", "texcoord"}},
               // Where meshes come from Debian's packages (scripts/data).
               {"2CylinderEngine.glb", 55843, 75730, {"normal"}},
               {"BoxTextured.glb", 24, 12, {"normal", "texcoord"}}};
  if (data_files("textured").empty()) GTEST_SKIP() << "there are no textured meshes in " << data_folder();
  for (const auto& file : files) {
    // The sanitizer build is given the small files only.
    if (!std::ifstream(data_folder() + "/textured/" + file.name)) continue;
    const auto result = read_file(gltf_format(), data_folder() + "/textured/" + file.name);
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_EQ(result->mesh.point_count(), file.points);
    EXPECT_EQ(result->mesh.cell_count(), file.triangles);
    std::vector<std::string> names;
    for (const Array& array : result->mesh.arrays) {
      if (array.domain == Domain::point) names.push_back(array.name);
    }
    std::sort(names.begin(), names.end());
    EXPECT_EQ(names, file.arrays);
    Mesh mesh = result->mesh;
    std::erase_if(mesh.metadata, [](const auto& pair) { return pair.first == "gltf.asset"; });
    Mesh back = round_trip(mesh);
    std::erase_if(back.metadata, [](const auto& pair) { return pair.first == "gltf.asset"; });
    // Cameras are left out of a copy, and so is what refers to them.
    for (auto& [name, text] : mesh.metadata) {
      constexpr std::string_view camera = R"("camera":0,)";
      if (const size_t at = text.find(camera); at != std::string::npos) text.erase(at, camera.size());
    }
    expect_same_mesh(back, mesh);
  }
}

TEST(GltfReader, NamesWhatOnlyGltfHas) {
  const std::string zeros(48, 'A');  // 36 bytes in base64
  const auto result = read_text(
      gltf_format(),
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"name":"stage","nodes":[0]}],"extensionsUsed":["ACME_x"],
        "nodes":[{"name":"holder","mesh":0}],"meshes":[{"name":"leaf","primitives":[
        {"attributes":{"POSITION":0},"extensions":{"ACME_x":{"a":1}}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,)" +
          zeros + R"("}]})");
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_TRUE(
      has_note(result->notes,
               "the names of 1 node, the name of the scene, 1 extension of primitives, such as ACME_x"));
}

}  // namespace
}  // namespace maille
