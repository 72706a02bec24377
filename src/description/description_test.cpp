#include "description/description.h"

#include <gtest/gtest.h>

#include "support/half_edges.h"

namespace maille::testing {
namespace {

Description example() {
  Description description;
  description.effort = 7;
  description.order = Order::keep;
  description.points = 1000;
  description.corners = 6003;
  description.blocks = {{"skin", {CellType::triangle, 2000}},
                        {"", {CellType::mixed, 1}, {{CellType::line, 1}}}};
  description.positions.name = "position";
  description.positions.components = 3;
  description.positions.asked = {Tolerance::Kind::bits, 12};
  description.positions.step = 0.25;
  ArrayDescription& material = description.arrays.emplace_back();
  material.name = "material";
  material.domain = Domain::cell;
  material.type = Scalar::u8;
  material.role = Role::label;
  material.labels = {"wood", "", "iron"};
  ArrayDescription& time = description.arrays.emplace_back();
  time.name = "time";
  time.domain = Domain::mesh;
  time.type = Scalar::f64;
  time.mesh_tuples = 4;
  description.metadata = {{"comment", "one"}, {"comment", "two"}, {"", ""}};
  description.provenance = "a test";
  return description;
}

std::vector<std::byte> encode(const Description& description) {
  const auto bytes = encode_description(description);
  EXPECT_TRUE(bytes) << bytes.error().message;
  return bytes ? *bytes : std::vector<std::byte>{};
}

ErrorCode error_of(const Description& description, const Limits& limits = {}) {
  const auto decoded = decode_description(encode(description), limits);
  EXPECT_FALSE(decoded);
  return decoded ? ErrorCode{} : decoded.error().code;
}

TEST(Description, ComesBack) {
  const Description before = example();
  const auto after = decode_description(encode(before), {});
  ASSERT_TRUE(after) << after.error().message;
  EXPECT_EQ(after->effort, 7);
  EXPECT_EQ(after->order, Order::keep);
  EXPECT_EQ(after->points, 1000u);
  EXPECT_EQ(after->corners, 6003u);
  ASSERT_EQ(after->blocks.size(), 2u);
  EXPECT_EQ(after->blocks[0].name, "skin");
  EXPECT_EQ(after->blocks[1].shape.type, CellType::mixed);
  EXPECT_EQ(after->blocks[1].types, before.blocks[1].types);
  EXPECT_EQ(after->cells(), 2001u);
  EXPECT_EQ(after->positions.asked.kind, Tolerance::Kind::bits);
  EXPECT_EQ(after->positions.asked.value, 12);
  EXPECT_EQ(after->positions.step, 0.25);
  ASSERT_EQ(after->arrays.size(), 2u);
  EXPECT_EQ(after->arrays[0].labels, before.arrays[0].labels);
  EXPECT_EQ(after->arrays[0].role, Role::label);
  EXPECT_EQ(after->tuples(after->arrays[0]), 2001u);
  EXPECT_EQ(after->tuples(after->arrays[1]), 4u);
  EXPECT_EQ(after->metadata, before.metadata);
  EXPECT_EQ(after->provenance, "a test");
}

TEST(Description, TypesOfAMixedBlockAddUpAndRise) {
  const std::vector<std::vector<std::pair<CellType, uint64_t>>> wrong = {
      {{CellType::line, 2}},
      {{CellType::line, 0}},
      {{CellType::triangle, 1}, {CellType::line, 0}},
      {{CellType::line, 1}, {CellType::line, 0}},
      {{CellType::mixed, 1}},
      {{CellType::polyhedron, 1}}};
  for (const auto& types : wrong) {
    Description description = example();
    description.blocks[1].types = types;
    EXPECT_EQ(error_of(description), ErrorCode::corrupt);
  }
}

Description welded(uint32_t split_points) {
  Description description = example();
  description.welded = true;
  description.split_points = split_points;
  description.arrays[0].domain = Domain::corner;
  description.arrays[0].by_twin = true;
  return description;
}

TEST(Description, OfTheUsualArraysTakesTwoBytesForEach) {
  Description description = example();
  description.effort = 1;
  description.metadata.clear();  // short enough to be written as it is
  const auto with = [&](const char* name, Scalar type, uint32_t components, Role role) {
    ArrayDescription array;
    array.name = name;
    array.domain = Domain::corner;
    array.type = type;
    array.components = components;
    array.role = role;
    Description larger = description;
    larger.arrays.assign(1, array);
    const auto after = decode_description(encode(larger), {});
    EXPECT_TRUE(after) << name;
    if (after) {
      const ArrayDescription& back = after->arrays[0];
      EXPECT_EQ(back.name, name);
      EXPECT_EQ(back.domain, Domain::corner);
      EXPECT_EQ(back.type, type);
      EXPECT_EQ(back.components, components);
      EXPECT_EQ(back.role, role);
    }
    return encode(larger).size();
  };
  description.arrays.clear();
  const size_t without = encode(description).size();
  EXPECT_EQ(with("normal", Scalar::f32, 3, Role::normal), without + 2);
  EXPECT_EQ(with("weights", Scalar::f32, 4, Role::none), without + 2);
  // Anything else about it, and it is spelled.
  EXPECT_GT(with("normal", Scalar::f32, 3, Role::none), without + 10);
  EXPECT_GT(with("normals", Scalar::f32, 3, Role::normal), without + 10);
  EXPECT_GT(with("normal", Scalar::f32, 4, Role::normal), without + 10);
  EXPECT_GT(with("normal", Scalar::i8, 3, Role::normal), without + 10);
}

TEST(Description, OfAWeldedMeshComesBack) {
  const auto after = decode_description(encode(welded(1200)), {});
  ASSERT_TRUE(after) << after.error().message;
  EXPECT_TRUE(after->welded);
  EXPECT_EQ(after->order, Order::keep);
  EXPECT_EQ(after->split_points, 1200u);
  EXPECT_TRUE(after->arrays[0].by_twin);
  EXPECT_EQ(after->arrays[0].domain, Domain::corner);
  EXPECT_FALSE(after->arrays[1].by_twin);
}

TEST(Description, HasMorePointsSplitThanWeldedAndNoMoreThanCornersTell) {
  for (const uint32_t points : {0u, 1000u, 7004u}) EXPECT_EQ(error_of(welded(points)), ErrorCode::corrupt);
  EXPECT_TRUE(decode_description(encode(welded(7003)), {}));
  Description not_welded = welded(1200);
  not_welded.welded = false;
  EXPECT_EQ(error_of(not_welded), ErrorCode::corrupt);
}

TEST(Description, IsTheSameWhenWrittenAgain) {
  const auto bytes = encode(example());
  EXPECT_TRUE(encode(*decode_description(bytes, {})) == bytes);
}

TEST(Description, ShortOnesOfFastLevelsAreWrittenAsTheyAre) {
  Description description;
  description.effort = 1;
  description.blocks = {{"skin", {CellType::triangle, 0}}};
  description.positions.name = "position";
  description.positions.components = 3;
  const std::vector<std::byte> bytes = encode(description);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  EXPECT_NE(text.find("skin"), text.npos);
  EXPECT_EQ(static_cast<size_t>(bytes[0]) + 1, bytes.size());
  const auto after = decode_description(bytes, {});
  ASSERT_TRUE(after) << after.error().message;
  EXPECT_EQ(after->blocks[0].name, "skin");
}

TEST(Description, EveryTruncationIsAnError) {
  const auto bytes = encode(example());
  for (size_t size = 0; size < bytes.size(); ++size) {
    const auto decoded = decode_description(Bytes(bytes).first(size), {});
    ASSERT_FALSE(decoded) << size;
    EXPECT_EQ(decoded.error().code, ErrorCode::corrupt) << size;
  }
}

TEST(Description, RefusesWhatNoMeshHas) {
  const auto changed = [](auto change) {
    Description description = example();
    change(description);
    return error_of(description);
  };
  using D = Description;
  EXPECT_EQ(changed([](D& d) { d.effort = 10; }), ErrorCode::corrupt);
  EXPECT_EQ(changed([](D& d) { d.order = static_cast<Order>(2); }), ErrorCode::corrupt);
  EXPECT_EQ(changed([](D& d) { d.points = none; }), ErrorCode::corrupt);
  EXPECT_EQ(changed([](D& d) { d.corners = uint64_t{1} << 32; }), ErrorCode::corrupt);
  EXPECT_EQ(changed([](D& d) { d.blocks[0].shape.type = static_cast<CellType>(200); }), ErrorCode::corrupt);
  EXPECT_EQ(changed([](D& d) { d.blocks[0].shape.cells = none; }), ErrorCode::corrupt);
  EXPECT_EQ(changed([](D& d) { d.positions.components = 2; }), ErrorCode::corrupt);
  EXPECT_EQ(changed([](D& d) { d.positions.domain = Domain::cell; }), ErrorCode::corrupt);
  EXPECT_EQ(changed([](D& d) { d.arrays[0].components = 0; }), ErrorCode::corrupt);
  EXPECT_EQ(changed([](D& d) { d.arrays[0].components = 0x10000; }), ErrorCode::corrupt);
  EXPECT_EQ(changed([](D& d) { d.arrays[0].type = static_cast<Scalar>(10); }), ErrorCode::corrupt);
  EXPECT_EQ(changed([](D& d) { d.arrays[0].domain = static_cast<Domain>(4); }), ErrorCode::corrupt);
  EXPECT_EQ(changed([](D& d) { d.arrays[0].role = static_cast<Role>(6); }), ErrorCode::corrupt);
  EXPECT_EQ(changed([](D& d) { d.arrays[1].mesh_tuples = none; }), ErrorCode::corrupt);
}

TEST(Description, KeepsToTheMemoryAllowed) {
  // 1000 points of 12 bytes, 6003 corners of 4, 2001 cells of 8 + 1, 4 times 8 bytes.
  const uint64_t needed = 12000 + 24012 + 18009 + 32;
  EXPECT_TRUE(decode_description(encode(example()), {.mesh_bytes = needed}));
  EXPECT_EQ(error_of(example(), {.mesh_bytes = needed - 1}), ErrorCode::memory_bound);
  Description huge = example();
  huge.points = 0xfffffffe;
  huge.arrays[0].domain = Domain::point;
  huge.arrays[0].components = 0xffff;  // sums of counts must not wrap around
  EXPECT_EQ(error_of(huge), ErrorCode::memory_bound);
}

TEST(Description, CountsItsArraysApartFromItsBlocks) {
  Description description = example();
  description.parts.clear();
  const uint64_t few = decode_description(encode(description), {}).value().memory;
  for (int i = 0; i < 1000; ++i) description.blocks.push_back({std::to_string(i), {CellType::triangle, 0}});
  const Description many = decode_description(encode(description), {}).value();
  EXPECT_EQ(many.memory, few);
  EXPECT_GE(many.block_memory(), 1000 * sizeof(CodedBlock));
}

TEST(Description, GivesPartsTheBlocksThatHaveCellsInThem) {
  Description description = example();
  description.blocks = {
      {"a", {CellType::triangle, 5}}, {"b", {CellType::quad, 0}}, {"c", {CellType::line, 2}}};
  description.corners = 19;
  description.parts = {{400, 15, {{0, 5}}}, {300, 0, {}}, {300, 4, {{2, 2}}}};
  const Description decoded = decode_description(encode(description), {}).value();
  EXPECT_EQ(decoded.of_part(0).block_numbers(), (std::vector<uint32_t>{0}));
  EXPECT_TRUE(decoded.of_part(1).blocks.empty());
  const Description last = decoded.of_part(2);
  EXPECT_EQ(last.block_numbers(), (std::vector<uint32_t>{2}));
  EXPECT_EQ(last.blocks[0].shape.type, CellType::line);
  EXPECT_EQ(last.cells(), 2u);
  EXPECT_EQ(last.corners, 4u);
}

TEST(Description, TextsHaveABound) {
  Description long_text = example();
  long_text.provenance.assign(17 << 20, 'x');
  const auto bytes = encode_description(long_text);
  ASSERT_FALSE(bytes);
  EXPECT_EQ(bytes.error().code, ErrorCode::unsupported);
  long_text.provenance.assign(3 << 20, 'x');
  const auto coded = encode(long_text);
  EXPECT_TRUE(decode_description(coded, {}));
  // A small file can claim long texts: they count, too, but for 4 MiB.
  const auto decoded = decode_description(coded, {.mesh_bytes = 1 << 20});
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::memory_bound);
}

TEST(Description, AnyBytesAreADescriptionOrAnError) {
  const auto bytes = encode(example());
  for (uint64_t seed = 0; seed < 5000; ++seed) {
    Random random(seed);
    const auto decoded = decode_description(
        random.chance(50) ? damaged(bytes, random) : random_bytes(random, random.below(100)),
        {.mesh_bytes = 1 << 26});
    if (!decoded) {
      EXPECT_TRUE(decoded.error().code == ErrorCode::corrupt ||
                  decoded.error().code == ErrorCode::memory_bound);
    } else {
      EXPECT_EQ(decoded->positions.components, 3u);
    }
  }
}

}  // namespace
}  // namespace maille::testing
