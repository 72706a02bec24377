// Files of mode stream, piece by piece, and their surface: what the full decoder has beside reader.cpp.
#include <maille/stream.h>

#include "boundary.h"
#include "reader.h"

namespace maille::wasm {
namespace {

/// Then a call gives others their turn.
constexpr uint64_t cells_per_call = 1u << 16;

struct OpenPieces final : Pieces {
  explicit OpenPieces(StreamReader opened) : stream(std::move(opened)) {}
  StreamReader stream;
  std::optional<Boundary> boundary;
  StreamPortion piece;
};
OpenPieces* open_pieces(Reader& reader) {
  return static_cast<OpenPieces*>(reader.pieces.get());
}

void list_piece(Reader& reader, const OpenPieces& pieces) {
  const StreamPortion& piece = pieces.piece;
  const StreamDescription& description = pieces.stream.description();
  std::vector<Buffer>& list = reader.buffers;
  Buffer types{BufferKind::piece_types};
  types.type = static_cast<uint32_t>(Scalar::u8);
  types.bytes = piece.types.data();
  types.size = static_cast<uint32_t>(piece.types.size());
  list.push_back(types);
  list.push_back(wide_numbers(reader, BufferKind::piece_offsets, piece.offsets));
  list.push_back(wide_numbers(reader, BufferKind::piece_connectivity, piece.connectivity));
  list.push_back(numbers_of(BufferKind::piece_slots, Scalar::u32, piece.slots));
  list.push_back(numbers_of(BufferKind::piece_face_sizes, Scalar::u32, piece.face_sizes));
  list.push_back(wide_numbers(reader, BufferKind::piece_cell_faces, piece.cell_faces));
  list.push_back(wide_numbers(reader, BufferKind::piece_points, piece.points));
  list.push_back(numbers_of(BufferKind::piece_point_slots, Scalar::u32, piece.point_slots));
  list.push_back(numbers_of(BufferKind::piece_ended_slots, Scalar::u32, piece.ended_slots));
  add_array(reader.buffers, BufferKind::points, description.positions, piece.positions);
  size_t of_points = 0, of_cells = 0;
  for (const StreamArray& array : description.arrays)
    add_array(
        reader.buffers, BufferKind::array, array,
        array.domain == Domain::point ? piece.point_arrays[of_points++] : piece.cell_arrays[of_cells++]);
}

}  // namespace

/// numbers: times of the steps behind the mesh; the first is that of step 1. Read are the front and the end
/// of the file, and of each step its end and header.
MAILLE_EXPORT int32_t maille_steps(Reader* reader) {
  std::vector<StreamStep> steps;
  // From a server all of the file is too much to look through.
  if (const int32_t outcome = reader->keep(list_steps(reader->bytes, false, reader->options().limits), steps);
      outcome != done)
    return outcome;
  reader->numbers.clear();
  for (const StreamStep& step : steps) reader->numbers.push_back(step.time);
  return done;
}

/// Begins to give a file of mode stream in pieces, with the arrays of one step.
MAILLE_EXPORT int32_t maille_begin_pieces(Reader* reader, double step) {
  reader->pieces.reset();
  StreamReadOptions options;
  options.limits = reader->options().limits;
  options.any_order = true;
  auto opened = StreamReader::open(reader->bytes, static_cast<uint64_t>(step), options);
  if (!opened) return reader->outcome(opened.error());
  reader->bytes.take_wanted();
  reader->pieces = std::make_unique<OpenPieces>(std::move(*opened));
  return done;
}

/// The next piece. numbers: is there one, number of its first cell, slots so far.
MAILLE_EXPORT int32_t maille_next_piece(Reader* reader) {
  OpenPieces* const pieces = open_pieces(*reader);
  if (pieces == nullptr) return no_file(*reader);
  bool there = false;
  const int32_t outcome = reader->keep(pieces->stream.next(pieces->piece), there);
  if (outcome != done) return outcome;
  reader->numbers = {double(there), double(pieces->piece.first_cell), double(pieces->piece.slot_count)};
  return done;
}

/// Lists it, as maille_buffers() does.
MAILLE_EXPORT const Buffer* maille_piece_buffers(Reader* reader) {
  reader->buffers.clear();
  reader->wide.clear();
  if (const OpenPieces* const pieces = open_pieces(*reader)) list_piece(*reader, *pieces);
  return reader->buffers.data();
}

/// The surface of what maille_begin_pieces() opened, some thousand cells a call, and then as a whole for
/// maille_buffers(). goes_on: numbers: cells so far.
MAILLE_EXPORT int32_t maille_surface_of_pieces(Reader* reader) {
  OpenPieces* const pieces = open_pieces(*reader);
  if (pieces == nullptr) return no_file(*reader);
  std::optional<Boundary>& boundary = pieces->boundary;
  if (!boundary) boundary.emplace(pieces->stream.description());
  for (const uint64_t end = boundary->cells() + cells_per_call;;) {
    bool there = false;
    if (const int32_t outcome = reader->keep(pieces->stream.next(pieces->piece), there); outcome != done)
      return outcome;
    if (!there) break;
    if (const auto added = boundary->add(pieces->piece); !added) return reader->outcome(added.error());
    if (boundary->cells() < end) continue;
    reader->numbers = {static_cast<double>(boundary->cells())};
    return goes_on;
  }
  reader->drawable = boundary->finish();
  reader->pieces.reset();
  return done;
}

/// No piece more is wanted.
MAILLE_EXPORT void maille_end_pieces(Reader* reader) {
  reader->pieces.reset();
}

}  // namespace maille::wasm
