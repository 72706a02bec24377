#include "container/file_writer.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>

#include "base/hash.h"
#include "container/testing.h"

namespace maille {
namespace {

using namespace maille::testing;

std::string hex(Bytes bytes) {
  std::string text;
  for (const std::byte byte : bytes) {
    const char* const digits = "0123456789abcdef";
    text += digits[std::to_integer<unsigned>(byte) >> 4];
    text += digits[std::to_integer<unsigned>(byte) & 15];
  }
  return text;
}

TEST(FileWriter, WritesTheseBytes) {
  EXPECT_EQ(hex(write_file({{{"TEST", 300, 2}, bytes_of("maille")}})),
            "894d41490d0a1a0a"  // magic
            "00000200"          // format 0.2
            "0000000000000000"  // required and optional features
            "00"                // mode single
            "46c00e22"          // header checksum
            "a54d"              // a chunk
            "54455354"          // TEST
            "ac0202"            // patch 300, number 2
            "01"                // part 0, the last
            "06"                // 6 bytes
            "9e23"              // header check
            "6d61696c6c65"      // "maille"
            "fd99a6d544bba50e"  // checksum of the chunk
            "0000000000000000"  // no index
            "1aebfa8325b252d1"  // digest
            "89454e44");        // end magic
}

TEST(FileWriter, LargeFileHasTheseBytes) {
  const std::vector<std::byte> file = write_file(large_streams());
  EXPECT_EQ(file.size(), 3149582u);
  EXPECT_EQ(hash64(file), 8895548755873528467u);
}

TEST(FileWriter, SpendsAtMost150BytesOnASmallFileOfFourStreams) {
  std::vector<std::byte> file;
  const auto sink = memory_sink(file);
  auto writer = FileWriter::begin(*sink, {.major = format_major, .minor = format_minor});
  size_t content = 0;
  for (const TestStream& stream : small_streams()) {
    ASSERT_TRUE(writer->write_stream(stream.key, stream.content));
    content += stream.content.size();
  }
  ASSERT_TRUE(writer->finish());
  EXPECT_LE(file.size() - content, 150u);
}

TEST(FileWriter, WritesAStreamChunkByChunkAsInOnePiece) {
  for (const size_t size : {size_t{0}, size_t{5}, size_t{max_chunk_bytes}, 2 * max_chunk_bytes + size_t{3}}) {
    const std::vector<std::byte> content = noise(size, 1);
    std::array<std::vector<std::byte>, 2> files;
    for (size_t i = 0; i < 2; ++i) {
      const auto sink = memory_sink(files[i]);
      auto writer = FileWriter::begin(*sink, {});
      const auto read = [&](uint64_t offset, std::span<std::byte> out) -> Result<> {
        EXPECT_LE(out.size(), max_chunk_bytes);
        std::copy_n(content.begin() + static_cast<ptrdiff_t>(offset), out.size(), out.begin());
        return {};
      };
      ASSERT_TRUE(i == 0 ? writer->write_stream({"ORDR"}, content)
                         : writer->write_stream({"ORDR"}, size, read));
      ASSERT_TRUE(writer->finish());
    }
    EXPECT_TRUE(files[0] == files[1]) << size;
  }
}

TEST(FileWriter, PassesTheErrorOfItsSinkOn) {
  class FullSink final : public Sink {
   public:
    explicit FullSink(size_t room) : room_(room) {}
    Result<> write(Bytes bytes) override {
      if (bytes.size() > room_) return failure(ErrorCode::write_failed, "full");
      room_ -= bytes.size();
      return {};
    }
    Result<> commit() override { return {}; }
    std::string name() const override { return "full"; }

   private:
    size_t room_;
  };
  const auto write_all = [](Sink& sink) -> Result<> {
    auto writer = FileWriter::begin(sink, {});
    if (!writer) return tl::unexpected(writer.error());
    for (const TestStream& stream : small_streams()) {
      if (auto done = writer->write_stream(stream.key, stream.content); !done) return done;
    }
    if (auto done = writer->finish(); !done) return tl::unexpected(done.error());
    return {};
  };
  const size_t whole = write_file(small_streams()).size();
  for (size_t room = 0; room < whole; ++room) {
    FullSink sink(room);
    const auto result = write_all(sink);
    ASSERT_FALSE(result) << room;
    EXPECT_EQ(result.error().code, ErrorCode::write_failed);
  }
  FullSink sink(whole);
  EXPECT_TRUE(write_all(sink));
}

RC_GTEST_PROP(FileWriter, AnyStreamsComeBack, (const std::vector<std::vector<uint8_t>>& contents)) {
  std::vector<TestStream> streams;
  for (const auto& content : contents) {
    const auto number = static_cast<uint32_t>(streams.size());
    const Bytes bytes = std::as_bytes(std::span(content));
    streams.push_back({{"Str1", *rc::gen::arbitrary<uint32_t>(), number}, {bytes.begin(), bytes.end()}});
  }
  const std::vector<std::byte> file = write_file(streams);
  RC_ASSERT(damage_report(file, streams).empty());
}

TEST(FileWriter, CutsStreamsAtTheCap) {
  for (const size_t size : {size_t{0}, size_t{1}, size_t{max_chunk_bytes} - 1, size_t{max_chunk_bytes},
                            size_t{max_chunk_bytes} + 1, 2 * size_t{max_chunk_bytes}}) {
    const std::vector<TestStream> streams = {{{"POSN"}, noise(size, 9)}};
    const std::vector<std::byte> file = write_file(streams);
    expect_streams(file, streams);
    const auto source = memory_source(file);
    const auto reader = FileReader::open(*source);
    EXPECT_EQ(reader->chunks().size(), std::max<size_t>(1, (size + max_chunk_bytes - 1) / max_chunk_bytes));
    EXPECT_TRUE(reader->complete());
    EXPECT_TRUE(reader->problems().empty());
  }
}

}  // namespace
}  // namespace maille
