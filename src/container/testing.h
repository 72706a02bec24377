#pragma once

#include <gtest/gtest.h>
#include <maille/version.h>

#include <string>
#include <string_view>
#include <vector>

#include "container/file_reader.h"

// Files made for the tests of this folder.

namespace maille::testing {

struct TestStream {
  StreamKey key;
  std::vector<std::byte> content;
};

inline std::vector<std::byte> bytes_of(std::string_view text) {
  const Bytes bytes = std::as_bytes(std::span(text.data(), text.size()));
  return {bytes.begin(), bytes.end()};
}

/// Bytes without a pattern, the same on every run.
inline std::vector<std::byte> noise(size_t size, uint32_t seed) {
  std::vector<std::byte> bytes(size);
  for (std::byte& byte : bytes) {
    seed = seed * 1664525u + 1013904223u;
    byte = static_cast<std::byte>(seed >> 24);
  }
  return bytes;
}

inline std::vector<std::byte> write_file(const std::vector<TestStream>& streams) {
  std::vector<std::byte> file;
  const auto sink = memory_sink(file);
  auto writer = FileWriter::begin(*sink, {.major = format_major, .minor = format_minor});
  for (const TestStream& stream : streams) EXPECT_TRUE(writer->write_stream(stream.key, stream.content));
  const uint64_t size = *writer->finish();
  EXPECT_EQ(size, file.size());
  return file;
}

/// A mesh of a few bytes, cut into four streams.
inline std::vector<TestStream> small_streams() {
  return {{{"MESH"}, bytes_of("description")},
          {{"CONN"}, bytes_of("connectivity of two patches")},
          {{"POSN"}, noise(40, 1)},
          {{"attr", 0, 1}, {}}};
}

/// Several patches, streams of several parts, more than 64 KiB: a file with an index.
inline std::vector<TestStream> large_streams() {
  return {{{"MESH"}, bytes_of("description")},
          {{"CONN", 0}, noise(max_chunk_bytes + 10, 1)},
          {{"CONN", 1}, noise(3000, 2)},
          {{"POSN", 0}, noise(2 * size_t{max_chunk_bytes}, 3)},
          {{"attr", 0, 7}, noise(500, 4)}};
}

/// A source of which only read_at() works, as over a network.
class RemoteSource final : public Source {
 public:
  explicit RemoteSource(Bytes bytes) : bytes_(bytes) {}
  uint64_t size() const override { return bytes_.size(); }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    if (offset > bytes_.size() || out.size() > bytes_.size() - offset) {
      ADD_FAILURE() << "read behind the end";
      return failure(ErrorCode::cannot_read, "behind the end");
    }
    bytes_read_ += out.size();
    std::copy_n(bytes_.begin() + static_cast<ptrdiff_t>(offset), out.size(), out.begin());
    return {};
  }
  std::string name() const override { return "<remote>"; }
  uint64_t bytes_read() const { return bytes_read_; }

 private:
  Bytes bytes_;
  mutable uint64_t bytes_read_ = 0;
};

/// All of `streams` come back from `file`, through a view and through reads.
inline void expect_streams(Bytes file, const std::vector<TestStream>& streams) {
  const auto memory = memory_source(file);
  const RemoteSource remote(file);
  for (const Source* source :
       {static_cast<const Source*>(memory.get()), static_cast<const Source*>(&remote)}) {
    const auto reader = FileReader::open(*source);
    ASSERT_TRUE(reader) << reader.error().message;
    for (const TestStream& stream : streams) {
      EXPECT_TRUE(reader->has_stream(stream.key));
      EXPECT_EQ(reader->stream_bytes(stream.key), stream.content.size());
      const auto content = reader->read_stream(stream.key);
      ASSERT_TRUE(content) << content.error().message;
      EXPECT_TRUE(*content == stream.content) << stream.key.type;
    }
  }
}

/// The error when `file` is opened and all of `streams` are read, as a careful decoder does; "" when all is
/// right; "wrong" when bytes differ without an error.
inline std::string damage_report(Bytes file, const std::vector<TestStream>& streams) {
  const auto source = memory_source(file, "f");
  const auto reader = FileReader::open(*source);
  if (!reader) return reader.error().message;
  if (const auto whole = reader->check_complete(); !whole) return whole.error().message;
  for (const TestStream& stream : streams) {
    const auto content = reader->read_stream(stream.key);
    if (!content) return content.error().message;
    if (*content != stream.content) return "wrong";
  }
  return "";
}

}  // namespace maille::testing
