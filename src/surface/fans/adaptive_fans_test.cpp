#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numeric>

#include "support/cases.h"
#include "support/coded_mesh.h"
#include "support/half_edges.h"
#include "support/random_mesh.h"
#include "surface/fans/adaptive_positions.h"
#include "surface/fans/fan_patch.h"

namespace maille::testing {
namespace {

struct Patch {
  EncodedFanPatch coded;
  uint64_t corners() const { return 3 * uint64_t{coded.patch.topology.surface.face_count}; }
  uint32_t points() const { return coded.patch.topology.points; }
};

Patch patch_of(const Surface& shape) {
  auto coded = encode_fan_patch(to_mesh(triangulated(shape)));
  EXPECT_TRUE(coded && *coded);
  return {std::move(**coded)};
}

Result<FanPatchDecoder> fans_of(const Patch& patch, Bytes bytes) {
  auto decoder = FanPatchDecoder::begin(bytes, patch.points(), patch.corners());
  if (!decoder) return decoder;
  const auto decoded = decoder->decode_fans_first();
  if (!decoded) return tl::unexpected(decoded.error());
  return decoder;
}

/// Empty when fans and numbers come back; those of a lattice once they lie on it.
std::string round_trip(const Patch& patch, const Array& array, const Tolerance& tolerance = {}) {
  auto decoder = fans_of(patch, patch.coded.bytes);
  if (!decoder) return decoder.error().message;
  const FanSurface& fans = decoder->all_fans;
  const FanSurface& before = patch.coded.patch.fans;
  if (fans.kinds != before.kinds || fans.valences != before.valences) return "other kinds or valences";
  for (uint32_t v = 0; v < fans.vertices; ++v) {
    if (fans.references[v].at != before.references[v].at) return "other references";
  }
  const auto maps = choose_maps(array, tolerance, true);
  if (!maps) return maps.error().message;
  const std::vector<uint32_t>& sources = patch.coded.sources.points;
  const auto bytes = encode_adaptive_positions(before, array, *maps, sources);
  Array decoded = positions(array.type, 0);
  const auto ok = decode_adaptive_positions(fans, bytes, patch.points(), decoded);
  if (!ok) return ok.error().message;
  return difference(array, *maps, sources, decoded);
}

/// Few values on each axis, but for one number in seven.
Array levelled(const Surface& shape) {
  Array array = positions(Scalar::i32, shape.points.size());
  auto values = array.values<int32_t>();
  for (size_t i = 0; i < values.size(); ++i) {
    const auto place = static_cast<int32_t>(1000 * shape.points[i / 3][i % 3]);
    values[i] = i % 7 == 0 ? place : place / 100 * 100 + place / 700;
  }
  return array;
}

TEST(AdaptiveFans, AnySoupComesBack) {
  RandomMeshOptions options;
  options.arrays = options.several_blocks = false;
  for (uint64_t seed = 0; seed < cases(600); ++seed) {
    options.faces = seed % 7 == 0 ? 600 : 60;
    const Surface shape = surface_of(random_surface(seed, options));
    const Patch patch = patch_of(shape);
    ASSERT_EQ(round_trip(patch, smooth(shape, 1), {Tolerance::Kind::bits, 12.0}), "") << "seed " << seed;
  }
}

TEST(AdaptivePositions, LatticesOfAllWidthsComeBack) {
  const Surface shape = shapes::sphere(40, 30);
  const Patch patch = patch_of(shape);
  for (const double bits : {1.0, 8.0, 14.0, 17.0, 24.0}) {
    EXPECT_EQ(round_trip(patch, smooth(shape, 3), {Tolerance::Kind::bits, bits}), "") << bits;
  }
}

TEST(AdaptivePositions, FloatsComeBackBitForBit) {
  const Surface shape = shapes::torus(30, 20);
  for (const double scale : {0.37, 1e38, 1e-42})
    EXPECT_EQ(round_trip(patch_of(shape), smooth(shape, scale)), "") << scale;
}

TEST(AdaptivePositions, AnyBitsOfFloatsAndIntegersComeBack) {
  const Surface shape = shapes::plate(2);
  const Patch patch = patch_of(shape);
  for (uint64_t seed = 0; seed < cases(50); ++seed) {
    for (const Scalar type :
         {Scalar::f32, Scalar::i32, Scalar::u32, Scalar::i16, Scalar::u16, Scalar::i8, Scalar::u8}) {
      Random random(seed);
      Array array = positions(type, shape.points.size());
      array.bytes = random_bytes(random, array.bytes.size());
      EXPECT_EQ(round_trip(patch, array), "") << name_of(type);
    }
  }
}

TEST(AdaptivePositions, ValuesThatComeAgainComeBack) {
  for (const Surface& shape : {shapes::sphere(80, 60), shapes::grid(50, 40), shapes::torus(60, 50)})
    EXPECT_EQ(round_trip(patch_of(shape), levelled(shape)), "");
}

TEST(AdaptivePositions, PointsBesideTheTrianglesComeBack) {
  Surface shape = shapes::grid(5, 5);
  shape.points.resize(5000);
  Array array = positions(Scalar::i32, 5000);
  std::iota(array.values<int32_t>().begin(), array.values<int32_t>().end(), 0);
  EXPECT_EQ(round_trip(patch_of(shape), array), "");
  // Nothing but points, and nothing at all.
  shape.faces.clear();
  EXPECT_EQ(round_trip(patch_of(shape), array), "");
  EXPECT_EQ(round_trip(patch_of({}), positions(Scalar::f32, 0)), "");
}

struct Encoded {
  Patch patch;
  Array array;
  std::vector<std::byte> bytes;
};

std::vector<Encoded> files() {
  std::vector<Encoded> result;
  const auto add = [&](const Surface& shape, const Array& array, const Tolerance& tolerance) {
    Patch patch = patch_of(shape);
    auto bytes = encode_adaptive_positions(patch.coded.patch.fans, array,
                                           *choose_maps(array, tolerance, true), patch.coded.sources.points);
    result.push_back({std::move(patch), array, std::move(bytes)});
  };
  Surface shape = shapes::sphere(14, 12);
  shape.points.resize(shape.points.size() + 7);
  add(shape, smooth(shape, 2), {});
  add(shape, smooth(shape, 2), {Tolerance::Kind::bits, 12.0});
  const Surface large = shapes::torus(30, 20);
  add(large, levelled(large), {});
  return result;
}

Result<> decode(const Encoded& file, Bytes bytes, uint32_t points, Array& decoded) {
  auto fans = fans_of(file.patch, file.patch.coded.bytes);
  EXPECT_TRUE(fans);
  return decode_adaptive_positions(fans->all_fans, bytes, points, decoded);
}

TEST(AdaptivePositions, EveryTruncationIsAnError) {
  for (const Encoded& file : files()) {
    for (size_t size = 0; size < file.bytes.size(); size += every(1)) {
      Array decoded = positions(file.array.type, 0);
      const auto ok =
          decode(file, Bytes(file.bytes).first(size), static_cast<uint32_t>(file.array.count()), decoded);
      ASSERT_FALSE(ok) << size << " of " << file.bytes.size();
      EXPECT_EQ(ok.error().code, ErrorCode::corrupt);
    }
  }
}

TEST(AdaptivePositions, DamageGivesTheRightNumberOfPointsOrAnError) {
  const auto encoded = files();
  for (uint64_t seed = 0; seed < cases(3000) && !HasFailure(); ++seed) {
    Random random(seed);
    const Encoded& file = encoded[seed % encoded.size()];
    Array decoded = positions(file.array.type, 0);
    const auto points = static_cast<uint32_t>(file.array.count()) + random.below(2) * random.below(5000);
    const auto ok = decode(file, damaged(file.bytes, random), points, decoded);
    if (ok) {
      EXPECT_EQ(decoded.count(), points);
    } else {
      EXPECT_EQ(ok.error().code, ErrorCode::corrupt);
    }
  }
}

TEST(AdaptiveFans, EveryTruncationIsAnError) {
  for (const Surface& shape : {shapes::sphere(14, 12), shapes::plate(3), shapes::book(9)}) {
    const Patch patch = patch_of(shape);
    for (size_t size = 0; size < patch.coded.bytes.size(); size += every(1)) {
      const auto decoded = fans_of(patch, Bytes(patch.coded.bytes).first(size));
      ASSERT_FALSE(decoded) << size;
      EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
    }
  }
}

TEST(AdaptiveFans, DamageEndsInErrorsOrValidTriangles) {
  std::vector<Patch> patches;
  RandomMeshOptions options;
  options.faces = 300;
  options.several_blocks = false;
  for (uint64_t seed = 0; seed < 20; ++seed)
    patches.push_back(patch_of(surface_of(random_surface(seed, options))));
  for (uint64_t seed = 0; seed < 2000 && !HasFailure(); ++seed) {
    Random random(seed);
    const Patch& patch = patches[random.below(patches.size())];
    const auto decoded = fans_of(patch, damaged(patch.coded.bytes, random));
    if (!decoded) {
      EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
      continue;
    }
    const FanSurface& fans = decoded->all_fans;
    EXPECT_LE(fans.vertices, patch.points());
    for (const uint32_t v : fans.corners) ASSERT_LT(v, fans.vertices);
    for (uint32_t v = 0; v < fans.vertices; ++v) {
      for (const uint32_t r : fans.references[v].at) ASSERT_LE(r, v);
    }
  }
}

}  // namespace
}  // namespace maille::testing
