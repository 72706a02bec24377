#pragma once

#include <maille/volume_file.h>

#include <vector>

#include "volume/pieces/piece_reader.h"

namespace maille {

/// A query that fits a file: its conditions by the number of their array. It keeps a reference to the query.
class CheckedQuery {
 public:
  /// Error: usage.
  static Result<CheckedQuery> check(const VolumeQuery& query, const PieceReader& file);

  /// Whether a piece may have such cells, as far as the index tells; no piece is read for it.
  bool may_have(const PieceRecord& piece) const;
  /// The cells of a piece that are wanted, through its blocks; all arrays of conditions are in the piece.
  std::vector<uint32_t> cells_of(const DecodedPiece& piece) const;

 private:
  struct Condition {
    size_t array = 0;  ///< of the file
    uint32_t components = 1;
    ValueCondition wanted;
  };
  const VolumeQuery* query_ = nullptr;
  std::vector<Condition> conditions_;
};

}  // namespace maille
