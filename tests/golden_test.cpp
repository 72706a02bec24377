// Files of the format as it is (tests/golden/single): today's decoder must read them, today's encoder must
// write exactly these bytes, on every machine, compiler and optimisation level.
//
// When this fails, some bytes have changed. By accident: find out why. On purpose: say so in docs/format.md
// and, once a version is released, raise format_minor (old files still decode) or format_major (they do not,
// and the decoder of the old ones moves to src/legacy). Then write the files anew, and look at what git says
// has changed:
//
//   UPDATE=1 build/release/tests/test_system --gtest_filter='Golden.*'
//
// Files of a released version are never written anew: they move to a folder of their own, which is only
// decoded.
#include "base/hash.h"
#include "support/codec.h"
#include "support/data.h"
#include "support/files.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <sstream>

namespace maille::testing {
namespace {

// Meshes are made by +, -, *, / and sqrt only: a sine may be rounded differently elsewhere.

EncodeOptions of_mode_single() {
  EncodeOptions options;
  options.mode = Mode::single;
  return options;
}

struct GoldenFile {
  std::string name;
  std::string about;
  Mesh mesh;
  EncodeOptions options;

  bool keeps_order() const { return options.order == Order::keep; }
  bool is_lossy() const {
    return options.positions.kind != Tolerance::Kind::lossless || !options.arrays.empty();
  }
};

template <class T>
Array array_of(std::string name, Domain domain, Scalar type, uint32_t components, uint64_t tuples,
               const std::function<T(uint64_t)>& value, Role role = Role::none) {
  Array array = make_array(std::move(name), domain, type, components, role);
  array.resize(tuples);
  for (uint64_t i = 0; i < tuples * components; ++i) array.values<T>()[i] = value(i);
  return array;
}

/// n x n quads over a saddle.
Surface saddle(uint32_t n) {
  Surface surface;
  for (uint32_t j = 0; j <= n; ++j) {
    for (uint32_t i = 0; i <= n; ++i) {
      const double x = i - n / 2.0, y = j - n / 2.0;
      surface.points.push_back({x, y, (x * x - y * y) / 7});
    }
  }
  for (uint32_t j = 0; j < n; ++j) {
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t a = j * (n + 1) + i;
      surface.faces.push_back({a, a + 1, a + n + 2, a + n + 1});
    }
  }
  return surface;
}

/// A cube of 2 x 2 x 2 voxels with an atlas and two materials.
Mesh textured_quads() {
  Mesh mesh = to_mesh(shapes::voxels(std::vector<bool>(8, true), 2, 2, 2));
  mesh.blocks[0].type = CellType::quad;
  mesh.blocks[0].offsets.clear();
  const auto uv = [](uint64_t i) {
    const uint64_t face = i / 8, corner = i / 2 % 4;
    const auto u = static_cast<float>(face % 6 + (corner == 1 || corner == 2)) / 6;
    const auto v = static_cast<float>(face / 6 + (corner >= 2)) / 4;
    return i % 2 == 0 ? u : v;
  };
  mesh.arrays.push_back(array_of<float>("uv", Domain::corner, Scalar::f32, 2, mesh.corner_count(), uv,
                                        Role::texture_coordinate));
  mesh.arrays.push_back(array_of<uint8_t>(
      "material", Domain::cell, Scalar::u8, 1, mesh.cell_count(),
      [](uint64_t i) { return static_cast<uint8_t>(i / 9 % 2); }, Role::label));
  mesh.arrays.back().labels = {"brick", "glass"};
  mesh.metadata = {{"comment", "a golden file"}, {"unit", "mm"}};
  return mesh;
}

/// A saddle whose second half has points of its own: an array has a seam there.
Mesh with_seam() {
  Surface surface = triangulated(saddle(12));
  // Rough, so that a point takes more than what says that it is there twice.
  for (uint32_t i = 0; i < surface.points.size(); ++i)
    surface.points[i][2] += (i * 2654435761U >> 20) / 8192.0;
  const auto half = surface.faces.begin() + static_cast<std::ptrdiff_t>(surface.faces.size() / 2);
  std::map<uint32_t, uint32_t> copies;
  const auto first_copy = static_cast<uint32_t>(surface.points.size());
  for (auto face = half; face != surface.faces.end(); ++face) {
    for (uint32_t& point : *face) {
      const auto [copy, is_new] = copies.try_emplace(point, static_cast<uint32_t>(surface.points.size()));
      if (is_new) surface.points.push_back(surface.points[point]);
      point = copy->second;
    }
  }
  // Only the points on the border between the halves are there twice.
  std::vector<uint32_t> number(surface.points.size(), 0);
  for (const auto& face : surface.faces) {
    for (const uint32_t point : face) number[point] = 1;
  }
  std::vector<float> side;
  Surface kept;
  for (uint32_t i = 0; i < surface.points.size(); ++i) {
    if (number[i] == 0) continue;
    number[i] = static_cast<uint32_t>(kept.points.size());
    kept.points.push_back(surface.points[i]);
    side.push_back(i < first_copy ? 0.25F : 0.75F);
  }
  for (auto face : surface.faces) {
    for (uint32_t& point : face) point = number[point];
    kept.faces.push_back(face);
  }
  Mesh mesh = to_mesh(kept);
  mesh.arrays.push_back(array_of<float>("side", Domain::point, Scalar::f32, 1, mesh.point_count(),
                                        [&](uint64_t i) { return side[i]; }));
  return mesh;
}

/// Edges of three faces and more, bow ties, faces turned over, twice, degenerate; points of no face.
Mesh soup() {
  Surface surface = shapes::voxels({true, false, false, true, false, true, true, false}, 2, 2, 2);
  append(surface, shapes::tetrahedron(), {5, 0, 0});
  append(surface, shapes::tetrahedron(), {7, 0, 0});
  const auto last = static_cast<uint32_t>(surface.points.size());
  surface.faces.push_back({last - 8, last - 4, last - 3});  // joins the two in a bow tie
  surface.faces.push_back(surface.faces[3]);                // twice
  surface.faces.push_back({surface.faces[5].rbegin(), surface.faces[5].rend()});  // twice, turned over
  surface.faces.push_back({0, 1, 0});                                             // degenerate
  surface.faces.push_back({2, 2, 2, 2});
  surface.faces.push_back({4, 5});
  surface.points.push_back({9, 9, 9});  // alone
  surface.points.push_back(surface.points[0]);
  for (uint32_t i = 0; i < 3; ++i) surface.faces.push_back({0, 1, 6 + i});  // a book
  return to_mesh(surface);
}

/// Lines, points, tetrahedra, a hexahedron beside triangles and a block of mixed type.
Mesh loose_cells() {
  Mesh mesh = to_mesh(shapes::voxels({true, true}, 2, 1, 1));
  const auto add = [&](std::string name, CellType type, std::vector<uint32_t> nodes) -> CellBlock& {
    CellBlock& block = mesh.blocks.emplace_back();
    block.name = std::move(name);
    block.type = type;
    block.connectivity = std::move(nodes);
    return block;
  };
  add("edges", CellType::line, {0, 1, 1, 2, 2, 3, 8, 9});
  add("tips", CellType::vertex, {4, 7, 11});
  add("tetrahedra", CellType::tetrahedron, {0, 1, 2, 4, 1, 2, 4, 7});
  add("brick", CellType::hexahedron, {0, 1, 3, 2, 4, 5, 7, 6});
  add("path", CellType::poly_line, {0, 4, 5, 9, 10, 11}).offsets = {0, 4, 6};
  CellBlock& mixed = add("mixed", CellType::mixed, {0, 1, 2, 3, 2, 1, 0, 4, 5, 6});
  mixed.offsets = {0, 3, 7, 10};
  mixed.types = {5, 9, 7};
  mesh.arrays.push_back(array_of<int16_t>("group", Domain::cell, Scalar::i16, 1, mesh.cell_count(),
                                          [](uint64_t i) { return static_cast<int16_t>(i / 3 - 1); }));
  return mesh;
}

/// Doubles that are no decimals, and those that nothing but their bits can stand for.
Mesh doubles() {
  Mesh mesh = to_mesh(saddle(4), Scalar::f64);
  auto values = mesh.points.values<double>();
  for (size_t i = 0; i < values.size(); ++i)
    values[i] = std::sqrt(static_cast<double>(i) + 2) + values[i] / 3;
  static constexpr uint64_t special[] = {0x7ff8000000001234, 0xfff0000000000000, 0x8000000000000000, 1,
                                         0x7fefffffffffffff};
  std::memcpy(values.data() + 30, special, sizeof special);
  return mesh;
}

template <class T>
void add_scalars(Mesh& mesh, Scalar type) {
  const auto domain = static_cast<Domain>(static_cast<unsigned>(type) % domain_count);
  const uint64_t tuples = domain == Domain::mesh ? 3 : mesh.count_of(domain);
  const auto value = [](uint64_t i) {
    if (i == 5) return std::numeric_limits<T>::lowest();
    if (i == 6) return std::numeric_limits<T>::max();
    return static_cast<T>(i * i % 100);
  };
  const uint32_t components = 1 + static_cast<unsigned>(type) % 4;
  mesh.arrays.push_back(array_of<T>(name_of(type), domain, type, components, tuples, value));
}

Mesh all_scalars() {
  Mesh mesh = to_mesh(saddle(3), Scalar::i32);
  add_scalars<int8_t>(mesh, Scalar::i8);
  add_scalars<uint8_t>(mesh, Scalar::u8);
  add_scalars<int16_t>(mesh, Scalar::i16);
  add_scalars<uint16_t>(mesh, Scalar::u16);
  add_scalars<int32_t>(mesh, Scalar::i32);
  add_scalars<uint32_t>(mesh, Scalar::u32);
  add_scalars<int64_t>(mesh, Scalar::i64);
  add_scalars<uint64_t>(mesh, Scalar::u64);
  add_scalars<float>(mesh, Scalar::f32);
  add_scalars<double>(mesh, Scalar::f64);
  return mesh;
}

/// A saddle with unit normals, a temperature with a hole in it, and a direction per corner.
Mesh with_fields() {
  Mesh mesh = to_mesh(saddle(6));
  const auto positions = mesh.points.values<float>();
  Array normals = make_array("normal", Domain::point, Scalar::f32, 3, Role::normal);
  normals.resize(mesh.point_count());
  for (size_t i = 0; i < mesh.point_count(); ++i) {
    const double x = -2.0 / 7 * double{positions[3 * i]}, y = 2.0 / 7 * double{positions[3 * i + 1]};
    const double length = std::sqrt(x * x + y * y + 1);
    const double normal[] = {x / length, y / length, 1 / length};
    for (size_t k = 0; k < 3; ++k) normals.values<float>()[3 * i + k] = static_cast<float>(normal[k]);
  }
  mesh.arrays.push_back(std::move(normals));
  mesh.arrays.push_back(
      array_of<double>("temperature", Domain::cell, Scalar::f64, 1, mesh.cell_count(), [](uint64_t i) {
        return i == 7 ? std::numeric_limits<double>::infinity() : 20 + static_cast<double>(i % 6) / 3;
      }));
  mesh.arrays.push_back(array_of<float>("flow", Domain::corner, Scalar::f32, 2, mesh.corner_count(),
                                        [](uint64_t i) { return static_cast<float>(i % 11) / 13; }));
  return mesh;
}

/// One coordinate of each point stays; the others go to planes.
Surface on_planes(Surface surface) {
  for (size_t i = 0; i < surface.points.size(); ++i) {
    for (size_t k = 0; k < 3; ++k) {
      double& x = surface.points[i][k];
      if (i * i % 3 != k) x = std::floor(x / 3) * 3;
    }
  }
  return surface;
}

/// Normals of facets whose corners were rounded after; some are computed from rounded ones.
Mesh with_facet_normals() {
  Surface surface = triangulated(saddle(16));
  for (size_t i = 0; i < surface.points.size(); ++i)
    surface.points[i][2] += static_cast<double>(i * i % 11) / 700;
  Mesh mesh = to_mesh(surface);
  for (float& x : mesh.points.values<float>())
    x = static_cast<float>(std::floor(double{x} * 1000 + 0.5) / 1000);
  Array normals = make_array("normal", Domain::cell, Scalar::f32, 3, Role::normal);
  normals.resize(mesh.cell_count());
  for (size_t i = 0; i < mesh.cell_count(); ++i) {
    double corners[3][3];
    for (size_t k = 0; k < 9; ++k) {
      const size_t point = mesh.blocks[0].cell(i)[k / 3];
      corners[k / 3][k % 3] =
          i % 3 == 0 ? double{mesh.points.values<float>()[3 * point + k % 3]} : surface.points[point][k % 3];
    }
    double n[3];
    for (size_t k = 0; k < 3; ++k) {
      const size_t l = (k + 1) % 3, m = (k + 2) % 3;
      n[k] = (corners[1][l] - corners[0][l]) * (corners[2][m] - corners[0][m]) -
             (corners[1][m] - corners[0][m]) * (corners[2][l] - corners[0][l]);
    }
    const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (size_t k = 0; k < 3; ++k) normals.values<float>()[3 * i + k] = static_cast<float>(n[k] / length);
  }
  mesh.arrays.push_back(std::move(normals));
  return mesh;
}

std::vector<GoldenFile> goldens() {
  using Kind = Tolerance::Kind;
  std::vector<GoldenFile> all;
  const auto add = [&](const char* name, const char* about, Mesh mesh) -> EncodeOptions& {
    all.push_back({name, about, std::move(mesh), of_mode_single()});
    return all.back().options;
  };
  add("empty", "no points, no cells", {});
  add("tetrahedron", "four triangles, f32, lossless", tetrahedron());
  add("triangles", "a surface with weights fitted to it, f32", to_mesh(triangulated(saddle(24))));
  add("planes", "coordinates that come again", to_mesh(on_planes(triangulated(saddle(24)))));
  add("fast", "static tables", to_mesh(triangulated(saddle(24)))).effort = 2;
  add("textured_quads", "quads, corner uv with seams, labels, metadata", textured_quads());
  add("twins", "points that stand twice at a seam", with_seam());
  add("soup", "non-manifold, flipped, twice, degenerate, alone", soup());
  add("lossy", "positions at 12 bits, quads", to_mesh(saddle(12))).positions = {Kind::bits, 12};
  add("keep_order", "a shuffled mesh with its order", shuffled(textured_quads(), 1)).order = Order::keep;
  add("loose_cells", "blocks of lines, points, volumes, mixed type", loose_cells());
  add("doubles", "f64, special values", doubles());
  add("all_scalars", "every scalar type, every domain, one to four components", all_scalars());
  EncodeOptions& fields = add("lossy_fields", "lossy arrays of each kind, in order", with_fields());
  fields.order = Order::keep;
  fields.positions = {Kind::absolute, 0.01};
  fields.arrays = {{"normal", {Kind::bits, 8}},
                   {"temperature", {Kind::relative, 0.001}},
                   {"flow", {Kind::absolute, 0.05}}};
  add("facet_normals", "normals older than their corners", with_facet_normals());
  add("effort_9", "the widest choice of pivots", to_mesh(saddle(9))).effort = 9;
  add("provenance", "who wrote it", cube()).provenance = "maille compress cube.ply";
  return all;
}

const std::filesystem::path folder = tests_folder() + "/golden/single";

std::vector<std::byte> read(const std::string& name) {
  std::ifstream file(folder / name, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  const std::string content = text.str();
  const auto bytes = std::as_bytes(std::span(content));
  return {bytes.begin(), bytes.end()};
}

/// A digest of everything in a mesh, in its order.
std::string digest(const Mesh& mesh) {
  std::vector<std::byte> all;
  const auto put = [&](const void* data, size_t size) {
    const auto* bytes = static_cast<const std::byte*>(data);
    all.insert(all.end(), bytes, bytes + size);
  };
  const auto put_array = [&](const Array& array) {
    put(array.name.c_str(), array.name.size() + 1);
    put(array.bytes.data(), array.bytes.size());
  };
  put_array(mesh.points);
  for (const CellBlock& block : mesh.blocks) {
    put(block.name.c_str(), block.name.size() + 1);
    put(&block.type, 1);
    put(block.types.data(), block.types.size());
    put(block.offsets.data(), block.offsets.size() * sizeof(uint64_t));
    put(block.connectivity.data(), block.connectivity.size() * sizeof(uint32_t));
  }
  for (const Array& array : mesh.arrays) put_array(array);
  std::ostringstream text;
  text << std::hex << hash64(all);
  return text.str();
}

/// Digests of the decoded meshes, by name.
std::map<std::string, std::string> recorded_digests() {
  std::map<std::string, std::string> digests;
  std::ifstream file(folder / "decoded.txt");
  for (std::string name, value; file >> name >> value;) digests[name] = value;
  return digests;
}

/// Without UPDATE in the environment nothing is written.
bool is_update() {
  const char* update = std::getenv("UPDATE");
  return update != nullptr && std::string(update) == "1";
}

void write_all() {
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  std::ofstream digests(folder / "decoded.txt");
  for (const GoldenFile& golden : goldens()) {
    const auto encoded = encode_bytes(golden.mesh, golden.options);
    ASSERT_TRUE(encoded) << golden.name << ": " << encoded.error().message;
    write_bytes(folder / (golden.name + ".maille"), encoded->bytes);
    const auto decoded = decode_bytes(encoded->bytes);
    ASSERT_TRUE(decoded) << golden.name << ": " << decoded.error().message;
    digests << golden.name << ' ' << digest(*decoded) << '\n';
  }
}

class Golden : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (is_update()) write_all();
  }
};

TEST_F(Golden, FilesAreDecodedToTheMeshesRecorded) {
  const auto recorded = recorded_digests();
  for (const GoldenFile& golden : goldens()) {
    const auto decoded = decode_bytes(read(golden.name + ".maille"));
    ASSERT_TRUE(decoded) << golden.name << ": " << decoded.error().message;
    ASSERT_EQ(recorded.count(golden.name), 1u) << golden.name;
    EXPECT_EQ(digest(*decoded), recorded.at(golden.name)) << golden.name << " (" << golden.about << ")";
  }
}

/// Empty when every value is within its bound; only for meshes in the same order.
std::string beyond_bounds(const GoldenFile& golden, const Mesh& decoded) {
  const auto differences = differences_by_order(golden.mesh, decoded);
  if (!differences) return differences.error().message;
  const std::map<std::string, double> allowed = {
      {"position", 0.01}, {"normal", 2.0 / 255}, {"temperature", 0.001 * 5 / 3}, {"flow", 0.05}};
  for (const ArrayDifference& difference : *differences) {
    if (difference.maximum > allowed.at(difference.name)) return difference.name + " is too far off";
    if (difference.unequal == 0) return difference.name + " is lossless, of all things";
  }
  return {};
}

TEST_F(Golden, FilesHoldTheMeshesTheyWereMadeOf) {
  for (const GoldenFile& golden : goldens()) {
    const auto decoded = decode_bytes(read(golden.name + ".maille"));
    ASSERT_TRUE(decoded) << golden.name << ": " << decoded.error().message;
    if (!golden.is_lossy()) {
      EXPECT_EQ(differences_between(golden.mesh, *decoded, golden.keeps_order()), "") << golden.name;
    } else if (golden.keeps_order()) {
      EXPECT_EQ(beyond_bounds(golden, *decoded), "") << golden.name;
    } else {
      Mesh shape = golden.mesh;
      Mesh decoded_shape = *decoded;
      for (Mesh* mesh : {&shape, &decoded_shape})
        std::fill(mesh->points.bytes.begin(), mesh->points.bytes.end(), std::byte{0});
      EXPECT_EQ(differences_between(shape, decoded_shape), "") << golden.name;
    }
  }
}

TEST_F(Golden, FilesAreWhatTheEncoderWrites) {
  for (const GoldenFile& golden : goldens()) {
    const auto encoded = encode_bytes(golden.mesh, golden.options);
    ASSERT_TRUE(encoded) << golden.name << ": " << encoded.error().message;
    const auto recorded = read(golden.name + ".maille");
    const auto [here, there] =
        std::mismatch(encoded->bytes.begin(), encoded->bytes.end(), recorded.begin(), recorded.end());
    EXPECT_TRUE(encoded->bytes == recorded)
        << golden.name << " (" << golden.about << "): " << encoded->bytes.size() << " bytes, recorded "
        << recorded.size() << ", the first difference at byte " << here - encoded->bytes.begin()
        << ". Was it on purpose? The head of tests/golden_test.cpp says what to do.";
  }
}

TEST_F(Golden, FilesAreSmallAndOneForEachMesh) {
  std::set<std::string> expected = {"decoded.txt"};
  for (const GoldenFile& golden : goldens()) expected.insert(golden.name + ".maille");
  std::set<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    found.insert(entry.path().filename().string());
    EXPECT_LT(entry.file_size(), 4096u) << entry.path().filename();
  }
  EXPECT_EQ(found, expected);
}

TEST_F(Golden, FilesCutShortAreRefused) {
  for (const GoldenFile& golden : goldens()) {
    const auto bytes = read(golden.name + ".maille");
    for (size_t size = 0; size < bytes.size(); ++size) {
      const std::vector<std::byte> part(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
      EXPECT_FALSE(decode_bytes(part)) << golden.name << ", " << size << " bytes";
    }
  }
}

}  // namespace
}  // namespace maille::testing
