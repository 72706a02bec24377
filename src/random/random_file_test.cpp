// Files of mode `random` as a whole: written, read back, taken apart.
#include "random/random_file.h"

#include <gtest/gtest.h>
#include <maille/random_access.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "random/mesh_geometry.h"
#include "support/cases.h"
#include "support/codec.h"
#include "support/random.h"
#include "support/random_file.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

namespace maille::testing {
namespace {

TEST(RandomFile, GivesRandomSurfacesBack) {
  RandomMeshOptions meshes;
  meshes.other_cells = true;
  EXPECT_EQ(check_random_surfaces(1, 400, meshes, [](const Mesh& mesh) { return round_trip(mesh, {}); }), "");
}

TEST(RandomFile, GivesSurfacesBackInTheirOrder) {
  RandomMeshOptions meshes;
  meshes.other_cells = true;
  EncodeOptions options;
  options.order = Order::keep;
  EXPECT_EQ(
      check_random_surfaces(10000, 200, meshes, [&](const Mesh& mesh) { return round_trip(mesh, options); }),
      "");
}

TEST(RandomFile, GivesSurfacesBackAtEveryEffort) {
  for (const int effort : {1, 2, 4, 7, 9}) {
    EncodeOptions options;
    options.effort = effort;
    EXPECT_EQ(
        check_random_surfaces(20000, 40, {}, [&](const Mesh& mesh) { return round_trip(mesh, options); }), "")
        << effort;
  }
}

TEST(RandomFile, DecodesALatticeAsModeSingleDoes) {
  for (uint64_t seed = 0; seed < cases(60); ++seed) {
    const Mesh mesh = random_surface(seed, {.special_values = false});
    EncodeOptions options;
    options.positions = {Tolerance::Kind::bits, 10};
    const auto single = encode_bytes(mesh, options);
    ASSERT_TRUE(single) << single.error().message;
    const RandomFile file = random_file(mesh, options);
    ASSERT_EQ(file.error, "") << seed;
    EXPECT_EQ(differences_between(decode_bytes(single->bytes).value(), decode_bytes(file.bytes).value()), "")
        << seed;
  }
}

TEST(RandomFile, IsTheSameForAnyNumberOfThreads) {
  const auto threads = thread_executor(3);
  for (uint64_t seed = 0; seed < cases(40); ++seed) {
    const Mesh mesh = random_surface(seed, {.faces = 300});
    EncodeOptions options;
    options.order = seed % 2 == 0 ? Order::keep : Order::canonical;
    const RandomFile serial = random_file(mesh, options);
    options.executor = threads.get();
    const RandomFile parallel = random_file(mesh, options);
    ASSERT_EQ(serial.error, "") << seed;
    EXPECT_TRUE(serial.bytes == parallel.bytes) << seed;
    DecodeOptions decoding;
    decoding.executor = threads.get();
    EXPECT_EQ(differences_between(decode_bytes(serial.bytes).value(),
                                  decode_bytes(serial.bytes, decoding).value(), true),
              "")
        << seed;
  }
}

TEST(RandomFile, HasFinestChartsOfTheSizeAskedForAndTheSameCoarseLevels) {
  const Mesh mesh = torus(128, 128);
  EncodeOptions options;
  options.mode = Mode::random;
  const auto usual = encode_bytes(mesh, options);
  options.most_cells_per_part = 1024;
  const auto small = encode_bytes(mesh, options);
  ASSERT_TRUE(usual && small);
  const auto usual_source = memory_source(Bytes(usual->bytes)), source = memory_source(Bytes(small->bytes));
  const auto few = File::open(*usual_source), many = File::open(*source);
  ASSERT_TRUE(few && many);
  // A quad counts as two triangles; the last cuts may be off by a fifth.
  const double charts = 2 * static_cast<double>(mesh.cell_count()) / 1024;
  EXPECT_NEAR(static_cast<double>(many->charts(0)), charts, charts / 5);
  EXPECT_LT(few->charts(0) * 3, many->charts(0));
  ASSERT_EQ(few->levels(), many->levels());
  for (uint32_t level = 1; level < few->levels(); ++level)
    EXPECT_EQ(few->charts(level), many->charts(level)) << level;
  EXPECT_EQ(differences_between(decode_bytes(usual->bytes).value(), decode_bytes(small->bytes).value()), "");
}

TEST(RandomFile, RefusesSolids) {
  Mesh mesh = tetrahedron();
  CellBlock& block = mesh.blocks.emplace_back();
  block.type = CellType::tetrahedron;
  block.connectivity = {0, 1, 2, 3};
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  const auto report = encode_random(mesh, *sink, {});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::unsupported);
}

/// A few hundred charts, several levels, a pair of arrays.
Mesh landscape(uint32_t n) {
  Mesh mesh = to_mesh(triangulated(shapes::grid(n, n)));
  Random random(n);
  for (float& x : mesh.points.values<float>()) x += static_cast<float>(0.2 * random.unit());
  Array height = make_array("height", Domain::point, Scalar::f32, 1);
  height.resize(mesh.point_count());
  for (uint64_t i = 0; i < mesh.point_count(); ++i)
    height.values<float>()[i] = mesh.points.values<float>()[3 * i + 2];
  Array material = make_array("material", Domain::cell, Scalar::u8, 1);
  material.resize(mesh.cell_count());
  for (uint64_t i = 0; i < mesh.cell_count(); ++i) material.values<uint8_t>()[i] = random.below(5) & 255;
  Array unit = make_array("unit", Domain::mesh, Scalar::u8, 2);
  unit.resize(3);
  unit.values<uint8_t>()[4] = 7;
  mesh.arrays = {height, material, unit};
  return mesh;
}

TEST(RandomFile, OfSeveralIndexPagesIsRead) {
  const Mesh mesh = landscape(50);
  EncodeOptions options;
  options.effort = 1;
  const RandomFile file = random_file(mesh, options, 4);
  ASSERT_EQ(file.error, "");
  const auto source = memory_source(Bytes(file.bytes));
  const auto info = inspect(*source);
  ASSERT_TRUE(info);
  const auto pages = std::count_if(info->chunks.begin(), info->chunks.end(),
                                   [](const ChunkInfo& chunk) { return chunk.type == "CIDX"; });
  EXPECT_GE(pages, 2);
  EXPECT_EQ(differences_between(mesh, decode_bytes(file.bytes).value()), "");
  // The number of faces of what is chosen stays below the limit, page by page.
  File open = File::open(*source).value();
  const Selection some = open.select({}, 2500).value();
  EXPECT_LE(some.faces, 2500u);
  EXPECT_GE(some.faces, 1500u);
}

TEST(RandomFile, GivesTheMeshAtFullDetail) {
  for (uint64_t seed = 0; seed < cases(150); ++seed) {
    const Mesh mesh = random_surface(seed);
    const RandomFile file = random_file(mesh, {});
    ASSERT_EQ(file.error, "") << seed;
    const auto source = memory_source(Bytes(file.bytes));
    auto open = File::open(*source);
    ASSERT_TRUE(open) << open.error().message;
    const auto extracted = open->extract(open->select({}, Detail::full()).value());
    ASSERT_TRUE(extracted) << seed << ": " << extracted.error().message;
    EXPECT_EQ(differences_between(mesh, *extracted), "") << seed;
  }
}

TEST(RandomFile, GivesValidMeshesOfEveryLevel) {
  for (uint64_t seed = 0; seed < cases(150); ++seed) {
    const Mesh mesh = random_surface(seed, {.faces = 200});
    const RandomFile file = random_file(mesh, {});
    ASSERT_EQ(file.error, "") << seed;
    const auto source = memory_source(Bytes(file.bytes));
    File open = File::open(*source).value();
    for (uint32_t level = 0; level < open.levels(); ++level) {
      Detail detail;
      detail.level = level;
      const Selection selection = open.select({}, detail).value();
      const auto extracted = open.extract(selection);
      ASSERT_TRUE(extracted) << seed << ": " << extracted.error().message;
      const auto valid = validate(*extracted);
      EXPECT_TRUE(valid) << seed << ", level " << level << ": " << valid.error().message;
    }
  }
}

/// Edges of one triangle only, by the positions of their ends.
std::multiset<std::array<float, 6>> open_edges(const Mesh& mesh) {
  std::multiset<std::array<float, 6>> open;
  const auto positions = mesh.points.values<float>();
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto nodes = block.cell(i);
      for (size_t k = 0; k < nodes.size(); ++k) {
        std::array<float, 6> edge;
        const uint32_t a = nodes[k], b = nodes[(k + 1) % nodes.size()];
        for (size_t x = 0; x < 3; ++x) {
          edge[x] = positions[size_t{3} * a + x];
          edge[3 + x] = positions[size_t{3} * b + x];
        }
        if (const auto other = open.find({edge[3], edge[4], edge[5], edge[0], edge[1], edge[2]});
            other != open.end()) {
          open.erase(other);
        } else {
          open.insert(edge);
        }
      }
    }
  }
  return open;
}

TEST(RandomFile, HasNoCracksInAnyView) {
  const Mesh mesh = to_mesh(triangulated(shapes::sphere(60, 40)));
  ASSERT_TRUE(open_edges(mesh).empty());
  const RandomFile file = random_file(mesh, {}, 32);
  ASSERT_EQ(file.error, "");
  const auto source = memory_source(Bytes(file.bytes));
  File open = File::open(*source).value();
  ASSERT_GE(open.levels(), 3u);
  Random random(1);
  std::set<uint64_t> sizes;
  for (uint64_t i = 0; i < cases(300); ++i) {
    Selection selection;
    const Vector3 eye{{4 * random.unit() - 2, 4 * random.unit() - 2, 4 * random.unit() - 2}};
    const View view{eye, std::pow(2.0, 14 * random.unit()), 1};
    if (i % 2 == 0) {
      Detail detail;
      detail.view = view;
      selection = open.select({}, detail).value();
    } else {
      selection = open.select({}, 50 + random.below(5000), view).value();
    }
    sizes.insert(selection.faces);
    const Mesh part = open.extract(selection).value();
    EXPECT_EQ(part.cell_count(), selection.faces);
    EXPECT_TRUE(open_edges(part).empty()) << i;
  }
  EXPECT_GE(sizes.size(), 10u);
}

Region random_region(Random& random, const Vector3& middle, double size) {
  const auto near = [&] {
    return middle + Vector3{{random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5}} * size;
  };
  Region region;
  if (random.chance(50)) {
    const Vector3 a = near(), b = near();
    Box box;
    for (unsigned k = 0; k < 3; ++k) {
      box.low[k] = std::min(a[k], b[k]);
      box.high[k] = std::max(a[k], b[k]);
    }
    region.box = box;
  }
  if (random.chance(40)) region.sphere = Sphere{near(), size * 0.6 * random.unit()};
  for (uint32_t planes = random.below(3); planes > 0; --planes) {
    Vector3 normal = near() - middle;
    normal = normal * (1 / std::sqrt(dot(normal, normal) + 1e-30));
    region.planes.push_back({normal, -dot(normal, near())});
  }
  return region;
}

std::string clips_differ(const Mesh& mesh, uint64_t seed) {
  const RandomFile file = random_file(mesh, {});
  if (!file.error.empty()) return file.error;
  const auto source = memory_source(Bytes(file.bytes));
  auto open = File::open(*source);
  if (!open) return open.error().message;
  Random random(seed);
  Vector3 low, high;
  for (uint64_t i = 0; i < mesh.point_count(); ++i) {
    const Vector3 p = point_position(mesh.points, i);
    for (unsigned k = 0; k < 3; ++k) {
      low[k] = i == 0 ? p[k] : std::min(low[k], p[k]);
      high[k] = i == 0 ? p[k] : std::max(high[k], p[k]);
    }
  }
  const double size = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  for (unsigned i = 0; i < 8; ++i) {
    const Region region = random_region(random, (low + high) * 0.5, size);
    const auto selection = open->select(region, Detail::full());
    if (!selection) return selection.error().message;
    const auto extracted = open->extract(*selection);
    if (!extracted) return extracted.error().message;
    const std::string differences = differences_between(clip(mesh, region), clip(*extracted, region));
    if (!differences.empty()) return "region " + std::to_string(i) + ": " + differences;
  }
  return "";
}

/// All of level 0, through the calls that `maille extract` makes for a region.
std::string whole_differs(const Mesh& mesh) {
  const RandomFile file = random_file(mesh, {});
  if (file.unsupported) return "";
  if (!file.error.empty()) return file.error;
  const auto source = memory_source(Bytes(file.bytes));
  auto open = File::open(*source);
  if (!open) return open.error().message;
  const auto selection = open->select({}, Detail::full());
  if (!selection) return selection.error().message;
  const auto extracted = open->extract(*selection);
  if (!extracted) return extracted.error().message;
  const Mesh whole = clip(*extracted, {});
  return whole.metadata == mesh.metadata ? differences_between(mesh, whole) : "other metadata";
}

TEST(RandomFile, GivesAllOfTheMeshWithoutALimit) {
  RandomMeshOptions meshes;
  meshes.other_cells = true;
  EXPECT_EQ(check_random_surfaces(40000, 150, meshes, whole_differs), "");
}

TEST(RandomFile, GivesWhatLiesInARegion) {
  const RandomMeshOptions meshes = {.faces = 200, .special_values = false, .other_cells = false};
  EXPECT_EQ(check_random_surfaces(30000, 150, meshes, [](const Mesh& mesh) { return clips_differ(mesh, 1); }),
            "");
}

/// Floats have no digits left there.
TEST(RandomFile, GivesWhatLiesInARegionFarFromZero) {
  Mesh mesh = to_mesh(triangulated(shapes::sphere(40, 30)), Scalar::f64);
  for (double& x : mesh.points.values<double>()) x += 5e8;
  EXPECT_EQ(clips_differ(mesh, 2), "");
  Mesh whole = to_mesh(triangulated(shapes::sphere(40, 30)), Scalar::i32);
  const Mesh sphere = to_mesh(triangulated(shapes::sphere(40, 30)), Scalar::f64);
  for (size_t i = 0; i < 3 * sphere.point_count(); ++i)
    whole.points.values<int32_t>()[i] = static_cast<int32_t>(1e9 + 200 * sphere.points.values<double>()[i]);
  EXPECT_EQ(clips_differ(whole, 3), "");
}

TEST(RandomFile, SimplifiesFarFromZero) {
  Mesh mesh = to_mesh(triangulated(shapes::sphere(60, 40)), Scalar::f64);
  for (double& x : mesh.points.values<double>())
    x = std::floor(x * 0x1p20) * 0x1p-20;  // no digit is lost below
  const RandomFile near = random_file(mesh, {}, 64);
  for (double& x : mesh.points.values<double>()) x += 0x1p29;
  const RandomFile far = random_file(mesh, {}, 64);
  const auto faces = [](const RandomFile& file) {
    return inspect(*memory_source(Bytes(file.bytes)))->faces_of_level;
  };
  EXPECT_EQ(faces(near), faces(far));
}

TEST(RandomFile, HasChartsWithAllBlocksAndAFewOfTheirCells) {
  Mesh mesh = to_mesh(triangulated(shapes::grid(40, 40)));
  const CellBlock all = mesh.blocks[0];
  // 533 blocks of six triangles; the last one has two.
  mesh.blocks.clear();
  for (size_t i = 0; i < all.connectivity.size(); i += 18) {
    CellBlock& block = mesh.blocks.emplace_back();
    block.type = CellType::triangle;
    block.name = std::to_string(i);
    const auto first = all.connectivity.begin() + static_cast<ptrdiff_t>(i);
    block.connectivity.assign(first, first + std::min<ptrdiff_t>(18, all.connectivity.end() - first));
  }
  const RandomFile file = random_file(mesh, {}, 128);
  ASSERT_EQ(file.error, "");
  std::map<std::string, uint64_t> cells;
  const auto source = memory_source(Bytes(file.bytes));
  File open = File::open(*source).value();
  for (uint32_t g = 0; g < open.groups(); ++g) {
    const GroupInfo group = open.group(g).value();
    for (uint32_t c = 0; group.level == 0 && c < group.charts.size(); ++c) {
      const Mesh chart = open.read({g, c}).value();
      ASSERT_EQ(chart.blocks.size(), mesh.blocks.size());
      EXPECT_LE(chart.cell_count(), 256u);
      for (const CellBlock& block : chart.blocks) cells[block.name] += block.size();
    }
  }
  ASSERT_EQ(cells.size(), mesh.blocks.size());
  for (const CellBlock& block : mesh.blocks) EXPECT_EQ(cells[block.name], block.size()) << block.name;
}

/// All triangles of a mesh.
std::vector<std::array<uint32_t, 3>> triangles_of(const Mesh& mesh) {
  std::vector<std::array<uint32_t, 3>> triangles;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto nodes = block.cell(i);
      if (!is_face(block.type_of(i))) continue;
      for_each_fan_triangle(mesh.points, nodes, [&](uint32_t a, uint32_t b, uint32_t c) {
        triangles.push_back({a, b, c});
      });
    }
  }
  return triangles;
}

/// Does the chart have the point where it says?
void expect_on_chart(File& open, const SurfacePoint& found) {
  const Mesh chart = open.read(found.chart).value();
  Vector3 at;
  for (unsigned k = 0; k < 3; ++k) {
    ASSERT_LT(found.corners[k], chart.point_count());
    at = at + point_position(chart.points, found.corners[k]) * found.weights[k];
  }
  const Vector3 d = at - found.position;
  EXPECT_LE(std::sqrt(dot(d, d)), 1e-6 * (1 + std::sqrt(dot(at, at))));
  ASSERT_LT(found.face, chart.cell_count());
  uint64_t face = found.face;
  for (const CellBlock& block : chart.blocks) {
    if (face < block.size()) {
      const auto nodes = block.cell(face);
      for (const uint32_t corner : found.corners)
        EXPECT_NE(std::find(nodes.begin(), nodes.end(), corner), nodes.end());
      return;
    }
    face -= block.size();
  }
}

TEST(RandomFile, IsHitByRaysWhereTheMeshIs) {
  Random random(7);
  unsigned hits = 0;
  for (uint64_t seed = 0; seed < cases(60); ++seed) {
    const Mesh mesh =
        random_surface(seed, {.faces = 150, .special_values = false, .any_position_type = false});
    const auto triangles = triangles_of(mesh);
    const RandomFile file = random_file(mesh, {});
    ASSERT_EQ(file.error, "") << seed;
    const auto source = memory_source(Bytes(file.bytes));
    File open = File::open(*source).value();
    for (unsigned i = 0; i < 10 && !triangles.empty(); ++i) {
      const auto corner = [&] {
        return point_position(mesh.points, triangles[random.below(triangles.size())][0]);
      };
      Vector3 origin = corner() * 2.5 - corner();
      Vector3 direction = corner() - origin;
      if (!(dot(direction, direction) > 0)) continue;
      std::optional<RayHit> nearest;
      for (const auto& t : triangles) {
        const auto hit = ray_hit(origin, direction, point_position(mesh.points, t[0]),
                                 point_position(mesh.points, t[1]), point_position(mesh.points, t[2]));
        if (hit && (!nearest || hit->distance < nearest->distance)) nearest = hit;
      }
      const auto found = open.hit(origin, direction);
      ASSERT_TRUE(found) << found.error().message;
      // A face that starts at another corner is hit, or missed, in other last bits.
      if (!nearest || !*found) continue;
      EXPECT_NEAR((*found)->distance, nearest->distance, 1e-6 * (1 + nearest->distance)) << seed << ' ' << i;
      expect_on_chart(open, **found);
      ++hits;
    }
  }
  EXPECT_GE(hits, cases(60));
}

TEST(RandomFile, MissesAsTheMeshDoes) {
  const Mesh mesh = landscape(30);
  const RandomFile file = random_file(mesh, {}, 16);
  const auto source = memory_source(Bytes(file.bytes));
  File open = File::open(*source).value();
  Random random(9);
  const auto triangles = triangles_of(mesh);
  unsigned hits = 0, misses = 0;
  for (unsigned i = 0; i < 300; ++i) {
    const Vector3 origin{{40 * random.unit() - 5, 40 * random.unit() - 5, 20}};
    const Vector3 direction{{random.unit() - 0.5, random.unit() - 0.5, -1}};
    const bool hit = std::any_of(triangles.begin(), triangles.end(), [&](const auto& t) {
      return ray_hit(origin, direction, point_position(mesh.points, t[0]), point_position(mesh.points, t[1]),
                     point_position(mesh.points, t[2]))
          .has_value();
    });
    EXPECT_EQ(open.hit(origin, direction).value().has_value(), hit) << i;
    (hit ? hits : misses) += 1;
  }
  EXPECT_GE(hits, 10u);
  EXPECT_GE(misses, 10u);
}

TEST(RandomFile, FindsTheNearestPoint) {
  Random random(8);
  unsigned found_points = 0;
  for (uint64_t seed = 0; seed < cases(60); ++seed) {
    const Mesh mesh =
        random_surface(seed, {.faces = 150, .special_values = false, .any_position_type = false});
    const auto triangles = triangles_of(mesh);
    const RandomFile file = random_file(mesh, {});
    ASSERT_EQ(file.error, "") << seed;
    const auto source = memory_source(Bytes(file.bytes));
    File open = File::open(*source).value();
    for (unsigned i = 0; i < 10 && !triangles.empty(); ++i) {
      const auto corner = [&] {
        return point_position(mesh.points, triangles[random.below(triangles.size())][0]);
      };
      const Vector3 point = corner() * 1.5 - corner() * 0.5;
      double least = std::numeric_limits<double>::infinity();
      for (const auto& t : triangles) {
        least = std::min(
            least, squared_distance(point, point_position(mesh.points, t[0]),
                                    point_position(mesh.points, t[1]), point_position(mesh.points, t[2])));
      }
      const auto found = open.nearest(point);
      ASSERT_TRUE(found) << found.error().message;
      ASSERT_TRUE(*found) << seed;
      EXPECT_NEAR((*found)->distance, std::sqrt(least), 1e-6 * (1 + std::sqrt(dot(point, point))))
          << seed << ' ' << i;
      expect_on_chart(open, **found);
      ++found_points;
    }
  }
  EXPECT_GE(found_points, cases(300));
}

TEST(RandomFile, KeepsWithinTheBoundAsked) {
  const Mesh mesh = landscape(large(60));
  const RandomFile file = random_file(mesh, {}, 64);
  const auto source = memory_source(Bytes(file.bytes));
  File open = File::open(*source).value();
  uint64_t last = UINT64_MAX;
  for (const double bound : {0.0, 0.1, 0.3, 1.0, 10.0}) {
    Detail detail;
    detail.bound = bound;
    const Selection selection = open.select({}, detail).value();
    EXPECT_LE(selection.faces, last);
    last = selection.faces;
    const Mesh coarse = open.extract(selection).value();
    const auto triangles = triangles_of(coarse);
    for (uint64_t i = 0; i < mesh.point_count(); i += every(7)) {
      const Vector3 p = point_position(mesh.points, i);
      double least = std::numeric_limits<double>::infinity();
      for (const auto& t : triangles)
        least = std::min(least, squared_distance(p, point_position(coarse.points, t[0]),
                                                 point_position(coarse.points, t[1]),
                                                 point_position(coarse.points, t[2])));
      ASSERT_LE(std::sqrt(least), bound * (1 + 1e-6) + 1e-6) << bound;
    }
  }
}

/// By nothing but the rule that GroupInfo states.
std::vector<ChartPlace> cut_by_groups(File& open, double view_error) {
  std::vector<GroupInfo> groups;
  for (uint32_t g = 0; g < open.groups(); ++g) groups.push_back(open.group(g).value());
  std::vector<uint32_t> replaced(groups.size());
  std::vector<bool> refined(groups.size());
  for (uint32_t g = 0; g < groups.size(); ++g) {
    refined[g] = g == 0 || (groups[g].view_error > view_error && replaced[g] == groups[g].replaces);
    for (const GroupInfo::Chart& chart : groups[g].charts) {
      if (refined[g] && chart.refined_by != GroupInfo::none) ++replaced[chart.refined_by];
    }
  }
  std::vector<ChartPlace> cut;
  for (uint32_t g = 0; g < groups.size(); ++g) {
    for (uint32_t c = 0; refined[g] && c < groups[g].charts.size(); ++c) {
      const uint32_t finer = groups[g].charts[c].refined_by;
      if (finer == GroupInfo::none || !refined[finer]) cut.push_back({g, c});
    }
  }
  return cut;
}

TEST(RandomFile, HasGroupsThatAloneSayWhatMayBeShown) {
  const RandomFile file = random_file(landscape(60), {}, 64);
  const auto source = memory_source(Bytes(file.bytes));
  File open = File::open(*source).value();
  size_t sizes = 0;
  for (const double view_error : {1e9, 0.3, 0.1, 0.03, 0.01, 0.0}) {
    Detail detail;
    detail.view_error = view_error;
    const auto cut = open.select({}, detail).value().charts;
    EXPECT_EQ(cut_by_groups(open, view_error), cut) << view_error;
    sizes += cut.size();
  }
  EXPECT_GT(sizes, 6u);
  EXPECT_EQ(open.group(open.groups()).error().code, ErrorCode::usage);
}

TEST(RandomFile, HasNoChartsThatAreNotThere) {
  const RandomFile file = random_file(landscape(10), {}, 32);
  const auto source = memory_source(Bytes(file.bytes));
  File open = File::open(*source).value();
  for (const ChartPlace place :
       {ChartPlace{0, 1000}, ChartPlace{1000000, 0}, ChartPlace{0xffffffff, 0xffffffff}}) {
    const auto mesh = open.read(place);
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().code, ErrorCode::usage);
    EXPECT_FALSE(open.info(place));
    Selection selection;
    selection.charts = {place};
    EXPECT_FALSE(open.extract(selection));
  }
}

TEST(RandomFile, GivesAnEmptyMeshWhereNothingIs) {
  const Mesh mesh = landscape(10);
  const RandomFile file = random_file(mesh, {}, 32);
  const auto source = memory_source(Bytes(file.bytes));
  File open = File::open(*source).value();
  Region region;
  region.box = Box{{{100, 100, 100}}, {{101, 101, 101}}};
  const Selection selection = open.select(region, Detail::full()).value();
  EXPECT_TRUE(selection.charts.empty());
  EXPECT_EQ(differences_between(clip(mesh, region), open.extract(selection).value()), "");
}

}  // namespace
}  // namespace maille::testing
