#include "surface/arrays/array_coder.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "base/bytes.h"
#include "support/cases.h"
#include "support/coded_mesh.h"
#include "support/half_edges.h"
#include "support/random_arrays.h"
#include "support/random_mesh.h"
#include "surface/arrays/surface_normals.h"

namespace maille::testing {
namespace {

ArrayMaps maps_of(const Array& array, const Tolerance& tolerance = {}) {
  const auto maps = choose_maps(array, tolerance, false);
  EXPECT_TRUE(maps) << maps.error().message;
  return maps ? *maps : ArrayMaps{};
}

std::vector<std::byte> encode(const CodedMesh& patch, const Array& array, const ArrayMaps& maps,
                              bool mixed = false) {
  return encode_array(patch.elements(), array, maps, patch.sources(array), mixed);
}

Result<Array> decode(const CodedMesh& patch, const Array& like, Bytes bytes) {
  Array array = make_array(like.name, like.domain, like.type, like.components, like.role);
  const auto done = decode_array(patch.elements(), bytes, like.count(), array);
  if (!done) return tl::unexpected(done.error());
  return array;
}

/// What is wrong with a decoded array, whose tuples are in coded order.
std::string difference(const CodedMesh& patch, const Array& array, const Array& decoded) {
  const auto sources = patch.sources(array);
  const size_t size = array.tuple_size();
  if (decoded.bytes.size() != sources.size() * size) return "another number of tuples";
  for (size_t i = 0; i < sources.size(); ++i) {
    if (sources[i] == none) continue;
    if (std::memcmp(decoded.bytes.data() + i * size, array.bytes.data() + sources[i] * size, size) != 0) {
      return "tuple " + std::to_string(sources[i]) + " is another one";
    }
  }
  return {};
}

std::string round_trip(const CodedMesh& patch, const Array& array, bool mixed = false) {
  const auto decoded = decode(patch, array, encode(patch, array, maps_of(array), mixed));
  return decoded ? difference(patch, array, *decoded) : decoded.error().message;
}

Array random_array(Random& random, const Mesh& mesh, Domain domain, Scalar type, uint32_t components) {
  Array array = make_array("values", domain, type, components);
  if (components == 3 && random.chance(50)) array.role = Role::normal;
  array.resize(domain == Domain::mesh ? random.below(20) : mesh.count_of(domain));
  // Bits at random, few different values, or what is left after special ones are sprinkled over zeros.
  const uint32_t kind = random.below(3);
  const auto values = random_bytes(random, 3 * array.tuple_size());
  for (size_t i = 0; i < array.bytes.size(); ++i) {
    const std::byte any = static_cast<std::byte>(random.below(256));
    if (kind == 0) array.bytes[i] = any;
    if (kind == 1)
      array.bytes[i] = values[i / array.tuple_size() / 4 % 3 * array.tuple_size() + i % array.tuple_size()];
  }
  if (kind == 2) sprinkle_special_values(array, random, 30);
  return array;
}

CodedMesh mixed_patch() {
  Surface surface = shapes::plate(1);
  append(surface, shapes::moebius(6, 2));
  append(surface, shapes::fan(5, false));
  surface.faces.push_back({0, 1, 0});  // loose cells
  surface.faces.push_back({3, 4});
  surface.points.push_back({1, 2, 3});
  return CodedMesh(to_mesh(surface));
}

TEST(ArrayCoder, EveryTypeComesBackInEveryDomain) {
  const CodedMesh patch = mixed_patch();
  for (unsigned type = 0; type < scalar_count; ++type) {
    for (unsigned domain = 0; domain < domain_count; ++domain) {
      for (uint64_t seed = 0; seed < 3 || seed < cases(6); ++seed) {
        Random random(seed);
        const Array array = random_array(random, patch.mesh, static_cast<Domain>(domain),
                                         static_cast<Scalar>(type), random.between(1, 5));
        ASSERT_EQ(round_trip(patch, array), "")
            << name_of(array.type) << " on " << name_of(array.domain) << ", seed " << seed;
      }
    }
  }
}

TEST(ArrayCoder, TuplesOfUpToTwentyNumbersComeBack) {
  const CodedMesh patch = mixed_patch();
  for (uint32_t components = 1; components <= 20; ++components) {
    for (const Scalar type : {Scalar::u8, Scalar::f32, Scalar::f64, Scalar::i64}) {
      Random random(components);
      const Array array =
          random_array(random, patch.mesh, static_cast<Domain>(components % 3), type, components);
      ASSERT_EQ(round_trip(patch, array), "") << name_of(type) << " x " << components;
    }
  }
}

TEST(ArrayCoder, ArraysOfRandomMeshesComeBack) {
  for (uint64_t seed = 0; seed < cases(150); ++seed) {
    const CodedMesh patch(random_surface(seed, {.faces = 40, .other_cells = true}));
    ASSERT_EQ(round_trip(patch, patch.mesh.points), "") << seed;
    for (const Array& array : patch.mesh.arrays)
      ASSERT_EQ(round_trip(patch, array), "") << seed << " " << array.name;
  }
}

TEST(ArrayCoder, WorksWithoutElements) {
  const CodedMesh patch{Mesh{}};
  for (unsigned domain = 0; domain < domain_count; ++domain) {
    for (const bool mixed : {false, true}) {
      EXPECT_EQ(round_trip(patch, make_array("none", static_cast<Domain>(domain), Scalar::f32, 3), mixed),
                "");
    }
  }
}

TEST(ArrayCoder, NumbersBesideALatticeComeBackBitForBit) {
  const CodedMesh patch(grid(9, 7));
  for (const Domain domain : {Domain::point, Domain::cell, Domain::corner, Domain::mesh}) {
    Array array = make_array("values", domain, Scalar::f32, 2);
    array.resize(domain == Domain::mesh ? 12 : patch.mesh.count_of(domain));
    const auto values = array.values<float>();
    for (size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i % 13) / 3;
    constexpr uint32_t special[] = {0x7fc00001, 0x7f800000, 0xff800000, 0xffc12345};
    for (size_t i = 0; i < 4; ++i) std::memcpy(&values[i * 5 + 1], &special[i], 4);
    const ArrayMaps maps = maps_of(array, {Tolerance::Kind::absolute, 0.01});
    ASSERT_FALSE(maps.lossless);
    ASSERT_EQ(maps.exceptions.size(), 4u);
    const auto decoded = decode(patch, array, encode(patch, array, maps));
    ASSERT_TRUE(decoded) << decoded.error().message;
    const auto sources = patch.sources(array);
    for (size_t i = 0; i < sources.size(); ++i) {
      for (size_t k = 0; k < 2 && sources[i] != none; ++k) {
        const float before = values[2 * sources[i] + k], after = decoded->values<float>()[2 * i + k];
        if (before - before == 0) {
          EXPECT_LE(std::abs(before - after), 0.01) << name_of(domain);
        } else {
          EXPECT_EQ(bits_as<uint32_t>(before), bits_as<uint32_t>(after)) << name_of(domain);
        }
      }
    }
  }
}

/// An array of the mesh as it is stored, with this list of exceptions: integers.
ErrorCode error_with_exceptions(std::initializer_list<unsigned> exceptions) {
  const CodedMesh patch{Mesh{}};
  Array array = make_array("values", Domain::mesh, Scalar::u8, 1);
  array.resize(3);
  const auto bytes = encode(patch, array, maps_of(array));
  ByteReader in(bytes);
  ByteWriter out;
  out.put_bytes(in.get_bytes(5));  // coding, flags, placement, flags of numbers, map
  EXPECT_EQ(in.get_count(), 1u);
  EXPECT_EQ(in.get<uint8_t>(), 0);
  out.put_count(exceptions.size());
  for (const unsigned byte : exceptions) out.put(static_cast<uint8_t>(byte));
  out.put_bytes(in.get_bytes(in.remaining()));
  const auto decoded = decode(patch, array, out.bytes());
  return decoded ? ErrorCode{} : decoded.error().code;
}

TEST(ArrayCoder, DamagedListsOfExceptionsAreRefused) {
  EXPECT_EQ(error_with_exceptions({0}), ErrorCode{});
  EXPECT_EQ(error_with_exceptions({2, 0, 7, 2, 9}), ErrorCode{});
  EXPECT_EQ(error_with_exceptions({}), ErrorCode::corrupt) << "no count";
  EXPECT_EQ(error_with_exceptions({0x80}), ErrorCode::corrupt) << "a count cut off";
  EXPECT_EQ(error_with_exceptions({1}), ErrorCode::corrupt) << "no place";
  EXPECT_EQ(error_with_exceptions({1, 0}), ErrorCode::corrupt) << "no number";
  EXPECT_EQ(error_with_exceptions({1, 3, 7}), ErrorCode::corrupt) << "a place that is not there";
  EXPECT_EQ(error_with_exceptions({2, 0, 7, 0, 9}), ErrorCode::corrupt) << "a place twice";
  EXPECT_EQ(error_with_exceptions({0, 0}), ErrorCode::corrupt) << "bytes behind the list";
  EXPECT_EQ(error_with_exceptions({1, 0, 7, 9}), ErrorCode::corrupt) << "bytes behind the list";
}

TEST(ArrayCoder, SmoothValuesCostLessThanNoise) {
  const CodedMesh patch(grid(60, 60));
  Array smooth = make_array("smooth", Domain::point, Scalar::f32, 1);
  smooth.resize(patch.mesh.point_count());
  Array noise = smooth;
  Random random(1);
  for (size_t i = 0; i < smooth.count(); ++i) {
    const double x = static_cast<double>(i % 61), y = static_cast<double>(i / 61);
    smooth.values<float>()[i] = static_cast<float>(x * x + x * y - y);
    noise.values<float>()[i] = static_cast<float>(random.unit());
  }
  EXPECT_LT(encode(patch, smooth, maps_of(smooth)).size() * 8, encode(patch, noise, maps_of(noise)).size());
  Array constant = smooth;
  std::fill(constant.bytes.begin(), constant.bytes.end(), std::byte{0x3f});
  EXPECT_LT(encode(patch, constant, maps_of(constant)).size(), 50u);
}

TEST(ArrayCoder, EveryTruncationIsAnError) {
  const CodedMesh patch = mixed_patch();
  for (const Domain domain : {Domain::point, Domain::cell, Domain::corner, Domain::mesh}) {
    Random random(9);
    Array array = random_array(random, patch.mesh, domain, Scalar::f32, 3);
    array.resize(std::max<uint64_t>(array.count(), 5));
    const auto bytes = encode(patch, array, maps_of(array));
    for (size_t size = 0; size < bytes.size(); ++size) {
      const auto decoded = decode(patch, array, Bytes(bytes).first(size));
      ASSERT_FALSE(decoded) << name_of(domain) << ", " << size << " of " << bytes.size();
      EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
    }
  }
}

TEST(ArrayCoder, DamageGivesTheRightNumberOfTuplesOrAnError) {
  const CodedMesh patch = mixed_patch();
  for (uint64_t seed = 0; seed < cases(3000); ++seed) {
    Random random(seed);
    const Array array = random_array(random, patch.mesh, static_cast<Domain>(random.below(domain_count)),
                                     static_cast<Scalar>(random.below(scalar_count)), random.between(1, 4));
    const bool lossy = random.chance(50);
    const auto bytes =
        encode(patch, array, maps_of(array, lossy ? Tolerance{Tolerance::Kind::bits, 7} : Tolerance{}));
    const auto decoded = decode(
        patch, array, random.chance(80) ? damaged(bytes, random) : random_bytes(random, random.below(60)));
    if (!decoded) {
      EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
    } else {
      EXPECT_EQ(decoded->bytes.size(), patch.sources(array).size() * array.tuple_size()) << seed;
    }
  }
}

TEST(ArrayCoder, ClaimedTuplesThatNoStreamHoldsAreAnError) {
  const CodedMesh patch{Mesh{}};
  Array array = make_array("values", Domain::mesh, Scalar::f64, 4);
  array.resize(3);
  const auto bytes = encode(patch, array, maps_of(array));
  Array back = make_array("values", Domain::mesh, Scalar::f64, 4);
  const auto done = decode_array(patch.elements(), bytes, 1u << 31, back);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::corrupt);
}

}  // namespace
}  // namespace maille::testing
