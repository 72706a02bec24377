#include <maille/out_of_core.h>

#include <random>

#include "container/file_reader.h"
#include "container/file_writer.h"
#include "volume/pieces/piece_layout.h"
#include "volume/pieces/shared_numbers.h"
#include "volume/stream/mesh_from_parts.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

std::vector<std::byte> in_pieces(const Mesh& mesh, uint64_t cells, Order order) {
  EncodeOptions options = kept(2);
  options.order = order;
  options.most_cells_per_part = cells;
  return encoded(mesh, options);
}

Result<Mesh> decoded_into_parts(const std::vector<std::byte>& bytes, const DecodeOptions& options = {}) {
  const auto source = memory_source(Bytes(bytes));
  const auto description = describe(*source, options);
  if (!description) return tl::unexpected(description.error());
  MeshFromParts sink(*description);
  const auto done = decode(*source, sink, options);
  if (!done) return tl::unexpected(done.error());
  EXPECT_TRUE(sink.committed);
  return std::move(sink.mesh);
}

Mesh blocks_with_arrays() {
  Mesh mesh = grid(11, 8, 9);
  CellBlock sides;
  sides.name = "sides";
  sides.type = CellType::polygon;
  sides.offsets = {0, 4, 7, 12};
  sides.connectivity = {0, 1, 13, 12, 1, 2, 13, 14, 15, 16, 17, 18};
  CellBlock empty;
  empty.name = "empty";
  empty.type = CellType::wedge;
  mesh.blocks = {sides, empty, mesh.blocks[0]};
  add_arrays(mesh, 3);
  return mesh;
}

TEST(PiecesIntoParts, AreTheMeshDecodedWholeInEitherOrder) {
  for (const Mesh& mesh : {blocks_with_arrays(), grid(9, 9, 9)}) {
    for (const Order order : {Order::keep, Order::canonical}) {
      const auto bytes = in_pieces(mesh, 60, order);
      const auto whole = decode(*memory_source(Bytes(bytes)));
      ASSERT_TRUE(whole);
      const auto parts = decoded_into_parts(bytes);
      ASSERT_TRUE(parts) << parts.error().message;
      expect_same(*whole, *parts);
    }
  }
}

TEST(PiecesIntoParts, HaveTheArraysThatAreAskedFor) {
  const Mesh mesh = blocks_with_arrays();
  DecodeOptions options;
  options.arrays = {{mesh.arrays[1].name}};
  const auto bytes = in_pieces(mesh, 60, Order::keep);
  const auto parts = decoded_into_parts(bytes, options);
  ASSERT_TRUE(parts) << parts.error().message;
  expect_same(*decode(*memory_source(Bytes(bytes)), options), *parts);
}

RC_GTEST_PROP(PiecesIntoParts, ComeBackFromAnyCellsOverAnyPoints, ()) {
  const auto seed = *rc::gen::arbitrary<unsigned>();
  const auto cells = *rc::gen::inRange(0u, 150u), points = *rc::gen::inRange(1u, 150u);
  Mesh mesh = soup(seed, cells, points);
  add_arrays(mesh, seed);
  for (const Order order : {Order::keep, Order::canonical}) {
    const auto bytes = in_pieces(mesh, *rc::gen::inRange<uint64_t>(1, 80), order);
    const auto parts = decoded_into_parts(bytes);
    RC_ASSERT(parts.has_value());
    expect_same(*decode(*memory_source(Bytes(bytes))), *parts);
  }
}

/// The same file with another index, and good checksums.
std::vector<std::byte> with_index(const std::vector<std::byte>& file,
                                  const std::function<void(std::vector<PieceRecord>&)>& change) {
  const auto source = memory_source(Bytes(file));
  const FileReader reader = *FileReader::open(*source);
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  FileWriter writer = *FileWriter::begin(*sink, reader.header());
  for (const ChunkRecord& record : reader.records()) {
    StreamKey key = {"", record.header.patch, record.header.number};
    std::copy(record.header.type.begin(), record.header.type.end(), key.type);
    std::vector<std::byte> stream = *reader.read_stream(key);
    if (std::string_view(key.type, 4) == "PIDX") {
      auto records = decode_index(stream, uint64_t{1} << 20)->records;
      change(records);
      stream = encode_index(records);
    }
    EXPECT_TRUE(writer.write_stream(key, stream));
  }
  EXPECT_TRUE(writer.finish());
  return bytes;
}

TEST(PiecesIntoParts, AnIndexThatLiesIsFound) {
  Mesh mesh = grid(11, 8, 9);
  add_arrays(mesh, 3);
  for (const Order order : {Order::keep, Order::canonical}) {
    const auto bytes = in_pieces(mesh, 60, order);
    ASSERT_TRUE(decoded_into_parts(with_index(bytes, [](auto&) {})));
    const auto box = with_index(bytes, [](auto& records) { records[2].high[0] = records[2].low[0]; });
    const auto range = with_index(bytes, [](auto& records) {
      for (PieceField& field : records[1].fields) {
        for (auto& component : field.components) component.low = component.high = 1e30f;
      }
    });
    for (const auto& lying : {box, range}) {
      const auto parts = decoded_into_parts(lying);
      ASSERT_FALSE(parts);
      EXPECT_EQ(parts.error().code, ErrorCode::corrupt);
      EXPECT_NE(parts.error().message.find("index"), std::string::npos) << parts.error().message;
    }
  }
}

TEST(SharedNumbers, AreKeptAsLongAsABoxMayHaveThePoint) {
  std::vector<PieceRecord> pieces(3);
  for (unsigned p = 0; p < 3; ++p) {
    const auto low = static_cast<float>(p);
    pieces[p].low = {low, 0, 0};
    pieces[p].high = {low + 1, 1, 1};
  }
  SharedNumbers numbers(pieces);
  const Place place = {1, 2, 3}, nowhere = {4, 5, 6};
  EXPECT_EQ(numbers.find_or_add(place, 0, {1, 0.5, 0.5}, 7), 7u);
  EXPECT_EQ(numbers.find_or_add(place, 1, {1, 0.5, 0.5}, 8), 8u);
  EXPECT_EQ(numbers.find_or_add(nowhere, 0, {std::nan(""), 0, 0}, 9), 9u);
  numbers.end_piece(0);
  EXPECT_EQ(numbers.find_or_add(place, 0, {1, 0.5, 0.5}, 10), 7u);
  EXPECT_EQ(numbers.find_or_add(place, 1, {1, 0.5, 0.5}, 10), 8u);
  numbers.end_piece(1);
  EXPECT_EQ(numbers.find_or_add(nowhere, 0, {std::nan(""), 0, 0}, 10), 9u);
}

TEST(SharedNumbers, TakeRoomForTheBordersOfTheMomentOnly) {
  constexpr uint32_t count = 300;
  std::vector<PieceRecord> pieces(count);
  for (uint32_t p = 0; p < count; ++p) {
    pieces[p].low = {static_cast<float>(p), 0, 0};
    pieces[p].high = {static_cast<float>(p + 1), 1, 1};
  }
  SharedNumbers numbers(pieces);
  uint64_t next = 0;
  for (uint32_t p = 0; p + 1 < count; ++p) {
    const std::array<double, 3> at = {static_cast<double>(p + 1), 0.5, 0.5};
    for (uint64_t i = 0; i < 1000; ++i, ++next) {
      EXPECT_EQ(numbers.find_or_add({p + 1, i, 0}, 0, at, next), next);
      if (p > 0) {
        EXPECT_EQ(numbers.find_or_add({p, i, 0}, 0, at, ~uint64_t{0}), next - 1000);
      }
    }
    numbers.end_piece(p);
  }
  EXPECT_LE(numbers.capacity(), 8000u);
}

/// Boxes in the order of a bisection, or in any.
std::vector<PieceRecord> random_boxes(std::mt19937& random, uint32_t count) {
  std::vector<PieceRecord> pieces(count);
  for (PieceRecord& piece : pieces) {
    if (random() % 8 == 0) continue;
    for (unsigned k = 0; k < 3; ++k) {
      piece.low[k] = static_cast<float>(random() % 16);
      piece.high[k] = piece.low[k] + static_cast<float>(random() % 6);
    }
  }
  return pieces;
}

TEST(LastPieces, AreNeverBeforeTheLastBoxThatHasAPoint) {
  std::mt19937 random(5);
  for (const uint32_t count : {1u, 2u, 3u, 17u, 64u, 3000u}) {
    const std::vector<PieceRecord> pieces = random_boxes(random, count);
    const LastPieces last(pieces);
    for (unsigned i = 0; i < 200; ++i) {
      std::array<double, 3> at;
      for (double& x : at) x = static_cast<double>(random() % 22);
      uint32_t found = 0;
      for (uint32_t p = 0; p < count; ++p) {
        bool has = true;
        for (unsigned k = 0; k < 3; ++k) {
          has = has && at[k] >= static_cast<double>(pieces[p].low[k]) &&
                at[k] <= static_cast<double>(pieces[p].high[k]);
        }
        if (has) found = p;
      }
      // Of few boxes all are looked at.
      EXPECT_GE(last.last_with(at), found);
      if (count <= 64) {
        EXPECT_EQ(last.last_with(at), found);
      }
    }
  }
}

}  // namespace
}  // namespace maille
