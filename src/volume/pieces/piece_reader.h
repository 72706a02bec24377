#pragma once

#include <maille/decode.h>

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "container/file_reader.h"
#include "surface/parts/shared_points.h"
#include "volume/pieces/piece_layout.h"
#include "volume/stream/numbered_arrays.h"
#include "volume/stream/stream_layout.h"

namespace maille {

/// A piece as a mesh of its own: arrays in the order of the file, as far as they were asked for.
struct DecodedPiece {
  Mesh mesh;
  std::vector<uint32_t> blocks;  ///< by block, its number in the whole mesh
  std::vector<SharedPoint> shared;
  PieceNumbers numbers;  ///< if they were asked for
};

/// An open file of mode stream: its description, its end and its index. A stream that is not in pieces is one
/// piece, of which nothing is known beforehand. Calls of read() may come from several threads: the reader
/// does not change after it was opened. What the index claims is checked on opening as far as sizes go, and
/// against each piece when that is read.
class PieceReader {
 public:
  /// `source` must outlive the reader. Errors: cannot_read, corrupt, unsupported.
  static Result<PieceReader> open(const Source& source, const DecodeOptions& options);
  /// The same of a file in pieces whose index or end is missing: the pieces there are, of which nothing is
  /// known beforehand.
  static Result<PieceReader> open_damaged(const Source& source, const DecodeOptions& options);

  const StreamHeader& header() const { return header_; }
  const StreamTail& tail() const { return tail_; }
  const FileReader& file() const { return *file_; }
  const std::vector<PieceRecord>& pieces() const { return pieces_; }
  bool in_pieces() const { return in_pieces_; }
  /// Whether the file has the order of the input.
  bool kept() const { return header_.description.order_apart || !header_.description.any_order; }
  /// Arrays of the header that were asked for.
  const std::vector<uint8_t>& wanted() const { return wanted_; }
  std::string name() const { return name_; }
  /// What it holds itself, in bytes: description, end and index.
  uint64_t memory() const { return memory_; }

  /// Names and types of blocks, where the end of the file is missing, from pieces that were read. Error:
  /// corrupt, if these contradict each other.
  Result<> take_blocks(const std::vector<DecodedPiece>& pieces);
  /// The same file with other arrays. None: all.
  PieceReader with_arrays(std::optional<std::vector<std::string>> arrays) const;
  /// Asks for pieces at once, which a distant source turns into few requests and keeps copies of.
  Result<> fetch(std::span<const uint32_t> pieces, bool numbered) const;
  /// Piece `number`, with its numbers in the mesh if that is asked for. Error: corrupt, naming the piece;
  /// cannot_read; memory_bound. `allowed`: bytes, instead of the limit of the options.
  Result<DecodedPiece> read(uint32_t number, bool numbered) const {
    return read(number, numbered, options_.limits.mesh_bytes);
  }
  Result<DecodedPiece> read(uint32_t number, bool numbered, uint64_t allowed) const;
  /// The numbers of a piece in the input. Error: corrupt.
  Result<PieceNumbers> read_numbers(uint32_t number) const;
  /// A piece as a stream of its own, behind it the steps before this one that stand in its group
  /// (pieces_steps.h). Error: corrupt.
  Result<std::vector<std::byte>> read_stream(uint32_t number, uint64_t step) const;
  /// Whether the index says of a piece what it holds; of one that was read with all that was asked for.
  /// Error: corrupt.
  Result<> hold_against_index(uint32_t number, const DecodedPiece& piece) const;

 private:
  static Result<PieceReader> open_front(const Source& source, const DecodeOptions& options);
  Result<> take_step();
  Result<> take_step_in_pieces();
  void take_numbered(const std::vector<NumberedArray>& numbered);
  bool has_numbers_wanted() const;
  void fill_numbers(DecodedPiece& piece) const;
  Result<std::vector<std::byte>> with_steps(std::vector<std::byte> stream, uint32_t number, uint64_t first,
                                            uint64_t last) const;
  Result<> check_index() const;
  Result<> check_fields() const;
  bool is_needed(uint64_t step) const;
  void choose_arrays(std::optional<std::vector<std::string>> arrays);
  Result<DecodedPiece> read_coded(uint32_t number, bool numbered, uint64_t allowed) const;
  Result<DecodedPiece> read_whole(bool numbered, uint64_t allowed) const;
  Result<> check(const DecodedPiece& piece, const PieceRecord& record) const;

  const Source* source_ = nullptr;
  std::shared_ptr<const FileReader> file_;
  std::string name_;
  DecodeOptions options_;
  bool in_pieces_ = false;
  bool indexed_ = true;  ///< index and end are there
  StreamHeader header_;
  StreamTail tail_;
  std::vector<PieceRecord> pieces_;
  uint64_t memory_ = 0;
  std::vector<uint8_t> wanted_;
  /// Arrays whose values follow from the numbers of points and cells, by array.
  std::vector<std::pair<size_t, RisingNumbers>> numbered_;
};

/// Reads pieces, several at once, and gives each to `take` in their order, damaged ones as errors (corrupt).
/// `cut`: makes a piece smaller as soon as it is decoded, on any thread; may be empty. Together they may take
/// half of what is allowed, as the other half is for the mesh that they are joined to. Errors: those of
/// read() but corrupt; memory_bound; those of `take`.
using CutPiece = std::function<DecodedPiece(size_t, DecodedPiece)>;
using TakePiece = std::function<Result<>(size_t, Result<DecodedPiece>)>;
Result<> read_pieces(const PieceReader& reader, std::span<const uint32_t> pieces, bool numbered,
                     const DecodeOptions& options, const CutPiece& cut, const TakePiece& take);

/// Puts pieces together as one mesh, with the blocks and arrays of the file; points that several pieces have
/// are one.
/// Without numbers points and cells (of each block) stand in the order of the pieces. With numbers they stand
/// in the order of the input, and of a whole mesh each has its place there. Pieces are valid one by one, but
/// may contradict each other: the caller validates the result. Error: corrupt.
Result<Mesh> join_pieces(const std::vector<DecodedPiece>& pieces, const PieceReader& reader, bool numbered,
                         Executor* executor);

}  // namespace maille
