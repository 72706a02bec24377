#pragma once

#include <maille/encode.h>
#include <maille/stream.h>

#include <array>
#include <cstdint>
#include <vector>

#include "container/file_writer.h"
#include "surface/parts/shared_points.h"
#include "volume/pieces/piece_layout.h"
#include "volume/pieces/sub_mesh.h"
#include "volume/stream/mesh_stream.h"
#include "volume/stream/stream_layout.h"

namespace maille {

// Coding pieces, wherever the mesh that they are cut from is: in memory (pieces_encoder.cpp), read in parts
// (source_pieces_encoder.cpp), or in many ranks (volume/ranks). All of these give the same bytes for the same
// pieces.

/// What all pieces of a mesh have in common. It is the same for every piece, so that they can be coded in any
/// order and by any thread.
struct PieceCoding {
  EncodeOptions options;
  StreamOptions stream;  ///< of the whole mesh
  /// Of the whole mesh, so that a number has one value in all pieces. Pieces have zeros in the stead of
  /// numbered arrays, which is for an order that is kept.
  ArrayMapsList maps;
  uint64_t cells = 0;  ///< of the whole mesh

  bool kept() const { return options.order == Order::keep; }
};
/// Pieces have zeros in the stead of the arrays that were `found`, of those that rise from their first value
/// to their last: more runs than one many ranks do not find, and files must not depend on how many there are.
void set_numbered(const std::vector<NumberedArray>& found, ArrayMapsList& maps);
/// DESC of the whole mesh.
StreamHeader header_of(const PieceCoding& coding);

/// A piece between its own coding and that of what joins it to others: which points are shared is known only
/// when all pieces know their points.
struct PieceInWork {
  CodedPiece coded;
  PieceRecord record;
  PieceNumbers numbers;                ///< of an order that is kept
  std::vector<uint32_t> coded_points;  ///< numbers in the mesh, in the coded order
  std::vector<uint32_t> border;        ///< points in the coded order
  std::vector<uint8_t> on_side;        ///< of these, see on_sides()
  std::vector<Place> places;           ///< by coded point, where positions are not exact
  EncodeReport report;
};

/// Codes cells of the numbers `cells` in the whole mesh; none: the points that no cell uses. `sub` is those
/// cells as a mesh. By one thread. Errors as encode().
Result<PieceInWork> code_piece(const PieceCoding& coding, SubMesh sub, std::vector<uint32_t> cells);

/// Adds what a piece says of itself to a report that has all arrays of the mesh, those on the mesh, too.
void add_report(const EncodeReport& piece, EncodeReport& all);

/// Begins a file in pieces with its description.
Result<FileWriter> begin_file(Sink& sink, const PieceCoding& coding);
/// PIDX, page by page.
Result<> write_index(FileWriter& file, const std::vector<PieceRecord>& records);

/// What TAIL says of cells, of a mesh or a part of one.
struct CellTotals {
  std::array<uint64_t, 256> of_type{};
  uint64_t corners = 0;
  MeshDescription::Polyhedra polyhedra;
};
CellTotals count_cells(const Mesh& mesh);
void add_totals(const CellTotals& some, CellTotals& all);
void set_totals(const CellTotals& totals, StreamTail& tail);
/// Ranges of 0 and -0 become those of 0, whichever came first: the order of pieces or ranks must not show in
/// the file.
void unsign_zeros(StreamTail& tail);
/// The errors in TAIL: of positions, then of each array; none where all are exact.
std::vector<double> errors_of(const EncodeReport& report);

}  // namespace maille
