#include "surface/fans/shared_fans.h"
#include "support/cases.h"

#include <gtest/gtest.h>

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

  void add(const Surface& shape, double scale) {
    meshes.push_back(to_mesh(triangulated(shape)));
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
  auto decoder = FanPatchDecoder::begin_shared(fans, *tables.fans, points, patches.corners(i));
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

TEST(SharedFans, PolygonsAreForOthers) {
  const Array array = smooth(shapes::grid(2, 2), 1);
  const ArrayToCode to_code{&array, *choose_maps(array, {}, true)};
  SharedFanEncoder encoder;
  std::vector<uint32_t> points(array.count());
  std::iota(points.begin(), points.end(), 0u);
  const Mesh mesh = to_mesh(shapes::grid(2, 2));
  ASSERT_TRUE(encoder.add(mesh, points, array));
  EXPECT_TRUE(encoder.finish(to_code.maps, 2, range_of_codes(to_code)).empty());
  EXPECT_FALSE(*encoder.encode(mesh, points, to_code));
}

TEST(SharedFans, DamageEndsInErrorsOrValidTriangles) {
  const std::vector<Patches> files{shapes_together({}), shapes_together({Tolerance::Kind::bits, 12.0})};
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
    const auto tables = SharedFanTables::read(table_bytes, Scalar::f32);
    if (!tables) {
      EXPECT_EQ(tables.error().code, ErrorCode::corrupt);
      continue;
    }
    Array array = positions(Scalar::f32, 0);
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
