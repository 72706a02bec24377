#pragma once

#include <maille/stream.h>

#include <array>
#include <optional>
#include <vector>

#include "container/file_writer.h"
#include "volume/stream/stream_intake.h"
#include "volume/stream/stream_layout.h"
#include "volume/values/array_stage.h"

namespace maille {

/// The half of StreamWriter that codes: blocks of cells as they were taken in, their values one block later,
/// batches, and the file. A block passes through two stages: its cells in one call of run_records(), its
/// values beside the cells of the next block. So a batch that is closed is written only when the values of
/// its last block are coded.
class StreamBatches {
 public:
  StreamBatches(Sink& sink, StreamOptions options, StreamHeader header, std::vector<std::byte> order_apart,
                std::vector<uint8_t> borders, FileWriter file);

  const StreamOptions& options() const { return options_; }
  bool is_full() const { return intake.records.size() == cells_per_block; }
  /// Records of the batch so far.
  uint64_t records() const { return records_taken_ + intake.records.size(); }
  /// Codes what waits. Behind an error there is nothing but that error.
  Result<> run();
  Result<> flush();
  /// `tail` has all but what is counted here.
  Result<StreamReport> finish();

  // What the other half fills.
  Intake intake;
  WaitingPoints waiting;
  StreamTail tail;

 private:
  /// A block between the stages: its cells, and the tuples of each array (positions first).
  struct Block {
    CodedCells cells;
    std::vector<std::vector<std::byte>> tuples;
    std::vector<Vector3> places = {};  ///< of the points, if is_placed_
  };
  /// A batch whose cells are coded, and the values of its last block may not be. There is never more than
  /// one.
  struct ClosedBatch {
    BatchHeader header;
    std::vector<std::byte> cells, numbers;
  };

  void resolve_ends(std::vector<uint64_t>& late);
  Result<> begin_stream();
  Result<> run_block();
  Result<> run_records();
  Result<> code_cells(Block& block);
  void code_records(CellCoder<RangeEncoder>& coder, RangeEncoder& cells, RangeEncoder& numbers,
                    CodedCells& out);
  bool only_positions() const { return point_buffer_.size() == stages_[0].tuple_size(); }
  /// Positions that can be read at any time are read beside the next cells.
  bool takes_late() const { return options_.points != nullptr && only_positions() && !is_placed_; }
  Result<> take_point_values(Block& block);
  Result<> code_values(Block& block, size_t stage);
  void close_batch();
  Result<> write_closed_batch();
  Result<> end_batch();
  void set_ranges_of_numbers();

  Sink& sink_;
  StreamOptions options_;
  Executor& executor_;
  StreamHeader header_;
  std::vector<std::byte> order_apart_;
  std::vector<uint8_t> borders_;  ///< of a gated stream
  FileWriter file_;
  std::optional<CellCoder<RangeEncoder>> coder_;  ///< from begin_stream() on
  RangeEncoder cells_, numbers_;
  std::vector<ArrayStage<RansEncoder>> stages_;
  DecodedPlaces places_;
  bool is_placed_ = false;  ///< an array is expected from where points are
  std::vector<std::byte> point_buffer_;
  // Never more than two blocks of cells and values are in memory, whatever the length of the stream.
  std::array<Block, 2> blocks_;
  unsigned current_ = 0;  ///< the block whose cells come next; the other one may wait for its values
  // Whether the other block was coded by its cells, and not by its values yet.
  bool values_wait_ = false;
  BatchHeader batch_;
  std::optional<ClosedBatch> closed_;
  StreamedCell cell_;
  StreamReport report_;
  uint64_t records_taken_ = 0;  ///< into the intake, in this batch
  // The first error, which all later calls give again.
  std::optional<Error> failed_;
};

}  // namespace maille
