#include "surface/front/mixed_array.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "support/cases.h"
#include "support/half_edges.h"
#include "support/random_arrays.h"
#include "support/random_mesh.h"
#include "surface/patch_topology.h"

namespace maille::testing {
namespace {

struct Patch {
  Mesh mesh;
  EncodedTopology encoded;

  explicit Patch(Mesh from) : mesh(std::move(from)) {
    auto topology = encode_topology(mesh);
    EXPECT_TRUE(topology) << topology.error().message;
    if (topology) encoded = std::move(*topology);
  }
  PatchElements elements() const { return encoded.topology.elements(); }
};

std::vector<std::byte> encode(const Patch& patch, const Array& array, const Tolerance& tolerance = {},
                              bool mixed = true) {
  const auto maps = choose_maps(array, tolerance, true);
  EXPECT_TRUE(maps) << maps.error().message;
  return encode_array(patch.elements(), array, *maps, patch.encoded.sources.points, mixed);
}

Result<Array> decode(const Patch& patch, const Array& like, Bytes bytes) {
  Array array = make_array(like.name, like.domain, like.type, like.components, like.role);
  const auto done = decode_array(patch.elements(), bytes, 0, array);
  if (!done) return tl::unexpected(done.error());
  return array;
}

/// What is wrong with a lossless round trip.
std::string round_trip(const Patch& patch, const Array& array, bool mixed = true) {
  const auto decoded = decode(patch, array, encode(patch, array, {}, mixed));
  if (!decoded) return decoded.error().message;
  const auto& sources = patch.encoded.sources.points;
  const size_t size = array.tuple_size();
  if (decoded->bytes.size() != sources.size() * size) return "another number of tuples";
  for (size_t i = 0; i < sources.size(); ++i) {
    if (std::memcmp(&decoded->bytes[i * size], &array.bytes[sources[i] * size], size) != 0)
      return "point " + std::to_string(sources[i]) + " is another one";
  }
  return {};
}

TEST(MixedArray, EveryTypeComesBack) {
  const Patch patch(random_surface(3, {.faces = 60, .other_cells = true}));
  for (unsigned type = 0; type < scalar_count; ++type) {
    for (uint64_t seed = 0; seed < cases(24) || seed < 3; ++seed) {
      Random random(seed);
      Array array = make_array("values", Domain::point, static_cast<Scalar>(type), 3);
      array.resize(patch.mesh.point_count());
      // Any bits, few different values, special values.
      for (size_t i = 0; i < array.bytes.size(); ++i)
        array.bytes[i] = static_cast<std::byte>(seed % 3 == 0 ? random.below(256) : i / 24 % 2 * 67);
      if (seed % 3 == 2) sprinkle_special_values(array, random, 30);
      ASSERT_EQ(round_trip(patch, array), "") << name_of(array.type) << ", seed " << seed;
    }
  }
}

TEST(MixedArray, PositionsOfRandomMeshesComeBack) {
  for (uint64_t seed = 0; seed < cases(150); ++seed) {
    const Patch patch(random_surface(seed, {.faces = 60, .other_cells = true}));
    ASSERT_EQ(round_trip(patch, patch.mesh.points), "") << seed;
  }
}

TEST(MixedArray, NumbersAtTheEndsOfTheirTypesComeBack) {
  const Patch patch(torus(12, 9));
  for (const Scalar type : {Scalar::i32, Scalar::u32, Scalar::i64, Scalar::f32, Scalar::f64}) {
    Array array = make_array("values", Domain::point, type, 3);
    array.resize(patch.mesh.point_count());
    for (size_t i = 0; i < array.bytes.size(); ++i)
      array.bytes[i] = static_cast<std::byte>(i / size_of(type) % 5 < 2 ? 0xff
                                              : i % size_of(type) == 0  ? 1
                                                                        : 0x7f);
    EXPECT_EQ(round_trip(patch, array), "") << name_of(type);
  }
}

TEST(MixedArray, InfinitiesAndNoNumbersBesideALatticeComeBack) {
  const Patch patch(torus(12, 9));
  Array array = patch.mesh.points;
  const auto values = array.values<float>();
  values[5] = std::numeric_limits<float>::infinity();
  values[9] = std::numeric_limits<float>::quiet_NaN();
  const auto decoded = decode(patch, array, encode(patch, array, {Tolerance::Kind::absolute, 0.01}));
  ASSERT_TRUE(decoded) << decoded.error().message;
  const auto& sources = patch.encoded.sources.points;
  for (size_t i = 0; i < sources.size(); ++i) {
    for (size_t k = 0; k < 3; ++k) {
      const float before = values[3 * sources[i] + k], after = decoded->values<float>()[3 * i + k];
      if (std::isfinite(before)) {
        EXPECT_LE(std::abs(before - after), 0.01F);
      } else {
        EXPECT_EQ(bits_as<uint32_t>(before), bits_as<uint32_t>(after));
      }
    }
  }
}

TEST(MixedArray, IsSmallerThanTheDefaultLevel) {
  const Patch patch(sphere(60, 50));
  for (const Tolerance& tolerance : {Tolerance{}, Tolerance{Tolerance::Kind::bits, 12}}) {
    EXPECT_LT(encode(patch, patch.mesh.points, tolerance, true).size(),
              encode(patch, patch.mesh.points, tolerance, false).size());
  }
}

/// A sphere whose points lie on edges of a lattice, as an iso-surface's: two coordinates of each on its
/// planes.
Array on_lattice_edges(const Mesh& mesh) {
  Array array = make_array("values", Domain::point, Scalar::i32, 3);
  array.resize(mesh.point_count());
  const auto from = mesh.points.values<float>();
  const auto to = array.values<int32_t>();
  Random random(1);
  for (size_t i = 0; i < to.size(); ++i) {
    const auto fine =
        static_cast<int32_t>(std::lround(from[i] * 20000)) + static_cast<int32_t>(random.below(600));
    const bool free = i / 3 % 7 % 3 == i % 3;
    to[i] = free ? fine : static_cast<int32_t>(std::lround(fine / 640.0)) * 640;
  }
  return array;
}

TEST(MixedArray, LevelsOfAnAxisAreFound) {
  const Patch patch(sphere(90, 80));
  const Array array = on_lattice_edges(patch.mesh);
  EXPECT_EQ(round_trip(patch, array), "");
  // Centre, then flags: with matches and levels.
  const auto bytes = encode(patch, array);
  const std::array<std::byte, 2> with_levels = {std::byte{1}, std::byte{3}};
  EXPECT_NE(std::search(bytes.begin(), bytes.begin() + 64, with_levels.begin(), with_levels.end()),
            bytes.begin() + 64);
}

TEST(MixedArray, DamagedLevelsGiveTheRightNumberOfTuplesOrAnError) {
  const Patch patch(sphere(90, 80));  // as above: with levels
  const Array array = on_lattice_edges(patch.mesh);
  const auto bytes = encode(patch, array);
  for (uint64_t seed = 0; seed < cases(40); ++seed) {
    Random random(seed);
    const auto decoded = decode(patch, array, damaged(bytes, random));
    if (!decoded) continue;
    EXPECT_EQ(decoded->bytes.size(), patch.encoded.sources.points.size() * array.tuple_size()) << seed;
  }
}

TEST(MixedArray, EveryTruncationIsAnError) {
  const Patch patch(random_surface(5, {.faces = 60}));
  const auto bytes = encode(patch, patch.mesh.points);
  for (size_t size = 0; size < bytes.size(); ++size) {
    const auto decoded = decode(patch, patch.mesh.points, Bytes(bytes).first(size));
    ASSERT_FALSE(decoded) << size << " of " << bytes.size();
    EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
  }
}

TEST(MixedArray, DamageGivesTheRightNumberOfTuplesOrAnError) {
  for (uint64_t seed = 0; seed < cases(500); ++seed) {
    Random random(seed);
    const Patch patch(random_surface(seed % 40, {.faces = 40, .other_cells = true}));
    Array array = make_array("values", Domain::point, static_cast<Scalar>(random.below(scalar_count)), 3);
    array.resize(patch.mesh.point_count());
    sprinkle_special_values(array, random, 30);
    const bool lossy = random.chance(50);
    const auto bytes = encode(patch, array, lossy ? Tolerance{Tolerance::Kind::bits, 7} : Tolerance{});
    const auto decoded = decode(patch, array, damaged(bytes, random));
    if (!decoded) {
      EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
    } else {
      EXPECT_EQ(decoded->bytes.size(), patch.encoded.sources.points.size() * array.tuple_size()) << seed;
    }
  }
}

float on_grid(double x) {
  return static_cast<float>(std::round(x * 4096) / 4096);
}

/// A rough torus, of which one side of `middle` is the image of the other, but for every `irregular`th point.
/// `salt`: for another roughness on the other side.
Mesh mirrored_torus(unsigned irregular, float middle, double salt = 0) {
  Mesh mesh = torus(40, 24);
  const auto values = mesh.points.values<float>();
  for (size_t i = 0; i < values.size(); i += 3) {
    for (unsigned k = 0; k < 3; ++k) values[i + k] = on_grid(static_cast<double>(values[i + k]));
    const double x = static_cast<double>(values[i]), y = static_cast<double>(values[i + 1]),
                 z = static_cast<double>(values[i + 2]);
    const double rough = std::sin(12345 * (std::fabs(x) + 3 * y + 7 * z) + (x < 0 ? salt : 0));
    values[i] = on_grid(x) + middle;
    values[i + 1] = on_grid(y + 0.05 * rough);
    if (irregular > 0 && i / 3 % irregular == 0) values[i + 2] += 0.0625F;
  }
  return mesh;
}

TEST(MixedArray, ImagesInAPlaneSaveTheRoughnessOfTheOtherHalf) {
  for (const float middle : {0.0F, 3.0F}) {
    const Patch mirrored(mirrored_torus(0, middle));
    const Patch other(mirrored_torus(0, middle, 1));
    EXPECT_EQ(round_trip(mirrored, mirrored.mesh.points), "");
    // Half of the points have images; learning that costs something in so small a mesh.
    EXPECT_LT(encode(mirrored, mirrored.mesh.points).size() * 5, encode(other, other.mesh.points).size() * 4);
  }
}

TEST(MixedArray, ImagesThatAreNoneComeBack) {
  for (const unsigned irregular : {1u, 2u, 3u, 7u, 50u}) {
    const Patch patch(mirrored_torus(irregular, 0));
    ASSERT_EQ(round_trip(patch, patch.mesh.points), "") << irregular;
    for (const Scalar type : {Scalar::f64, Scalar::i16, Scalar::i64}) {
      Array array = make_array("values", Domain::point, type, 3);
      array.resize(patch.mesh.point_count());
      const auto from = patch.mesh.points.values<float>();
      for (size_t i = 0; i < from.size(); ++i) {
        const double value = static_cast<double>(from[i]);
        if (type == Scalar::f64) array.values<double>()[i] = value;
        if (type == Scalar::i16) array.values<int16_t>()[i] = static_cast<int16_t>(value * 1024);
        if (type == Scalar::i64) array.values<int64_t>()[i] = static_cast<int64_t>(value * 1e15) * 512;
      }
      ASSERT_EQ(round_trip(patch, array), "") << irregular << ", " << name_of(type);
    }
  }
}

TEST(MixedArray, PlanesBeyondAllRangeAreRefusedOrDecoded) {
  const Patch patch(mirrored_torus(0, 0));
  const auto bytes = encode(patch, patch.mesh.points, {Tolerance::Kind::bits, 12});
  for (size_t i = 0; i < 160; ++i) {
    for (const int value : {0, 0x7f, 0x80, 0xff}) {
      auto damaged = bytes;
      damaged[i] = static_cast<std::byte>(value);
      (void)decode(patch, patch.mesh.points, damaged);  // no crash, no overflow
    }
  }
}

}  // namespace
}  // namespace maille::testing
