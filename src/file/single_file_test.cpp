// encode(), decode() and inspect() of whole files; round trips of all kinds of meshes are in tests/.
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/file.h>
#include <maille/version.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "support/codec.h"
#include "support/half_edges.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

namespace maille::testing {
namespace {

using ::testing::HasSubstr;

Mesh with_arrays() {
  Mesh mesh = torus(20, 15);
  mesh.arrays.push_back(make_array("speed", Domain::point, Scalar::f64, 3));
  mesh.arrays.push_back(make_array("group", Domain::cell, Scalar::u16, 1, Role::label));
  mesh.arrays.back().labels = {"a", "b"};
  mesh.arrays.push_back(make_array("uv", Domain::corner, Scalar::f32, 2, Role::texture_coordinate));
  mesh.arrays.push_back(make_array("time", Domain::mesh, Scalar::f32, 1));
  for (Array& array : mesh.arrays)
    array.resize(array.domain == Domain::mesh ? 5 : mesh.count_of(array.domain));
  for (size_t i = 0; i < 900; ++i) mesh.arrays[0].values<double>()[i] = static_cast<double>(i % 41) / 7;
  for (size_t i = 0; i < 300; ++i) mesh.arrays[1].values<uint16_t>()[i] = i % 2;
  mesh.metadata = {{"unit", "mm"}};
  return mesh;
}

EncodeOptions some_options() {
  EncodeOptions options;
  options.effort = 8;
  options.order = Order::keep;
  options.positions = {Tolerance::Kind::absolute, 0.01};
  options.arrays["speed"] = {Tolerance::Kind::bits, 9};
  options.provenance = "a test";
  return options;
}

Result<FileInfo> inspect_bytes(const std::vector<std::byte>& bytes) {
  return inspect(*memory_source(Bytes(bytes), "test.maille"));
}

void expect_agreement(const ArrayInfo& info, const ArrayReport& report) {
  EXPECT_EQ(info.name, report.name);
  EXPECT_EQ(info.domain, report.domain);
  EXPECT_EQ(info.type, report.type);
  EXPECT_EQ(info.components, report.components);
  EXPECT_EQ(info.count, report.elements);
  EXPECT_EQ(info.coded_bytes, report.coded_bytes);
  EXPECT_EQ(info.lossless, report.lossless);
  EXPECT_EQ(info.step, report.step);
  EXPECT_GE(info.bound, report.maximum_error);
}

TEST(Inspect, AgreesWithWhatEncodingReported) {
  const Mesh mesh = with_arrays();
  for (const EncodeOptions& options : {EncodeOptions{}, some_options()}) {
    const auto encoded = encode_bytes(mesh, options);
    ASSERT_TRUE(encoded) << encoded.error().message;
    const auto info = inspect_bytes(encoded->bytes);
    ASSERT_TRUE(info) << info.error().message;
    const EncodeReport& report = encoded->report;
    EXPECT_EQ(info->format_major, format_major);
    EXPECT_EQ(info->format_minor, format_minor);
    EXPECT_EQ(info->effort, options.effort);
    EXPECT_EQ(info->order, options.order);
    EXPECT_EQ(info->provenance, options.provenance);
    EXPECT_EQ(info->metadata, mesh.metadata);
    EXPECT_EQ(info->points, report.points);
    EXPECT_EQ(info->cells, report.cells);
    EXPECT_EQ(info->corners, mesh.corner_count());
    EXPECT_EQ(info->file_bytes, encoded->bytes.size());
    EXPECT_EQ(report.file_bytes, encoded->bytes.size());
    EXPECT_EQ(info->connectivity.coded_bytes, report.connectivity.coded_bytes);
    expect_agreement(info->positions, report.positions);
    ASSERT_EQ(info->arrays.size(), report.arrays.size());
    for (size_t i = 0; i < info->arrays.size(); ++i) expect_agreement(info->arrays[i], report.arrays[i]);
  }
}

TEST(EncodeReport, PartsAddUpToTheFile) {
  for (const EncodeOptions& options : {EncodeOptions{}, some_options()}) {
    const auto encoded = encode_bytes(with_arrays(), options);
    ASSERT_TRUE(encoded) << encoded.error().message;
    const EncodeReport& report = encoded->report;
    uint64_t sum = report.connectivity.coded_bytes + report.positions.coded_bytes + report.order_bytes +
                   report.other_bytes;
    for (const ArrayReport& array : report.arrays) sum += array.coded_bytes;
    EXPECT_EQ(sum, encoded->bytes.size());
    EXPECT_LT(report.other_bytes, 600u);
    EXPECT_EQ(report.order_bytes > 0, options.order == Order::keep);
  }
}

/// Mixing pays for each of them, where fans code that a face comes again.
TEST(EncodeReport, OfOneFaceManyTimesIsNoLargerAtTheHighestEffort) {
  Mesh mesh = to_mesh(shapes::tetrahedron());
  for (const uint64_t faces : {uint64_t{3000}, uint64_t{6000}}) {
    CellBlock& block = mesh.blocks[0];
    block = {};
    block.type = CellType::triangle;
    for (uint64_t i = 0; i < 3 * faces; ++i) block.connectivity.push_back(static_cast<uint32_t>(i % 3));
    EncodeOptions best;
    best.effort = 9;
    EXPECT_LE(encode_bytes(mesh, best)->bytes.size(), encode_bytes(mesh)->bytes.size());
    EXPECT_LT(encode_bytes(mesh, best)->bytes.size(), 500u);
  }
}

void expect_refused(const EncodeOptions& options, ErrorCode code, const char* why) {
  const auto encoded = encode_bytes(with_arrays(), options);
  ASSERT_FALSE(encoded) << why;
  EXPECT_EQ(encoded.error().code, code) << encoded.error().message;
  EXPECT_THAT(encoded.error().message, HasSubstr(why));
}

TEST(Encode, RefusesOptionsThatMakeNoSense) {
  EncodeOptions unknown;
  unknown.arrays["temperature"] = {Tolerance::Kind::bits, 8};
  expect_refused(unknown, ErrorCode::usage, "\"temperature\"");
  EncodeOptions position;
  position.arrays["speed"] = {Tolerance::Kind::absolute, -1};
  expect_refused(position, ErrorCode::usage, "\"speed\"");
  for (const int effort : {0, 10, -1}) {
    EncodeOptions options;
    options.effort = effort;
    expect_refused(options, ErrorCode::usage, "effort");
  }
}

TEST(Encode, WritesNothingWhenTheMeshIsInvalid) {
  Mesh mesh = cube();
  mesh.blocks[0].connectivity[0] = 99;
  std::vector<std::byte> bytes;
  EXPECT_FALSE(encode(mesh, *memory_sink(bytes)));
  EXPECT_TRUE(bytes.empty());
}

TEST(Encode, FindsAnOrderForPointsWithoutCells) {
  const Mesh scan = torus(100, 80);
  Mesh cloud;
  cloud.points = scan.points;
  std::vector<uint32_t> shuffled(cloud.point_count());
  std::iota(shuffled.begin(), shuffled.end(), 0u);
  std::sort(shuffled.begin(), shuffled.end(),
            [](uint32_t a, uint32_t b) { return a * 2654435761u < b * 2654435761u; });
  for (size_t i = 0; i < shuffled.size(); ++i) {
    for (size_t k = 0; k < 3; ++k)
      cloud.points.values<float>()[3 * i + k] = scan.points.values<float>()[3 * size_t{shuffled[i]} + k];
  }
  for (const int effort : {1, 5, 9}) {
    EncodeOptions options;
    options.effort = effort;
    options.positions = {Tolerance::Kind::bits, 12};
    const auto any = encode_bytes(cloud, options);
    options.order = Order::keep;
    const auto kept = encode_bytes(cloud, options);
    ASSERT_TRUE(any && kept);
    EXPECT_LT(any->bytes.size() * 3, kept->bytes.size() * 2) << effort;
    const auto decoded = decode_bytes(any->bytes);
    ASSERT_TRUE(decoded);
    options.order = Order::canonical;
    const auto again = encode_bytes(*decoded, options);
    ASSERT_TRUE(again);
    EXPECT_EQ(any->bytes, again->bytes) << effort;
  }
}

TEST(Decode, KeepsToTheMemoryAllowed) {
  const auto encoded = encode_bytes(with_arrays());
  ASSERT_TRUE(encoded) << encoded.error().message;
  for (const uint64_t allowed : {uint64_t{0}, uint64_t{1000}, uint64_t{20000}}) {
    DecodeOptions options;
    options.limits.mesh_bytes = allowed;
    const auto decoded = decode_bytes(encoded->bytes, options);
    ASSERT_FALSE(decoded) << allowed;
    EXPECT_EQ(decoded.error().code, ErrorCode::memory_bound);
    EXPECT_THAT(decoded.error().message, HasSubstr("<memory>"));
  }
  DecodeOptions enough;
  enough.limits.mesh_bytes = 1 << 20;
  EXPECT_TRUE(decode_bytes(encoded->bytes, enough));
}

TEST(Decode, BringsTheArraysAskedForAndIgnoresNamesThatAreNotThere) {
  const auto encoded = encode_bytes(with_arrays(), some_options());
  ASSERT_TRUE(encoded) << encoded.error().message;
  DecodeOptions options;
  options.arrays = std::vector<std::string>{"uv", "no such array"};
  const auto some = decode_bytes(encoded->bytes, options);
  ASSERT_TRUE(some) << some.error().message;
  ASSERT_EQ(some->arrays.size(), 1u);
  EXPECT_EQ(some->arrays[0].name, "uv");
  options.arrays = std::vector<std::string>{};
  EXPECT_TRUE(decode_bytes(encoded->bytes, options)->arrays.empty());
  EXPECT_EQ(decode_bytes(encoded->bytes)->arrays.size(), 4u);
}

TEST(Decode, CanBeCancelledAtAnyReport) {
  const auto encoded = encode_bytes(with_arrays(), some_options());
  ASSERT_TRUE(encoded) << encoded.error().message;
  int reports = 0;
  DecodeOptions count;
  count.progress = [&](const ProgressReport&) { return ++reports > 0; };
  ASSERT_TRUE(decode_bytes(encoded->bytes, count));
  ASSERT_GT(reports, 4);
  for (int last = 0; last < reports; ++last) {
    int seen = 0;
    DecodeOptions options;
    options.progress = [&](const ProgressReport&) { return seen++ < last; };
    const auto decoded = decode_bytes(encoded->bytes, options);
    ASSERT_FALSE(decoded) << last;
    EXPECT_EQ(decoded.error().code, ErrorCode::cancelled);
  }
}

TEST(Decode, NamesTheFileThatIsDamaged) {
  const auto encoded = encode_bytes(cube());
  ASSERT_TRUE(encoded) << encoded.error().message;
  for (size_t at = 0; at < encoded->bytes.size(); ++at) {
    auto bytes = encoded->bytes;
    bytes[at] ^= std::byte{0x10};
    const auto decoded = decode(*memory_source(Bytes(bytes), "test.maille"));
    if (!decoded) {
      EXPECT_THAT(decoded.error().message, HasSubstr("test.maille")) << at;
    } else {
      EXPECT_EQ(differences_between(cube(), *decoded), "") << at;  // the footer can be done without
    }
  }
}

}  // namespace
}  // namespace maille::testing
