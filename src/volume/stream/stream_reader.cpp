#include <maille/stream.h>
#include <maille/version.h>

#include <atomic>

#include "base/held_bytes.h"
#include "base/named_error.h"
#include "base/result.h"
#include "volume/stream/chunk_pull.h"
#include "volume/stream/numbered_arrays.h"
#include "volume/stream/step_chain.h"
#include "volume/stream/stream_layout.h"
#include "volume/stream/time_steps.h"

namespace maille {
namespace {

/// Nodes of cells that were swept, and where they stand in the connectivity of the portion. Their numbers are
/// filled in by complete(), beside the next cells.
struct NodeRun {
  size_t node = 0, at = 0, count = 0;
};

/// A block between the stages: cells are decoded, values not yet.
struct Block {
  CodedCells cells;
  StreamPortion portion;
  std::vector<NodeRun> runs;  ///< not yet in the portion
  uint32_t cell_slots = 0;    ///< so far
  uint64_t bytes = 0;         ///< counted of the most it held, as its vectors only ever grow
};

/// Empties a portion but for `connectivity` and `slots`, which are written over and cut off behind the last
/// cell: clearing them would write zeros into megabytes just to overwrite them.
void clear(StreamPortion& portion) {
  portion.blocks.clear();
  portion.types.clear();
  portion.offsets.assign(1, 0);
  portion.face_sizes.clear();
  portion.cell_faces.clear();
  portion.points.clear();
  portion.point_slots.clear();
  portion.ended_slots.clear();
}

// Measured on faces of 102,400 corners over as many points (maille_scaling): with 8 MiB more they bound what
// a block takes. A usual one, of a new point and eight corners a cell, is within these 8 MiB, so that
// streams of hexahedra go on to be read with 3 MiB allowed.
constexpr uint64_t bytes_per_new_point = 250, bytes_per_new_corner = 110;
constexpr uint64_t usual_points = cells_per_block, usual_corners = 8 * cells_per_block;
constexpr uint64_t block_grain = 1 << 20;  // how often it is looked at

}  // namespace

// Two blocks are in work: while the values of one are decoded, the cells of the next one are (next()). All
// memory is bounded: chunks are complete before they are decoded, counts of the file only ever limit loops
// that coded bytes feed, and portions are held against the limits. docs/format.md, 16.
class StreamReader::Implementation {
 public:
  Implementation(std::unique_ptr<ByteStream> bytes, const StreamReadOptions& options)
      : pull_(std::move(bytes)),
        options_(options),
        executor_(options.executor ? *options.executor : serial_executor()) {}

  /// Reads the header and the description. `step`: values of that step in place of the mesh's.
  Result<> open(std::optional<StepValues> step = {});
  const StreamDescription& description() const { return header_.description; }
  Result<bool> next(StreamPortion& portion);
  /// May be asked while next() works.
  uint64_t memory() const { return bytes_.load(); }

 private:
  // Errors name the file and the batch, which is where salvage stops.
  tl::unexpected<Error> damaged(const std::string& what) const {
    return failure(ErrorCode::corrupt, pull_.name() + ": batch " + std::to_string(batches_) + ": " + what);
  }
  Result<bool> next_chunk(ChunkHeader& header, Bytes& content);
  Result<std::vector<std::byte>> rest_of_stream(const ChunkHeader& first, Bytes content);
  Result<bool> begin_batch();
  Result<bool> read_batch();
  Result<> take_step(StepValues step);
  void fill_numbers(StreamPortion& portion) const;
  Result<> read_values();
  Result<> check_tail(Bytes bytes);
  uint64_t decode_alike(Block& block, uint64_t most);
  Result<> decode_cells(Block& block);
  void complete(Block& block);
  Result<> take_memory(uint64_t& held, uint64_t wanted);
  uint64_t memory_left() const;
  tl::unexpected<Error> too_little_memory() const;
  uint64_t memory_of_block(const Block& block) const;
  Result<> take_block(Block& block, uint64_t cells);
  Result<> prepare_values(Block& block);
  Result<> decode_values(const Block& block, size_t stage);
  size_t add_nodes(StreamPortion& portion, size_t count);
  Result<> append_cell(const StreamedCell& cell, Block& block);
  static void append_faces(const StreamedCell& cell, StreamPortion& portion);
  void begin_blocks(StreamPortion& portion);
  Result<CellType> type_here(const StreamedCell& cell, size_t nodes) const;

  // `pull_` has verified the checksum of each chunk. What may still be wrong is which chunks there are (some
  // may be missing or change places, which types and numbers tell), and any content that somebody made on
  // purpose.
  ChunkPull pull_;
  StreamReadOptions options_;
  Executor& executor_;
  StreamHeader header_;
  std::optional<CellCoder<RangeDecoder>> coder_;
  std::vector<ValueChain> chains_;                          ///< positions, then the arrays that are given out
  std::vector<Domain> domains_;                             ///< of the arrays in the stream
  std::vector<std::pair<size_t, RisingNumbers>> numbered_;  ///< by chain
  std::optional<StepValues> step_;
  BatchHeader batch_;
  std::vector<std::byte> cell_stream_, number_stream_;
  std::vector<std::vector<std::byte>> value_streams_;  ///< positions, then the arrays in the stream
  std::optional<RangeDecoder> cells_, numbers_;
  // They take turns: `ready_` is the one whose values come next, the other one gets the next cells.
  std::array<Block, 2> blocks_;
  std::vector<std::byte*> tuples_;        ///< by stage, of the block whose values come next
  std::vector<Vector3> places_;           ///< of the points of that block, if arrays need them
  std::vector<uint64_t> number_of_slot_;  ///< up to the block whose values come next
  size_t corners_ = 0;                    ///< of the portion whose cells are decoded
  unsigned ready_ = 0;                    ///< the block whose cells are decoded
  bool is_ready_ = false;
  uint64_t records_left_ = 0;
  size_t starts_used_ = 0;  ///< of the batch's blocks of cells
  // Of the block of cells that the current record is in.
  CellType block_type_ = CellType::mixed;
  /// All that is in memory: descriptions, models, what cells keep, what each chain of values keeps, and the
  /// portions. What each of them takes is known to the task that works on it; the sum is what is held against
  /// the limit.
  std::atomic<uint64_t> bytes_ = 0;
  uint64_t model_bytes_ = 0, batch_bytes_ = 0, cell_bytes_ = 0, portion_bytes_ = 0;
  std::vector<uint64_t> chain_bytes_;
  uint64_t batches_ = 0;
  uint64_t cells_seen_ = 0, points_seen_ = 0;
  bool ended_ = false;
  StreamedCell cell_;
};

Result<> StreamReader::Implementation::open(std::optional<StepValues> step) {
  const FileHeader file = MAILLE_TRY(pull_.begin());
  if (file.mode != Mode::stream) {
    return failure(ErrorCode::unsupported,
                   pull_.name() + ": a file of another mode than \"stream\"; decode() reads it");
  }
  if ((file.required_features & in_pieces_feature) != 0)
    return failure(ErrorCode::unsupported, pull_.name() +
                                               ": a volume in pieces, which is no stream: decode() and "
                                               "VolumeFile read it (`maille decompress`, `extract`)");
  ChunkHeader header;
  Bytes content;
  if (!MAILLE_TRY(next_chunk(header, content)) || header.type != ChunkType{'D', 'E', 'S', 'C'}) {
    return failure(ErrorCode::corrupt, pull_.name() + ": the stream does not begin with its description");
  }
  const std::vector<std::byte> bytes = MAILLE_TRY(rest_of_stream(header, content));
  header_ = MAILLE_TRY(with_name(decode_header(bytes, plain_memory(options_.limits)), pull_.name()));
  if (header_.description.order_apart && !options_.any_order) {
    return failure(
        ErrorCode::unsupported,
        pull_.name() + ": cells and points stand in another order than in the mesh; decode() reads it");
  }
  for (const StreamArray& array : header_.description.arrays) domains_.push_back(array.domain);
  // Added up before any coder is made, as a description of a few bytes can name thousands of arrays.
  uint64_t models = header_.memory + tuple_coder_bytes(header_.positions());
  for (size_t i = 0; i < domains_.size() && !step; ++i) models += tuple_coder_bytes(header_.array(i));
  MAILLE_CHECK(take_memory(model_bytes_, models));
  coder_.emplace(header_.mixing, !header_.description.any_order);
  if (header_.gated) coder_->use_gates(nullptr);
  // By stream of the mesh, positions first, also where a step takes only some of them: the streams of a batch
  // must be passed over in order.
  value_streams_.resize(1 + domains_.size());
  chains_.push_back(ValueChain::of_mesh(header_, {}));
  if (step) {
    MAILLE_CHECK(take_step(std::move(*step)));
  } else {
    for (size_t i = 0; i < domains_.size(); ++i) chains_.push_back(ValueChain::of_mesh(header_, i));
  }
  chain_bytes_.resize(chains_.size());
  // Where the order stands apart the numbers of elements are known only when it was restored
  // (MeshCollector::set_numbers()).
  if (header_.description.order_apart) return {};
  for (const NumberedArray& array : header_.description.numbered)
    numbered_.emplace_back(array.array + 1,
                           RisingNumbers(array, header_.description.arrays[array.array].type));
  return {};
}

/// The next chunk that matters: ancillary ones (lower case first) are passed over. The mesh's own end is
/// where ChunkPull finds the footer.
Result<bool> StreamReader::Implementation::next_chunk(ChunkHeader& header, Bytes& content) {
  for (;;) {
    if (!MAILLE_TRY(pull_.next(header, content))) return false;
    if (header.type[0] >= 'A' && header.type[0] <= 'Z') return true;
  }
}

/// The content of a stream whose first chunk was just read: its parts stand one behind the other. A stream
/// has at most as many bytes as the limit, however many parts it claims.
Result<std::vector<std::byte>> StreamReader::Implementation::rest_of_stream(const ChunkHeader& first,
                                                                            Bytes content) {
  std::vector<std::byte> bytes(content.begin(), content.end());
  ChunkHeader part = first;
  for (uint32_t number = 0;; ++number) {
    const bool same = part.type == first.type && part.patch == first.patch && part.number == first.number;
    if (!same || part.part() != number) return damaged("parts of " + describe(first) + " are not in order");
    if (number > 0) bytes.insert(bytes.end(), content.begin(), content.end());
    if (part.last()) return bytes;
    if (bytes.size() > options_.limits.mesh_bytes) {
      return failure(ErrorCode::memory_bound, pull_.name() + ": one stream takes more memory than allowed");
    }
    if (!MAILLE_TRY(next_chunk(part, content))) return damaged("the stream ends within it");
  }
}

/// Reads the next batch; false: there is none. All of it is read before anything is decoded, so that a stream
/// whose bytes have not arrived yet can be asked again: the place is marked, and an error of kind `network`
/// goes back to it.
Result<bool> StreamReader::Implementation::begin_batch() {
  pull_.mark();
  auto begun = read_batch();
  if (!begun && begun.error().code == ErrorCode::network) pull_.rewind();
  return begun;
}

// CELL comes first, then POSI and ARRY in the order of the header; anything else is damage. The bytes of
// coded cells are copied, as decoders refer to them while chunks go by.
Result<bool> StreamReader::Implementation::read_batch() {
  ChunkHeader header;
  Bytes content;
  if (!MAILLE_TRY(next_chunk(header, content))) return damaged("the end of the stream is missing");
  std::vector<std::byte> bytes = MAILLE_TRY(rest_of_stream(header, content));
  // The tail must be the last chunk, so that a file cannot go on after its end was checked.
  if (header.type == ChunkType{'T', 'A', 'I', 'L'}) {
    MAILLE_CHECK(check_tail(bytes));
    return false;
  }
  if (header.type != ChunkType{'C', 'E', 'L', 'L'} || header.patch != batches_ || header.number != 0) {
    return damaged("cells are missing");
  }
  ByteReader in(bytes);
  // Besides the batch's list its blocks may stand in both portions, whose lists grow.
  constexpr uint64_t lists = 5;
  batch_ = MAILLE_TRY(with_name(read_batch_header(in, memory_left() / lists), pull_.name()));
  MAILLE_CHECK(take_memory(batch_bytes_, lists * batch_.memory));
  const Bytes cells = in.get_bytes(batch_.cell_bytes), numbers = in.get_bytes(in.remaining());
  cell_stream_.assign(cells.begin(), cells.end());
  number_stream_.assign(numbers.begin(), numbers.end());
  cells_.emplace(cell_stream_);
  numbers_.emplace(number_stream_);
  MAILLE_CHECK(read_values());
  records_left_ = batch_.records;
  starts_used_ = 0;
  ++batches_;
  return true;
}

/// Takes the arrays of the step in place of the mesh's own, of which only those are read that the step needs
/// (ValueChain::mesh_array()).
Result<> StreamReader::Implementation::take_step(StepValues step) {
  for (size_t i = 0; i < step.header().arrays.size(); ++i) {
    chains_.push_back(MAILLE_TRY(ValueChain::of_step(header_, step, i)));
    MAILLE_CHECK(take_memory(model_bytes_, model_bytes_ + chains_.back().coder_bytes()));
  }
  std::vector<NumberedArray> numbered;
  for (size_t i = 0; i < step.header().arrays.size(); ++i) {
    const StepCoding& coding = step.header().codings[i];
    for (const NumberedArray& of_mesh : header_.description.numbered) {
      if (coding.method == StepCoding::as_mesh && coding.of == of_mesh.array)
        numbered.push_back({i, of_mesh.runs});
    }
  }
  header_.description.numbered = std::move(numbered);
  header_.description.metadata = MAILLE_TRY(step.metadata(header_));
  header_.description.arrays = step.header().arrays;
  set_time(step.header().time, header_.description.mesh_arrays);
  step_.emplace(std::move(step));
  return {};
}

/// One part of the reader's memory, of which `held` bytes are counted, comes to be of `wanted`.
Result<> StreamReader::Implementation::take_memory(uint64_t& held, uint64_t wanted) {
  const uint64_t all = bytes_ += wanted - held;
  held = wanted;
  if (all > options_.limits.mesh_bytes) return too_little_memory();
  return {};
}

/// Enough for a few names, whatever the limit is.
uint64_t StreamReader::Implementation::memory_left() const {
  const uint64_t most = plain_memory(options_.limits);
  return most - std::min<uint64_t>(bytes_, most);
}

tl::unexpected<Error> StreamReader::Implementation::too_little_memory() const {
  return failure(ErrorCode::memory_bound,
                 pull_.name() + ": the points, cells and models that its decoder keeps take more than the " +
                     std::to_string(options_.limits.mesh_bytes >> 20) + " MiB allowed");
}

/// What a block takes for its own points and corners: as the cells that are decoded, as a portion, and while
/// values are.
uint64_t StreamReader::Implementation::memory_of_block(const Block& block) const {
  const auto beyond = [](uint64_t count, uint64_t usual) { return count - std::min(count, usual); };
  return beyond(block.cells.points.size(), usual_points) * bytes_per_new_point +
         beyond(corners_, usual_corners) * bytes_per_new_corner;
}

/// Counts what the decoder of cells keeps with `cells` more of up to eight corners, and the block so far; the
/// next cell may have as many corners as there is memory for.
Result<> StreamReader::Implementation::take_block(Block& block, uint64_t cells) {
  MAILLE_CHECK(take_memory(cell_bytes_, coder_->bytes(cells)));
  MAILLE_CHECK(take_memory(block.bytes, std::max(block.bytes, memory_of_block(block))));
  const uint64_t left = options_.limits.mesh_bytes - std::min<uint64_t>(bytes_, options_.limits.mesh_bytes);
  coder_->allow((left + block_grain) / (bytes_per_new_point + bytes_per_new_corner), left + block_grain);
  return {};
}

/// Reads the values of the batch, in the order of the arrays. Arrays without tuples in the batch have no
/// chunk.
Result<> StreamReader::Implementation::read_values() {
  for (auto& bytes : value_streams_) bytes.clear();
  for (size_t s = 0; s <= domains_.size(); ++s) {
    const bool of_points = s == 0 || domains_[s - 1] == Domain::point;
    const uint64_t tuples = of_points ? batch_.points : batch_.cells;
    if (tuples > 0) {
      ChunkHeader header;
      Bytes content;
      const ChunkType wanted = s == 0 ? ChunkType{'P', 'O', 'S', 'I'} : ChunkType{'A', 'R', 'R', 'Y'};
      const bool there = MAILLE_TRY(next_chunk(header, content));
      if (!there || header.type != wanted || header.patch != batches_ ||
          header.number != (s == 0 ? 0 : s - 1)) {
        return damaged("numbers are missing");
      }
      std::vector<std::byte> bytes = MAILLE_TRY(rest_of_stream(header, content));
      value_streams_[s] = std::move(bytes);
    }
  }
  for (size_t s = 0; s < chains_.size(); ++s) {
    const uint64_t tuples = chains_[s].domain() == Domain::point ? batch_.points : batch_.cells;
    if (tuples == 0) {
      chains_[s].begin_empty_batch();
      continue;
    }
    // A chain of a step that begins with an array of the mesh needs that array's bytes, too.
    const Bytes of_mesh = value_streams_[s == 0 ? 0 : chains_[s].mesh_array()];
    MAILLE_CHECK(chains_[s].begin_batch(of_mesh, step_ ? &*step_ : nullptr, static_cast<uint32_t>(batches_)));
  }
  return {};
}

/// The counts that were met must be those that the file tells; this finds batches that are missing at the
/// end.
Result<> StreamReader::Implementation::check_tail(Bytes bytes) {
  const StreamTail tail = MAILLE_TRY(with_name(decode_tail(bytes, memory_left()), pull_.name()));
  if (tail.batches != batches_ || tail.cells != cells_seen_ || tail.points != points_seen_) {
    return damaged("the stream does not hold what its end says");
  }
  ChunkHeader header;
  Bytes content;
  if (MAILLE_TRY(next_chunk(header, content))) return damaged("something follows the end of the stream");
  return {};
}

/// Notes the blocks of cells that begin at the current record, empty ones included.
void StreamReader::Implementation::begin_blocks(StreamPortion& portion) {
  const uint64_t before = batch_.records - records_left_;
  for (; starts_used_ < batch_.blocks.size() && batch_.blocks[starts_used_].records_before <= before;
       ++starts_used_) {
    const BlockStart& start = batch_.blocks[starts_used_];
    portion.blocks.push_back({cells_seen_, start.name, start.type});
    block_type_ = start.type;
  }
}

/// The type of a decoded cell. Any byte may have been decoded for loose cells and cells given by faces, so
/// the type is held against what a cell of the block can be.
Result<CellType> StreamReader::Implementation::type_here(const StreamedCell& cell, size_t nodes) const {
  CellType type = cell.kind >= shape_count ? cell.type : cell_shapes[cell.kind].type;
  const bool renamed = type == CellType::triangle || type == CellType::quad;
  if (block_type_ == CellType::polygon && renamed && cell.kind < shape_count) type = CellType::polygon;
  const bool known = cell.kind < shape_count ||
                     (type != CellType::mixed && (type != CellType::polyhedron || cell.kind == face_cell) &&
                      std::string_view(name_of(type)) != "unknown");
  const bool fits = block_type_ == CellType::mixed || block_type_ == type;
  if (!known || !fits || (nodes_of(type) != 0 && nodes_of(type) != nodes)) {
    return damaged("a cell of an impossible type");
  }
  return type;
}

/// Makes room for the points of cells; returns where they begin. Vectors only ever grow here, and are cut at
/// the end of the block.
size_t StreamReader::Implementation::add_nodes(StreamPortion& portion, size_t count) {
  const size_t at = corners_;
  corners_ += count;
  if (portion.connectivity.size() < corners_) portion.connectivity.resize(corners_);
  if (portion.slots.size() < corners_) portion.slots.resize(corners_);
  return at;
}

/// Appends a decoded cell to the portion, in the order of nodes that files and Mesh have.
Result<> StreamReader::Implementation::append_cell(const StreamedCell& cell, Block& block) {
  StreamPortion& portion = block.portion;
  const auto slots = std::span(block.cells.nodes).subspan(block.cells.begin.back());
  portion.types.push_back(MAILLE_TRY(type_here(cell, slots.size())));
  if (portion.types.back() == CellType::polyhedron) append_faces(cell, portion);
  const size_t at = add_nodes(portion, slots.size());
  const bool has_shape = cell.kind < shape_count;
  std::copy_n(has_shape ? cell.number.data() : cell.numbers.data(), slots.size(),
              portion.connectivity.data() + at);
  std::copy_n(slots.data(), slots.size(), portion.slots.data() + at);
  // Voxels and pixels: their nodes go to other places than the hull numbers them by.
  for (size_t i = 0; has_shape && i < slots.size() && !cell_shapes[cell.kind].in_place(); ++i) {
    const size_t place = at + cell_shapes[cell.kind].place[i];
    portion.connectivity[place] = cell.number[i];
    portion.slots[place] = slots[i];
  }
  portion.offsets.push_back(corners_);
  if (!portion.cell_faces.empty()) portion.cell_faces.push_back(portion.face_sizes.size());
  ++cells_seen_;
  // Sixteen bytes a corner: number, slot, and what stands beside.
  if ((corners_ + portion.face_sizes.size()) * 16 > options_.limits.mesh_bytes) {
    return failure(ErrorCode::memory_bound,
                   pull_.name() + ": some thousand cells take more memory than allowed");
  }
  return {};
}

/// Faces of a polyhedron. With the first one all cells of the portion have faces, those before it none.
void StreamReader::Implementation::append_faces(const StreamedCell& cell, StreamPortion& portion) {
  if (portion.cell_faces.empty()) portion.cell_faces.assign(portion.types.size(), 0);
  portion.face_sizes.insert(portion.face_sizes.end(), cell.sizes.begin(), cell.sizes.end());
}

/// Decodes hexahedra by CellCoder::sweep(), in the block of cells where it is; `most` at most. Returns how
/// many. complete() gives them their points, beside the next cells: cells are what the two tasks of next()
/// wait for.
uint64_t StreamReader::Implementation::decode_alike(Block& block, uint64_t most) {
  if (block_type_ != CellType::hexahedron && block_type_ != CellType::mixed) return 0;
  // Not beyond the start of the next block of cells, which may be of another type.
  if (starts_used_ < batch_.blocks.size()) {
    const uint64_t before = batch_.records - records_left_;
    most = std::min(most, batch_.blocks[starts_used_].records_before - before);
  }
  StreamPortion& portion = block.portion;
  const size_t node = block.cells.nodes.size();
  const size_t count = coder_->sweep(*cells_, *numbers_, nullptr, nullptr, most, block.cells);
  if (count == 0) return 0;
  const size_t at = add_nodes(portion, count * most_corners);
  block.runs.push_back({node, at, count * most_corners});
  portion.types.resize(portion.types.size() + count, CellType::hexahedron);
  const size_t before = portion.offsets.size();
  portion.offsets.resize(before + count);
  for (size_t k = 0; k < count; ++k) portion.offsets[before + k] = at + (k + 1) * most_corners;
  if (!portion.cell_faces.empty())
    portion.cell_faces.resize(portion.cell_faces.size() + count, portion.face_sizes.size());
  cells_seen_ += count;
  return count;
}

/// Decodes the records of one block. Slots that ended before are free from here on.
Result<> StreamReader::Implementation::decode_cells(Block& block) {
  block.cells.clear();
  block.runs.clear();
  clear(block.portion);
  corners_ = 0;
  block.portion.first_cell = cells_seen_;
  coder_->end_block();
  const uint64_t count = std::min<uint64_t>(records_left_, cells_per_block);
  MAILLE_CHECK(take_block(block, count));
  for (uint64_t i = 0; i < count; ++i) {
    begin_blocks(block.portion);
    const uint64_t swept = decode_alike(block, count - i);
    records_left_ -= swept;
    i += swept;
    if (i == count) break;
    if (swept > 0) begin_blocks(block.portion);
    const size_t cells = block.cells.size();
    // exhausted() is asked after each cell, so that a stream that is too short ends within one cell.
    if (!coder_->code(*cells_, *numbers_, cell_, block.cells) || cells_->exhausted() ||
        numbers_->exhausted()) {
      return coder_->is_beyond() ? too_little_memory() : damaged("the cells are damaged");
    }
    if (block.cells.size() > cells) MAILLE_CHECK(append_cell(cell_, block));
    if (memory_of_block(block) >= block.bytes + block_grain) MAILLE_CHECK(take_block(block, count - i));
    --records_left_;
  }
  // Blocks that begin behind the last record of the batch, empty ones.
  if (records_left_ == 0) begin_blocks(block.portion);
  block.portion.connectivity.resize(corners_);
  block.portion.slots.resize(corners_);
  points_seen_ += block.cells.points.size();
  block.portion.slot_count = coder_->hull().point_capacity();
  block.cell_slots = coder_->hull().cell_capacity();
  return {};
}

/// What of a portion follows from its cells, while the next ones are decoded. Slots may be taken again by the
/// next block, so numbers by slot are kept here, up to this block.
void StreamReader::Implementation::complete(Block& block) {
  StreamPortion& portion = block.portion;
  portion.points.resize(block.cells.points.size());
  portion.point_slots.resize(block.cells.points.size());
  if (number_of_slot_.size() < portion.slot_count) number_of_slot_.resize(portion.slot_count);
  for (size_t i = 0; i < portion.points.size(); ++i) {
    const NewPoint& point = block.cells.points[i];
    portion.points[i] = point.number;
    portion.point_slots[i] = point.slot;
    number_of_slot_[point.slot] = point.number;
  }
  for (const NodeRun& run : block.runs) {
    const uint32_t* const slots = block.cells.nodes.data() + run.node;
    std::copy_n(slots, run.count, portion.slots.begin() + static_cast<ptrdiff_t>(run.at));
    uint64_t* const numbers = portion.connectivity.data() + run.at;
    for (size_t k = 0; k < run.count; ++k) numbers[k] = number_of_slot_[slots[k]];
  }
  portion.ended_slots = block.cells.removed;
}

/// Makes room for the values of a block. Sizes are multiplied in 64 bits: at most 2^32 tuples of 2^19 bytes.
Result<> StreamReader::Implementation::prepare_values(Block& block) {
  StreamPortion& portion = block.portion;
  const auto size_at = [&](size_t s) {
    const bool on_points = chains_[s].domain() == Domain::point;
    return (on_points ? block.cells.points.size() : block.cells.size()) * chains_[s].tuple_size();
  };
  uint64_t all = 0;
  for (size_t s = 0; s < chains_.size(); ++s) all += size_at(s);
  // Portions take turns, so that two of them are there.
  MAILLE_CHECK(take_memory(portion_bytes_, 2 * all + bytes_to_hold(number_of_slot_, portion.slot_count)));
  size_t of_points = 0, of_cells = 0;
  tuples_.clear();
  for (size_t s = 0; s < chains_.size(); ++s) {
    const bool on_points = chains_[s].domain() == Domain::point;
    auto& arrays = on_points ? portion.point_arrays : portion.cell_arrays;
    size_t& next = on_points ? of_points : of_cells;
    if (s > 0 && next == arrays.size()) arrays.emplace_back();
    std::vector<std::byte>& bytes = s == 0 ? portion.positions : arrays[next++];
    bytes.resize(size_at(s));
    tuples_.push_back(bytes.data());
  }
  portion.point_arrays.resize(of_points);
  portion.cell_arrays.resize(of_cells);
  return {};
}

/// The values of one chain. Its tables by slot are counted before they grow, its models afterwards: a block
/// adds at most 3 MiB of these.
Result<> StreamReader::Implementation::decode_values(const Block& block, size_t stage) {
  ValueChain& chain = chains_[stage];
  const uint64_t points = block.portion.slot_count, cells = block.cell_slots;
  MAILLE_CHECK(take_memory(chain_bytes_[stage], chain.grown_bytes(points, cells)));
  if (!chain.code(block.cells, places_, tuples_[stage])) return damaged("the numbers are damaged");
  return take_memory(chain_bytes_[stage], chain.grown_bytes(0, 0));
}

/// The coded zeros of arrays of numbers become the numbers of these elements.
void StreamReader::Implementation::fill_numbers(StreamPortion& portion) const {
  for (const auto& [stage, numbers] : numbered_) {
    const size_t size = numbers.number_size();
    if (chains_[stage].domain() == Domain::cell) {
      numbers.store_all(portion.first_cell, {tuples_[stage], portion.cell_count() * size});
      continue;
    }
    for (size_t i = 0; i < portion.points.size(); ++i)
      numbers.store(portion.points[i], tuples_[stage] + i * size);
  }
}

/// Gives the next portion: values of one block are decoded at the same time as the cells of the next. Tasks
/// share nothing that another one writes: the values read the cells of `block`, the cells write `following`
/// and the coder.
Result<bool> StreamReader::Implementation::next(StreamPortion& portion) {
  if (ended_) return false;
  if (!is_ready_) {
    if (!MAILLE_TRY(begin_batch())) {
      ended_ = true;
      return false;
    }
    MAILLE_CHECK(decode_cells(blocks_[ready_]));
  }
  Block& block = blocks_[ready_];
  Block& following = blocks_[1 - ready_];
  MAILLE_CHECK(prepare_values(block));
  // Positions come first where other values need them; they are then not part of the tasks.
  // The cells first: they take longest.
  const size_t ahead = records_left_ > 0 ? 1 : 0;
  // An error of the next cells is told only after this block's values were found whole, but before they are
  // given out.
  Result<> cells;
  std::vector<Result<>> values(chains_.size());
  const auto decode = [&](size_t stage) { values[stage] = decode_values(block, stage); };
  const bool placed =
      std::any_of(chains_.begin(), chains_.end(), [](const ValueChain& chain) { return chain.is_placed(); });
  const size_t first = placed ? 1 : 0;
  if (placed) {
    decode(0);
    find_places(header_.description.positions.type, block.portion.positions, places_);
  }
  executor_.parallel_for(ahead + chains_.size() - first + 1, [&](size_t task) {
    if (task < ahead) {
      cells = decode_cells(following);
    } else if (task - ahead < chains_.size() - first) {
      decode(task - ahead + first);
    } else {
      complete(block);
    }
  });
  for (Result<>& each : values) MAILLE_CHECK(std::move(each));
  MAILLE_CHECK(cells);
  fill_numbers(block.portion);
  std::swap(portion, block.portion);
  is_ready_ = ahead == 1;
  if (is_ready_) ready_ = 1 - ready_;
  return true;
}

StreamReader::StreamReader(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
StreamReader::StreamReader(StreamReader&&) noexcept = default;
StreamReader::~StreamReader() = default;

// Errors: cannot_read, corrupt, unsupported, memory_bound; nothing beyond the description is read.
Result<StreamReader> StreamReader::open(std::unique_ptr<ByteStream> bytes, const StreamReadOptions& options) {
  auto implementation = std::make_unique<Implementation>(std::move(bytes), options);
  MAILLE_CHECK(implementation->open());
  return StreamReader(std::move(implementation));
}
// A reader of a step reads the file twice: front to back for cells, and step chunks by the index.
Result<StreamReader> StreamReader::open(const Source& source, uint64_t step,
                                        const StreamReadOptions& options) {
  if (step == 0) return open(source_stream(source), options);
  auto implementation = std::make_unique<Implementation>(source_stream(source), options);
  MAILLE_CHECK(implementation->open(MAILLE_TRY(StepValues::open(source, step, options.limits))));
  return StreamReader(std::move(implementation));
}
const StreamDescription& StreamReader::description() const {
  return implementation_->description();
}
uint64_t StreamReader::memory() const {
  return implementation_->memory();
}
Result<bool> StreamReader::next(StreamPortion& portion) {
  return implementation_->next(portion);
}

}  // namespace maille
