#include "surface/fans/fan_positions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "support/coded_mesh.h"
#include "support/half_edges.h"
#include "support/random_mesh.h"
#include "surface/fans/fan_patch.h"

namespace maille::testing {
namespace {

/// Triangles of a shape, coded, and an order of its points.
struct Patch {
  EncodedFanPatch coded;
  const FanSurface& fans() const { return coded.patch.fans; }
  const std::vector<uint32_t>& sources() const { return coded.sources.points; }
};

Patch patch_of(const Surface& shape) {
  auto coded = encode_fan_patch(to_mesh(triangulated(shape)));
  EXPECT_TRUE(coded && *coded);
  return {std::move(**coded)};
}

Result<> decode(const Patch& patch, Bytes bytes, uint32_t points, Array& array) {
  const auto corners = 3 * uint64_t{patch.coded.patch.topology.surface.face_count};
  auto decoder = FanPatchDecoder::begin(patch.coded.bytes, points, corners);
  EXPECT_TRUE(decoder);
  return decode_fan_positions(*decoder->fans, bytes, points, array);
}

std::vector<std::byte> encode(const Patch& patch, const Array& array, const ArrayMaps& maps) {
  EXPECT_TRUE(fits_fan_positions(array, maps));
  return encode_fan_positions(patch.fans(), array, maps, patch.sources());
}

/// Empty when the numbers come back; those of a lattice once they lie on it.
std::string round_trip(const Patch& patch, const Array& array, const Tolerance& tolerance = {}) {
  const auto maps = choose_maps(array, tolerance, true);
  if (!maps) return maps.error().message;
  const auto bytes = encode(patch, array, *maps);
  Array decoded = positions(array.type, 0);
  const auto ok = decode(patch, bytes, static_cast<uint32_t>(patch.sources().size()), decoded);
  if (!ok) return ok.error().message;
  return difference(array, *maps, patch.sources(), decoded);
}

TEST(FanPositions, LatticesOfAllWidthsComeBack) {
  const Surface shape = shapes::sphere(40, 30);
  const Patch patch = patch_of(shape);
  for (const double bits : {1.0, 8.0, 14.0, 16.0, 17.0, 24.0}) {
    EXPECT_EQ(round_trip(patch, smooth(shape, 3), {Tolerance::Kind::bits, bits}), "") << bits;
  }
}

TEST(FanPositions, FloatsComeBackBitForBit) {
  const Surface shape = shapes::torus(30, 20);
  EXPECT_EQ(round_trip(patch_of(shape), smooth(shape, 0.37)), "");
  EXPECT_EQ(round_trip(patch_of(shape), smooth(shape, 1e38)), "");
  EXPECT_EQ(round_trip(patch_of(shape), smooth(shape, 1e-42)), "");
}

TEST(FanPositions, AnyBitsOfFloatsAndIntegersComeBack) {
  const Surface shape = shapes::plate(2);
  const Patch patch = patch_of(shape);
  for (uint64_t seed = 0; seed < 50; ++seed) {
    for (const Scalar type :
         {Scalar::f32, Scalar::i32, Scalar::u32, Scalar::i16, Scalar::u16, Scalar::i8, Scalar::u8}) {
      Random random(seed);
      Array array = positions(type, shape.points.size());
      array.bytes = random_bytes(random, array.bytes.size());
      EXPECT_EQ(round_trip(patch, array), "") << name_of(type);
    }
  }
}

TEST(FanPositions, PointsBesideTheTrianglesComeBack) {
  Surface shape = shapes::grid(5, 5);
  shape.points.resize(5000);
  Patch patch = patch_of(shape);
  Array array = positions(Scalar::i32, 5000);
  std::iota(array.values<int32_t>().begin(), array.values<int32_t>().end(), 0);
  EXPECT_EQ(round_trip(patch, array), "");
  // Nothing but points, and nothing at all.
  shape.faces.clear();
  EXPECT_EQ(round_trip(patch_of(shape), array), "");
  EXPECT_EQ(round_trip(patch_of({}), positions(Scalar::f32, 0)), "");
}

TEST(FanPositions, NumbersOfEightBytesAndLeftOversAreForOthers) {
  const Array wide = positions(Scalar::f64, 3);
  EXPECT_FALSE(fits_fan_positions(wide, *choose_maps(wide, {}, true)));
  Array nan = positions(Scalar::f32, 3);
  nan.values<float>()[0] = std::numeric_limits<float>::infinity();
  nan.values<float>()[3] = 1;
  EXPECT_FALSE(fits_fan_positions(nan, *choose_maps(nan, {Tolerance::Kind::absolute, 0.1}, true)));
}

TEST(FanPositions, SmoothSurfacesCostLessThanNoise) {
  const Surface shape = shapes::sphere(60, 60);
  const Patch patch = patch_of(shape);
  const Array array = smooth(shape, 100);
  Array noise = array;
  Random random(1);
  for (float& x : noise.values<float>()) x = static_cast<float>(random.below(20001)) / 100 - 100;
  const auto size = [&](const Array& a) {
    return encode(patch, a, *choose_maps(a, {Tolerance::Kind::bits, 14.0}, true)).size();
  };
  EXPECT_LT(2 * size(array), size(noise));
}

struct Encoded {
  Patch patch;
  Array array;
  std::vector<std::byte> bytes;
};

std::vector<Encoded> files() {
  std::vector<Encoded> result;
  for (const Tolerance& tolerance : {Tolerance{}, Tolerance{Tolerance::Kind::bits, 12.0}}) {
    Surface shape = shapes::sphere(14, 12);
    shape.points.resize(shape.points.size() + 7);
    Patch patch = patch_of(shape);
    Array array = smooth(shape, 2);
    auto bytes = encode(patch, array, *choose_maps(array, tolerance, true));
    result.push_back({std::move(patch), std::move(array), std::move(bytes)});
  }
  return result;
}

TEST(FanPositions, EveryTruncationIsAnError) {
  for (const Encoded& file : files()) {
    for (size_t size = 0; size < file.bytes.size(); ++size) {
      Array decoded = positions(Scalar::f32, 0);
      const auto ok = decode(file.patch, Bytes(file.bytes).first(size),
                             static_cast<uint32_t>(file.array.count()), decoded);
      ASSERT_FALSE(ok) << size << " of " << file.bytes.size();
      EXPECT_EQ(ok.error().code, ErrorCode::corrupt);
    }
  }
}

TEST(FanPositions, DamageGivesTheRightNumberOfPointsOrAnError) {
  const auto encoded = files();
  for (uint64_t seed = 0; seed < 4000 && !HasFailure(); ++seed) {
    Random random(seed);
    const Encoded& file = encoded[seed % encoded.size()];
    Array decoded = positions(Scalar::f32, 0);
    const auto points = static_cast<uint32_t>(file.array.count()) + random.below(2) * random.below(5000);
    const auto ok = decode(file.patch, damaged(file.bytes, random), points, decoded);
    if (ok) {
      EXPECT_EQ(decoded.count(), points);
    } else {
      EXPECT_EQ(ok.error().code, ErrorCode::corrupt);
    }
  }
}

}  // namespace
}  // namespace maille::testing
