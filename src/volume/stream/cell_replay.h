#pragma once

#include <maille/stream.h>

#include <optional>

#include "container/file_reader.h"
#include "volume/cells/cell_coder.h"
#include "volume/stream/stream_layout.h"

namespace maille {

/// The cells of a stream once more, without any values: the order in which points come up and cells follow
/// one another, behind which values of a later time are coded. Encoder and decoder of a step see the same
/// slots as when the mesh was coded, so that predictors of values work as there.
class CellReplay {
 public:
  CellReplay(const FileReader& file, const StreamHeader& header, const Limits& limits)
      : file_(file), limits_(limits), coder_(header.mixing, !header.description.any_order) {
    if (header.gated) coder_.use_gates(nullptr);
  }

  /// False: there is no batch more. Error: corrupt, memory_bound.
  Result<bool> next_batch();
  const BatchHeader& batch() const { return batch_; }
  uint32_t batch_number() const { return batches_ - 1; }
  /// Up to some thousand cells of the batch, in `cells`. False: the batch has no more.
  Result<bool> next_block(CodedCells& cells);

 private:
  const FileReader& file_;
  const Limits& limits_;
  CellCoder<RangeDecoder> coder_;
  uint32_t batches_ = 0;
  BatchHeader batch_;
  uint64_t records_left_ = 0;
  std::vector<std::byte> bytes_;
  std::optional<RangeDecoder> cells_, numbers_;
  StreamedCell cell_;
};

}  // namespace maille
