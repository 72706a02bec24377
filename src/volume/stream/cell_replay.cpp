#include "volume/stream/cell_replay.h"

#include "base/result.h"

namespace maille {

Result<bool> CellReplay::next_batch() {
  if (!file_.has_stream({"CELL", batches_, 0})) return false;
  bytes_ = MAILLE_TRY(file_.read_stream({"CELL", batches_, 0}));
  ByteReader in(bytes_);
  batch_ = MAILLE_TRY(read_batch_header(in, plain_memory({})));
  const Bytes cells = in.get_bytes(batch_.cell_bytes), numbers = in.get_bytes(in.remaining());
  cells_.emplace(cells);
  numbers_.emplace(numbers);
  records_left_ = batch_.records;
  ++batches_;
  return true;
}

Result<bool> CellReplay::next_block(CodedCells& cells) {
  if (records_left_ == 0) return false;
  cells.clear();
  coder_.end_block();
  const uint64_t count = std::min<uint64_t>(records_left_, cells_per_block);
  for (uint64_t i = 0; i < count; ++i) {
    if (!coder_.code(*cells_, *numbers_, cell_, cells) || cells_->exhausted() || numbers_->exhausted())
      return failure(ErrorCode::corrupt,
                     "batch " + std::to_string(batch_number()) + ": the cells are damaged");
    // A record may be a loose cell of 2^24 points: the limit is asked for after each.
    if (cells.nodes.size() * 16 > limits_.mesh_bytes)
      return failure(ErrorCode::memory_bound, "some thousand cells take more memory than allowed");
  }
  records_left_ -= count;
  return true;
}

}  // namespace maille
