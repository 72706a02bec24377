#include "volume/stream/stream_batches.h"

#include <algorithm>
#include <string>

#include "base/result.h"
#include "volume/stream/numbered_arrays.h"

namespace maille {
namespace {

/// Bytes of all values of a point.
size_t stride_of(const StreamOptions& options) {
  size_t stride = options.positions.tuple_size();
  for (const StreamArray& array : options.arrays)
    stride += array.domain == Domain::point ? array.tuple_size() : 0;
  return stride;
}

}  // namespace

// Room for tuples is made once: blocks exchange their vectors with the intake.
StreamBatches::StreamBatches(Sink& sink, StreamOptions options, StreamHeader header,
                             std::vector<std::byte> order_apart, std::vector<uint8_t> borders,
                             FileWriter file)
    : waiting(stride_of(options)),
      sink_(sink),
      options_(std::move(options)),
      executor_(options_.executor ? *options_.executor : serial_executor()),
      header_(std::move(header)),
      order_apart_(std::move(order_apart)),
      borders_(std::move(borders)),
      file_(std::move(file)),
      places_(header_.positions()) {
  stages_.emplace_back(header_.positions(), Domain::point);
  for (size_t i = 0; i < options_.arrays.size(); ++i)
    stages_.emplace_back(header_.array(i), options_.arrays[i].domain);
  for (auto& stage : stages_) {
    // Coders begin with each batch, models do not.
    stage.begin_batch(RansEncoder(stage.lanes()));
    is_placed_ = is_placed_ || stage.is_placed();
  }
  for (const StreamArray& array : options_.arrays) {
    if (array.domain == Domain::cell) intake.cell_arrays.emplace_back();
  }
  report_.array_bytes.resize(options_.arrays.size());
  tail.ranges.resize(stages_.size());
  point_buffer_.resize(stride_of(options_));
  for (Block& block : blocks_) block.tuples.resize(stages_.size());
}

/// Points told to have ended end with the last cell that waits and uses them; `late` gets the others. Going
/// backwards finds the last use first; the set is only looked up, so that its order does not matter.
void StreamBatches::resolve_ends(std::vector<uint64_t>& late) {
  for (size_t i = intake.numbers.size(); i-- > 0 && !intake.ended.empty();) {
    if (intake.ended.erase(intake.numbers[i]) > 0) intake.last_use[i] = 1;
  }
  for (const uint64_t number : intake.told) {
    if (intake.ended.contains(number)) late.push_back(number);
  }
  // Numbers that are kept cost least when they rise; any order is the caller's.
  if (!options_.any_order) std::sort(late.begin(), late.end());
  intake.ended.clear();
  intake.told.clear();
}

/// Writes the description, which tells how cells are coded, once and before the first of them.
Result<> StreamBatches::begin_stream() {
  if (coder_) return {};
  coder_.emplace(header_.mixing, !options_.any_order);
  if (header_.gated) coder_->use_gates(&borders_);
  MAILLE_CHECK(file_.write_stream({"DESC", 0, 0}, MAILLE_TRY(encode_header(header_))));
  if (order_apart_.empty()) return {};
  return file_.write_stream({"ordr", 0, 0}, order_apart_);
}

/// Codes the records of the intake. Runs of hexahedra go through sweep(), which does as many as it can; each
/// that it leaves is coded alone, and the sweep is tried again behind it.
void StreamBatches::code_records(CellCoder<RangeEncoder>& coder, RangeEncoder& cells,
                                 RangeEncoder& numbers_out, CodedCells& out) {
  const uint64_t* const all_numbers = intake.all_numbers();
  const uint8_t* const all_last_uses = intake.all_last_uses();
  size_t at = 0, faces_at = 0, alike = 0;
  for (size_t i = 0; i < intake.records.size(); ++i) {
    // Hexahedra from here on.
    alike = std::max(alike, i);
    while (alike < intake.records.size() && intake.records[alike].kind == hexahedron_kind) ++alike;
    const size_t swept =
        coder.sweep(cells, numbers_out, all_numbers + at, all_last_uses + at, alike - i, out);
    at += swept * most_corners;
    i += swept;
    if (i == intake.records.size()) break;
    const Intake::Record& record = intake.records[i];
    const std::span numbers(all_numbers + at, record.nodes);
    const std::span last_use(all_last_uses + at, record.nodes);
    at += record.nodes;
    cell_.kind = record.kind;
    cell_.type = record.type;
    const auto sizes = std::span(intake.face_sizes).subspan(faces_at, record.faces);
    cell_.sizes.assign(sizes.begin(), sizes.end());
    faces_at += record.faces;
    if (record.kind == loose_cell || record.kind == face_cell) {
      cell_.numbers.assign(numbers.begin(), numbers.end());
      cell_.finals.assign(last_use.begin(), last_use.end());
    } else {
      cell_.final = 0;
      // Nodes stand in the order of the hull here; files have voxels and pixels in another one.
      for (size_t i = 0; i < record.nodes; ++i) {
        const size_t place = record.kind < shape_count ? cell_shapes[record.kind].place[i] : i;
        cell_.number[i] = numbers[place];
        cell_.final |= (last_use[place] != 0 ? 1u : 0u) << i;
      }
    }
    coder.code(cells, numbers_out, cell_, out);
  }
}

/// Takes the values of the points that came up, out of the waiting ones or from the caller (PointSource), in
/// the order in which they came up, which is that of the file.
Result<> StreamBatches::take_point_values(Block& block) {
  for (size_t s = 0; s < stages_.size(); ++s) {
    if (stages_[s].domain() == Domain::point)
      block.tuples[s].resize(block.cells.points.size() * stages_[s].tuple_size());
  }
  for (size_t i = 0; i < block.cells.points.size(); ++i) {
    const uint64_t number = block.cells.points[i].number;
    // Positions alone need no buffer in between.
    std::byte* to =
        only_positions() ? block.tuples[0].data() + i * point_buffer_.size() : point_buffer_.data();
    if (options_.points) {
      MAILLE_CHECK(options_.points->read(number, to));
    } else if (!waiting.take(number, to)) {
      // The cell is told from the start of the stream, as callers count them.
      const uint64_t cell = block.cells.points[i].cell;
      const std::string where = cell == no_slot ? "" : "cell " + std::to_string(report_.cells + cell) + ": ";
      return failure(ErrorCode::malformed_input, where + "point " + std::to_string(number) +
                                                     " was not given, or is used after its last use");
    }
    const std::byte* from = point_buffer_.data();
    for (size_t s = 0; s < stages_.size() && !only_positions(); ++s) {
      if (stages_[s].domain() != Domain::point) continue;
      const size_t size = stages_[s].tuple_size();
      std::copy_n(from, size, block.tuples[s].data() + i * size);
      from += size;
    }
  }
  return {};
}

/// The first stage of a block: its cells, and the values that they bring. Values of cells are swapped, not
/// copied.
Result<> StreamBatches::code_cells(Block& block) {
  block.cells.clear();
  coder_->end_block();
  code_records(*coder_, cells_, numbers_, block.cells);
  if (!takes_late()) MAILLE_CHECK(take_point_values(block));
  if (is_placed_) places_.find(block.tuples[0], block.places);
  // The buffers of the block before come back into the intake, so that nothing is allocated in the long run.
  size_t next = 0;
  for (size_t s = 0; s < stages_.size(); ++s) {
    if (stages_[s].domain() == Domain::cell) block.tuples[s].swap(intake.cell_arrays[next++]);
  }
  report_.cells += block.cells.size();
  report_.points += block.cells.points.size();
  batch_.records += intake.records.size();
  batch_.cells += block.cells.size();
  batch_.points += block.cells.points.size();
  batch_.blocks.insert(batch_.blocks.end(), intake.blocks.begin(), intake.blocks.end());
  report_.most_live_points = std::max(report_.most_live_points, coder_->hull().live_points());
  report_.most_live_cells = std::max(report_.most_live_cells, coder_->hull().live_cells());
  records_taken_ += intake.records.size();
  intake.clear();
  return {};
}

/// The second stage of a block, for one array. Ranges are of the numbers as they were given.
Result<> StreamBatches::code_values(Block& block, size_t stage) {
  if (stage == 0 && takes_late()) MAILLE_CHECK(take_point_values(block));
  const StreamArray& array = stage == 0 ? options_.positions : options_.arrays[stage - 1];
  widen(tail.ranges[stage], array.type, array.components, block.tuples[stage]);
  stages_[stage].code(block.cells, block.places, block.tuples[stage].data());
  return {};
}

/// Codes what waits; ends of points that no waiting cell uses follow as records of their own: the end of a
/// point in memory, or a point without cells.
Result<> StreamBatches::run_block() {
  std::vector<uint64_t> late;
  if (!intake.ended.empty()) resolve_ends(late);
  MAILLE_CHECK(begin_stream());
  MAILLE_CHECK(run_records());
  // is_alive() is asked after all waiting cells were coded: a point that none of them has is either
  // still in memory, or no cell has had it.
  for (const uint64_t number : late) {
    intake.add(coder_->is_alive(number) ? ended_point : isolated_point, CellType::vertex, {&number, 1}, {});
    if (is_full()) MAILLE_CHECK(run_records());
  }
  return {};
}

/// Codes the cells of one block at the same time as the values of the block before. Each task has its own
/// coder and models, so that threads change no byte.
Result<> StreamBatches::run_records() {
  if (intake.records.empty()) return {};
  Result<> cells, positions;
  Block& block = blocks_[current_];
  Block& before = blocks_[1 - current_];
  // Task 0 are the cells, which take longest; then positions; then arrays.
  executor_.parallel_for(1 + (values_wait_ ? stages_.size() : 0), [&](size_t task) {
    if (task == 0) {
      cells = code_cells(block);
    } else if (task == 1) {
      positions = code_values(before, 0);
    } else {
      [[maybe_unused]] const Result<> none = code_values(before, task - 1);  // only positions can fail
    }
  });
  // The older error first: values belong to the block before.
  MAILLE_CHECK(positions);
  MAILLE_CHECK(cells);
  MAILLE_CHECK(write_closed_batch());
  values_wait_ = true;
  current_ = 1 - current_;
  size_t bytes = cells_.size() + numbers_.size();
  for (auto& stage : stages_) bytes += stage.coder().size();
  // The values of its last block are coded beside the cells of the next. The bytes are those so far, so that
  // a batch ends a block late at most.
  if (batch_.records >= options_.most_cells_per_batch || bytes >= options_.bytes_per_batch) close_batch();
  return {};
}

/// Ends the batch: the next records are another one's. It is written when the values that wait are coded.
void StreamBatches::close_batch() {
  if (batch_.records == 0) return;
  closed_.emplace();
  closed_->cells = cells_.finish();
  closed_->numbers = numbers_.finish();
  cells_ = {};
  numbers_ = {};
  // The numbers follow in the same chunk, and take the rest of it.
  batch_.cell_bytes = closed_->cells.size();
  closed_->header = std::move(batch_);
  batch_ = {};
  records_taken_ = 0;
  for (BlockStart& start : intake.blocks) start.records_before = 0;
}

/// Writes the batch that is closed, all of whose values are coded: cells, then each array that has tuples in
/// it.
Result<> StreamBatches::write_closed_batch() {
  if (!closed_) return {};
  const ClosedBatch batch = std::move(*closed_);
  closed_.reset();
  const auto patch = static_cast<uint32_t>(tail.batches++);
  ByteWriter out;
  write_batch_header(out, batch.header);
  out.put_bytes(batch.cells);
  out.put_bytes(batch.numbers);
  report_.cell_bytes += batch.cells.size();
  report_.number_bytes += batch.numbers.size();
  MAILLE_CHECK(file_.write_stream({"CELL", patch, 0}, out.bytes()));
  for (size_t s = 0; s < stages_.size(); ++s) {
    const std::vector<std::byte> bytes = stages_[s].coder().finish();
    stages_[s].begin_batch(RansEncoder(stages_[s].lanes()));
    const bool of_points = stages_[s].domain() == Domain::point;
    const uint64_t tuples = of_points ? batch.header.points : batch.header.cells;
    (s == 0 ? report_.position_bytes : report_.array_bytes[s - 1]) += bytes.size();
    if (tuples == 0) continue;
    const StreamKey key =
        s == 0 ? StreamKey{"POSI", patch, 0} : StreamKey{"ARRY", patch, static_cast<uint32_t>(s - 1)};
    MAILLE_CHECK(file_.write_stream(key, bytes));
  }
  return {};
}

/// Everything that waits is coded and written: there is no next block whose cells it could go beside.
Result<> StreamBatches::end_batch() {
  if (!closed_) close_batch();
  if (values_wait_) {
    Result<> positions;
    executor_.parallel_for(stages_.size(), [&](size_t stage) {
      const Result<> coded = code_values(blocks_[1 - current_], stage);
      if (stage == 0) positions = coded;
    });
    MAILLE_CHECK(positions);
    values_wait_ = false;
  }
  return write_closed_batch();
}

/// Behind an error the state is not consistent any more, so that each further call gives that error again.
Result<> StreamBatches::run() {
  if (failed_) return tl::unexpected(*failed_);
  const Result<> done = run_block();
  if (done) return done;
  failed_ = done.error();
  intake.clear();  // the caller may take back what was given
  return done;
}

Result<> StreamBatches::flush() {
  MAILLE_CHECK(run());
  MAILLE_CHECK(run_records());
  return end_batch();
}

/// Ranges of arrays of numbers: zeros were coded in their stead, and their ends tell the true ones, as they
/// rise within each run.
void StreamBatches::set_ranges_of_numbers() {
  for (const NumberedArray& numbered : header_.description.numbered) {
    const StreamArray& array = options_.arrays[numbered.array];
    const RisingNumbers numbers(numbered, array.type);
    ValueRange& range = tail.ranges[numbered.array + 1];
    range = {};
    uint64_t begin = 0;
    for (const NumberedArray::Run& run : numbered.runs) {
      std::array<std::byte, 8> number{};
      for (const uint64_t element : {begin, begin + run.count - 1}) {
        numbers.store(element, number.data());
        widen(range, array.type, 1, Bytes(number).first(numbers.number_size()));
      }
      begin += run.count;
    }
  }
}

Result<StreamReport> StreamBatches::finish() {
  MAILLE_CHECK(flush());
  for (const uint64_t number : waiting.numbers()) {  // what waits now is used by no cell
    intake.add(isolated_point, CellType::vertex, {&number, 1}, {});
    if (is_full()) MAILLE_CHECK(run_records());
  }
  MAILLE_CHECK(flush());
  if (!intake.blocks.empty()) {  // blocks without cells, behind all others
    batch_.blocks = intake.blocks;
    ByteWriter out;
    write_batch_header(out, batch_);
    MAILLE_CHECK(file_.write_stream({"CELL", static_cast<uint32_t>(tail.batches++), 0}, out.bytes()));
  }
  tail.points = report_.points;
  tail.cells = report_.cells;
  report_.corners = tail.corners;
  // What a decoder will need at most: readers estimate their memory by it.
  tail.most_live_points = report_.most_live_points;
  tail.most_live_cells = report_.most_live_cells;
  set_ranges_of_numbers();
  for (const auto& stage : stages_) report_.errors.push_back(stage.largest_error());
  // Without bounds all are 0, and the list is left out.
  if (std::any_of(header_.bounds.begin(), header_.bounds.end(), [](double bound) { return bound > 0; }))
    tail.errors = report_.errors;
  MAILLE_CHECK(file_.write_stream({"TAIL", 0, 0}, encode_tail(tail)));
  report_.file_bytes = MAILLE_TRY(file_.finish());
  MAILLE_CHECK(sink_.commit());
  return report_;
}

}  // namespace maille
