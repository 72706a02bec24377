#include "container/packed_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "base/hash.h"
#include "container/testing.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::HasSubstr;

constexpr FileHeader single = {.major = format_major, .minor = format_minor};

std::vector<TestStream> streams_of_a_mesh() {
  return {{{"DESC"}, bytes_of("description")},
          {{"TOPO", 0, 1}, noise(30, 1)},
          {{"POSI", 0, 1}, noise(200, 2)},
          {{"ARRY", 0, 300}, {}}};
}

std::vector<std::byte> file_of(const std::vector<TestStream>& streams, const FileHeader& header = single) {
  std::vector<NamedStream> named;
  for (const TestStream& stream : streams) named.push_back({stream.key, stream.content});
  std::vector<std::byte> file;
  const auto sink = memory_sink(file);
  const uint64_t size = write_file(*sink, header, named).value_or(0);
  EXPECT_EQ(size, file.size());
  return file;
}

bool is_packed(Bytes file) {
  return (read_file_header(file.first(file_header_bytes), "f")->required_features & packed_feature) != 0;
}

/// A packed file of these streams, type and number in one, and their sizes and contents, whose checks are
/// right.
struct Stream {
  uint64_t stream;
  uint64_t size;
  std::string_view content;
};
std::vector<std::byte> packed(std::initializer_list<Stream> streams) {
  ByteWriter out;
  FileHeader header = single;
  header.required_features = packed_feature;
  out.put_bytes(write_file_header(header));
  for (const Stream& stream : streams) {
    ByteWriter checked;
    checked.put_count(stream.stream);
    checked.put_count(stream.size);
    out.put_bytes(checked.bytes());
    checked.put_bytes(bytes_of(stream.content));
    out.put(static_cast<uint16_t>(hash64(checked.bytes())));
    out.put_bytes(bytes_of(stream.content));
  }
  out.put(hash64(out.bytes()));
  return out.take();
}

/// Which of a file's streams are given although it is damaged; "wrong" if one has other bytes.
std::string remains_of(Bytes file, const std::vector<TestStream>& streams) {
  const auto source = memory_source(file, "f");
  const auto reader = FileReader::open(*source);
  if (!reader) return "";
  std::string types;
  for (const TestStream& stream : streams) {
    const auto content = reader->read_stream(stream.key);
    if (content && *content != stream.content) return "wrong";
    if (content) types += std::string(stream.key.type) + " ";
  }
  return types;
}

TEST(PackedFile, GivesItsStreamsBack) {
  const std::vector<std::byte> file = file_of(streams_of_a_mesh());
  EXPECT_TRUE(is_packed(file));
  expect_streams(file, streams_of_a_mesh());
  EXPECT_EQ(damage_report(file, streams_of_a_mesh()), "");
}

TEST(PackedFile, SpendsFortyFiveBytesOnThreeStreams) {
  size_t content = 0;
  std::vector<TestStream> streams = streams_of_a_mesh();
  streams.pop_back();
  streams.back().content.resize(100);
  for (const TestStream& stream : streams) content += stream.content.size();
  EXPECT_EQ(file_of(streams).size(), content + 45);
}

TEST(PackedFile, IsTriedOnlyWhereAllStreamsFit) {
  const auto with = [](const StreamKey& key, size_t size) {
    std::vector<TestStream> streams = streams_of_a_mesh();
    streams.push_back({key, noise(size, 3)});
    return streams;
  };
  for (const auto& streams : {with({"POSI", 1}, 9), with({"note"}, 9), with({"ORDR"}, most_packed_bytes)}) {
    const std::vector<std::byte> file = file_of(streams);
    EXPECT_FALSE(is_packed(file));
    expect_streams(file, streams);
  }
  FileHeader header = single;
  header.mode = Mode::stream;
  EXPECT_FALSE(is_packed(file_of(streams_of_a_mesh(), header)));
}

TEST(PackedFile, MayBeAsLargeAsOneRead) {
  std::vector<TestStream> streams = streams_of_a_mesh();
  const size_t others = file_of(streams).size();
  streams[1].content = noise(30 + most_packed_bytes - others - 2, 1);  // two bytes for its size
  EXPECT_EQ(file_of(streams).size(), most_packed_bytes);
  EXPECT_TRUE(is_packed(file_of(streams)));
  expect_streams(file_of(streams), streams);
  streams[1].content.push_back({});
  EXPECT_FALSE(is_packed(file_of(streams)));
}

TEST(PackedFile, GivesWhatIsNotDamaged) {
  const std::vector<TestStream> streams = streams_of_a_mesh();
  std::vector<std::byte> file = file_of(streams);
  const auto flipped = [&](size_t at) {
    std::vector<std::byte> bytes = file;
    bytes[at] ^= std::byte{1};
    return remains_of(bytes, streams);
  };
  const size_t description = file_header_bytes + 4;
  const size_t topology = description + 11 + 4;
  EXPECT_EQ(flipped(description), "TOPO POSI ARRY ");
  EXPECT_EQ(flipped(topology), "DESC POSI ARRY ");
  EXPECT_EQ(flipped(topology - 4), "DESC POSI ARRY ");  // of another type
  EXPECT_EQ(flipped(topology - 1), "DESC POSI ARRY ");  // its check
  EXPECT_EQ(flipped(file.size() - 1), "DESC TOPO POSI ARRY ");
  EXPECT_EQ(remains_of(Bytes(file).first(file.size() - 8), streams), "DESC TOPO POSI ");
  EXPECT_EQ(remains_of(Bytes(file).first(topology + 30), streams), "DESC TOPO ");
  EXPECT_EQ(remains_of(Bytes(file).first(topology + 29), streams), "DESC ");
  file.insert(file.end(), 5, {});
  EXPECT_EQ(remains_of(file, streams), "DESC TOPO POSI ARRY ");
}

TEST(PackedFile, NamesWhatIsDamaged) {
  std::vector<std::byte> file = file_of(streams_of_a_mesh());
  const auto problem = [](Bytes bytes) { return damage_report(bytes, streams_of_a_mesh()); };
  EXPECT_EQ(
      problem(Bytes(file).first(60)),
      "f: damaged or incomplete: chunk TOPO (patch 0, number 1, part 0) is cut off: 16 of its 30 bytes are "
      "there (from byte 44 on)");
  file[50] ^= std::byte{1};
  EXPECT_EQ(problem(file),
            "f: damaged or incomplete: chunk TOPO (patch 0, number 1, part 0), bytes 40..74: "
            "checksum mismatch: the file is damaged there");
  EXPECT_EQ(verify_checksums(*memory_source(file))->size(), 1u);
}

TEST(PackedFile, ShowsEveryBitFlipAndCut) {
  std::vector<std::byte> file = file_of(streams_of_a_mesh());
  for (size_t bit = 0; bit < 8 * file.size(); ++bit) {
    file[bit / 8] ^= std::byte{1} << bit % 8;
    const std::string report = damage_report(file, streams_of_a_mesh());
    EXPECT_TRUE(!report.empty() && report != "wrong") << bit;
    const auto damage = verify_checksums(*memory_source(file));
    EXPECT_TRUE(!damage || !damage->empty()) << bit;
    file[bit / 8] ^= std::byte{1} << bit % 8;
  }
  for (size_t size = 0; size < file.size(); ++size)
    EXPECT_NE(damage_report(Bytes(file).first(size), streams_of_a_mesh()), "") << size;
  file.push_back({});
  EXPECT_NE(damage_report(file, streams_of_a_mesh()), "");
}

TEST(PackedFile, IsRefusedWhereItsStreamsCannotBe) {
  EXPECT_EQ(damage_report(packed({{0, 3, "abc"}, {1, 2, "de"}}), {{{"DESC"}, bytes_of("abc")}}), "");
  const auto report = [](const std::vector<std::byte>& file) { return damage_report(file, {}); };
  EXPECT_THAT(report(packed({{0, 3, "abc"}, {1, 20, "de"}})), HasSubstr("10 of its 20 bytes"));
  EXPECT_THAT(report(packed({{0, 3, "abc"}, {1, 3, "de"}})), HasSubstr("TOPO"));
  EXPECT_THAT(report(packed({{0, 3, "abc"}, {6, 2, "de"}})), HasSubstr("no intact stream"));
  EXPECT_THAT(report(packed({{0, most_packed_bytes + 1, "abc"}})), HasSubstr("no intact stream"));
  EXPECT_THAT(report(packed({{UINT64_MAX, 3, "abc"}})), HasSubstr("no intact stream"));
  EXPECT_THAT(report(packed({{0, 3, "abc"}, {0, 2, "de"}})), HasSubstr("chunk DESC"));
  EXPECT_THAT(report(packed({{0, most_packed_bytes, std::string(most_packed_bytes, 'a')}})),
              HasSubstr("larger than a packed file"));
}

TEST(PackedFile, IsOfModeSingle) {
  const auto source = memory_source(
      write_file_header({.minor = format_minor, .required_features = packed_feature, .mode = Mode::random}));
  const auto reader = FileReader::open(*source);
  ASSERT_FALSE(reader);
  EXPECT_EQ(reader.error().code, ErrorCode::unsupported);
}

}  // namespace
}  // namespace maille
