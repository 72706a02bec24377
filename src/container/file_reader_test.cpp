#include "container/file_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "base/hash.h"
#include "container/testing.h"
#include "support/cases.h"

namespace maille {
namespace {

using namespace maille::testing;
using ::testing::HasSubstr;

Result<FileReader> open_bytes(std::unique_ptr<Source>& source, Bytes bytes,
                              std::span<const std::string_view> known = {}) {
  source = memory_source(bytes, "f");
  return FileReader::open(*source, known);
}

std::vector<ChunkRecord> records_of(Bytes file) {
  const auto source = memory_source(file);
  return FileReader::open(*source)->records();
}

Bytes part_of(Bytes file, const ChunkRecord& record) {
  return file.subspan(record.offset, static_cast<size_t>(chunk_total_bytes(record.header)));
}

std::vector<std::byte> join(std::initializer_list<Bytes> parts) {
  std::vector<std::byte> bytes;
  for (const Bytes part : parts) bytes.insert(bytes.end(), part.begin(), part.end());
  return bytes;
}

size_t index_offset(Bytes file) {
  return static_cast<size_t>(read_footer(file.last(footer_bytes))->index_offset);
}

/// The file with a new index and a footer that fits it: what only a hostile writer would make.
std::vector<std::byte> with_index(Bytes file, Bytes index, const std::vector<ChunkRecord>& digested) {
  const size_t offset = index_offset(file);
  const ChunkHeader header = {
      .type = index_type, .part_and_last = 1, .size = static_cast<uint32_t>(index.size())};
  std::vector<std::byte> chunk = join({write_chunk_header(header), index});
  const uint64_t checksum = hash64(chunk);
  chunk = join({chunk, std::as_bytes(std::span(&checksum, 1))});
  Digest digest(file.first(file_header_bytes));
  for (const ChunkRecord& record : digested) digest.add_chunk(record.header, record.checksum);
  return join({file.first(offset), chunk, write_footer({offset, digest.finish(offset)})});
}

std::vector<std::byte> index_of(const std::vector<ChunkRecord>& records) {
  ByteWriter out;
  for (const ChunkRecord& record : records) {
    FieldWriter fields(out);
    ChunkHeader::visit(record.header, fields);
    out.put(record.checksum);
  }
  return out.take();
}

TEST(FileReader, GivesHeaderChunksAndStreams) {
  const std::vector<std::byte> file = write_file(large_streams());
  expect_streams(file, large_streams());
  std::unique_ptr<Source> source;
  const auto reader = open_bytes(source, file);
  EXPECT_TRUE(reader->complete());
  EXPECT_TRUE(reader->check_complete());
  EXPECT_TRUE(reader->problems().empty());
  EXPECT_EQ(reader->header().minor, format_minor);
  ASSERT_EQ(reader->chunks().size(), 7u);
  EXPECT_EQ(reader->chunks()[3].type, "CONN");
  EXPECT_EQ(reader->chunks()[3].id, uint64_t{1} << 32);
  EXPECT_EQ(reader->chunks()[6].id, 7u);
  EXPECT_EQ(reader->chunks()[0].offset, file_header_bytes);
  EXPECT_EQ(reader->chunks()[1].size, max_chunk_bytes);
  EXPECT_FALSE(reader->has_stream({"POSN", 1}));
  EXPECT_EQ(reader->stream_bytes({"POSN", 1}), 0u);
}

TEST(FileReader, NamesAMissingStream) {
  std::unique_ptr<Source> source;
  const std::vector<std::byte> file = write_file(small_streams());
  const auto stream = open_bytes(source, file)->read_stream({"POSN", 4, 2});
  ASSERT_FALSE(stream);
  EXPECT_EQ(stream.error().code, ErrorCode::corrupt);
  EXPECT_EQ(stream.error().message, "f: stream POSN (patch 4, number 2) is missing");
}

TEST(FileReader, RefusesWhatIsNoMailleFile) {
  std::unique_ptr<Source> source;
  const auto message = [&](Bytes bytes) {
    const auto reader = open_bytes(source, bytes);
    EXPECT_FALSE(reader);
    EXPECT_EQ(reader.error().code, ErrorCode::corrupt);
    return reader ? "" : reader.error().message;
  };
  EXPECT_EQ(message({}), "f: not a .maille file: it is empty");
  EXPECT_EQ(message(bytes_of("ply\nformat ascii 1.0\nelement")),
            "f: not a .maille file: it does not start with the magic bytes");
  std::vector<std::byte> file = write_file(small_streams());
  EXPECT_EQ(message(Bytes(file).first(20)), "f: cut off within its header");
  file.erase(file.begin() + 4);  // what a transfer in text mode does to CR LF
  EXPECT_THAT(message(file), HasSubstr("binary mode"));
}

TEST(FileReader, NamesWhatANewerFileNeeds) {
  std::unique_ptr<Source> source;
  const auto message = [&](const FileHeader& header) {
    const std::vector<std::byte> bytes = write_file_header(header);
    const auto reader = open_bytes(source, bytes);
    EXPECT_FALSE(reader);
    EXPECT_EQ(reader.error().code, ErrorCode::unsupported);
    return reader ? "" : reader.error().message;
  };
  EXPECT_EQ(message({.major = 7, .minor = 3}),
            "f: needs a newer maille: the file has format 7.3, this maille reads 0.2");
  EXPECT_EQ(message({.major = 0, .minor = format_minor, .required_features = 16}),
            "f: needs a newer maille: the file (format 0.2) uses features this one does not know (bits 16)");
  EXPECT_THAT(message({.minor = format_minor, .mode = static_cast<Mode>(9)}), HasSubstr("unknown mode 9"));
}

TEST(FileReader, IgnoresUnknownOptionalFeatures) {
  std::unique_ptr<Source> source;
  EXPECT_TRUE(
      open_bytes(source, write_file_header({.minor = format_minor, .optional_features = UINT32_MAX})));
}

TEST(FileReader, RefusesUnknownCriticalChunksAndSkipsOthers) {
  std::unique_ptr<Source> source;
  const std::vector<std::byte> file = write_file(small_streams());
  const std::string_view all[] = {"MESH", "CONN", "POSN"};
  EXPECT_TRUE(open_bytes(source, file, all));  // "attr" may be skipped
  const auto reader = open_bytes(source, file, std::span(all).first(2));
  ASSERT_FALSE(reader);
  EXPECT_EQ(reader.error().code, ErrorCode::unsupported);
  EXPECT_EQ(
      reader.error().message,
      "f: needs a newer maille: chunk POSN (patch 0, number 0, part 0) at byte 103 is of an unknown kind");
}

TEST(FileReader, ReportsEveryTruncation) {
  const std::vector<TestStream> streams = small_streams();
  const std::vector<std::byte> file = write_file(streams);
  for (size_t size = 0; size < file.size(); ++size) {
    const std::string report = damage_report(Bytes(file).first(size), streams);
    EXPECT_THAT(report, HasSubstr("f: ")) << size;
  }
}

TEST(FileReader, GivesEveryWholeStreamBeforeACut) {
  const std::vector<TestStream> streams = large_streams();
  const std::vector<std::byte> file = write_file(streams);
  const std::vector<ChunkRecord> records = records_of(file);
  for (size_t size = file_header_bytes; size < file.size(); size += 7919) {
    std::unique_ptr<Source> source;
    const auto reader = open_bytes(source, Bytes(file).first(size));
    ASSERT_TRUE(reader) << reader.error().message;
    EXPECT_FALSE(reader->complete());
    EXPECT_FALSE(reader->problems().empty());
    const auto whole = std::count_if(records.begin(), records.end(), [&](const ChunkRecord& record) {
      return record.offset + chunk_total_bytes(record.header) <= size;
    });
    ASSERT_EQ(reader->records().size(), static_cast<size_t>(whole));
    for (const ChunkRecord& record : reader->records()) EXPECT_TRUE(reader->read_chunk(record));
  }
}

TEST(FileReader, SaysWhereAFileIsCut) {
  std::unique_ptr<Source> source;
  const std::vector<std::byte> file = write_file(small_streams());
  const auto reader = open_bytes(source, Bytes(file).first(150));
  EXPECT_THAT(
      reader->problems(),
      ::testing::ElementsAre("the end of the file is missing or damaged",
                             "chunk POSN (patch 0, number 0, part 0) is cut off: 47 of its 60 bytes are "
                             "there (from byte 103 on)"));
  EXPECT_EQ(reader->check_complete().error().message,
            "f: damaged or incomplete: the end of the file is missing or damaged");
}

TEST(FileReader, DetectsEveryBitFlipInASmallFile) {
  const std::vector<TestStream> streams = small_streams();
  std::vector<std::byte> file = write_file(streams);
  for (size_t bit = 0; bit < 8 * file.size(); ++bit) {
    file[bit / 8] ^= std::byte{1} << bit % 8;
    const std::string report = damage_report(file, streams);
    EXPECT_THAT(report, HasSubstr("f: ")) << "bit " << bit;  // no byte of a small file is redundant
    file[bit / 8] ^= std::byte{1} << bit % 8;
  }
}

TEST(FileReader, OneFlippedBitCostsAtMostItsChunk) {
  const std::vector<TestStream> streams = {
      {{"AAAA"}, noise(300, 1)}, {{"BBBB"}, noise(70000, 2)}, {{"CCCC"}, noise(9, 3)}};
  std::vector<std::byte> file = write_file(streams);
  const std::vector<ChunkRecord> records = records_of(file);
  for (size_t bit = 8 * file_header_bytes; bit < 8 * file.size();
       bit += every(bit < 3200 || bit > 8 * 70300 ? 1 : 1009)) {
    file[bit / 8] ^= std::byte{1} << bit % 8;
    std::unique_ptr<Source> source;
    const auto reader = open_bytes(source, file);
    ASSERT_TRUE(reader);
    for (size_t i = 0; i < streams.size(); ++i) {
      const uint64_t end = records[i].offset + chunk_total_bytes(records[i].header);
      const bool hit = bit / 8 >= records[i].offset && bit / 8 < end;
      const auto content = reader->read_stream(streams[i].key);
      ASSERT_EQ(content.has_value(), !hit) << "bit " << bit << " stream " << i;
      ASSERT_TRUE(hit || *content == streams[i].content);
    }
    file[bit / 8] ^= std::byte{1} << bit % 8;
  }
}

TEST(FileReader, NeedsNoIndex) {
  const std::vector<TestStream> streams = large_streams();
  const std::vector<std::byte> file = write_file(streams);
  const size_t index = index_offset(file);
  ASSERT_GT(index, 0u);

  // The index damaged: the footer still proves that nothing is missing.
  std::vector<std::byte> damaged = file;
  damaged[index + 30] ^= std::byte{1};
  expect_streams(damaged, streams);
  std::unique_ptr<Source> source;
  EXPECT_TRUE(open_bytes(source, damaged)->complete());
  EXPECT_EQ(open_bytes(source, damaged)->problems(),
            std::vector<std::string>{
                "the index is damaged (checksum mismatch); its chunks were found by scanning"});

  // Index removed, or index and footer removed.
  const auto no_index = join({Bytes(file).first(index), Bytes(file).last(footer_bytes)});
  expect_streams(no_index, streams);
  EXPECT_TRUE(open_bytes(source, no_index)->complete());
  expect_streams(Bytes(file).first(index), streams);
  EXPECT_FALSE(open_bytes(source, Bytes(file).first(index))->complete());
}

TEST(FileReader, NoticesChunksMovedDoubledLostOrForeign) {
  const std::vector<TestStream> streams = small_streams();
  const std::vector<std::byte> file = write_file(streams);
  std::vector<TestStream> other = streams;
  other[2].content = noise(40, 77);
  const std::vector<std::byte> foreign = write_file(other);
  const std::vector<ChunkRecord> records = records_of(file);
  const Bytes head = Bytes(file).first(file_header_bytes);
  const Bytes tail = Bytes(file).last(footer_bytes);
  const Bytes a = part_of(file, records[0]), b = part_of(file, records[1]), c = part_of(file, records[2]),
              d = part_of(file, records[3]);
  ASSERT_TRUE(join({head, a, b, c, d, tail}) == file);
  const std::vector<std::vector<std::byte>> bad = {
      join({head, b, a, c, d, tail}),                                    // moved
      join({head, a, a, b, c, d, tail}),                                 // doubled
      join({head, a, b, c, d, d, tail}),                                 //
      join({head, a, b, c, tail}),                                       // lost
      join({head, tail}),                                                //
      join({head, a, b, part_of(foreign, records[2]), d, tail}),         // of another file, same key and size
      join({head, a, b, c, d, Bytes(foreign).last(footer_bytes)}),       //
      join({head, a, b, c, d, Bytes(file).subspan(file_header_bytes)}),  // written twice
  };
  for (size_t i = 0; i < bad.size(); ++i) {
    EXPECT_THAT(damage_report(bad[i], streams), HasSubstr("f: damaged or incomplete")) << i;
  }
}

TEST(FileReader, NoticesAForeignChunkBehindAnIndex) {
  std::vector<TestStream> streams = large_streams();
  std::vector<std::byte> file = write_file(streams);
  streams[4].content = noise(500, 99);
  const std::vector<std::byte> foreign = write_file(streams);
  const Bytes chunk = part_of(foreign, records_of(foreign)[6]);
  std::copy(chunk.begin(), chunk.end(), file.begin() + static_cast<ptrdiff_t>(records_of(file)[6].offset));
  const std::string report = damage_report(file, large_streams());
  EXPECT_THAT(report, HasSubstr("f: chunk attr (patch 0, number 7, part 0), bytes "));
  EXPECT_THAT(report, HasSubstr("checksum mismatch"));
}

TEST(FileReader, IgnoresJunkBetweenChunksButTellsIt) {
  const std::vector<TestStream> streams = small_streams();
  const std::vector<std::byte> file = write_file(streams);
  const std::vector<ChunkRecord> records = records_of(file);
  const size_t place = static_cast<size_t>(records[2].offset);
  const auto junk =
      join({Bytes(file).first(place), bytes_of("\xa5M\xa5MMESH junk"), Bytes(file).subspan(place)});
  expect_streams(junk, streams);
  std::unique_ptr<Source> source;
  EXPECT_THAT(open_bytes(source, junk)->problems(),
              ::testing::ElementsAre(HasSubstr("hold no intact chunk header")));
}

TEST(FileReader, SurvivesHostileIndexes) {
  const std::vector<TestStream> streams = large_streams();
  const std::vector<std::byte> file = write_file(streams);
  const std::vector<ChunkRecord> records = records_of(file);
  const auto opens_by_scan = [&](const std::vector<ChunkRecord>& listed) {
    const std::vector<std::byte> hostile = with_index(file, index_of(listed), listed);
    std::unique_ptr<Source> source;
    const auto reader = open_bytes(source, hostile);
    return reader && !reader->problems().empty() && reader->records().size() == records.size();
  };
  std::vector<ChunkRecord> listed = records;
  EXPECT_FALSE(opens_by_scan(listed));  // the true index is taken
  listed.push_back(records[2]);
  EXPECT_TRUE(opens_by_scan(listed));  // more than the file holds
  listed = {records.begin(), records.end() - 1};
  EXPECT_TRUE(opens_by_scan(listed));  // fewer
  listed = records;
  listed[1].header.size = max_chunk_bytes - 1;
  EXPECT_TRUE(opens_by_scan(listed));  // sizes that do not add up
  listed.assign(100000, records[1]);
  EXPECT_TRUE(opens_by_scan(listed));  // a terabyte
  EXPECT_TRUE(opens_by_scan({}));
}

TEST(FileReader, FindsTwoExchangedIndexEntries) {
  const std::vector<std::byte> file = write_file(large_streams());
  std::vector<ChunkRecord> listed = records_of(file);
  std::swap(listed[2].header.patch, listed[3].header.patch);
  const std::vector<std::byte> hostile = with_index(file, index_of(listed), listed);
  EXPECT_THAT(damage_report(hostile, large_streams()), HasSubstr("f: "));
}

TEST(FileReader, RefusesIndexPlacesOutsideTheFile) {
  const std::vector<std::byte> file = write_file(large_streams());
  for (const uint64_t place :
       {uint64_t{1}, uint64_t{24}, uint64_t{25}, uint64_t{file.size()}, uint64_t{file.size() - 1},
        uint64_t{file.size() - footer_bytes}, UINT64_MAX, UINT64_MAX / 2 + 1}) {
    std::vector<std::byte> hostile = file;
    store(hostile.data() + hostile.size() - footer_bytes, place);
    std::unique_ptr<Source> source;
    const auto reader = open_bytes(source, hostile);
    ASSERT_TRUE(reader) << place;
    EXPECT_FALSE(reader->complete());
    EXPECT_EQ(reader->records().size(), 7u);
  }
}

TEST(FileReader, RefusesAValidFileWhosePartsDoNotFit) {
  // A hostile writer: valid checksums and digest, but a part twice, a part missing, a part behind the last.
  const auto file_of = [](const std::vector<uint32_t>& parts) {
    std::vector<std::byte> file = write_file_header({.minor = format_minor});
    Digest digest(file);
    for (const uint32_t part : parts) {
      std::vector<std::byte> chunk =
          write_chunk_header({.type = {'P', 'O', 'S', 'N'}, .part_and_last = part});
      const uint64_t checksum = hash64(chunk);
      digest.add_chunk(read_chunk_header(chunk)->header, checksum);
      file = join({file, chunk, std::as_bytes(std::span(&checksum, 1))});
    }
    return join({file, write_footer({0, digest.finish(0)})});
  };
  EXPECT_EQ(damage_report(file_of({0, 3}), {{{"POSN"}, {}}}), "");
  EXPECT_EQ(damage_report(file_of({3, 0}), {{{"POSN"}, {}}}), "");
  for (const auto& parts : std::vector<std::vector<uint32_t>>{{0},
                                                              {3},
                                                              {1, 1},
                                                              {0, 0, 3},
                                                              {0, 5},
                                                              {1, 2},
                                                              {1, 3},
                                                              {0, 2},
                                                              {0, 3, 3},
                                                              {UINT32_MAX},
                                                              {0, UINT32_MAX}}) {
    const std::string report = damage_report(file_of(parts), {{{"POSN"}, {}}});
    EXPECT_THAT(report, HasSubstr("f: damaged or incomplete: chunk POSN")) << parts.size();
    std::unique_ptr<Source> source;
    const std::vector<std::byte> file = file_of(parts);
    EXPECT_FALSE(open_bytes(source, file)->read_stream({"POSN"}));
  }
}

TEST(FileReader, ReadsEachByteAFewTimesWhateverTheFileHolds) {
  // Markers everywhere, and headers that each claim a whole chunk: a search that started anew at each would
  // be quadratic.
  const std::vector<std::byte> header = write_file_header({.minor = format_minor});
  const std::vector<std::byte> claim =
      write_chunk_header({.type = {'P', 'O', 'S', 'N'}, .part_and_last = 1, .size = max_chunk_bytes});
  for (const Bytes& pattern : {Bytes(claim), Bytes(claim).first(2), Bytes(claim).first(1)}) {
    std::vector<std::byte> file = header;
    while (file.size() < 1000000) file.insert(file.end(), pattern.begin(), pattern.end());
    const RemoteSource source(file);
    const auto reader = FileReader::open(source);
    ASSERT_TRUE(reader);
    EXPECT_FALSE(reader->complete());
    EXPECT_LE(reader->problems().size(), 200u);
    EXPECT_LE(source.bytes_read(), 2 * file.size());
  }
}

TEST(FileReader, SurvivesGarbage) {
  const std::vector<std::byte> header = write_file_header({.minor = format_minor});
  for (uint32_t seed = 0; seed < 2000; ++seed) {
    std::vector<std::byte> file = join({header, noise(seed % 97 * 3, seed)});
    if (seed % 2 != 0) file = join({file, write_footer({seed % 3 * uint64_t{25}, seed})});
    const std::string report = damage_report(file, {{{"POSN"}, {}}});
    EXPECT_THAT(report, HasSubstr("f: damaged or incomplete")) << seed;
  }
}

TEST(FileReader, SurvivesEveryHeaderFieldAtItsExtremes) {
  const std::vector<TestStream> streams = small_streams();
  const std::vector<std::byte> file = write_file(streams);
  for (size_t place = 0; place < file.size(); ++place) {
    for (const unsigned value : {0x00u, 0x01u, 0x7fu, 0x80u, 0xffu}) {
      for (size_t run = 1; run <= 8 && place + run <= file.size(); run *= 2) {
        std::vector<std::byte> hostile = file;
        std::fill_n(hostile.begin() + static_cast<ptrdiff_t>(place), run, static_cast<std::byte>(value));
        const std::string report = damage_report(hostile, streams);
        EXPECT_EQ(report.empty(), hostile == file) << place;
        EXPECT_NE(report, "wrong") << place;
      }
    }
  }
}

TEST(VerifyChecksums, FindsNothingInAnIntactFile) {
  for (const auto& streams : {small_streams(), large_streams()}) {
    const std::vector<std::byte> file = write_file(streams);
    const auto damage = verify_checksums(*memory_source(file));
    ASSERT_TRUE(damage);
    EXPECT_TRUE(damage->empty());
  }
}

TEST(VerifyChecksums, NamesEachDamagedChunk) {
  std::vector<std::byte> file = write_file(large_streams());
  const std::vector<ChunkRecord> records = records_of(file);
  file[records[0].offset + 25] ^= std::byte{4};
  file[records[4].offset + 1000] ^= std::byte{4};
  const auto damage = verify_checksums(*memory_source(file, "f"));
  ASSERT_TRUE(damage);
  EXPECT_THAT(*damage,
              ::testing::ElementsAre(HasSubstr("f: chunk MESH (patch 0, number 0, part 0), bytes 25..56: "),
                                     HasSubstr("f: chunk POSN (patch 0, number 0, part 0), bytes ")));
}

TEST(VerifyChecksums, FindsEveryBitFlip) {
  std::vector<std::byte> file = write_file(small_streams());
  for (size_t bit = 0; bit < 8 * file.size(); ++bit) {
    file[bit / 8] ^= std::byte{1} << bit % 8;
    const auto damage = verify_checksums(*memory_source(file));
    EXPECT_TRUE(!damage || !damage->empty()) << bit;
    file[bit / 8] ^= std::byte{1} << bit % 8;
  }
}

}  // namespace
}  // namespace maille
