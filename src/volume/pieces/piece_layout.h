#pragma once

#include <maille/mesh.h>
#include <maille/source.h>

#include <array>
#include <cstdint>
#include <vector>

#include "base/result.h"

namespace maille {

// What stands in the chunks of a volume in pieces besides the streams of the pieces themselves.
// docs/format.md, 16.14. Each decode function is safe on any bytes.

/// PIEC: some cells of the mesh, and the points they use, as a stream of their own.
struct CodedPiece {
  std::vector<uint32_t> blocks;   ///< by block of the piece, its number in the mesh; rising
  std::vector<std::byte> shared;  ///< encode_shared()
  std::vector<std::byte> file;    ///< a whole file of mode stream, with arrays on points and cells only
};
std::vector<std::byte> encode_piece(const CodedPiece& piece);
/// Error: corrupt.
Result<CodedPiece> decode_piece(std::vector<std::byte> bytes);

/// What queries know of an array in a piece without decoding it.
struct PieceField {
  /// Least, largest and mean number of a component, NaN left out; decoded numbers are within. None is there
  /// where low > high.
  struct Component {
    float low = 1, high = 0, mean = 0;
  };
  std::vector<Component> components;  ///< one for all where an array has more than most_ranges
  uint64_t nans = 0;
  std::vector<uint8_t> coarse;  ///< values of coarse points within the ranges, see coarse_level.h
};

/// A line of the index: what is known of a piece before it is read, some hundred bytes.
struct PieceRecord {
  uint64_t cells = 0, points = 0;
  /// The least box around the decoded points with sides in floats; low > high where there is none, since no
  /// point has finite numbers.
  std::array<float, 3> low{1, 1, 1}, high{0, 0, 0};
  /// Least and largest number of its cells in the input; 0 where the order is not kept.
  uint64_t first_cell = 0, last_cell = 0;
  /// Bytes of connectivity, order, positions, then of each array.
  std::vector<uint64_t> coded_bytes;
  std::vector<PieceField> fields;  ///< by array on points and cells
  std::vector<uint8_t> coarse;     ///< places of coarse points in the box, see coarse_level.h
};
/// PIDX: the lines of so many pieces are a page.
inline constexpr uint32_t pieces_per_page = 4096;
std::vector<std::byte> encode_index(const std::vector<PieceRecord>& records);
/// Of one page of an index, by piece.
template <class Record>
struct IndexPage {
  std::vector<Record> records;
  uint64_t memory = 0;  ///< what they take, in bytes
};
/// `most_memory`: what they may take, in bytes. Errors: corrupt, memory_bound.
Result<IndexPage<PieceRecord>> decode_index(Bytes bytes, uint64_t most_memory);

/// SIDX: the fields of a step, by piece; pages as of PIDX.
std::vector<std::byte> encode_step_index(const std::vector<std::vector<PieceField>>& fields);
/// As decode_index().
Result<IndexPage<std::vector<PieceField>>> decode_step_index(Bytes bytes, uint64_t most_memory);

/// The bytes, each inverted. A file within a file has chunks of its own, which must not be found where the
/// index is lost and chunks are looked for; no inverted chunk header is one. It is its own inverse.
std::vector<std::byte> inverted(std::vector<std::byte> bytes);

/// GIDS: the numbers that the piece's cells and points have in the whole mesh, both rising.
struct PieceNumbers {
  std::vector<uint32_t> cells, points;
};
std::vector<std::byte> encode_numbers(const PieceNumbers& numbers);
/// As many as the piece has. Error: corrupt.
Result<PieceNumbers> decode_numbers(Bytes bytes, uint64_t cells, uint64_t points);

/// How far decoded numbers may be from those given: statistics are made before coding, and must hold for what
/// is decoded.
struct PieceBound {
  double bound = 0;
  bool by_size = false;  ///< of each number, times this
};
/// The statistics of an array as it will be decoded: ranges are widened by the bound, then rounded outwards
/// to floats.
PieceField describe_field(const Array& array, PieceBound bound);
/// Sets the box around positions as they will be decoded; none if an axis has no finite number.
void enclose(const Array& positions, PieceBound bound, PieceRecord& record);

}  // namespace maille
