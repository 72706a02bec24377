#pragma once

#include <maille/decode.h>
#include <maille/random_access.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "arrived_bytes.h"
#include "drawable.h"
#include "placement.h"

// Emscripten exports what is `used`.
#define MAILLE_EXPORT extern "C" __attribute__((used))

namespace maille::wasm {

inline constexpr int32_t done = 0, wants_bytes = 1000, goes_on = 1001;
/// What the decoder of charts says of what it leaves out but the small one has.
inline constexpr int32_t not_in_charts = 1003;
// Not inline: what is compiled for that decoder has a value of its own.
#ifdef MAILLE_CHART_DECODER
constexpr bool charts_alone = true;
#else
constexpr bool charts_alone = false;
#endif

/// What a buffer holds, as web/maille.js numbers it.
enum class BufferKind : uint32_t {
  drawn_positions,
  drawn_points,
  drawn_triangles,
  drawn_cells,
  drawn_array,
  points,
  block_types,
  block_offsets,
  block_connectivity,
  array,
  triangle_array,
  piece_types,
  piece_offsets,
  piece_connectivity,
  piece_slots,
  piece_face_sizes,
  piece_cell_faces,
  piece_points,
  piece_point_slots,
  piece_ended_slots,
  drawn_faces,
  border_keys,
  cell_numbers,
  point_numbers,
};

/// One entry of the list that buffers() gives.
struct Buffer {
  BufferKind kind;
  uint32_t type = 0;  ///< Scalar
  uint32_t components = 1;
  uint32_t domain = 0;
  uint32_t role = 0;
  uint32_t block = 0;      ///< number of the block
  uint32_t cell_type = 0;  ///< of the block
  const char* name = "";
  uint32_t name_size = 0;
  const void* bytes = nullptr;
  uint32_t size = 0;                                 ///< in bytes
  const std::vector<std::string>* labels = nullptr;  ///< names of the values of a label; see maille_labels()
};

/// A file of mode stream while it is read: pieces.cpp.
struct Pieces {
  virtual ~Pieces() = default;
};
/// A file of mode stream of which parts are read: volume.cpp.
struct Volume {
  virtual ~Volume() = default;
};

struct Reader {
  Reader(uint64_t size, std::string name, uint64_t mesh_bytes)
      : bytes(size, std::move(name)), mesh_bytes(mesh_bytes) {}

  ArrivedBytes bytes;
  uint64_t mesh_bytes;  ///< what a decoded mesh may take
  std::optional<File> file;
  Selection selection;
  Mesh mesh;
  Drawable drawable;
  PackedChart packed;
  std::unique_ptr<Pieces> pieces;
  std::unique_ptr<Volume> volume;
  std::vector<std::vector<double>> wide;  ///< what buffers have of numbers of 64 bits
  std::vector<Buffer> buffers;
  std::vector<std::byte> written;  ///< a file made of the mesh: save_ply.cpp
  std::vector<double> numbers;
  std::string message;

  /// What a call with this outcome returns.
  int32_t outcome(const Error& error) {
    message = error.message;
    const std::vector<ByteRange> wanted = bytes.take_wanted();
    if (wanted.empty()) return static_cast<int32_t>(error.code);
    numbers.clear();
    for (const ByteRange& range : wanted) {
      numbers.push_back(static_cast<double>(range.offset));
      numbers.push_back(static_cast<double>(range.size));
    }
    return wants_bytes;
  }
  template <class T>
  int32_t keep(Result<T>&& result, T& to) {
    if (!result) return outcome(result.error());
    bytes.take_wanted();
    to = std::move(*result);
    return done;
  }
  DecodeOptions options() const {
    DecodeOptions options;
    options.limits.mesh_bytes = mesh_bytes;
    return options;
  }
};

/// `array`: an Array or a StreamArray, whose tuples are `bytes`.
template <class Described>
void add_array(std::vector<Buffer>& buffers, BufferKind kind, const Described& array, Bytes bytes) {
  Buffer buffer{kind};
  buffer.type = static_cast<uint32_t>(array.type);
  buffer.components = array.components;
  buffer.domain = static_cast<uint32_t>(array.domain);
  buffer.role = static_cast<uint32_t>(array.role);
  buffer.name = array.name.data();
  buffer.name_size = static_cast<uint32_t>(array.name.size());
  buffer.bytes = bytes.data();
  buffer.size = static_cast<uint32_t>(bytes.size());
  if (!array.labels.empty()) buffer.labels = &array.labels;
  buffers.push_back(buffer);
}
inline void add_array(std::vector<Buffer>& buffers, BufferKind kind, const Array& array) {
  add_array(buffers, kind, array, array.bytes);
}

template <class Values>
Buffer numbers_of(BufferKind kind, Scalar type, const Values& values, uint32_t components = 1) {
  Buffer buffer{kind};
  buffer.type = static_cast<uint32_t>(type);
  buffer.components = components;
  buffer.bytes = values.data();
  buffer.size = static_cast<uint32_t>(values.size() * sizeof(values[0]));
  return buffer;
}

/// Numbers of 64 bits, as JavaScript has them.
inline Buffer wide_numbers(Reader& reader, BufferKind kind, std::span<const uint64_t> values) {
  reader.wide.emplace_back(values.begin(), values.end());
  return numbers_of(kind, Scalar::f64, reader.wide.back());
}

/// The drawable of the reader. numbers: origin (3).
void list_drawn(Reader& reader);
/// The mesh of the reader, bit for bit.
void list_exact(Reader& reader);

inline int32_t no_file(Reader& reader) {
  reader.message = reader.bytes.name() +
                   ": only files of mode \"random\" are read in parts, and of mode \"stream\" in pieces";
  return static_cast<int32_t>(ErrorCode::usage);
}

}  // namespace maille::wasm
