#pragma once

#include "packed_streams.h"

// As packed_streams.h, for files of mode stream.
namespace maille::fuzzing {

inline constexpr StreamKey cell_streams[] = {{"DESC", 0, 0}, {"CELL", 0, 0}, {"POSI", 0, 0}, {"ARRY", 0, 0},
                                             {"ARRY", 0, 1}, {"CELL", 1, 0}, {"POSI", 1, 0}, {"ARRY", 1, 0},
                                             {"ARRY", 1, 1}, {"ordr", 0, 0}, {"TAIL", 0, 0}};

inline std::vector<std::byte> file_of_cell_streams(Bytes input) {
  std::vector<std::byte> file;
  const auto sink = memory_sink(file);
  auto writer =
      FileWriter::begin(*sink, {.major = format_major, .minor = format_minor, .mode = Mode::stream});
  ByteReader in(input);
  for (unsigned streams = 0; in.ok() && in.remaining() > 0 && streams < 64; ++streams) {
    const unsigned kind = in.get<uint8_t>();
    const Bytes bytes = in.get_bytes(std::min<uint64_t>(in.get_count(), in.remaining()));
    ByteWriter out;
    if (kind == 0) {  // the description, in the clear
      out.put_count(bytes.size());
      out.put_bytes(encode_bytes(bytes));
    } else {
      out.put_bytes(bytes);
    }
    (void)writer->write_stream(cell_streams[kind % std::size(cell_streams)], out.bytes());
  }
  (void)writer->finish();
  return file;
}

inline std::vector<std::byte> cell_streams_of(Bytes file) {
  const auto source = memory_source(file);
  const auto reader = FileReader::open(*source);
  ByteWriter out;
  for (unsigned kind = 0; kind < std::size(cell_streams); ++kind) {
    if (!reader->has_stream(cell_streams[kind])) continue;
    std::vector<std::byte> bytes = *reader->read_stream(cell_streams[kind]);
    if (kind == 0) {
      ByteReader in(bytes);
      const uint64_t size = in.get_count();
      bytes = decode_bytes(in.get_bytes(in.remaining()), size);
    }
    out.put(static_cast<uint8_t>(kind));
    out.put_count(bytes.size());
    out.put_bytes(bytes);
  }
  return out.take();
}

}  // namespace maille::fuzzing
