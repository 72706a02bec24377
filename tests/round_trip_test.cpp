#include "support/cases.h"
#include "support/codec.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

#include <maille/executor.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace maille::testing {
namespace {

using ::testing::HasSubstr;

/// Empty when decode(encode(mesh)) is the mesh; what went wrong otherwise.
std::string round_trip(const Mesh& mesh, const EncodeOptions& options = {}) {
  const auto encoded = encode_bytes(mesh, options);
  if (!encoded) return "encode: " + encoded.error().message;
  if (encoded->report.file_bytes != encoded->bytes.size())
    return "the report has another file size than the file";
  const auto decoded = decode_bytes(encoded->bytes);
  if (!decoded) return "decode: " + decoded.error().message;
  return differences_between(mesh, *decoded, options.order == Order::keep);
}

/// Empty when encoding what was decoded gives the same file, or need not.
std::string repeats(const Mesh& mesh, const EncodeOptions& options) {
  if (is_glued_by_choice(mesh)) return {};
  const auto once = encode_bytes(mesh, options);
  if (!once) return "encode: " + once.error().message;
  const auto decoded = decode_bytes(once->bytes);
  if (!decoded) return "decode: " + decoded.error().message;
  if (has_twins(*decoded)) return {};
  const auto twice = encode_bytes(*decoded, options);
  if (!twice) return "second encode: " + twice.error().message;
  if (once->bytes == twice->bytes) return {};
  const size_t size = std::min(once->bytes.size(), twice->bytes.size());
  size_t at = 0;
  while (at < size && once->bytes[at] == twice->bytes[at]) ++at;
  return std::to_string(once->bytes.size()) + " bytes, then " + std::to_string(twice->bytes.size()) +
         "; first difference at byte " + std::to_string(at);
}

EncodeOptions keeping_order() {
  EncodeOptions options;
  options.order = Order::keep;
  return options;
}

TEST(RoundTrip, ClassicsComeBack) {
  for (const Mesh& mesh :
       {Mesh{}, tetrahedron(), cube(), grid(1, 1), grid(13, 9), torus(12, 7), sphere(10, 8), moebius(9, 2)}) {
    EXPECT_EQ(round_trip(mesh), "") << describe(mesh);
    EXPECT_EQ(round_trip(mesh, keeping_order()), "") << describe(mesh);
  }
}

TEST(RoundTrip, OneLargeMeshComesBack) {
  const Mesh mesh = torus(large(400), large(300));
  EXPECT_EQ(round_trip(mesh), "");
  EXPECT_EQ(round_trip(shuffled(mesh, 1), keeping_order()), "");
}

TEST(RoundTrip, FacesOfThousandsOfCornersComeBack) {
  Surface disc = shapes::fan(5000, true);
  std::vector<uint32_t> rim;
  for (uint32_t i = 5000; i > 0; --i) rim.push_back(i);
  disc.faces.push_back(rim);
  EXPECT_EQ(round_trip(to_mesh(disc)), "");
  disc.faces = {rim, rim};
  EXPECT_EQ(round_trip(to_mesh(disc)), "");
}

TEST(RoundTrip, ManyFacesOnOneEdgeComeBack) {
  EXPECT_EQ(round_trip(to_mesh(shapes::book(1000))), "");
  EXPECT_EQ(round_trip(flipped(to_mesh(shapes::book(1000)), 1)), "");
}

TEST(RoundTrip, ManyComponentsComeBack) {
  Surface surface;
  for (int i = 0; i < 3000; ++i) append(surface, shapes::tetrahedron(), {double(i), 0, 0});
  EXPECT_EQ(round_trip(to_mesh(surface)), "");
  for (auto& face : surface.faces) face.resize(2);
  EXPECT_EQ(round_trip(to_mesh(surface)), "");
}

/// Seeds are dealt out, so that ctest runs the shards at once.
class RandomRoundTrip : public ::testing::TestWithParam<int> {
 protected:
  static constexpr uint64_t seeds = 600;
  uint64_t first() const { return static_cast<uint64_t>(GetParam()) * 100000; }
};
INSTANTIATE_TEST_SUITE_P(Shard, RandomRoundTrip, ::testing::Range(0, 4));

TEST_P(RandomRoundTrip, EveryMeshComesBack) {
  const auto property = [](const Mesh& mesh) { return round_trip(mesh); };
  EXPECT_EQ(check_random_surfaces(first(), seeds, {}, property), "");
}

TEST_P(RandomRoundTrip, ConnectivityAloneComesBack) {
  RandomMeshOptions options;
  options.arrays = options.special_values = options.any_position_type = options.several_blocks = false;
  options.faces = 120;
  const auto property = [](const Mesh& mesh) { return round_trip(mesh); };
  EXPECT_EQ(check_random_surfaces(first() + 10000, seeds, options, property), "");
}

TEST_P(RandomRoundTrip, OrderAndFirstCornersAreKeptOnRequest) {
  const auto property = [](const Mesh& mesh) { return round_trip(mesh, keeping_order()); };
  EXPECT_EQ(check_random_surfaces(first() + 20000, seeds, {}, property), "");
}

TEST_P(RandomRoundTrip, EncodingTheDecodedMeshGivesTheSameBytes) {
  const auto property = [](const Mesh& mesh) { return repeats(mesh, {}); };
  EXPECT_EQ(check_random_surfaces(first() + 30000, seeds, {}, property), "");
  const auto in_order = [](const Mesh& mesh) { return repeats(mesh, keeping_order()); };
  EXPECT_EQ(check_random_surfaces(first() + 40000, seeds / 4, {}, in_order), "");
}

TEST_P(RandomRoundTrip, EncodingLossilyTwiceGivesTheSameBytes) {
  for (const Tolerance::Kind kind :
       {Tolerance::Kind::absolute, Tolerance::Kind::relative, Tolerance::Kind::bits}) {
    const auto property = [kind](const Mesh& mesh) {
      EncodeOptions options;
      options.positions = {kind, kind == Tolerance::Kind::bits ? 10.0 : 0.003};
      for (const Array& array : mesh.arrays) {
        if (array.role != Role::label) options.arrays[array.name] = options.positions;
      }
      return repeats(mesh, options);
    };
    EXPECT_EQ(check_random_surfaces(first() + 50000, seeds / 3, {}, property), "")
        << "kind " << static_cast<int>(kind);
  }
}

TEST_P(RandomRoundTrip, EveryEffortBringsTheMeshBack) {
  for (const int effort : {1, 7, 9}) {
    const auto property = [effort](const Mesh& mesh) {
      EncodeOptions options;
      options.effort = effort;
      return round_trip(mesh, options);
    };
    EXPECT_EQ(check_random_surfaces(first() + 60000, seeds / 4, {}, property), "") << "effort " << effort;
  }
}

/// The file of a mesh with so many threads.
std::vector<std::byte> bytes_with(const Mesh& mesh, unsigned threads) {
  const auto executor = thread_executor(threads);
  EncodeOptions options;
  options.executor = executor.get();
  const auto encoded = encode_bytes(mesh, options);
  EXPECT_TRUE(encoded) << encoded.error().message;
  return encoded ? encoded->bytes : std::vector<std::byte>{};
}

TEST(Threads, MakeNoDifference) {
  std::vector<Mesh> meshes = {torus(large(300), large(250))};
  for (uint64_t seed = 0; seed < cases(30); ++seed) meshes.push_back(random_surface(seed, {.faces = 400}));
  for (const Mesh& mesh : meshes) {
    const auto encoded = encode_bytes(mesh);
    ASSERT_TRUE(encoded) << encoded.error().message;
    for (const unsigned threads : {1u, 2u, 3u, 8u}) {
      EXPECT_TRUE(bytes_with(mesh, threads) == encoded->bytes) << threads << " threads";
      const auto executor = thread_executor(threads);
      DecodeOptions options;
      options.executor = executor.get();
      const auto decoded = decode_bytes(encoded->bytes, options);
      ASSERT_TRUE(decoded) << decoded.error().message;
      EXPECT_EQ(differences_between(mesh, *decoded), "");
    }
  }
}

TEST(Encode, NamesWhatIsWrongWithTheMesh) {
  Mesh mesh = cube();
  mesh.blocks[0].connectivity[3] = 8;
  const auto encoded = encode_bytes(mesh);
  ASSERT_FALSE(encoded);
  EXPECT_EQ(encoded.error().code, ErrorCode::malformed_input);
  EXPECT_THAT(encoded.error().message, HasSubstr("connectivity entry 3"));
}

TEST(Encode, RefusesAToleranceForAnArrayThatIsNotThere) {
  EncodeOptions options;
  options.arrays["temperature"] = {Tolerance::Kind::bits, 8};
  const auto encoded = encode_bytes(cube(), options);
  ASSERT_FALSE(encoded);
  EXPECT_EQ(encoded.error().code, ErrorCode::usage);
  EXPECT_THAT(encoded.error().message, HasSubstr("temperature"));
}

TEST(Encode, StopsWhenProgressSaysSo) {
  EncodeOptions options;
  options.progress = [](const ProgressReport&) { return false; };
  const auto encoded = encode_bytes(torus(200, 200), options);
  ASSERT_FALSE(encoded);
  EXPECT_EQ(encoded.error().code, ErrorCode::cancelled);
}

Mesh with_two_arrays() {
  Mesh mesh = torus(20, 20);
  for (const char* name : {"wanted", "other"}) {
    mesh.arrays.push_back(make_array(name, Domain::point, Scalar::f32, 2));
    mesh.arrays.back().resize(mesh.point_count());
    for (size_t i = 0; i < 800; ++i) mesh.arrays.back().values<float>()[i] = static_cast<float>(i % 37);
  }
  return mesh;
}

TEST(Decode, BringsOnlyTheArraysAskedFor) {
  Mesh mesh = with_two_arrays();
  const auto encoded = encode_bytes(mesh);
  ASSERT_TRUE(encoded) << encoded.error().message;
  DecodeOptions options;
  options.arrays = std::vector<std::string>{"wanted"};
  const auto decoded = decode_bytes(encoded->bytes, options);
  ASSERT_TRUE(decoded) << decoded.error().message;
  mesh.arrays.pop_back();
  EXPECT_EQ(differences_between(mesh, *decoded), "");
}

TEST(Decode, StaysWithinTheMemoryAllowed) {
  const auto encoded = encode_bytes(torus(100, 100));
  ASSERT_TRUE(encoded) << encoded.error().message;
  DecodeOptions options;
  options.limits.mesh_bytes = 1000;
  const auto decoded = decode_bytes(encoded->bytes, options);
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::memory_bound);
}

}  // namespace
}  // namespace maille::testing
