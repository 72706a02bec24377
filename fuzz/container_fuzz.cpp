// The container reader on any bytes, and the round trip of any streams.

#include <maille/version.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "container/file_reader.h"

namespace maille {
namespace {

void require(bool claim) {
  if (!claim) std::abort();
}

/// A source without a view: the reader takes its other path.
class RemoteSource final : public Source {
 public:
  explicit RemoteSource(Bytes bytes) : bytes_(bytes) {}
  uint64_t size() const override { return bytes_.size(); }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    require(offset <= bytes_.size() && out.size() <= bytes_.size() - offset);
    std::copy_n(bytes_.begin() + static_cast<ptrdiff_t>(offset), out.size(), out.begin());
    return {};
  }
  std::string name() const override { return "<remote>"; }

 private:
  Bytes bytes_;
};

void read_all(const Source& source) {
  const auto reader = FileReader::open(source);
  if (!reader) return;
  uint64_t end = file_header_bytes;
  for (const ChunkRecord& record : reader->records()) {
    require(record.offset >= end);  // chunks never overlap
    end = reader->content_offset(record) + record.header.size;
    require(end <= source.size());
    if (record.header.part() != 0) continue;
    StreamKey key = {"", record.header.patch, record.header.number};
    std::copy_n(record.header.type.begin(), 4, key.type);
    require(reader->has_stream(key));
    const auto stream = reader->read_stream(key);
    require(!stream || stream->size() == reader->stream_bytes(key));
  }
}

void same_by_both_paths(Bytes file) {
  const auto memory = memory_source(file);
  const RemoteSource remote(file);
  const auto a = FileReader::open(*memory), b = FileReader::open(remote);
  require(a.has_value() == b.has_value());
  if (!a) return;
  require(a->complete() == b->complete() && a->problems() == b->problems());
  require(a->chunks().size() == b->chunks().size());
  require(verify_checksums(*memory).has_value());
}

/// Takes the input as contents: each stream's size in one byte, then its bytes.
void round_trip(Bytes input) {
  std::vector<Bytes> contents;
  while (!input.empty()) {
    const auto size = std::min<size_t>(std::to_integer<size_t>(input[0]), input.size() - 1);
    contents.push_back(input.subspan(1, size));
    input = input.subspan(1 + size);
  }
  std::vector<std::byte> file;
  const auto sink = memory_sink(file);
  auto writer = FileWriter::begin(*sink, {.major = format_major, .minor = format_minor});
  for (size_t i = 0; i < contents.size(); ++i) {
    require(
        writer->write_stream({"Fuzz", static_cast<uint32_t>(i / 3), static_cast<uint32_t>(i)}, contents[i])
            .has_value());
  }
  const uint64_t size = *writer->finish();
  require(size == file.size());
  const auto source = memory_source(file);
  const auto reader = FileReader::open(*source);
  require(reader && reader->complete() && reader->problems().empty());
  for (size_t i = 0; i < contents.size(); ++i) {
    const auto stream = reader->read_stream({"Fuzz", static_cast<uint32_t>(i / 3), static_cast<uint32_t>(i)});
    require(stream && std::equal(stream->begin(), stream->end(), contents[i].begin(), contents[i].end()));
  }
}

}  // namespace
}  // namespace maille

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const maille::Bytes input = std::as_bytes(std::span(data, size));
  maille::read_all(*maille::memory_source(input));
  maille::same_by_both_paths(input);
  maille::round_trip(input);
  return 0;
}
