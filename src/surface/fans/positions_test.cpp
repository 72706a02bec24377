#include "surface/fans/positions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "support/cases.h"
#include "support/coded_mesh.h"
#include "support/half_edges.h"
#include "support/random.h"
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
  return decode_positions(*decoder->fans, bytes, points, array);
}

std::vector<std::byte> encode(const Patch& patch, const Array& array, const ArrayMaps& maps,
                              const Effort& effort = effort_of(6)) {
  EXPECT_TRUE(fits_positions(array, maps));
  return encode_positions(patch.fans(), array, maps, patch.sources(), effort);
}

/// Empty when the numbers come back, those of a lattice once they lie on it, whatever the encoder may use.
std::string round_trip(const Patch& patch, const Array& array, const Tolerance& tolerance = {}) {
  const auto maps = choose_maps(array, tolerance, true);
  if (!maps) return maps.error().message;
  for (const Effort& effort : efforts) {
    const auto bytes = encode(patch, array, *maps, effort);
    Array decoded = positions(array.type, 0);
    const auto ok = decode(patch, bytes, static_cast<uint32_t>(patch.sources().size()), decoded);
    if (!ok) return ok.error().message;
    const std::string other = difference(array, *maps, patch.sources(), decoded);
    if (!other.empty()) return other;
  }
  return "";
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

TEST(Positions, LatticesOfAllWidthsComeBack) {
  const Surface shape = shapes::sphere(40, 30);
  const Patch patch = patch_of(shape);
  for (const double bits : {1.0, 8.0, 14.0, 16.0, 17.0, 20.0, 21.0, 24.0})
    EXPECT_EQ(round_trip(patch, smooth(shape, 3), {Tolerance::Kind::bits, bits}), "") << bits;
}

TEST(Positions, FloatsComeBackBitForBit) {
  const Surface shape = shapes::torus(30, 20);
  for (const double scale : {0.37, 1e38, 1e-42})
    EXPECT_EQ(round_trip(patch_of(shape), smooth(shape, scale)), "") << scale;
}

TEST(Positions, AnyBitsOfFloatsAndIntegersComeBack) {
  const Surface shape = shapes::plate(2);
  const Patch patch = patch_of(shape);
  for (uint64_t seed = 0; seed < cases(50); ++seed) {
    for (const Scalar type : {Scalar::f64, Scalar::i64, Scalar::u64, Scalar::f32, Scalar::i32, Scalar::u32,
                              Scalar::i16, Scalar::u16, Scalar::i8, Scalar::u8}) {
      Random random(seed);
      Array array = positions(type, shape.points.size());
      array.bytes = random_bytes(random, array.bytes.size());
      EXPECT_EQ(round_trip(patch, array), "") << name_of(type) << " seed " << seed;
    }
  }
}

TEST(Positions, NumbersThatALatticeCannotHoldComeBack) {
  const Surface shape = shapes::sphere(20, 15);
  Array array = smooth(shape, 1);
  array.values<float>()[0] = std::numeric_limits<float>::infinity();
  array.values<float>()[100] = std::numeric_limits<float>::quiet_NaN();
  const auto maps = choose_maps(array, {Tolerance::Kind::absolute, 0.01}, true);
  ASSERT_TRUE(maps);
  ASSERT_EQ(maps->exceptions.size(), 2u);
  EXPECT_EQ(round_trip(patch_of(shape), array, {Tolerance::Kind::absolute, 0.01}), "");
}

Array as_doubles(Array floats) {
  Array array = positions(Scalar::f64, floats.count());
  for (size_t i = 0; i < 3 * floats.count(); ++i)
    array.values<double>()[i] = double{floats.values<float>()[i]};
  return array;
}

TEST(Positions, DoublesComeBackBitForBitAndCostWhatFloatsCost) {
  const Surface shape = shapes::sphere(60, 60);
  const Patch patch = patch_of(shape);
  const Array floats = smooth(shape, 0.37), doubles = as_doubles(floats);
  EXPECT_EQ(round_trip(patch, doubles), "");
  const auto size = [&](const Array& a) { return encode(patch, a, *choose_maps(a, {}, true)).size(); };
  EXPECT_LE(100 * size(doubles), 101 * size(floats));
  // Thirds of them: a coarse map, and details.
  Array thirds = doubles;
  for (double& x : thirds.values<double>()) x = std::floor(x * 1000) / 3000;
  EXPECT_EQ(round_trip(patch, thirds), "");
}

TEST(Positions, ValuesThatComeAgainComeBack) {
  for (const Surface& shape : {shapes::sphere(80, 60), shapes::grid(50, 40), shapes::torus(60, 50)})
    EXPECT_EQ(round_trip(patch_of(shape), levelled(shape)), "");
}

/// A rolling plane with disordered points, `tilted` out of the plane of two axes.
Array ground(const Array& flat, bool tilted) {
  Array points = flat;
  const auto xyz = points.values<float>();
  Random random(5);
  for (size_t i = 0; i < points.count(); ++i) {
    const double u = xyz[3 * i] + 0.02 * random.unit(), v = xyz[3 * i + 1] + 0.02 * random.unit();
    const double w = 0.001 * std::sin(9 * u);
    xyz[3 * i] = static_cast<float>(tilted ? 0.36 * u + 0.48 * v - 0.8 * w : u);
    xyz[3 * i + 1] = static_cast<float>(tilted ? -0.8 * u + 0.6 * v : v);
    xyz[3 * i + 2] = static_cast<float>(tilted ? 0.48 * u + 0.64 * v + 0.6 * w : w);
  }
  return points;
}

TEST(Positions, TiltedGroundCostsLittleMoreThanLevelGround) {
  const Surface shape = shapes::grid(60, 60);
  const Patch patch = patch_of(shape);
  const Array flat = to_mesh(triangulated(shape)).points;
  const auto size = [&](bool tilted) {
    const Array array = ground(flat, tilted);
    EXPECT_EQ(round_trip(patch, array, {Tolerance::Kind::absolute, 1e-5}), "");
    const auto maps = choose_maps(array, {Tolerance::Kind::absolute, 1e-5}, true);
    return encode(patch, array, *maps).size();
  };
  EXPECT_LT(static_cast<double>(size(true)), 1.05 * static_cast<double>(size(false)));
}

TEST(Positions, PointsBesideTheTrianglesComeBack) {
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

TEST(Positions, AnySoupComesBack) {
  RandomMeshOptions options;
  options.arrays = options.several_blocks = false;
  for (uint64_t seed = 0; seed < cases(300); ++seed) {
    options.faces = seed % 7 == 0 ? 600 : 60;
    const Surface shape = surface_of(random_surface(seed, options));
    const Patch patch = patch_of(shape);
    if (patch.sources().size() != shape.points.size()) continue;
    ASSERT_EQ(round_trip(patch, smooth(shape, 1), {Tolerance::Kind::bits, 12.0}), "") << "seed " << seed;
  }
}

TEST(Positions, SmoothSurfacesCostLessThanNoise) {
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
  const auto add = [&](const Surface& shape, const Array& array, const Tolerance& tolerance) {
    Patch patch = patch_of(shape);
    auto bytes = encode(patch, array, *choose_maps(array, tolerance, true));
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

TEST(Positions, EveryTruncationIsAnError) {
  for (const Encoded& file : files()) {
    for (size_t size = 0; size < file.bytes.size(); size += every(1)) {
      Array decoded = positions(file.array.type, 0);
      const auto ok = decode(file.patch, Bytes(file.bytes).first(size),
                             static_cast<uint32_t>(file.array.count()), decoded);
      ASSERT_FALSE(ok) << size << " of " << file.bytes.size();
      EXPECT_EQ(ok.error().code, ErrorCode::corrupt);
    }
  }
}

TEST(Positions, DamageGivesTheRightNumberOfPointsOrAnError) {
  const auto encoded = files();
  for (uint64_t seed = 0; seed < cases(4000) && !HasFailure(); ++seed) {
    Random random(seed);
    const Encoded& file = encoded[seed % encoded.size()];
    Array decoded = positions(file.array.type, 0);
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
