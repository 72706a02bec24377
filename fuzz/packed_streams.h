#pragma once

#include <maille/version.h>

#include <span>
#include <string>
#include <vector>

#include "base/bytes.h"
#include "container/file_reader.h"
#include "container/file_writer.h"
#include "entropy/byte_model.h"

// A file as a fuzzer can change it: its streams one after the other, each with its length, the description in
// the clear. Mutations then reach the codec, where changes of a real file mostly end in the container.
// The key lists say which streams a file of each mode may have; the first is the description's.
namespace maille::fuzzing {

inline constexpr StreamKey single_streams[] = {
    {"DESC", 0, 0}, {"TOPO", 0, 0}, {"POSI", 0, 0}, {"ORDR", 0, 0}, {"TOPO", 0, 1}, {"POSI", 0, 1},
    {"TOPO", 0, 2}, {"POSI", 0, 2}, {"ARRY", 0, 0}, {"ARRY", 0, 1}, {"ARRY", 0, 2}, {"ARRY", 0, 3},
    {"ARRY", 0, 4}, {"ARRY", 0, 5}, {"ARRY", 0, 6}, {"ARRY", 0, 7}};
inline constexpr StreamKey cell_streams[] = {{"DESC", 0, 0}, {"CELL", 0, 0}, {"POSI", 0, 0}, {"ARRY", 0, 0},
                                             {"ARRY", 0, 1}, {"CELL", 1, 0}, {"POSI", 1, 0}, {"ARRY", 1, 0},
                                             {"ARRY", 1, 1}, {"ordr", 0, 0}, {"TAIL", 0, 0}};
/// Where the description changes in size, places in the index no longer fit: charts are found by their keys
/// then.
inline constexpr StreamKey chart_streams[] = {
    {"DESC", 0, 0}, {"CTAB", 0, 0}, {"CTAB", 1, 0}, {"ARRY", 0, 0}, {"ARRY", 0, 1}, {"ARRY", 0, 2},
    {"CDIR", 0, 0}, {"CIDX", 0, 0}, {"CHRT", 0, 0}, {"CHRT", 1, 0}, {"CHRT", 2, 0}, {"CHRT", 3, 0},
    {"CHRT", 4, 0}, {"CHRT", 5, 0}, {"CHRT", 6, 0}, {"CHRT", 7, 0}, {"ORDR", 0, 0}};

inline std::span<const StreamKey> keys_of(Mode mode) {
  if (mode == Mode::stream) return cell_streams;
  if (mode == Mode::random) return chart_streams;
  return single_streams;
}

/// The file whose streams `input` lists: number of the key, length, bytes.
inline std::vector<std::byte> file_of_streams(Bytes input, Mode mode) {
  const std::span<const StreamKey> keys = keys_of(mode);
  std::vector<std::byte> file;
  const auto sink = memory_sink(file);
  auto writer = FileWriter::begin(*sink, {.major = format_major, .minor = format_minor, .mode = mode});
  ByteReader in(input);
  for (unsigned streams = 0; in.ok() && in.remaining() > 0 && streams < 64; ++streams) {
    const size_t kind = in.get<uint8_t>() % keys.size();
    const Bytes bytes = in.get_bytes(std::min<uint64_t>(in.get_count(), in.remaining()));
    ByteWriter out;
    if (kind == 0) {  // the description, in the clear
      out.put_count(bytes.size());
      out.put_bytes(encode_bytes(bytes));
    } else {
      out.put_bytes(bytes);
    }
    (void)writer->write_stream(keys[kind], out.bytes());
  }
  (void)writer->finish();
  return file;
}

/// Inverse, for seeds.
inline std::vector<std::byte> streams_of_file(Bytes file, Mode mode) {
  const std::span<const StreamKey> keys = keys_of(mode);
  const auto source = memory_source(file);
  const auto reader = FileReader::open(*source);
  ByteWriter out;
  for (size_t kind = 0; kind < keys.size(); ++kind) {
    if (!reader->has_stream(keys[kind])) continue;
    std::vector<std::byte> bytes = *reader->read_stream(keys[kind]);
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
