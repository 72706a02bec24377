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
    write_clear(*writer, cell_streams[kind % std::size(cell_streams)], bytes, kind == 0);
  }
  (void)writer->finish();
  return file;
}

inline std::vector<std::byte> cell_streams_of(Bytes file) {
  const auto source = memory_source(file);
  const auto reader = FileReader::open(*source);
  ByteWriter out;
  for (unsigned kind = 0; kind < std::size(cell_streams); ++kind)
    put_clear(out, *reader, cell_streams[kind], kind);
  return out.take();
}

}  // namespace maille::fuzzing
