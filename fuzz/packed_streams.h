#pragma once

#include <maille/version.h>

#include <string>
#include <vector>

#include "base/bytes.h"
#include "container/file_reader.h"
#include "container/file_writer.h"
#include "entropy/byte_model.h"

// A file as a fuzzer can change it: its streams one after the other, each with its length, the description in
// the clear. Mutations then reach the codec, where changes of a real file mostly end in the container.
namespace maille::fuzzing {

/// A stream of a file as it is here: the description, which the file has compressed, is in the clear.
inline void write_clear(FileWriter& writer, const StreamKey& key, Bytes bytes, bool description) {
  ByteWriter out;
  if (description) {
    out.put_count(bytes.size());
    out.put_bytes(encode_bytes(bytes));
  } else {
    out.put_bytes(bytes);
  }
  (void)writer.write_stream(key, out.bytes());
}

/// Inverse, behind its kind and its length.
inline void put_clear(ByteWriter& out, const FileReader& reader, const StreamKey& key, unsigned kind) {
  if (!reader.has_stream(key)) return;
  std::vector<std::byte> bytes = *reader.read_stream(key);
  if (kind == 0) {
    ByteReader in(bytes);
    const uint64_t size = in.get_count();
    bytes = decode_bytes(in.get_bytes(in.remaining()), size);
  }
  out.put(static_cast<uint8_t>(kind));
  out.put_count(bytes.size());
  out.put_bytes(bytes);
}

/// By kind; further kinds are arrays.
inline constexpr unsigned single_streams = 8;
inline StreamKey key_of_kind(unsigned kind) {
  constexpr StreamKey keys[single_streams] = {{"DESC", 0, 0}, {"TOPO", 0, 0}, {"POSI", 0, 0}, {"ORDR", 0, 0},
                                              {"TOPO", 0, 1}, {"POSI", 0, 1}, {"TOPO", 0, 2}, {"POSI", 0, 2}};
  return kind < single_streams ? keys[kind] : StreamKey{"ARRY", 0, kind - single_streams};
}

/// The file whose streams `input` lists: kind, length, bytes.
inline std::vector<std::byte> file_of_streams(Bytes input) {
  std::vector<std::byte> file;
  const auto sink = memory_sink(file);
  auto writer = FileWriter::begin(*sink, {.major = format_major, .minor = format_minor});
  ByteReader in(input);
  std::vector<bool> written(256);
  while (in.ok() && in.remaining() > 0) {
    const unsigned kind = in.get<uint8_t>();
    const uint64_t size = std::min<uint64_t>(in.get_count(), in.remaining());
    const Bytes bytes = in.get_bytes(size);
    if (!in.ok() || written[kind]) break;
    written[kind] = true;
    write_clear(*writer, key_of_kind(kind), bytes, kind == 0);
  }
  (void)writer->finish();
  return file;
}

/// Inverse, for seeds.
inline std::vector<std::byte> streams_of_file(Bytes file) {
  const auto source = memory_source(file);
  const auto reader = FileReader::open(*source);
  ByteWriter out;
  for (unsigned kind = 0; kind < 256; ++kind) put_clear(out, *reader, key_of_kind(kind), kind);
  return out.take();
}

}  // namespace maille::fuzzing
