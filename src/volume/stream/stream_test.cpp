#include <maille/stream.h>

#include <algorithm>

#include "support/cases.h"
#include "support/codec.h"
#include "volume/cells/cell_coder.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

/// A pipe that hands out a few bytes at a time, and can be asked how far it was read.
class Trickle final : public ByteStream {
 public:
  explicit Trickle(const std::vector<std::byte>& bytes) : bytes_(bytes) {}
  Result<size_t> read(std::span<std::byte> out) override {
    const size_t count = std::min({out.size(), size_t{100}, bytes_.size() - at_});
    std::copy_n(bytes_.begin() + static_cast<ptrdiff_t>(at_), count, out.begin());
    at_ += count;
    return count;
  }
  std::string name() const override { return "<pipe>"; }
  bool at_end() const { return at_ == bytes_.size(); }

 private:
  const std::vector<std::byte>& bytes_;
  size_t at_ = 0;
};

/// Every second time the bytes have not arrived yet, once `hesitates`.
class Hesitant final : public ByteStream {
 public:
  Hesitant(const std::vector<std::byte>& bytes, const bool& hesitates)
      : pipe_(bytes), hesitates_(hesitates) {}
  Result<size_t> read(std::span<std::byte> out) override {
    waits_ = hesitates_ && !waits_ && !pipe_.at_end();
    if (waits_) return failure(ErrorCode::network, "not yet");
    return pipe_.read(out);
  }
  std::string name() const override { return "<slow>"; }

 private:
  Trickle pipe_;
  const bool& hesitates_;
  bool waits_ = false;
};

Bytes bytes_of(const std::vector<float>& values) {
  return std::as_bytes(std::span(values));
}

/// A column of hexahedra that goes on for ever, with numbers far beyond 2^32.
struct Column {
  static constexpr uint64_t first = uint64_t{1} << 40;
  static std::vector<float> layer(uint64_t z) {
    const auto height = static_cast<float>(z);
    return {0, 0, height, 1, 0, height, 1, 1, height, 0, 1, height};
  }
  static std::vector<uint64_t> cell(uint64_t z) {
    std::vector<uint64_t> numbers;
    for (uint64_t i = 0; i < 8; ++i) numbers.push_back(first + 4 * z + i);
    return numbers;
  }
};

std::vector<std::byte> written_column(uint64_t cells, bool told_late) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  StreamWriter writer = *StreamWriter::begin(*sink, {});
  EXPECT_TRUE(writer.add_points(Column::first, bytes_of(Column::layer(0))));
  const std::vector<uint8_t> last_use = {1, 1, 1, 1, 0, 0, 0, 0};
  for (uint64_t z = 0; z < cells; ++z) {
    EXPECT_TRUE(writer.add_points(Column::first + 4 * (z + 1), bytes_of(Column::layer(z + 1))));
    const std::vector<uint64_t> cell = Column::cell(z);
    const auto flags = told_late ? std::span<const uint8_t>{} : std::span(last_use);
    EXPECT_TRUE(writer.add_cells(CellType::hexahedron, cell, flags));
    if (told_late) {
      EXPECT_TRUE(writer.end_points(std::span(cell).first(4)));
    }
  }
  const auto report = writer.finish();
  EXPECT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->cells, cells);
  EXPECT_LT(report->most_live_points, 20000u);
  return bytes;
}

void expect_column(const std::vector<std::byte>& bytes, uint64_t cells) {
  StreamReader reader = *StreamReader::open(std::make_unique<Trickle>(bytes));
  StreamPortion piece;
  uint64_t seen = 0, points = 0;
  for (;;) {
    const auto more = reader.next(piece);
    ASSERT_TRUE(more) << more.error().message;
    if (!*more) break;
    for (size_t i = 0; i < piece.cell_count(); ++i, ++seen) {
      const std::vector<uint64_t> wanted = Column::cell(seen);
      ASSERT_TRUE(std::equal(wanted.begin(), wanted.end(),
                             piece.connectivity.begin() + static_cast<ptrdiff_t>(8 * i)));
    }
    points += piece.points.size();
    ASSERT_LT(piece.slot_count, 60000u);
  }
  EXPECT_EQ(seen, cells);
  EXPECT_EQ(points, 4 * (cells + 1));
}

TEST(StreamReader, gives_a_piece_later_whose_bytes_had_not_arrived) {
  constexpr uint64_t cells = 30000;
  const std::vector<std::byte> bytes = written_column(cells, false);
  bool hesitates = false;
  StreamReader reader = *StreamReader::open(std::make_unique<Hesitant>(bytes, hesitates));
  hesitates = true;
  StreamPortion piece;
  uint64_t seen = 0, refused = 0;
  for (;;) {
    const auto more = reader.next(piece);
    if (!more) {
      ASSERT_EQ(more.error().code, ErrorCode::network) << more.error().message;
      ++refused;
      continue;
    }
    if (!*more) break;
    ASSERT_EQ(piece.first_cell, seen);
    seen += piece.cell_count();
    ASSERT_EQ(piece.connectivity.back(), Column::cell(seen - 1).back());
  }
  EXPECT_EQ(seen, cells);
  EXPECT_GT(refused, 10u);
}

TEST(Stream, RunsWithMemoryForTheFrontOnly) {
  expect_column(written_column(30000, false), 30000);
}

TEST(Stream, TakesEndsOfPointsAfterTheFact) {
  expect_column(written_column(30000, true), 30000);
}

TEST(Stream, EndsToldVeryLateAreKept) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  StreamWriter writer = *StreamWriter::begin(*sink, {});
  for (uint64_t z = 0; z < 5000; ++z) {
    ASSERT_TRUE(writer.add_points(4 * z, bytes_of(Column::layer(z))));
    if (z == 0) continue;
    std::vector<uint64_t> cell;
    for (uint64_t i = 0; i < 8; ++i) cell.push_back(4 * (z - 1) + i);
    ASSERT_TRUE(writer.add_cells(CellType::hexahedron, cell));
  }
  ASSERT_TRUE(writer.flush());
  ASSERT_TRUE(writer.end_points(std::vector<uint64_t>{3, 17, 4000}));
  ASSERT_TRUE(writer.finish());
  StreamReader reader = *StreamReader::open(std::make_unique<Trickle>(bytes));
  StreamPortion piece;
  size_t ended = 0;
  while (*reader.next(piece)) ended += piece.ended_slots.size();
  EXPECT_EQ(ended, 3u);
}

TEST(Stream, SlotsNamePointsWithinAPiece) {
  const std::vector<std::byte> bytes = written_column(20000, false);
  StreamReader reader = *StreamReader::open(std::make_unique<Trickle>(bytes));
  StreamPortion piece;
  std::vector<uint64_t> table;
  while (*reader.next(piece)) {
    table.resize(std::max<size_t>(table.size(), piece.slot_count));
    for (size_t i = 0; i < piece.points.size(); ++i) table[piece.point_slots[i]] = piece.points[i];
    for (size_t i = 0; i < piece.slots.size(); ++i) ASSERT_EQ(table[piece.slots[i]], piece.connectivity[i]);
  }
}

TEST(Stream, TakesNoCellsAtOnce) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  StreamWriter writer = *StreamWriter::begin(*sink, {});
  ASSERT_TRUE(writer.add_cells(CellType::hexahedron, {}));
  const auto report = writer.finish();
  ASSERT_TRUE(report);
  EXPECT_EQ(report->cells, 0u);
}

TEST(Stream, GivesWhatWasFlushedBeforeTheEnd) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  StreamWriter writer = *StreamWriter::begin(*sink, {});
  ASSERT_TRUE(writer.add_points(0, bytes_of(Column::layer(0))));
  ASSERT_TRUE(writer.add_points(4, bytes_of(Column::layer(1))));
  ASSERT_TRUE(writer.add_cells(CellType::hexahedron, std::vector<uint64_t>{0, 1, 2, 3, 4, 5, 6, 7}));
  ASSERT_TRUE(writer.flush());
  const std::vector<std::byte> so_far = bytes;  // the end is missing
  StreamReader reader = *StreamReader::open(std::make_unique<Trickle>(so_far));
  StreamPortion piece;
  ASSERT_TRUE(*reader.next(piece));
  EXPECT_EQ(piece.cell_count(), 1u);
  const auto end = reader.next(piece);
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().code, ErrorCode::corrupt);
}

TEST(Stream, BlocksBeginWhereTheyWereToldAcrossBatches) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  StreamWriter writer = *StreamWriter::begin(*sink, {});
  ASSERT_TRUE(writer.add_points(0, bytes_of(Column::layer(0))));
  const std::vector<uint64_t> quad = {0, 1, 2, 3}, triangle = {0, 1, 2};
  ASSERT_TRUE(writer.begin_block("a", CellType::quad));
  ASSERT_TRUE(writer.add_cells(CellType::quad, quad));
  ASSERT_TRUE(writer.begin_block("b", CellType::polygon));
  ASSERT_TRUE(writer.flush());
  ASSERT_TRUE(writer.add_cells(CellType::polygon, triangle, {}, {}, 3));
  EXPECT_FALSE(writer.add_cells(CellType::quad, quad));
  ASSERT_TRUE(writer.flush());
  ASSERT_TRUE(writer.begin_block("c", CellType::mixed));
  ASSERT_TRUE(writer.finish());
  const auto mesh = decode(*memory_source(Bytes(bytes)));
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(mesh->blocks.size(), 3u);
  EXPECT_EQ(mesh->blocks[0].size(), 1u);
  EXPECT_EQ(mesh->blocks[1].size(), 1u);
  EXPECT_EQ(mesh->blocks[1].name, "b");
  EXPECT_EQ(mesh->blocks[1].type, CellType::polygon);
  EXPECT_EQ(mesh->blocks[2].name, "c");
}

TEST(Stream, RefusesPointsUsedAfterTheirLastUse) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  StreamWriter writer = *StreamWriter::begin(*sink, {});
  ASSERT_TRUE(writer.add_points(0, bytes_of(Column::layer(0))));
  const std::vector<uint64_t> quad = {0, 1, 2, 3};
  ASSERT_TRUE(writer.add_cells(CellType::quad, quad, std::vector<uint8_t>{0, 0, 0, 1}));
  ASSERT_TRUE(writer.add_cells(CellType::quad, quad));
  const auto end = writer.finish();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().code, ErrorCode::malformed_input);
  EXPECT_NE(end.error().message.find("point 3"), std::string::npos) << end.error().message;
}

TEST(Stream, RefusesPointsThatWereNotGiven) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  StreamWriter writer = *StreamWriter::begin(*sink, {});
  ASSERT_TRUE(writer.add_points(0, bytes_of(Column::layer(0))));
  EXPECT_FALSE(writer.add_points(3, bytes_of(Column::layer(0))));
  EXPECT_FALSE(writer.add_cells(CellType::hexahedron, std::vector<uint64_t>{0, 1, 2}));
  ASSERT_TRUE(writer.add_cells(CellType::quad, std::vector<uint64_t>{0, 1, 2, 9}));
  EXPECT_FALSE(writer.finish());
}

TEST(Stream, StaysFailedWhenWholeBlocksOfCellsCouldNotBeCoded) {
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  auto writer = StreamWriter::begin(*sink, {});
  ASSERT_TRUE(writer);
  const Mesh mesh = grid(20, 20, 30);
  {
    const std::vector<uint64_t> cells(mesh.blocks[0].connectivity.begin(), mesh.blocks[0].connectivity.end());
    const std::vector<uint8_t> flags(cells.size());
    const auto added = writer->add_cells(CellType::hexahedron, cells, flags);
    ASSERT_FALSE(added);
    EXPECT_NE(added.error().message.find("was not given"), std::string::npos);
  }
  EXPECT_FALSE(writer->finish());  // and does not look at the cells, which are gone
}

TEST(Stream, IsTheSameForEveryExecutor) {
  const Mesh mesh = grid(40, 30, 20);
  struct Backwards final : Executor {
    void parallel_for(size_t count, const std::function<void(size_t)>& work) override {
      while (count-- > 0) work(count);
    }
  } backwards;
  EncodeOptions options = kept();
  const std::vector<std::byte> once = encoded(mesh, options);
  options.executor = &backwards;
  EXPECT_EQ(encoded(mesh, options), once);
  DecodeOptions decoding;
  decoding.executor = &backwards;
  const auto back = decode(*memory_source(Bytes(once)), decoding);
  ASSERT_TRUE(back);
  expect_same(mesh, *back);
}

TEST(Stream, DamageCostsOnlyWhatComesBehindIt) {
  std::vector<std::byte> bytes = written_column(200000, false);
  bytes[bytes.size() * 3 / 4] ^= std::byte{1};
  StreamReader reader = *StreamReader::open(std::make_unique<Trickle>(bytes));
  StreamPortion piece;
  Result<bool> more = false;
  while ((more = reader.next(piece)) && *more) {
  }
  ASSERT_FALSE(more);
  EXPECT_EQ(more.error().code, ErrorCode::corrupt);
}

TEST(Stream, ReaderKeepsItsMemoryLimit) {
  const std::vector<std::byte> bytes = written_column(20000, false);
  StreamReadOptions options;
  options.limits.mesh_bytes = 4096;
  const auto reader = StreamReader::open(std::make_unique<Trickle>(bytes), options);
  ASSERT_FALSE(reader);
  EXPECT_EQ(reader.error().code, ErrorCode::memory_bound);
}

/// Cells that come once more behind all others: each point is in memory from its first use to the end.
Mesh grid_twice() {
  Mesh mesh = grid(20, 20, 40);
  auto& corners = mesh.blocks[0].connectivity;
  const std::vector<uint32_t> once(corners.begin(), corners.end());
  corners.insert(corners.end(), once.begin(), once.end());
  return mesh;
}

// 16,000 cells keep a line of 64 bytes each, and 18,081 points about as much, in a mesh of 1.2 MB.
TEST(Stream, WhatTheReaderKeepsCountsAgainstItsLimit) {
  const auto encoded = encode_bytes(grid_twice(), kept());
  ASSERT_TRUE(encoded) << encoded.error().message;
  const auto source = memory_source(Bytes(encoded->bytes));
  auto reader = StreamReader::open(*source, 0);
  ASSERT_TRUE(reader);
  StreamPortion portion;
  uint64_t most = 0;
  while (reader->next(portion).value()) most = std::max(most, reader->memory());
  EXPECT_GT(most, uint64_t{2} << 20);
  EXPECT_LT(most, uint64_t{16} << 20);
  DecodeOptions options;
  options.limits.mesh_bytes = uint64_t{2} << 20;
  const auto refused = decode(*source, options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::memory_bound);
  options.limits.mesh_bytes = uint64_t{24} << 20;
  EXPECT_TRUE(decode(*source, options));
}

Result<> read_all(Bytes file, uint64_t limit) {
  const auto source = memory_source(file);
  StreamReadOptions options;
  options.limits.mesh_bytes = limit;
  StreamReader reader = *StreamReader::open(source_stream(*source), options);
  StreamPortion portion;
  for (;;) {
    const auto more = reader.next(portion);
    if (!more) return tl::unexpected(more.error());
    if (!*more) return {};
  }
}

// The table of nodes has a row for each cell in memory, and comes with the first cell that has such nodes:
// some 20,000 rows of 92 bytes here, which may grow once more.
TEST(Stream, NodesBehindCornersCountBeforeTheirTableIsMade) {
  Mesh mesh = grid_twice();
  const auto linear = encode_bytes(mesh, kept());
  ASSERT_TRUE(linear) << linear.error().message;
  uint64_t limit = uint64_t{4} << 20;
  while (!read_all(linear->bytes, limit)) limit += uint64_t{256} << 10;
  CellBlock quadratic;
  quadratic.type = CellType::quadratic_tetrahedron;
  for (uint32_t node = 0; node < 10; ++node) quadratic.connectivity.push_back(node);
  mesh.blocks.push_back(quadratic);
  const auto with_nodes = encode_bytes(mesh, kept());
  ASSERT_TRUE(with_nodes) << with_nodes.error().message;
  EXPECT_TRUE(read_all(with_nodes->bytes, 4 * limit));
  const auto refused = read_all(with_nodes->bytes, limit);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::memory_bound);
}

/// One cell with many arrays.
Mesh with_arrays(unsigned count) {
  Mesh mesh = grid(1, 1, 1);
  for (unsigned i = 0; i < count; ++i) {
    Array array = make_array("a" + std::to_string(i), Domain::point, Scalar::f32, 1);
    array.resize(mesh.point_count());
    mesh.arrays.push_back(std::move(array));
  }
  return mesh;
}

// Models that no number has asked for are not made: an array of eight numbers takes tens of kilobytes.
TEST(Stream, ArraysOfFewNumbersTakeLittleMemory) {
  for (const int effort : {1, 5, 9}) {
    EncodeOptions options = kept();
    options.effort = effort;
    const auto encoded = encode_bytes(with_arrays(100), options);
    ASSERT_TRUE(encoded) << encoded.error().message;
    DecodeOptions bounded;
    bounded.limits.mesh_bytes = uint64_t{effort < 5 ? 8u : 64u} << 20;
    const auto decoded = decode_bytes(encoded->bytes, bounded);
    EXPECT_TRUE(decoded) << effort;
    bounded.limits.mesh_bytes = uint64_t{1} << 20;
    const auto refused = decode_bytes(encoded->bytes, bounded);
    ASSERT_FALSE(refused) << effort;
    EXPECT_EQ(refused.error().code, ErrorCode::memory_bound);
  }
}

// Checksums keep accidents out, not attackers: the coder itself must take any bytes.
TEST(CellCoder, AnyBytesDecodeOrAreRefused) {
  std::mt19937 random(1);
  for (unsigned round = 0; round < cases(400); ++round) {
    std::vector<std::byte> topology(200), numbers(100);
    for (std::byte& byte : topology) byte = static_cast<std::byte>(random() >> (round % 3 == 0 ? 6 : 0));
    for (std::byte& byte : numbers) byte = static_cast<std::byte>(random() >> (round % 2 == 0 ? 6 : 0));
    RangeDecoder cells{Bytes(topology)}, names{Bytes(numbers)};
    CellCoder<RangeDecoder> coder(static_cast<Mixing>(round % mixing_count), round % 5 != 0);
    CodedCells out;
    StreamedCell cell;
    for (unsigned i = 0; i < 5000; ++i) {
      if (!coder.code(cells, names, cell, out) || cells.exhausted() || names.exhausted()) break;
      if (i % 64 == 63) {
        out.clear();
        coder.end_block();
      }
    }
  }
}

// As above, but the bytes are nearly right, so that damage strikes in the middle of a mesh.
TEST(CellCoder, DamagedMeshesDecodeOrAreRefused) {
  const Mesh mesh = soup(11, 400, 90);
  RangeEncoder topology, numbers;
  CellCoder<RangeEncoder> encoder(Mixing::mixed, true);
  CodedCells out;
  std::vector<unsigned> uses(mesh.point_count());
  for (uint64_t i = 0; i < mesh.blocks[0].size(); ++i) {
    for (const uint32_t point : mesh.blocks[0].cell(i)) ++uses[point];
  }
  for (uint64_t i = 0; i < mesh.blocks[0].size(); ++i) {
    StreamedCell cell;
    const auto points = mesh.blocks[0].cell(i);
    cell.kind = kind_of(static_cast<CellType>(mesh.blocks[0].types[i]));
    cell.type = static_cast<CellType>(mesh.blocks[0].types[i]);
    cell.numbers.assign(points.begin(), points.end());
    cell.finals.assign(points.size(), 0);
    for (const uint32_t point : points) --uses[point];
    for (size_t k = 0; k < points.size() && cell.kind != loose_cell; ++k) {
      cell.number[k] = points[k];
      cell.final |= (uses[points[k]] == 0 ? 1u : 0u) << k;
    }
    encoder.code(topology, numbers, cell, out);
  }
  const std::vector<std::byte> right_cells = topology.finish(), right_numbers = numbers.finish();
  std::mt19937 random(2);
  for (unsigned round = 0; round < cases(600); ++round) {
    std::vector<std::byte> cells = right_cells, names = right_numbers;
    cells[random() % cells.size()] ^= static_cast<std::byte>(1u << random() % 8);
    if (round % 3 == 0) names[random() % names.size()] ^= static_cast<std::byte>(1u << random() % 8);
    RangeDecoder cell_decoder{Bytes(cells)}, name_decoder{Bytes(names)};
    CellCoder<RangeDecoder> decoder(Mixing::mixed, true);
    StreamedCell cell;
    out.clear();
    for (unsigned i = 0; i < 1000; ++i) {
      if (!decoder.code(cell_decoder, name_decoder, cell, out) || cell_decoder.exhausted()) break;
    }
  }
}

}  // namespace
}  // namespace maille
