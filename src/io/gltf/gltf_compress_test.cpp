#include <gtest/gtest.h>
#include <maille/compare.h>
#include <maille/gltf.h>
#include <maille/io.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "base/bytes.h"
#include "support/cases.h"

namespace maille {
namespace {

using namespace maille::testing;
using Asset = nlohmann::ordered_json;

/// A glTF file being put together: one buffer view for each accessor.
struct AssetMaker {
  Asset json = {{"asset", {{"version", "2.0"}}},
                {"scene", 0},
                {"scenes", {{{"nodes", {0}}}}},
                {"nodes", {{{"mesh", 0}}}},
                {"meshes", {{{"primitives", Asset::array()}}}},
                {"accessors", Asset::array()},
                {"bufferViews", Asset::array()}};
  std::string binary;

  size_t view(const std::string& bytes) {
    binary.resize((binary.size() + 3) / 4 * 4);
    json["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}});
    binary += bytes;
    return json["bufferViews"].size() - 1;
  }
  template <class T>
  size_t accessor(const std::vector<T>& values, const char* type, unsigned components, int component_type) {
    const std::string bytes(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    Asset accessor = {{"bufferView", view(bytes)},
                      {"componentType", component_type},
                      {"count", values.size() / components},
                      {"type", type}};
    json["accessors"].push_back(accessor);
    return json["accessors"].size() - 1;
  }
  size_t vectors(const std::vector<float>& values) { return accessor(values, "VEC3", 3, 5126); }
  size_t indices(const std::vector<uint16_t>& values) { return accessor(values, "SCALAR", 1, 5123); }
  Asset& primitive(Asset attributes, int indices) {
    json["meshes"][0]["primitives"].push_back({{"attributes", std::move(attributes)}});
    Asset& added = json["meshes"][0]["primitives"].back();
    if (indices >= 0) added["indices"] = indices;
    return added;
  }
  std::string text() {
    json["buffers"] = {{{"byteLength", binary.size()}}};
    std::string document = json.dump();
    while (document.size() % 4 != 0) document += ' ';
    while (binary.size() % 4 != 0) binary += '\0';
    const auto word = [](size_t value) {
      const auto number = static_cast<uint32_t>(value);
      return std::string(reinterpret_cast<const char*>(&number), 4);
    };
    const std::string body =
        word(document.size()) + "JSON" + document + word(binary.size()) + std::string("BIN\0", 4) + binary;
    return "glTF" + word(2) + word(12 + body.size()) + body;
  }
};

/// A waving sheet of n x n points, `x` from the origin, and what covers it.
std::vector<float> sheet(unsigned n, float x = 0) {
  std::vector<float> positions;
  for (unsigned i = 0; i < n * n; ++i) {
    const float u = static_cast<float>(i % n), v = static_cast<float>(i / n);
    positions.insert(positions.end(), {x + u, v, std::sin(u * 0.3f) + std::cos(v * 0.2f)});
  }
  return positions;
}
std::vector<uint16_t> cover(unsigned n, unsigned first_row = 0) {
  std::vector<uint16_t> corners;
  for (unsigned v = first_row; v + 1 < n; ++v) {
    for (unsigned u = 0; u + 1 < n; ++u) {
      const unsigned at = v * n + u;
      for (const unsigned corner : {at, at + 1, at + n, at + 1, at + n + 1, at + n})
        corners.push_back(static_cast<uint16_t>(corner));
    }
  }
  return corners;
}

std::unique_ptr<Source> source_of(const std::string& text) {
  std::vector<std::byte> bytes(text.size());
  std::copy_n(reinterpret_cast<const std::byte*>(text.data()), text.size(), bytes.begin());
  return memory_source(std::move(bytes), "test.glb");
}

struct Made {
  GltfReport report;
  std::string text;
  Asset json() const { return Asset::parse(std::string_view(text).substr(20, load<uint32_t>(bytes() + 12))); }
  const std::byte* bytes() const { return reinterpret_cast<const std::byte*>(text.data()); }
};

Made compressed(const std::string& text, const GltfCompressOptions& options = {}) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  const auto report = compress_gltf(*source_of(text), *sink, options);
  EXPECT_TRUE(report) << report.error().message;
  return {report.value_or(GltfReport{}), std::string(reinterpret_cast<char*>(bytes.data()), bytes.size())};
}

Made decompressed(const std::string& text) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  const auto report = decompress_gltf(*source_of(text), *sink);
  EXPECT_TRUE(report) << report.error().message;
  return {report.value_or(GltfReport{}), std::string(reinterpret_cast<char*>(bytes.data()), bytes.size())};
}

Mesh mesh_in(const std::string& text) {
  auto result = read_mesh(*source_of(text), {});
  EXPECT_TRUE(result) << result.error().message;
  return result ? std::move(result->mesh) : Mesh{};
}

void expect_same_geometry(const std::string& a, const std::string& b) {
  const Comparison comparison = compare(mesh_in(a), mesh_in(b), {});
  EXPECT_TRUE(comparison.equal) << (comparison.differences.empty() ? "" : comparison.differences[0]);
}

/// Without what compressing may change.
Asset without_places(Asset json) {
  for (const char* key : {"buffers", "bufferViews"}) json.erase(key);
  for (Asset& accessor : json["accessors"]) {
    for (const char* key : {"bufferView", "byteOffset", "min", "max"}) accessor.erase(key);
  }
  return json;
}

AssetMaker plain_sheet() {
  AssetMaker asset;
  const size_t positions = asset.vectors(sheet(20));
  asset.primitive({{"POSITION", positions}}, static_cast<int>(asset.indices(cover(20))));
  return asset;
}

TEST(GltfCompression, KeepsTheGeometryAndEverythingElse) {
  AssetMaker asset = plain_sheet();
  const size_t image = asset.view("an image");
  asset.json["images"] = {{{"mimeType", "image/png"}, {"bufferView", image}}};
  asset.json["extras"] = {{"big", 12345678901234567890u}, {"none", nullptr}, {"empty", Asset::object()}};
  asset.json["extensionsUsed"] = {"ACME_own"};
  asset.json["extensions"] = {{"ACME_own", {{"list", {1, nullptr, 2.5}}}}};
  const std::string original = asset.text();
  const Made packed = compressed(original);
  EXPECT_EQ(packed.report.compressed, 1u);
  EXPECT_LT(packed.text.size(), original.size());
  EXPECT_EQ(packed.json()["extensionsRequired"], Asset::array({"MAILLE_mesh_compression"}));
  EXPECT_FALSE(packed.json()["accessors"][0].contains("bufferView"));
  expect_same_geometry(original, packed.text);
  const Made back = decompressed(packed.text);
  expect_same_geometry(original, back.text);
  EXPECT_EQ(without_places(back.json()), without_places(asset.json));
  EXPECT_EQ(back.json()["images"][0]["bufferView"], image);
  const Asset view = back.json()["bufferViews"][image];
  const size_t binary = 20 + load<uint32_t>(back.bytes() + 12) + 8;
  EXPECT_EQ(back.text.substr(binary + view["byteOffset"].get<size_t>(), 8), "an image");
}

TEST(GltfCompression, PrimitivesThatShareVerticesAreBlocksOfOneFile) {
  AssetMaker asset;
  const size_t positions = asset.vectors(sheet(20));
  const std::vector<uint16_t> all = cover(20);
  const std::vector<uint16_t> front(all.begin(), all.begin() + 600), rest(all.begin() + 600, all.end());
  asset.primitive({{"POSITION", positions}}, static_cast<int>(asset.indices(front)));
  asset.primitive({{"POSITION", positions}}, static_cast<int>(asset.indices(rest)));
  const Made packed = compressed(asset.text());
  EXPECT_EQ(packed.report.files, 1u);
  EXPECT_EQ(packed.report.points, 400u);
  const Asset primitives = packed.json()["meshes"][0]["primitives"];
  EXPECT_EQ(primitives[0]["attributes"], primitives[1]["attributes"]);
  EXPECT_EQ(primitives[1]["extensions"]["MAILLE_mesh_compression"]["block"], 1);
  expect_same_geometry(asset.text(), packed.text);
}

TEST(GltfCompression, SmallMeshesOfOneKindShareAFile) {
  AssetMaker asset;
  for (const float x : {0.f, 50.f, 100.f})
    asset.primitive({{"POSITION", asset.vectors(sheet(8, x))}}, static_cast<int>(asset.indices(cover(8))));
  const Made packed = compressed(asset.text());
  EXPECT_EQ(packed.report.files, 1u);
  EXPECT_EQ(packed.report.compressed, 3u);
  const Asset json = packed.json();
  for (const Asset& accessor : json["accessors"])
    EXPECT_EQ(accessor["count"], accessor["type"] == "SCALAR" ? 294 : 64);
  expect_same_geometry(asset.text(), packed.text);
}

TEST(GltfCompression, AnAccessorThatOthersUseIsCopied) {
  AssetMaker asset;
  const size_t positions = asset.vectors(sheet(20));
  const auto indices = static_cast<int>(asset.indices(cover(20)));
  asset.primitive({{"POSITION", positions}}, indices);
  asset.primitive({{"POSITION", positions}, {"NORMAL", asset.vectors(sheet(20, 1))}}, indices);
  asset.primitive({{"POSITION", positions}}, indices)["mode"] = 0;
  const Made packed = compressed(asset.text());
  EXPECT_EQ(packed.report.compressed, 2u);
  EXPECT_TRUE(packed.json()["accessors"][positions].contains("bufferView"));
  EXPECT_NE(packed.json()["meshes"][0]["primitives"][0]["attributes"]["POSITION"],
            packed.json()["meshes"][0]["primitives"][1]["attributes"]["POSITION"]);
  const Mesh original = mesh_in(asset.text()), back = mesh_in(packed.text);
  EXPECT_EQ(original.cell_count(), back.cell_count());
  EXPECT_EQ(back.point_count(), 1200u);  // no longer shared
  ASSERT_EQ(packed.report.notes.size(), 1u);
  EXPECT_EQ(packed.report.notes[0], "1 primitive left uncompressed: points, lines, strips or fans");
}

TEST(GltfCompression, MorphTargetsAndIntegersComeBackExactly) {
  AssetMaker asset;
  std::vector<uint8_t> joints(20 * 20 * 4);
  for (size_t i = 0; i < joints.size(); ++i) joints[i] = static_cast<uint8_t>(i / 50);
  std::vector<float> moved(20 * 20 * 3);
  for (size_t i = 0; i < moved.size(); ++i) moved[i] = static_cast<float>(i % 7) * 0.01f;
  Asset& primitive = asset.primitive(
      {{"POSITION", asset.vectors(sheet(20))}, {"JOINTS_0", asset.accessor(joints, "VEC4", 4, 5121)}},
      static_cast<int>(asset.indices(cover(20))));
  primitive["targets"] = {{{"POSITION", asset.vectors(moved)}}};
  const std::string original = asset.text();
  GltfCompressOptions options;
  options.encoding.order = Order::keep;
  const Made back = decompressed(compressed(original, options).text);
  const Asset json = back.json();
  const size_t binary = 20 + load<uint32_t>(back.bytes() + 12) + 8;
  const auto values = [&](size_t accessor) {
    const Asset view = json["bufferViews"][json["accessors"][accessor]["bufferView"].get<size_t>()];
    return back.text.substr(binary + view.value("byteOffset", size_t{0}), view["byteLength"].get<size_t>());
  };
  EXPECT_EQ(values(json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"]),
            std::string(reinterpret_cast<char*>(moved.data()), moved.size() * 4));
  EXPECT_EQ(values(json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"]),
            std::string(reinterpret_cast<char*>(joints.data()), joints.size()));
}

TEST(GltfCompression, VerticesThatNoTriangleUsesStay) {
  AssetMaker asset;
  asset.primitive({{"POSITION", asset.vectors(sheet(20))}}, static_cast<int>(asset.indices(cover(20, 5))));
  asset.primitive({{"POSITION", asset.vectors(sheet(20, 9))}}, static_cast<int>(asset.indices(cover(20))));
  const Made packed = compressed(asset.text());
  EXPECT_EQ(packed.report.points, 800u);
  EXPECT_EQ(packed.report.files, 2u);
  expect_same_geometry(asset.text(), packed.text);
}

TEST(GltfCompression, PrimitivesOfAMeshShareOneLattice) {
  AssetMaker asset;
  // Beside each other: the last column of one is the first of the other.
  asset.primitive({{"POSITION", asset.vectors(sheet(20))}}, static_cast<int>(asset.indices(cover(20))));
  asset.primitive({{"POSITION", asset.vectors(sheet(20, 19))}, {"NORMAL", asset.vectors(sheet(20, 1))}},
                  static_cast<int>(asset.indices(cover(20))));
  GltfCompressOptions options;
  options.encoding.positions = {Tolerance::Kind::bits, 10};
  const Mesh mesh = mesh_in(compressed(asset.text(), options).text);
  const auto positions = mesh.points.values<float>();
  std::vector<float> at_border[2];
  for (size_t i = 0; i < mesh.point_count(); ++i) {
    if (std::fabs(positions[3 * i] - 19) < 0.1f) at_border[i / 400].push_back(positions[3 * i]);
  }
  ASSERT_EQ(at_border[0].size(), 20u);
  EXPECT_EQ(at_border[0], at_border[1]);
}

/// A mesh of one primitive, `size` times as large as a sheet.
void add_scaled_sheet(AssetMaker& asset, unsigned n, float size) {
  std::vector<float> positions = sheet(n), uv;
  const auto noise = [](size_t i) { return std::sin(static_cast<float>(i * i)) / 2; };
  for (size_t i = 0; i < positions.size(); ++i) positions[i] = size * (positions[i] + noise(i));
  for (unsigned i = 0; i < 2 * n * n; ++i) uv.push_back(size * (noise(i) + 0.5f));
  const size_t points = asset.vectors(positions), textures = asset.accessor(uv, "VEC2", 2, 5126);
  asset.primitive({{"POSITION", points}, {"TEXCOORD_0", textures}},
                  static_cast<int>(asset.indices(cover(n))));
  Asset& meshes = asset.json["meshes"];
  if (meshes[0]["primitives"].size() == 1) return;
  meshes.push_back({{"primitives", Asset::array({meshes[0]["primitives"][1]})}});
  meshes[0]["primitives"].erase(1);
  asset.json["scenes"][0]["nodes"].push_back(meshes.size() - 1);
  asset.json["nodes"].push_back({{"mesh", meshes.size() - 1}});
}

double largest_error(const Mesh& a, const Mesh& b, size_t first, size_t count, bool of_texture) {
  const Array& before = of_texture ? a.arrays[0] : a.points;
  const Array& after = of_texture ? b.arrays[0] : b.points;
  const auto x = before.values<float>(), y = after.values<float>();
  double error = 0;
  for (size_t i = first * before.components; i < (first + count) * before.components; ++i)
    error = std::max(error, std::fabs(static_cast<double>(x[i]) - static_cast<double>(y[i])));
  return error;
}

TEST(GltfCompression, SmallMeshesOfManySizesShareAFileWithinTheBoundsOfEach) {
  AssetMaker asset;
  std::vector<float> sizes;
  for (int i = 0; i < 20; ++i) sizes.push_back(std::ldexp(1.f, (7 * i) % 20 - 10));
  for (const float size : sizes) add_scaled_sheet(asset, 4, size);
  GltfCompressOptions options;
  options.encoding.order = Order::keep;
  const Made lossless = compressed(asset.text(), options);
  options.encoding.positions = {Tolerance::Kind::bits, 10};
  options.encoding.arrays["texcoord"] = {Tolerance::Kind::bits, 10};
  const Made packed = compressed(asset.text(), options);
  EXPECT_LE(packed.report.files, 4u);
  EXPECT_LT(packed.text.size(), lossless.text.size());
  const Mesh before = mesh_in(asset.text()), after = mesh_in(packed.text);
  ASSERT_EQ(before.point_count(), 16 * sizes.size());
  ASSERT_EQ(after.point_count(), 16 * sizes.size());
  for (size_t m = 0; m < sizes.size(); ++m) {
    const double size = static_cast<double>(sizes[m]);
    EXPECT_LE(largest_error(before, after, 16 * m, 16, false), 4 * size / 1023 / 2 * 1.001) << m;
    EXPECT_LE(largest_error(before, after, 16 * m, 16, true), 1 * size / 1023 / 2 * 1.001) << m;
  }
}

TEST(GltfCompression, ALargeMeshHasNoFinerLatticeForASmallOnesSake) {
  AssetMaker asset;
  for (const float size : {1.f, 1.5f}) add_scaled_sheet(asset, size == 1 ? 4u : 60u, size);
  GltfCompressOptions options;
  options.encoding.positions = {Tolerance::Kind::bits, 10};
  EXPECT_EQ(compressed(asset.text(), options).report.files, 2u);
}

TEST(GltfCompression, RoundedWeightsAddUpToOne) {
  AssetMaker asset = plain_sheet();
  std::vector<float> weights;
  for (int i = 0; i < 400; ++i) {
    const float a = static_cast<float>(i) / 1000, b = 0.3f;
    weights.insert(weights.end(), {a, b, 1 - a - b, 0});
  }
  asset.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] =
      asset.accessor(weights, "VEC4", 4, 5126);
  GltfCompressOptions options;
  options.encoding.arrays["weights"] = {Tolerance::Kind::bits, 8};
  options.encoding.order = Order::keep;
  const Mesh mesh = mesh_in(compressed(asset.text(), options).text);
  const Array* decoded = mesh.find("weights", Domain::point);
  ASSERT_TRUE(decoded);
  for (size_t i = 0; i < 400; ++i) {
    const auto four = decoded->values<float>().subspan(4 * i, 4);
    EXPECT_EQ(four[0] + four[1] + four[2] + four[3], 1.f);
    for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(four[k], weights[4 * i + k], 1.0 / 256);
  }
}

TEST(GltfCompression, BoundsAreThoseOfWhatIsDecoded) {
  AssetMaker asset = plain_sheet();
  asset.json["accessors"][0]["min"] = {-1, -1, -1};
  GltfCompressOptions options;
  options.encoding.positions = {Tolerance::Kind::absolute, 0.3};
  const Made packed = compressed(asset.text(), options);
  const Mesh mesh = mesh_in(packed.text);
  double least = INFINITY;
  for (size_t i = 2; i < 1200; i += 3)
    least = std::min(least, static_cast<double>(mesh.points.values<float>()[i]));
  EXPECT_EQ(packed.json()["accessors"][0]["min"][2].get<double>(), least);
}

TEST(GltfCompression, BlendedTrianglesKeepTheirOrder) {
  AssetMaker asset = plain_sheet();
  asset.json["materials"] = {{{"alphaMode", "BLEND"}}};
  asset.json["meshes"][0]["primitives"][0]["material"] = 0;
  const Mesh original = mesh_in(asset.text()), back = mesh_in(compressed(asset.text()).text);
  EXPECT_TRUE(compare(original, back, {.same_order = true}).equal);
}

TEST(GltfCompression, WhatItWouldNotMakeSmallerStays) {
  AssetMaker asset;
  asset.primitive({{"POSITION", asset.vectors({0, 0, 0, 1, 0, 0, 0, 1, 0})}}, -1);
  const Made packed = compressed(asset.text());
  EXPECT_EQ(packed.report.compressed, 0u);
  EXPECT_FALSE(packed.json().contains("extensionsRequired"));
  EXPECT_EQ(packed.json()["meshes"], asset.json["meshes"]);
}

TEST(GltfCompression, ExtensionsThatMayNumberVerticesKeepAPrimitiveAsItIs) {
  AssetMaker asset = plain_sheet();
  asset.json["meshes"][0]["primitives"][0]["extensions"] = {{"CESIUM_primitive_outline", {{"indices", 1}}}};
  const Made packed = compressed(asset.text());
  EXPECT_EQ(packed.report.compressed, 0u);
  ASSERT_EQ(packed.report.notes.size(), 1u);
  EXPECT_NE(packed.report.notes[0].find("CESIUM_primitive_outline"), std::string::npos);
}

TEST(GltfCompression, IsNotAppliedTwice) {
  const Made packed = compressed(plain_sheet().text());
  std::vector<std::byte> bytes;
  const auto again = compress_gltf(*source_of(packed.text), *memory_sink(bytes));
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::unsupported);
  const auto plain = decompress_gltf(*source_of(plain_sheet().text()), *memory_sink(bytes));
  ASSERT_FALSE(plain);
  EXPECT_EQ(plain.error().code, ErrorCode::usage);
}

TEST(GltfCompression, TextHoldsTheBufferItself) {
  GltfCompressOptions options;
  options.text = true;
  const Made packed = compressed(plain_sheet().text(), options);
  EXPECT_TRUE(packed.text.starts_with("{"));
  expect_same_geometry(plain_sheet().text(), packed.text);
}

std::string error_of(const std::string& text) {
  std::vector<std::byte> bytes;
  const auto result = decompress_gltf(*source_of(text), *memory_sink(bytes));
  return result ? "" : result.error().message;
}

TEST(GltfDecompression, NamesWhatDoesNotFit) {
  AssetMaker asset = plain_sheet();
  const Made packed = compressed(asset.text());
  const size_t json_size = load<uint32_t>(packed.bytes() + 12);
  const std::string binary = packed.text.substr(20 + json_size + 8);
  const auto error_with = [&](const std::function<void(Asset&)>& change) {
    AssetMaker changed;
    changed.json = packed.json();
    change(changed.json);
    changed.binary = binary;
    return error_of(changed.text());
  };
  const auto link = [](Asset& json) -> Asset& {
    return json["meshes"][0]["primitives"][0]["extensions"]["MAILLE_mesh_compression"];
  };
  const std::pair<std::function<void(Asset&)>, const char*> cases[] = {
      {[&](Asset& json) { link(json)["bufferView"] = 99; }, "does not exist"},
      {[&](Asset& json) { link(json)["bufferView"] = 1.5; }, "names no buffer view"},
      {[&](Asset& json) { link(json)["block"] = 1; }, "no block 1"},
      {[&](Asset& json) { link(json)["block"] = -1; }, "no whole number"},
      {[&](Asset& json) { link(json).erase("attributes"); }, "has no attributes"},
      {[&](Asset& json) { link(json)["attributes"]["POSITION"] = "elsewhere"; }, "no array 'elsewhere'"},
      {[&](Asset& json) { link(json)["attributes"]["NORMAL"] = "position"; }, "not in the primitive"},
      {[&](Asset& json) {
         link(json)["targets"] = {{{"POSITION", "position"}}};
       },
       "not in the primitive"},
      {[&](Asset& json) { json["accessors"][0]["count"] = 401; }, "that were decoded"},
      {[&](Asset& json) { json["accessors"][0]["type"] = "VEC2"; }, "another type"},
      {[&](Asset& json) { json["accessors"][0]["componentType"] = 5123; }, "another type"},
      {[&](Asset& json) { json["accessors"][0]["bufferView"] = 0; }, "has values besides"},
      {[&](Asset& json) { json["accessors"][1]["componentType"] = 5121; }, "too many vertices"},
      {[&](Asset& json) { json["accessors"][1]["componentType"] = 5126; }, "not of unsigned integers"},
      {[&](Asset& json) { json["meshes"][0]["primitives"][0]["indices"] = 0; }, "given twice"},
      {[&](Asset& json) { json["meshes"][0]["primitives"][0].erase("indices"); },
       "no accessor for its indices"},
      {[&](Asset& json) { json["bufferViews"][0]["byteLength"] = 40; }, "buffer view 0"},
      {[&](Asset& json) { json["bufferViews"][0]["byteLength"] = 1 << 30; }, "beyond"},
  };
  for (const auto& [change, words] : cases)
    EXPECT_NE(error_with(change).find(words), std::string::npos) << words << ": " << error_with(change);
  EXPECT_EQ(error_with([](Asset&) {}), "");
}

TEST(GltfDecompression, SurvivesDamage) {
  AssetMaker asset = plain_sheet();
  const std::string good = compressed(asset.text()).text;
  for (size_t i = 0; i < good.size(); i += every(3)) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0x15);
    error_of(bad);
    error_of(good.substr(0, i));
  }
}

TEST(GltfDecompression, ManyPrimitivesOverOneFileStayWithinTheLimit) {
  const Made packed = compressed(plain_sheet().text());
  AssetMaker asset;
  asset.json = packed.json();
  asset.binary = packed.text.substr(20 + load<uint32_t>(packed.bytes() + 12) + 8);
  Asset& primitives = asset.json["meshes"][0]["primitives"];
  for (int i = 0; i < 1000; ++i) {
    for (const size_t old : {0u, 1u}) asset.json["accessors"].push_back(Asset(asset.json["accessors"][old]));
    Asset copy = primitives[0];
    copy["attributes"]["POSITION"] = asset.json["accessors"].size() - 2;
    copy["indices"] = asset.json["accessors"].size() - 1;
    primitives.push_back(std::move(copy));
  }
  std::vector<std::byte> bytes;
  GltfDecompressOptions options;
  options.limits.mesh_bytes = 1 << 20;
  const auto result = decompress_gltf(*source_of(asset.text()), *memory_sink(bytes), options);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::memory_bound);
}

}  // namespace
}  // namespace maille
