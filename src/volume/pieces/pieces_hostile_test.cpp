// Files in pieces with good checksums and lies: of a box, of statistics, of numbers, of a step. Decoding into
// parts, as `maille verify` does, names them. tests/corrupt/pieces has each beside its sentence (UPDATE=1).
#include <maille/file.h>
#include <maille/out_of_core.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "container/file_reader.h"
#include "container/file_writer.h"
#include "support/data.h"
#include "support/files.h"
#include "support/temporary_folder.h"
#include "volume/pieces/piece_layout.h"
#include "volume/stream/mesh_from_parts.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

Mesh mesh_at(float time) {
  Mesh mesh = grid(5, 4, 4);
  Array field = make_array("T", Domain::point, Scalar::f32, 1);
  field.resize(mesh.point_count());
  for (size_t i = 0; i < mesh.point_count(); ++i) field.values<float>()[i] = static_cast<float>(i % 7) + time;
  mesh.arrays = {field};
  return mesh;
}

/// A file of two pieces and a step of time behind it.
std::vector<std::byte> file_with_step() {
  const testing::TemporaryFolder folder;
  EncodeOptions options = kept(2);
  options.most_cells_per_part = 30;
  const std::vector<std::byte> bytes = encoded(mesh_at(0), options);
  const std::string path = folder.path("steps.maille");
  write_bytes(path, bytes);
  EXPECT_TRUE(append_step(path, 1, mesh_at(10)));
  const auto source = *file_source(path);
  std::vector<std::byte> all(source->size());
  EXPECT_TRUE(source->read_at(0, all));
  return all;
}

/// The same streams but one, with good checksums.
std::vector<std::byte> with_stream(const std::vector<std::byte>& file, const StreamKey& wanted,
                                   const std::function<void(std::vector<std::byte>&)>& change) {
  const auto source = memory_source(Bytes(file));
  const FileReader reader = *FileReader::open(*source);
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  FileWriter writer = *FileWriter::begin(*sink, reader.header());
  unsigned changed = 0;
  for (const ChunkRecord& record : reader.records()) {
    StreamKey key = {"", record.header.patch, record.header.number};
    std::copy(record.header.type.begin(), record.header.type.end(), key.type);
    std::vector<std::byte> stream = *reader.read_stream(key);
    const bool same = std::equal(key.type, key.type + 4, wanted.type);
    if (same && key.patch == wanted.patch && key.number == wanted.number && changed++ == 0) change(stream);
    EXPECT_TRUE(writer.write_stream(key, stream));
  }
  EXPECT_EQ(changed, 1u) << std::string(wanted.type, 4);
  EXPECT_TRUE(writer.finish());
  return bytes;
}

/// What `maille verify` finds: the mesh and all steps, into parts.
Result<> decoded_into_parts(const Source& source) {
  const auto steps = list_steps(source);
  if (!steps) return tl::unexpected(steps.error());
  for (uint64_t step = 0; step <= steps->size(); ++step) {
    DecodeOptions options;
    options.step = step;
    options.limits.mesh_bytes = 64 << 20;
    const auto description = describe(source, options);
    if (!description) return tl::unexpected(description.error());
    MeshFromParts sink(*description);
    const auto done = decode(source, sink, options);
    if (!done) return done;
  }
  return {};
}

const std::string folder = tests_folder() + "/corrupt/pieces/";

void expect_found(const std::string& name, const std::vector<std::byte>& bytes) {
  const auto found = decoded_into_parts(*memory_source(Bytes(bytes), name + ".maille"));
  ASSERT_FALSE(found) << name;
  EXPECT_EQ(found.error().code, ErrorCode::corrupt) << found.error().message;
  const char* const update = std::getenv("UPDATE");
  if (update != nullptr && std::string(update) == "1") {
    std::filesystem::create_directories(folder);
    write_bytes(folder + name + ".maille", bytes);
    std::ofstream(folder + name + ".maille.error")
        << static_cast<int>(found.error().code) << ' ' << found.error().message << '\n';
  }
  EXPECT_TRUE(std::filesystem::exists(folder + name + ".maille"));
}

using Records = std::vector<PieceRecord>;
std::vector<std::byte> with_index(const std::function<void(Records&)>& change) {
  return with_stream(file_with_step(), {"PIDX"}, [&](std::vector<std::byte>& stream) {
    Records records = decode_index(stream, uint64_t{1} << 20)->records;
    ASSERT_GE(records.size(), 2u);
    change(records);
    stream = encode_index(records);
  });
}

TEST(PiecesHostile, WrittenAgainAFileIsAsItWas) {
  const auto found = decoded_into_parts(*memory_source(with_index([](auto&) {})));
  EXPECT_TRUE(found) << found.error().message;
}

TEST(PiecesHostile, AnIndexThatLiesOfABox) {
  expect_found("index_with_a_box_too_small", with_index([](Records& r) { r[1].high[0] = r[1].low[0]; }));
}

TEST(PiecesHostile, AnIndexThatLiesOfStatistics) {
  expect_found("index_with_a_range_too_small", with_index([](Records& r) {
                 r[0].fields[0].components[0].high = r[0].fields[0].components[0].low;
               }));
}

TEST(PiecesHostile, AnIndexThatLiesOfNumbersOfCells) {
  expect_found("index_with_other_numbers", with_index([](Records& r) {
                 r[0].first_cell = r[1].first_cell;
                 r[0].last_cell = r[1].last_cell;
               }));
}

TEST(PiecesHostile, AnIndexThatLiesOfCounts) {
  expect_found("index_with_fewer_cells", with_index([](Records& r) { r[0].cells -= 1; }));
}

TEST(PiecesHostile, PiecesWithTheNumbersOfEachOther) {
  std::vector<std::byte> other;
  const std::vector<std::byte> file = file_with_step();
  with_stream(file, {"GIDS", 1}, [&](std::vector<std::byte>& stream) { other = stream; });
  expect_found("pieces_with_the_same_numbers",
               with_stream(file, {"GIDS", 0}, [&](std::vector<std::byte>& stream) { stream = other; }));
}

TEST(PiecesHostile, AStepWithTheValuesOfAnotherPiece) {
  std::vector<std::byte> other;
  const std::vector<std::byte> file = file_with_step();
  with_stream(file, {"SVAL", 1, 1}, [&](std::vector<std::byte>& stream) { other = stream; });
  expect_found("step_with_values_of_another_piece",
               with_stream(file, {"SVAL", 1, 0}, [&](std::vector<std::byte>& stream) { stream = other; }));
}

TEST(PiecesHostile, AStepWhoseValuesEnd) {
  expect_found("step_whose_values_end",
               with_stream(file_with_step(), {"SVAL", 1, 0},
                           [&](std::vector<std::byte>& stream) { stream.resize(stream.size() / 2); }));
}

TEST(PiecesHostile, AStepWhoseIndexLies) {
  expect_found("step_with_a_range_too_small",
               with_stream(file_with_step(), {"SIDX", 1, 0}, [&](std::vector<std::byte>& stream) {
                 auto fields = decode_step_index(stream, uint64_t{1} << 20)->records;
                 fields[0][0].components[0].high = fields[0][0].components[0].low;
                 stream = encode_step_index(fields);
               }));
}

/// Also by readers of another time than the writer.
TEST(PiecesHostile, FilesThatLieAreNamedInOneSentence) {
  unsigned files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".maille") continue;
    const std::string expected = read_text(entry.path().string() + ".error");
    const std::vector<std::byte> bytes = read_bytes(entry.path());
    const auto found = decoded_into_parts(*memory_source(bytes, entry.path().filename().string()));
    ASSERT_FALSE(found) << entry.path();
    EXPECT_EQ(std::to_string(static_cast<int>(found.error().code)) + " " + found.error().message + "\n",
              expected);
    ++files;
  }
  EXPECT_GE(files, 8u);
}

}  // namespace
}  // namespace maille
