#include "surface/fans/shared_fans.h"
#include "support/cases.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "support/coded_mesh.h"
#include "support/half_edges.h"
#include "support/random_mesh.h"
#include "surface/fans/fan_tables.h"

namespace maille::testing {
namespace {

/// Shapes side by side in one array of points, each a patch.
struct Patches {
  std::vector<Mesh> meshes;
  std::vector<std::vector<uint32_t>> points;
  Array array = positions(Scalar::f32, 0);
  ArrayMaps maps;
  std::vector<std::optional<SharedFanPatch>> coded;
  std::vector<std::byte> tables;

  void add(const Surface& shape, double scale) { add(shape, to_mesh(triangulated(shape)), scale); }
  void add_polygons(const Surface& shape, double scale) { add(shape, to_mesh(shape), scale); }
  void add(const Surface& shape, Mesh mesh, double scale) {
    meshes.push_back(std::move(mesh));
    const Array more = smooth(shape, scale);
    std::vector<uint32_t>& numbers = points.emplace_back(shape.points.size());
    std::iota(numbers.begin(), numbers.end(), static_cast<uint32_t>(array.count()));
    array.bytes.insert(array.bytes.end(), more.bytes.begin(), more.bytes.end());
  }
  void encode(const Tolerance& tolerance, int effort = 2) {
    maps = *choose_maps(array, tolerance, true);
    const ArrayToCode to_code{&array, maps};
    ASSERT_TRUE(can_share_tables(to_code));
    SharedFanEncoder encoder;
    for (size_t i = 0; i < meshes.size(); i += 1 + meshes.size() / most_sampled_patches)
      ASSERT_TRUE(encoder.add(meshes[i], points[i], array));
    tables = encoder.finish(maps, effort, range_of_codes(to_code), &array);
    for (size_t i = 0; i < meshes.size(); ++i)
      coded.push_back(*encoder.encode(meshes[i], points[i], to_code));
  }
  /// Thirds of decimals, as doubles.
  void make_thirds() {
    Array doubles = positions(Scalar::f64, array.count());
    for (size_t i = 0; i < 3 * array.count(); ++i)
      doubles.values<double>()[i] = std::round(array.values<float>()[i] * 1e5) / 1e5 / 3;
    array = std::move(doubles);
  }
  uint64_t corners(size_t i) const { return meshes[i].corner_count(); }
  size_t bytes() const {
    size_t sum = tables.size();
    for (const auto& patch : coded) sum += patch->coded.bytes.size() + patch->positions.size();
    return sum;
  }
};

Result<FanPatch> decode(const Patches& patches, size_t i, const SharedFanTables& tables, Bytes fans,
                        Bytes positions_bytes, Array& array) {
  const auto points = static_cast<uint32_t>(patches.meshes[i].point_count());
  auto decoder = tables.fans->polygons
                     ? FanPatchDecoder::begin_shared_polygons(fans, *tables.fans, points, patches.corners(i))
                     : FanPatchDecoder::begin_shared(fans, *tables.fans, points, patches.corners(i));
  if (!decoder) return tl::unexpected(decoder.error());
  if (auto ok = decode_shared_positions(*decoder->fans, positions_bytes, *tables.positions, points, array);
      !ok)
    return tl::unexpected(ok.error());
  const CellBlock& block = patches.meshes[i].blocks[0];
  const BlockShape shape{block.type, block.size()};
  return decoder->finish(std::span(&shape, 1), points, patches.corners(i));
}

void expect_round_trip(const Patches& patches) {
  const auto tables = SharedFanTables::read(patches.tables, patches.array.type);
  ASSERT_TRUE(tables) << tables.error().message;
  for (size_t i = 0; i < patches.meshes.size(); ++i) {
    if (!patches.coded[i]) continue;  // has what no patch of the sample has
    const SharedFanPatch& coded = *patches.coded[i];
    Array array = positions(patches.array.type, 0);
    const auto decoded = decode(patches, i, *tables, coded.coded.bytes, coded.positions, array);
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(decoded->fans.corners, coded.coded.patch.fans.corners);
    EXPECT_EQ(decoded->fans.offsets, coded.coded.patch.fans.offsets);
    Array of_patch = positions(patches.array.type, 0);
    const size_t tuple = patches.array.tuple_size();
    const auto begin = patches.array.bytes.begin() + static_cast<ptrdiff_t>(patches.points[i][0] * tuple);
    of_patch.bytes.assign(begin, begin + static_cast<ptrdiff_t>(patches.points[i].size() * tuple));
    EXPECT_EQ(difference(of_patch, patches.maps, coded.coded.sources.points, array), "") << i;
  }
}

Patches shapes_together(const Tolerance& tolerance, int effort = 2) {
  Patches patches;
  patches.add(shapes::sphere(40, 30), 3);
  patches.add(shapes::torus(30, 20), 1.5);
  patches.add(shapes::grid(20, 30), 2);
  patches.add(shapes::plate(2), 1);
  patches.encode(tolerance, effort);
  return patches;
}

Patches polygons_together(const Tolerance& tolerance, int effort = 2) {
  Patches patches;
  patches.add_polygons(shapes::sphere(40, 30), 3);
  patches.add_polygons(shapes::torus(30, 20), 1.5);
  patches.add_polygons(shapes::grid(20, 30), 2);
  patches.encode(tolerance, effort);
  return patches;
}

TEST(SharedFans, PolygonsComeBackAtAllWidthsAndEfforts) {
  for (const int effort : {1, 2, 5, 9}) {
    for (const Tolerance& tolerance : {Tolerance{}, Tolerance{Tolerance::Kind::bits, 12.0}}) {
      const Patches patches = polygons_together(tolerance, effort);
      for (const auto& coded : patches.coded) EXPECT_TRUE(coded);
      expect_round_trip(patches);
    }
  }
}

TEST(SharedFans, PolygonsWithCopiesAndLooseCellsComeBack) {
  Patches patches;
  RandomMeshOptions options;
  options.faces = 200;
  options.several_blocks = false;
  for (uint64_t seed = 0; seed < 30; ++seed)
    patches.add_polygons(surface_of(random_surface(seed, options)), 1);
  patches.encode({Tolerance::Kind::bits, 12.0});
  expect_round_trip(patches);
}

Patches tori_of_thirds(bool polygons) {
  Patches patches;
  for (uint32_t i = 0; i < 8; ++i) {
    const Surface shape = shapes::torus(20 + i, 15);
    patches.add(shape, to_mesh(polygons ? shape : triangulated(shape)), 1 + 0.1 * i);
  }
  patches.make_thirds();
  patches.encode({});
  return patches;
}

TEST(SharedFans, DoublesNearDecimalsShareTheirCoarseMaps) {
  for (const bool polygons : {false, true}) {
    const Patches patches = tori_of_thirds(polygons);
    for (const auto& coded : patches.coded) EXPECT_TRUE(coded);
    EXPECT_LT(patches.bytes(), patches.array.bytes.size() / 3);  // exact codes take half of what doubles do
    expect_round_trip(patches);
  }
}

TEST(SharedFans, PatchesComeBackAtAllWidthsAndEfforts) {
  for (const int effort : {1, 2, 5, 9}) {
    expect_round_trip(shapes_together({}, effort));
    for (const double bits : {1.0, 12.0, 16.0, 17.0, 24.0})
      expect_round_trip(shapes_together({Tolerance::Kind::bits, bits}, effort));
  }
}

TEST(SharedFans, SmallPatchesFarApartComeBack) {
  Patches patches;
  const Surface shape = shapes::sphere(12, 10);
  for (int i = 0; i < 5; ++i) patches.add(shape, 1);
  auto numbers = patches.array.values<float>();
  for (size_t i = 0; i < numbers.size(); ++i)
    numbers[i] += 1000 * static_cast<float>(i / (3 * shape.points.size()));
  patches.encode({Tolerance::Kind::bits, 24.0});
  expect_round_trip(patches);
}

TEST(SharedFans, ManyPatchesOfWhichSomeAreLearntFromComeBack) {
  Patches patches;
  for (uint32_t i = 0; i < 150; ++i) patches.add(shapes::torus(6 + i % 7, 5 + i % 3), 0.1 * i);
  patches.encode({Tolerance::Kind::bits, 14.0});
  expect_round_trip(patches);
}

TEST(SharedFans, PatchesWithCopiesLooseCellsAndBlocksComeBack) {
  Patches patches;
  RandomMeshOptions options;
  options.faces = 200;
  options.several_blocks = false;
  for (uint64_t seed = 0; seed < 30; ++seed) patches.add(surface_of(random_surface(seed, options)), 1);
  patches.encode({Tolerance::Kind::bits, 12.0});
  expect_round_trip(patches);
}

TEST(SharedFans, TablesWrittenOnceTakeLessThanThoseOfEachPatch) {
  Patches patches;
  for (int i = 0; i < 10; ++i) patches.add(shapes::sphere(20, 15), 1 + i);
  patches.encode({Tolerance::Kind::bits, 12.0});
  size_t alone = 0;
  for (size_t i = 0; i < patches.meshes.size(); ++i) {
    const auto fans = encode_fan_patch(patches.meshes[i]);
    ASSERT_TRUE(fans && *fans);
    std::vector<uint32_t> sources = (*fans)->sources.points;
    for (uint32_t& source : sources) source = patches.points[i][source];
    alone += (*fans)->bytes.size() +
             encode_positions((*fans)->patch.fans, patches.array, patches.maps, sources, {}).size();
  }
  EXPECT_LT(patches.bytes(), alone);
}

TEST(SharedFans, PatchesOfAnotherKindThanTheFirstHaveTheirOwnTables) {
  for (const bool polygons_first : {false, true}) {
    Patches patches;
    const Surface shape = shapes::grid(20, 20);
    for (const bool first : {true, false, true}) {
      if (first == polygons_first) patches.add_polygons(shape, 1);
      if (first != polygons_first) patches.add(shape, 1);
    }
    patches.encode({Tolerance::Kind::bits, 12.0});
    EXPECT_TRUE(patches.coded[0]);
    EXPECT_FALSE(patches.coded[1]);
    EXPECT_TRUE(patches.coded[2]);
    expect_round_trip(patches);
  }
}

TEST(SharedFans, DamageEndsInErrorsOrValidTriangles) {
  const std::vector<Patches> files{shapes_together({}), shapes_together({Tolerance::Kind::bits, 12.0}),
                                   polygons_together({Tolerance::Kind::bits, 12.0}), tori_of_thirds(true)};
  for (uint64_t seed = 0; seed < cases(3000) && !HasFailure(); ++seed) {
    Random random(seed);
    const Patches& file = files[seed % files.size()];
    const size_t i = random.below(static_cast<uint32_t>(file.meshes.size()));
    std::vector<std::byte> table_bytes = file.tables, fans = file.coded[i]->coded.bytes,
                           numbers = file.coded[i]->positions;
    const unsigned which = random.below(3);
    (which == 0   ? table_bytes
     : which == 1 ? fans
                  : numbers) = damaged(which == 0   ? table_bytes
                                       : which == 1 ? fans
                                                    : numbers,
                                       random);
    const Scalar type = file.array.type;
    const auto tables = SharedFanTables::read(table_bytes, type);
    if (!tables) {
      EXPECT_EQ(tables.error().code, ErrorCode::corrupt);
      continue;
    }
    Array array = positions(type, 0);
    const auto decoded = decode(file, i, *tables, fans, numbers, array);
    if (!decoded) {
      EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
      continue;
    }
    EXPECT_EQ(array.count(), file.meshes[i].point_count());
    for (const uint32_t v : decoded->fans.corners) ASSERT_LT(v, decoded->fans.vertices);
  }
}

TEST(SharedFans, EveryTruncationOfAPatchIsAnError) {
  const Patches file = shapes_together({Tolerance::Kind::bits, 12.0});
  const auto tables = SharedFanTables::read(file.tables, Scalar::f32);
  ASSERT_TRUE(tables);
  for (size_t size = 0; size < file.coded[3]->positions.size(); ++size) {
    Array array = positions(Scalar::f32, 0);
    EXPECT_FALSE(decode(file, 3, *tables, file.coded[3]->coded.bytes,
                        Bytes(file.coded[3]->positions).first(size), array));
  }
}

}  // namespace
}  // namespace maille::testing
