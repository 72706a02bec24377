#include <maille/stream.h>
#include <maille/version.h>

#include <algorithm>
#include <cmath>

#include "base/result.h"
#include "container/file_writer.h"
#include "volume/order/delay_buffer.h"
#include "volume/stream/mesh_stream.h"
#include "volume/stream/stream_intake.h"
#include "volume/stream/stream_layout.h"
#include "volume/values/array_stage.h"

namespace maille {
namespace {

/// Ends of points that wait for a block of cells: a mesh of points only has as many as points.
constexpr size_t most_ended = 1 << 16;

/// A block between the stages: its cells, and the tuples of each array (positions first).
struct Block {
  CodedCells cells;
  std::vector<std::vector<std::byte>> tuples;
};

}  // namespace

class StreamWriter::Implementation {
 public:
  Implementation(Sink& sink, StreamOptions options, StreamHeader header, std::vector<std::byte> order_apart,
                 std::vector<uint8_t> borders, FileWriter file)
      : sink_(sink),
        options_(std::move(options)),
        executor_(options_.executor ? *options_.executor : serial_executor()),
        header_(std::move(header)),
        order_apart_(std::move(order_apart)),
        borders_(std::move(borders)),
        file_(std::move(file)),
        waiting_(stride_of(options_)) {
    stages_.emplace_back(header_.positions(), Domain::point);
    for (size_t i = 0; i < options_.arrays.size(); ++i)
      stages_.emplace_back(header_.array(i), options_.arrays[i].domain);
    for (auto& stage : stages_) stage.begin_batch(RansEncoder(stage.lanes()));
    for (const StreamArray& array : options_.arrays) {
      if (array.domain == Domain::cell) intake_.cell_arrays.emplace_back();
    }
    report_.array_bytes.resize(options_.arrays.size());
    tail_.ranges.resize(stages_.size());
    point_buffer_.resize(stride_of(options_));
    for (Block& block : blocks_) block.tuples.resize(stages_.size());
    if (options_.delay > 0) delay_.emplace(options_.delay);
  }

  template <class NumberAt>
  Result<> add_points(uint64_t count, NumberAt number_at, Bytes positions, std::span<const Bytes> arrays);
  Result<> begin_block(std::string name, CellType type);
  Result<> add_cells(CellType type, std::span<const uint64_t> connectivity, std::span<const uint8_t> last_use,
                     std::span<const Bytes> arrays, size_t nodes);
  Result<> add_polyhedron(std::span<const uint32_t> face_sizes, std::span<const uint64_t> connectivity,
                          std::span<const uint8_t> last_use, std::span<const Bytes> arrays);
  Result<> end_points(std::span<const uint64_t> numbers);
  Result<> flush();
  Result<StreamReport> finish();

 private:
  static size_t stride_of(const StreamOptions& options) {
    size_t stride = options.positions.tuple_size();
    for (const StreamArray& array : options.arrays)
      stride += array.domain == Domain::point ? array.tuple_size() : 0;
    return stride;
  }
  friend class StreamWriter;
  size_t position_size() const { return options_.positions.tuple_size(); }
  bool is_full() const { return intake_.records.size() == cells_per_block; }
  unsigned kind_in_block(CellType type, size_t nodes) const;
  Result<> check_cells(CellType type, size_t count, size_t nodes, std::span<const uint8_t> last_use,
                       std::span<const Bytes> arrays) const;
  Result<> add_alike(unsigned kind, CellType type, std::span<const uint64_t> numbers,
                     std::span<const uint8_t> last_use, std::span<const Bytes> arrays, size_t count);
  Result<> add_cell(unsigned kind, CellType type, std::span<const uint64_t> numbers,
                    std::span<const uint8_t> last_use, std::span<const uint32_t> face_sizes, size_t i,
                    size_t count, std::span<const Bytes> arrays);
  Result<> add_values(size_t i, size_t count, std::span<const Bytes> arrays);
  Result<> add_delayed();
  Result<> add_all_delayed();
  void add_record(unsigned kind, CellType type, std::span<const uint64_t> numbers,
                  std::span<const uint8_t> last_use);
  void resolve_ends(std::vector<uint64_t>& late);
  Result<> run_records();
  Result<> run_block();
  Result<> code_cells(Block& block);
  Result<> begin_stream();
  void code_records(CellCoder<RangeEncoder>& coder, RangeEncoder& cells, RangeEncoder& numbers,
                    CodedCells& out);
  bool only_positions() const { return point_buffer_.size() == stages_[0].tuple_size(); }
  /// Positions that can be read at any time are read beside the next cells.
  bool takes_late() const { return options_.points != nullptr && only_positions(); }
  Result<> take_point_values(Block& block);
  Result<> code_values(Block& block, size_t stage);
  void count_polyhedron(std::span<const uint32_t> face_sizes, std::span<const uint64_t> points);
  /// A batch whose cells are coded, and the values of its last block may not be.
  struct ClosedBatch {
    BatchHeader header;
    std::vector<std::byte> cells, numbers;
  };
  void close_batch();
  Result<> write_closed_batch();
  Result<> end_batch();

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
  WaitingPoints waiting_;
  std::vector<std::byte> point_buffer_;
  std::optional<DelayBuffer> delay_;
  Intake intake_;
  std::array<Block, 2> blocks_;
  unsigned current_ = 0;  ///< the block whose cells come next; the other one may wait for its values
  bool values_wait_ = false;
  BatchHeader batch_;
  std::optional<ClosedBatch> closed_;
  StreamedCell cell_;
  StreamTail tail_;
  std::array<uint64_t, 256> cells_of_type_{};
  std::vector<uint64_t> sorted_;
  StreamReport report_;
  uint64_t records_taken_ = 0;  ///< into the intake, in this batch
  uint64_t cells_given_ = 0;
  std::optional<Error> failed_;
};

unsigned StreamWriter::Implementation::kind_in_block(CellType type, size_t nodes) const {
  // Polygons of three and four corners are triangles and quads with another name, which the block remembers.
  const bool polygons = !tail_.blocks.empty() && tail_.blocks.back().type == CellType::polygon;
  if (polygons && type == CellType::polygon && nodes == 3) return kind_of(CellType::triangle);
  if (polygons && type == CellType::polygon && nodes == 4) return kind_of(CellType::quad);
  const unsigned kind = kind_of(type);
  return kind == face_cell && type == CellType::polygon && nodes > most_face_corners ? loose_cell : kind;
}

template <class NumberAt>
Result<> StreamWriter::Implementation::add_points(uint64_t count, NumberAt number_at, Bytes positions,
                                                  std::span<const Bytes> arrays) {
  std::vector<std::pair<const std::byte*, size_t>> parts;
  const auto add_part = [&](Bytes bytes, const StreamArray& array) {
    parts.emplace_back(bytes.data(), array.tuple_size());
    return bytes.size() == count * array.tuple_size();
  };
  bool fit = add_part(positions, options_.positions);
  size_t next = 0;
  for (const StreamArray& array : options_.arrays) {
    if (array.domain != Domain::point) continue;
    fit = fit && next < arrays.size() && add_part(arrays[next], array);
    ++next;
  }
  if (!fit || next != arrays.size())
    return failure(ErrorCode::usage, "values of points do not have the size declared");
  for (uint64_t i = 0; i < count; ++i) {
    const uint64_t number = number_at(i);
    if (number == ~uint64_t{0} || waiting_.has(number)) {
      return failure(ErrorCode::usage, "point " + std::to_string(number) + " was given twice");
    }
    std::byte* out = waiting_.add(number);
    for (const auto& [bytes, size] : parts) out = std::copy_n(bytes + i * size, size, out);
  }
  return {};
}

Result<> StreamWriter::Implementation::begin_block(std::string name, CellType type) {
  if (std::string_view(name_of(type)) == "unknown")
    return failure(ErrorCode::usage, "a block of an unknown cell type");
  MAILLE_CHECK(add_all_delayed());
  intake_.blocks.push_back({records_taken_ + intake_.records.size(), name, type});
  tail_.blocks.push_back({std::move(name), type, 0});
  return {};
}

Result<> StreamWriter::Implementation::check_cells(CellType type, size_t count, size_t nodes,
                                                   std::span<const uint8_t> last_use,
                                                   std::span<const Bytes> arrays) const {
  const auto wrong = [&](const std::string& what) {
    return failure(ErrorCode::malformed_input, "cell " + std::to_string(cells_given_) + ": " + what);
  };
  const CellType block = tail_.blocks.back().type;
  if (block != CellType::mixed && block != type) {
    return wrong(std::string(name_of(type)) + " in a block of type " + name_of(block));
  }
  if (type == CellType::mixed || std::string_view(name_of(type)) == "unknown") return wrong("unknown type");
  const unsigned needed = nodes_of(type);
  if ((needed != 0 && nodes != needed) || nodes > most_loose_nodes) {
    return wrong(std::string(name_of(type)) + " with " + std::to_string(nodes) + " nodes");
  }
  if (!last_use.empty() && last_use.size() != count * nodes) return wrong("flags of last use do not fit");
  size_t next = 0;
  for (const StreamArray& array : options_.arrays) {
    if (array.domain != Domain::cell) continue;
    if (next >= arrays.size() || arrays[next].size() != count * array.tuple_size()) {
      return wrong("values of \"" + array.name + "\" do not have the size declared");
    }
    ++next;
  }
  return next == arrays.size() ? Result<>{} : wrong("more arrays than declared");
}

void StreamWriter::Implementation::add_record(unsigned kind, CellType type, std::span<const uint64_t> numbers,
                                              std::span<const uint8_t> last_use) {
  intake_.records.push_back({static_cast<uint8_t>(kind), type, static_cast<uint32_t>(numbers.size()), 0});
  intake_.numbers.insert(intake_.numbers.end(), numbers.begin(), numbers.end());
  if (last_use.empty()) {
    intake_.last_use.resize(intake_.numbers.size());
  } else {
    intake_.last_use.insert(intake_.last_use.end(), last_use.begin(), last_use.end());
  }
}

Result<> StreamWriter::Implementation::add_cells(CellType type, std::span<const uint64_t> connectivity,
                                                 std::span<const uint8_t> last_use,
                                                 std::span<const Bytes> arrays, size_t nodes) {
  if (type == CellType::polyhedron) return failure(ErrorCode::usage, "polyhedra come by add_polyhedron()");
  if (tail_.blocks.empty()) MAILLE_CHECK(begin_block("", CellType::mixed));
  if (nodes == 0) nodes = nodes_of(type);
  if (nodes == 0 ? !connectivity.empty() : connectivity.size() % nodes != 0) {
    return failure(ErrorCode::malformed_input,
                   "the number of nodes of a " + std::string(name_of(type)) + " is not clear");
  }
  // A cell without any node is one cell.
  const size_t count = nodes == 0 ? 1 : connectivity.size() / nodes;
  MAILLE_CHECK(check_cells(type, count, nodes, last_use, arrays));
  const unsigned kind = kind_in_block(type, nodes);
  cells_of_type_[static_cast<uint8_t>(type)] += count;
  if (!delay_) return add_alike(kind, type, connectivity, last_use, arrays, count);
  for (size_t i = 0; i < count; ++i) {
    MAILLE_CHECK(add_cell(kind, type, connectivity.subspan(i * nodes, nodes),
                          last_use.empty() ? last_use : last_use.subspan(i * nodes, nodes), {}, i, count,
                          arrays));
  }
  return {};
}

/// Cells of one size, as many at once as a block has room for.
Result<> StreamWriter::Implementation::add_alike(unsigned kind, CellType type,
                                                 std::span<const uint64_t> numbers,
                                                 std::span<const uint8_t> last_use,
                                                 std::span<const Bytes> arrays, size_t count) {
  const size_t nodes = numbers.size() / count;
  for (size_t i = 0; i < count;) {
    const size_t some = std::min<size_t>(count - i, cells_per_block - intake_.records.size());
    tail_.blocks.back().cells += some;
    cells_given_ += some;
    tail_.corners += some * nodes;
    intake_.records.insert(intake_.records.end(), some,
                           {static_cast<uint8_t>(kind), type, static_cast<uint32_t>(nodes), 0});
    const auto append = [&](auto& to, const auto& from, size_t size) {
      const auto begin = from.begin() + static_cast<ptrdiff_t>(i * size);
      to.insert(to.end(), begin, begin + static_cast<ptrdiff_t>(some * size));
    };
    if (intake_.numbers.empty() && some == cells_per_block && !last_use.empty() && intake_.ended.empty()) {
      intake_.given_numbers = numbers.subspan(i * nodes, some * nodes);
      intake_.given_last_use = last_use.subspan(i * nodes, some * nodes);
    } else {
      append(intake_.numbers, numbers, nodes);
      if (last_use.empty()) {
        intake_.last_use.resize(intake_.numbers.size());
      } else {
        append(intake_.last_use, last_use, nodes);
      }
    }
    for (size_t k = 0; k < arrays.size(); ++k)
      append(intake_.cell_arrays[k], arrays[k], arrays[k].size() / count);
    i += some;
    if (!is_full()) continue;
    const Result<> done = run_block();
    if (done) continue;
    failed_ = done.error();
    intake_.clear();  // the caller may take back what was given
    return done;
  }
  return {};
}

/// Cell i of `count`, whose tuples are in `arrays`: held back, or given to the coder.
Result<> StreamWriter::Implementation::add_cell(unsigned kind, CellType type,
                                                std::span<const uint64_t> numbers,
                                                std::span<const uint8_t> last_use,
                                                std::span<const uint32_t> face_sizes, size_t i, size_t count,
                                                std::span<const Bytes> arrays) {
  ++tail_.blocks.back().cells;
  ++cells_given_;
  tail_.corners += numbers.size();
  if (!delay_) {
    add_record(kind, type, numbers, last_use);
    intake_.records.back().faces = static_cast<uint32_t>(face_sizes.size());
    intake_.face_sizes.insert(intake_.face_sizes.end(), face_sizes.begin(), face_sizes.end());
    return add_values(i, count, arrays);
  }
  if (delay_->is_full()) MAILLE_CHECK(add_delayed());
  DelayedCell& cell = delay_->next();
  cell.kind = kind;
  cell.type = type;
  cell.numbers.assign(numbers.begin(), numbers.end());
  cell.last_use.assign(last_use.begin(), last_use.end());
  cell.last_use.resize(numbers.size());
  cell.face_sizes.assign(face_sizes.begin(), face_sizes.end());
  cell.values.clear();
  for (const Bytes array : arrays) {
    const Bytes tuple = array.subspan(i * (array.size() / count), array.size() / count);
    cell.values.insert(cell.values.end(), tuple.begin(), tuple.end());
  }
  delay_->enter();
  return {};
}

/// The best of the cells that are held back.
Result<> StreamWriter::Implementation::add_delayed() {
  const DelayedCell& cell = delay_->take();
  add_record(cell.kind, cell.type, cell.numbers, cell.last_use);
  intake_.records.back().faces = static_cast<uint32_t>(cell.face_sizes.size());
  intake_.face_sizes.insert(intake_.face_sizes.end(), cell.face_sizes.begin(), cell.face_sizes.end());
  std::vector<Bytes> tuples;
  size_t at = 0;
  for (const StreamArray& array : options_.arrays) {
    if (array.domain != Domain::cell) continue;
    tuples.push_back(Bytes(cell.values).subspan(at, array.tuple_size()));
    at += array.tuple_size();
  }
  return add_values(0, 1, tuples);
}

Result<> StreamWriter::Implementation::add_all_delayed() {
  while (delay_ && !delay_->is_empty()) MAILLE_CHECK(add_delayed());
  return {};
}

/// The tuples of cell i of `count` behind its record.
Result<> StreamWriter::Implementation::add_values(size_t i, size_t count, std::span<const Bytes> arrays) {
  for (size_t k = 0; k < arrays.size(); ++k) {
    const size_t size = arrays[k].size() / count;
    const auto from = arrays[k].begin() + static_cast<ptrdiff_t>(i * size);
    intake_.cell_arrays[k].insert(intake_.cell_arrays[k].end(), from, from + static_cast<ptrdiff_t>(size));
  }
  return is_full() ? run_block() : Result<>{};
}

Result<> StreamWriter::Implementation::add_polyhedron(std::span<const uint32_t> face_sizes,
                                                      std::span<const uint64_t> connectivity,
                                                      std::span<const uint8_t> last_use,
                                                      std::span<const Bytes> arrays) {
  if (tail_.blocks.empty()) MAILLE_CHECK(begin_block("", CellType::mixed));
  MAILLE_CHECK(check_cells(CellType::polyhedron, 1, connectivity.size(), last_use, arrays));
  uint64_t corners = 0;
  for (const uint32_t size : face_sizes) corners += size;
  if (corners != connectivity.size() || corners > most_face_corners ||
      face_sizes.size() > most_face_corners) {
    return failure(ErrorCode::malformed_input,
                   "cell " + std::to_string(cells_given_) + ": a polyhedron with " +
                       std::to_string(face_sizes.size()) + " faces of " + std::to_string(corners) +
                       " corners, and " + std::to_string(connectivity.size()) + " points for them");
  }
  count_polyhedron(face_sizes, connectivity);
  return add_cell(face_cell, CellType::polyhedron, connectivity, last_use, face_sizes, 0, 1, arrays);
}

void StreamWriter::Implementation::count_polyhedron(std::span<const uint32_t> face_sizes,
                                                    std::span<const uint64_t> points) {
  ++cells_of_type_[static_cast<uint8_t>(CellType::polyhedron)];
  ++tail_.polyhedra.cells;
  tail_.polyhedra.faces += face_sizes.size();
  tail_.polyhedra.corners += points.size();
  sorted_.assign(points.begin(), points.end());
  std::sort(sorted_.begin(), sorted_.end());
  tail_.polyhedra.points +=
      static_cast<uint64_t>(std::unique(sorted_.begin(), sorted_.end()) - sorted_.begin());
}

Result<> StreamWriter::Implementation::end_points(std::span<const uint64_t> numbers) {
  for (const uint64_t number : numbers) {
    if (delay_ && delay_->end(number)) continue;
    if (intake_.ended.insert(number).second) intake_.told.push_back(number);
    if (intake_.ended.size() == most_ended) MAILLE_CHECK(run_block());
  }
  return {};
}

/// Points told to have ended end with the last cell that waits and uses them; `late` gets the others.
void StreamWriter::Implementation::resolve_ends(std::vector<uint64_t>& late) {
  for (size_t i = intake_.numbers.size(); i-- > 0 && !intake_.ended.empty();) {
    if (intake_.ended.erase(intake_.numbers[i]) > 0) intake_.last_use[i] = 1;
  }
  for (const uint64_t number : intake_.told) {
    if (intake_.ended.contains(number)) late.push_back(number);
  }
  // Numbers that are kept cost least when they rise; any order is the caller's.
  if (!options_.any_order) std::sort(late.begin(), late.end());
  intake_.ended.clear();
  intake_.told.clear();
}

/// The description, which tells how cells are coded.
Result<> StreamWriter::Implementation::begin_stream() {
  if (coder_) return {};
  coder_.emplace(header_.mixing, !options_.any_order);
  if (header_.gated) coder_->use_gates(&borders_);
  MAILLE_CHECK(file_.write_stream({"DESC", 0, 0}, MAILLE_TRY(encode_header(header_))));
  if (order_apart_.empty()) return {};
  return file_.write_stream({"ordr", 0, 0}, order_apart_);
}

void StreamWriter::Implementation::code_records(CellCoder<RangeEncoder>& coder, RangeEncoder& cells,
                                                RangeEncoder& numbers_out, CodedCells& out) {
  const uint64_t* const all_numbers = intake_.all_numbers();
  const uint8_t* const all_last_uses = intake_.all_last_uses();
  size_t at = 0, faces_at = 0, alike = 0;
  for (size_t i = 0; i < intake_.records.size(); ++i) {
    // Hexahedra from here on.
    alike = std::max(alike, i);
    while (alike < intake_.records.size() && intake_.records[alike].kind == hexahedron_kind) ++alike;
    const size_t swept =
        coder.sweep(cells, numbers_out, all_numbers + at, all_last_uses + at, alike - i, out);
    at += swept * most_corners;
    i += swept;
    if (i == intake_.records.size()) break;
    const Intake::Record& record = intake_.records[i];
    const std::span numbers(all_numbers + at, record.nodes);
    const std::span last_use(all_last_uses + at, record.nodes);
    at += record.nodes;
    cell_.kind = record.kind;
    cell_.type = record.type;
    const auto sizes = std::span(intake_.face_sizes).subspan(faces_at, record.faces);
    cell_.sizes.assign(sizes.begin(), sizes.end());
    faces_at += record.faces;
    if (record.kind == loose_cell || record.kind == face_cell) {
      cell_.numbers.assign(numbers.begin(), numbers.end());
      cell_.finals.assign(last_use.begin(), last_use.end());
    } else {
      cell_.final = 0;
      for (size_t i = 0; i < record.nodes; ++i) {
        const size_t place = record.kind < shape_count ? cell_shapes[record.kind].place[i] : i;
        cell_.number[i] = numbers[place];
        cell_.final |= (last_use[place] != 0 ? 1u : 0u) << i;
      }
    }
    coder.code(cells, numbers_out, cell_, out);
  }
}

/// The values of the points that came up, out of the waiting ones or from the caller.
Result<> StreamWriter::Implementation::take_point_values(Block& block) {
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
    } else if (!waiting_.take(number, to)) {
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

Result<> StreamWriter::Implementation::code_cells(Block& block) {
  block.cells.clear();
  coder_->end_block();
  code_records(*coder_, cells_, numbers_, block.cells);
  if (!takes_late()) MAILLE_CHECK(take_point_values(block));
  size_t next = 0;
  for (size_t s = 0; s < stages_.size(); ++s) {
    if (stages_[s].domain() == Domain::cell) block.tuples[s].swap(intake_.cell_arrays[next++]);
  }
  report_.cells += block.cells.size();
  report_.points += block.cells.points.size();
  batch_.records += intake_.records.size();
  batch_.cells += block.cells.size();
  batch_.points += block.cells.points.size();
  batch_.blocks.insert(batch_.blocks.end(), intake_.blocks.begin(), intake_.blocks.end());
  report_.most_live_points = std::max(report_.most_live_points, coder_->hull().live_points());
  report_.most_live_cells = std::max(report_.most_live_cells, coder_->hull().live_cells());
  records_taken_ += intake_.records.size();
  intake_.clear();
  return {};
}

Result<> StreamWriter::Implementation::code_values(Block& block, size_t stage) {
  if (stage == 0 && takes_late()) MAILLE_CHECK(take_point_values(block));
  const StreamArray& array = stage == 0 ? options_.positions : options_.arrays[stage - 1];
  widen(tail_.ranges[stage], array.type, array.components, block.tuples[stage]);
  stages_[stage].code(block.cells, block.tuples[stage].data());
  return {};
}

/// Codes what waits; ends of points that no waiting cell uses follow as records of their own.
Result<> StreamWriter::Implementation::run_block() {
  if (failed_) return tl::unexpected(*failed_);
  std::vector<uint64_t> late;
  if (!intake_.ended.empty()) resolve_ends(late);
  MAILLE_CHECK(begin_stream());
  MAILLE_CHECK(run_records());
  for (const uint64_t number : late) {
    add_record(coder_->is_alive(number) ? ended_point : isolated_point, CellType::vertex, {&number, 1}, {});
    if (is_full()) MAILLE_CHECK(run_records());
  }
  return {};
}

/// The cells of one block at the same time as the values of the block before.
Result<> StreamWriter::Implementation::run_records() {
  if (intake_.records.empty()) return {};
  Result<> cells, positions;
  Block& block = blocks_[current_];
  Block& before = blocks_[1 - current_];
  executor_.parallel_for(1 + (values_wait_ ? stages_.size() : 0), [&](size_t task) {
    if (task == 0) {
      cells = code_cells(block);
    } else if (task == 1) {
      positions = code_values(before, 0);
    } else {
      [[maybe_unused]] const Result<> none = code_values(before, task - 1);  // only positions can fail
    }
  });
  MAILLE_CHECK(positions);
  MAILLE_CHECK(cells);
  MAILLE_CHECK(write_closed_batch());
  values_wait_ = true;
  current_ = 1 - current_;
  size_t bytes = cells_.size() + numbers_.size();
  for (auto& stage : stages_) bytes += stage.coder().size();
  // The values of its last block are coded beside the cells of the next.
  if (batch_.records >= options_.most_cells_per_batch || bytes >= options_.bytes_per_batch) close_batch();
  return {};
}

/// No more records: the next ones are another batch's. What waits for their values is written then.
void StreamWriter::Implementation::close_batch() {
  if (batch_.records == 0) return;
  closed_.emplace();
  closed_->cells = cells_.finish();
  closed_->numbers = numbers_.finish();
  cells_ = {};
  numbers_ = {};
  batch_.cell_bytes = closed_->cells.size();
  closed_->header = std::move(batch_);
  batch_ = {};
  records_taken_ = 0;
  for (BlockStart& start : intake_.blocks) start.records_before = 0;
}

/// The batch that is closed, all of whose values are coded.
Result<> StreamWriter::Implementation::write_closed_batch() {
  if (!closed_) return {};
  const ClosedBatch batch = std::move(*closed_);
  closed_.reset();
  const auto patch = static_cast<uint32_t>(tail_.batches++);
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

Result<> StreamWriter::Implementation::end_batch() {
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

Result<> StreamWriter::Implementation::flush() {
  MAILLE_CHECK(add_all_delayed());
  MAILLE_CHECK(run_block());
  MAILLE_CHECK(run_records());
  return end_batch();
}

Result<StreamReport> StreamWriter::Implementation::finish() {
  MAILLE_CHECK(flush());
  for (const uint64_t number : waiting_.numbers()) {  // what waits now is used by no cell
    add_record(isolated_point, CellType::vertex, {&number, 1}, {});
    if (is_full()) MAILLE_CHECK(run_records());
  }
  MAILLE_CHECK(flush());
  if (!intake_.blocks.empty()) {  // blocks without cells, behind all others
    batch_.blocks = intake_.blocks;
    ByteWriter out;
    write_batch_header(out, batch_);
    MAILLE_CHECK(file_.write_stream({"CELL", static_cast<uint32_t>(tail_.batches++), 0}, out.bytes()));
  }
  tail_.points = report_.points;
  tail_.cells = report_.cells;
  report_.corners = tail_.corners;
  tail_.most_live_points = report_.most_live_points;
  tail_.most_live_cells = report_.most_live_cells;
  for (unsigned type = 0; type < cells_of_type_.size(); ++type) {
    if (cells_of_type_[type] > 0) tail_.types.emplace_back(static_cast<CellType>(type), cells_of_type_[type]);
  }
  MAILLE_CHECK(file_.write_stream({"TAIL", 0, 0}, encode_tail(tail_)));
  report_.file_bytes = MAILLE_TRY(file_.finish());
  MAILLE_CHECK(sink_.commit());
  return report_;
}

StreamWriter::StreamWriter(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
StreamWriter::StreamWriter(StreamWriter&&) noexcept = default;
StreamWriter::~StreamWriter() = default;

namespace {

Result<> check_options(const StreamOptions& options) {
  if (options.positions.components != 3)
    return failure(ErrorCode::usage, "positions must have three components");
  if (options.effort < 1 || options.effort > 9)
    return failure(ErrorCode::usage, "the effort must be from 1 to 9");
  if (options.delay > 0 && !options.any_order)
    return failure(ErrorCode::usage, "cells can be delayed only if any order will do");
  for (const StreamArray& array : options.arrays) {
    if (array.components == 0 || array.components > 0xffff) {
      return failure(ErrorCode::usage, "array \"" + array.name + "\" must have 1 to 65535 components");
    }
    if (array.domain != Domain::point && array.domain != Domain::cell) {
      return failure(ErrorCode::unsupported, "array \"" + array.name + "\" is on " + name_of(array.domain) +
                                                 "s; a stream has arrays on points and on cells");
    }
  }
  return {};
}

}  // namespace

Result<StreamWriter> StreamWriter::begin(Sink& sink, StreamOptions options) {
  MAILLE_CHECK(check_options(options));
  ArrayMapsList maps;
  maps.bounds.resize(options.arrays.size() + 1);
  // The diagonal of a box with equal sides: the bound is kept, if the box is in the range declared.
  const double diagonal = declared_width(options.positions) * 1.7320508075688772;
  maps.maps.push_back(MAILLE_TRY(declared_maps(options.positions, diagonal, maps.bounds[0])));
  for (size_t i = 0; i < options.arrays.size(); ++i) {
    maps.maps.push_back(
        MAILLE_TRY(declared_maps(options.arrays[i], declared_width(options.arrays[i]), maps.bounds[i + 1])));
  }
  return begin(sink, std::move(options), maps);
}

Result<StreamWriter> begin_with_maps(Sink& sink, StreamOptions options, const ArrayMapsList& maps) {
  MAILLE_CHECK(check_options(options));
  return StreamWriter::begin(sink, std::move(options), maps);
}

Result<StreamWriter> StreamWriter::begin(Sink& sink, StreamOptions options, const ArrayMapsList& maps) {
  StreamHeader header;
  header.description = {options.positions,  options.arrays, options.mesh_arrays, options.metadata,
                        options.provenance, options.effort, options.any_order,   !maps.order_apart.empty()};
  header.mixing = mixing_at(options.effort);
  header.mixed_values = mixes_values(options.effort, maps.mixing_is_fast);
  header.gated = !maps.borders.empty();
  header.maps = maps.maps;
  header.bounds = maps.bounds;
  MAILLE_TRY(encode_header(header));  // it is written with the first cells: what is wrong is told here
  FileWriter file = MAILLE_TRY(
      FileWriter::begin(sink, {.major = format_major, .minor = format_minor, .mode = Mode::stream}));
  return StreamWriter(std::make_unique<Implementation>(sink, std::move(options), std::move(header),
                                                       maps.order_apart, maps.borders, std::move(file)));
}

Result<> StreamWriter::add_points(uint64_t first, Bytes positions, std::span<const Bytes> arrays) {
  const size_t size = implementation_->position_size();
  return implementation_->add_points(
      positions.size() / size, [first](uint64_t i) { return first + i; }, positions, arrays);
}
Result<> StreamWriter::add_points(std::span<const uint64_t> numbers, Bytes positions,
                                  std::span<const Bytes> arrays) {
  return implementation_->add_points(
      numbers.size(), [numbers](uint64_t i) { return numbers[i]; }, positions, arrays);
}
Result<> StreamWriter::begin_block(std::string name, CellType type) {
  return implementation_->begin_block(std::move(name), type);
}
Result<> StreamWriter::add_cells(CellType type, std::span<const uint64_t> connectivity,
                                 std::span<const uint8_t> last_use, std::span<const Bytes> arrays,
                                 size_t nodes) {
  return implementation_->add_cells(type, connectivity, last_use, arrays, nodes);
}
Result<> StreamWriter::add_polyhedron(std::span<const uint32_t> face_sizes,
                                      std::span<const uint64_t> connectivity,
                                      std::span<const uint8_t> last_use, std::span<const Bytes> arrays) {
  return implementation_->add_polyhedron(face_sizes, connectivity, last_use, arrays);
}
Result<> StreamWriter::end_points(std::span<const uint64_t> numbers) {
  return implementation_->end_points(numbers);
}
Result<> StreamWriter::flush() {
  return implementation_->flush();
}
Result<StreamReport> StreamWriter::finish() {
  return implementation_->finish();
}

}  // namespace maille
