#include "volume/pieces/piece_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/named_error.h"
#include "base/result.h"
#include "description/description.h"
#include "mesh/mesh_size.h"
#include "volume/pieces/border_points.h"
#include "volume/pieces/coarse_level.h"
#include "volume/pieces/pieces_steps.h"
#include "volume/stream/step_chain.h"
#include "volume/stream/stream_file.h"
#include "volume/stream/time_steps.h"
#include "volume/values/value_range.h"

namespace maille {
namespace {

/// Reads pages until there is none. A page that is not full is the last one.
Result<IndexPage<PieceRecord>> read_index(const FileReader& file, uint64_t most_memory) {
  IndexPage<PieceRecord> all;
  for (uint32_t number = 0; file.has_stream({"PIDX", number, 0}); ++number) {
    const std::vector<std::byte> bytes = MAILLE_TRY(file.read_stream({"PIDX", number, 0}));
    auto page = MAILLE_TRY(decode_index(bytes, most_memory - all.memory));
    all.memory += page.memory;
    std::move(page.records.begin(), page.records.end(), std::back_inserter(all.records));
    if (page.records.size() < pieces_per_page) break;
  }
  return all;
}

/// Index and end of a file lie together: one read lets a distant source fetch them at once. Of 6,176 pieces
/// of 11 kB they are a three hundredth of the file, of larger pieces less.
Result<> fetch_end(const Source& source) {
  if (!source.view().empty()) return {};
  constexpr uint64_t least = uint64_t{64} << 10, most = uint64_t{512} << 10;
  const uint64_t size = std::min(source.size(), std::clamp(source.size() / 256, least, most));
  std::vector<std::byte> end(static_cast<size_t>(size));
  return source.read_at(source.size() - end.size(), end);
}

// Roles and labels may differ: they are not what later steps rely on.
bool is_alike(const StreamArray& array, const Array& decoded) {
  return array.name == decoded.name && array.domain == decoded.domain && array.type == decoded.type &&
         array.components == decoded.components;
}

}  // namespace

/// What opens whole files and damaged ones alike. Threads are the caller's: pieces are decoded by one each.
Result<PieceReader> PieceReader::open_front(const Source& source, const DecodeOptions& options) {
  MAILLE_CHECK(fetch_end(source));
  PieceReader reader;
  reader.source_ = &source;
  reader.name_ = source.name();
  reader.options_ = options;
  reader.options_.executor = nullptr;
  reader.options_.progress = nullptr;
  reader.file_ = std::make_shared<FileReader>(MAILLE_TRY(FileReader::open(source, stream_chunk_types)));
  const FileReader& file = *reader.file_;
  if (file.header().mode != Mode::stream)
    return failure(ErrorCode::unsupported, source.name() + ": a file of another mode than \"stream\"");
  reader.in_pieces_ = (file.header().required_features & in_pieces_feature) != 0;
  reader.header_ = MAILLE_TRY(header_of(file, options.limits));
  reader.memory_ = reader.header_.memory;
  // Each piece has a description of its own, of the same arrays, which is there beside this one.
  if (reader.in_pieces_ && reader.memory_ > plain_memory(options.limits) / 2)
    return failure(ErrorCode::memory_bound, source.name() + ": " + texts_too_large);
  return reader;
}

/// The whole index is read, some hundred bytes a piece: queries need all of it.
Result<PieceReader> PieceReader::open(const Source& source, const DecodeOptions& options) {
  PieceReader reader = MAILLE_TRY(open_front(source, options));
  const FileReader& file = *reader.file_;
  const uint64_t most_memory = plain_memory(options.limits);
  reader.tail_ = MAILLE_TRY(tail_of(file, most_memory - reader.memory_));
  reader.memory_ += reader.tail_.memory;
  if (reader.in_pieces_) {
    auto index = MAILLE_TRY(with_name(read_index(file, most_memory - reader.memory_), source.name()));
    reader.pieces_ = std::move(index.records);
    reader.memory_ += index.memory;
    MAILLE_CHECK(reader.check_index());
    reader.take_numbered(reader.header_.description.numbered);
    if (options.step != 0) MAILLE_CHECK(reader.take_step_in_pieces());
  } else {
    PieceRecord& all = reader.pieces_.emplace_back();
    all.cells = reader.tail_.cells;
    all.points = reader.tail_.points;
    if (options.step != 0) MAILLE_CHECK(reader.take_step());
  }
  reader.choose_arrays(options.arrays);
  return reader;
}

/// The number of pieces follows from the chunks that are there, as nothing else is left to tell it.
Result<PieceReader> PieceReader::open_damaged(const Source& source, const DecodeOptions& options) {
  PieceReader reader = MAILLE_TRY(open_front(source, options));
  uint32_t pieces = 0;
  for (const ChunkRecord& record : reader.file_->records()) {
    // A file of so many chunks has no piece of a higher number.
    const bool of_piece = record.header.type == ChunkType{'P', 'I', 'E', 'C'};
    if (of_piece && record.header.patch < reader.file_->records().size())
      pieces = std::max(pieces, record.header.patch + 1);
  }
  reader.indexed_ = false;
  reader.pieces_.resize(pieces);
  // Numbers stand behind all pieces, and are mostly missing then: without them nobody knows these arrays.
  std::vector<std::string> arrays;
  for (size_t i = 0; i < reader.header_.description.arrays.size(); ++i) {
    const auto& numbered = reader.header_.description.numbered;
    const bool is_numbered = std::any_of(numbered.begin(), numbered.end(),
                                         [&](const NumberedArray& each) { return each.array == i; });
    const std::string& name = reader.header_.description.arrays[i].name;
    if (!is_numbered && is_wanted(options, name)) arrays.push_back(name);
  }
  reader.choose_arrays(std::move(arrays));
  return reader;
}

/// Names and types of blocks from the pieces. A hostile piece may name any block, so that the numbers are
/// bounded by 2^16 here.
Result<> PieceReader::take_blocks(const std::vector<DecodedPiece>& pieces) {
  constexpr uint32_t most = 1 << 16;  // nothing but the piece says how many there are
  for (const DecodedPiece& piece : pieces) {
    for (size_t b = 0; b < piece.blocks.size(); ++b) {
      const uint32_t number = piece.blocks[b];
      if (number >= most) return failure(ErrorCode::corrupt, name_ + ": the blocks of a piece are damaged");
      if (number >= tail_.blocks.size()) tail_.blocks.resize(number + 1);
      StreamTail::Block& block = tail_.blocks[number];
      const CellBlock& found = piece.mesh.blocks[b];
      if (block.cells > 0 && block.type != found.type)
        return failure(ErrorCode::corrupt, name_ + ": the blocks of the pieces do not fit");
      block.name = found.name;
      block.type = found.type;
      block.cells += found.size();
    }
  }
  return {};
}

/// Takes the arrays of the step in place of the mesh's, in a file that is not in pieces.
Result<> PieceReader::take_step() {
  const std::vector<StreamStep> steps = MAILLE_TRY(list_steps(*source_, true, options_.limits));
  MAILLE_CHECK(check_step(options_.step, steps.size(), name_));
  header_.description.arrays = steps[options_.step - 1].arrays;
  const StepValues values = MAILLE_TRY(StepValues::open(*source_, options_.step, options_.limits));
  header_.description.metadata = MAILLE_TRY(values.metadata(header_));
  return {};
}

/// The same in a file in pieces: its fields take the place of those of the index.
Result<> PieceReader::take_step_in_pieces() {
  const auto number = static_cast<uint32_t>(options_.step);
  MAILLE_CHECK(check_step(options_.step, count_steps(*file_), name_));
  StepHeader step = MAILLE_TRY(decode_step(MAILLE_TRY(file_->read_stream({"STEP", number, 0})),
                                           header_.description.arrays, plain_memory(options_.limits)));
  std::vector<NumberedArray> numbered;
  for (size_t i = 0; i < step.arrays.size(); ++i) {
    for (const NumberedArray& of_mesh : header_.description.numbered) {
      if (step.codings[i].method == StepCoding::as_mesh && step.codings[i].of == of_mesh.array)
        numbered.push_back({i, of_mesh.runs});
    }
  }
  header_.description.metadata = MAILLE_TRY(metadata_of_step(*file_, header_, number, options_.limits));
  header_.description.arrays = std::move(step.arrays);
  take_numbered(numbered);
  set_time(step.time, header_.description.mesh_arrays);
  for (size_t first = 0; first < pieces_.size(); first += pieces_per_page) {
    const StreamKey key = {"SIDX", number, static_cast<uint32_t>(first / pieces_per_page)};
    auto page = MAILLE_TRY(
        decode_step_index(MAILLE_TRY(file_->read_stream(key)), plain_memory(options_.limits) - memory_));
    memory_ += page.memory;
    auto& fields = page.records;
    if (fields.size() != std::min<size_t>(pieces_per_page, pieces_.size() - first))
      return failure(ErrorCode::corrupt, name_ + ": the index of a step is damaged");
    for (size_t i = 0; i < fields.size(); ++i) {
      pieces_[first + i].fields = std::move(fields[i]);
      pieces_[first + i].coarse.clear();  // has no values at this time
    }
  }
  return check_fields();
}

// The arrays of the mesh, or those of a step that are the mesh's numbers.
void PieceReader::take_numbered(const std::vector<NumberedArray>& numbered) {
  numbered_.clear();
  for (const NumberedArray& array : numbered)
    numbered_.emplace_back(array.array, RisingNumbers(array, header_.description.arrays[array.array].type));
}

/// Counts and bytes of the index: one set for each piece, as many fields as arrays, no piece larger than the
/// mesh.
Result<> PieceReader::check_index() const {
  const size_t arrays = header_.description.arrays.size();
  // What is decoded of a piece without its cells is bounded by what the file says of the whole mesh.
  const bool fits = std::all_of(pieces_.begin(), pieces_.end(), [&](const PieceRecord& record) {
    return record.coded_bytes.size() == arrays + 3 && record.cells <= tail_.cells &&
           record.points <= tail_.points;
  });
  if (!fits || pieces_.size() != tail_.batches)
    return failure(ErrorCode::corrupt, name_ + ": the index of pieces is damaged");
  return check_fields();
}

/// Queries and the coarse level index fields by array and component without further checks.
Result<> PieceReader::check_fields() const {
  const size_t arrays = header_.description.arrays.size();
  for (const PieceRecord& record : pieces_) {
    if (record.fields.size() != arrays)
      return failure(ErrorCode::corrupt, name_ + ": the index of pieces is damaged");
    for (size_t i = 0; i < arrays; ++i) {
      const uint32_t components = header_.description.arrays[i].components;
      if (record.fields[i].components.size() != (components > most_ranges ? 1 : components))
        return failure(ErrorCode::corrupt, name_ + ": the index of pieces is damaged");
    }
    if (!has_coarse_sizes(record, header_.description.arrays))
      return failure(ErrorCode::corrupt, name_ + ": the index of pieces is damaged");
  }
  return {};
}

void PieceReader::choose_arrays(std::optional<std::vector<std::string>> arrays) {
  options_.arrays = std::move(arrays);
  wanted_.clear();
  for (const StreamArray& array : header_.description.arrays) {
    wanted_.push_back(is_wanted(options_, array.name));
  }
}

// Shares the open file; only what is wanted differs.
PieceReader PieceReader::with_arrays(std::optional<std::vector<std::string>> arrays) const {
  PieceReader other = *this;
  other.choose_arrays(std::move(arrays));
  return other;
}

/// Chunks are asked for in the order of the file, 16 MiB at a time: neighbours become one request. A failure
/// to fetch is one to read. Nothing is kept here but by the source.
Result<> PieceReader::fetch(std::span<const uint32_t> pieces, bool numbered) const {
  if (!in_pieces_ || !source_->view().empty()) return {};
  // How much a distant source keeps at least, so that read() finds what was fetched.
  constexpr size_t most = size_t{16} << 20;  // a distant source keeps more than that
  std::vector<uint8_t> wanted(pieces_.size());
  for (const uint32_t piece : pieces) wanted[piece] = 1;
  std::vector<ChunkRecord> records;
  size_t bytes = 0;
  const auto read = [&]() -> Result<> {
    std::vector<std::byte> all(bytes);
    std::vector<Source::Part> parts;
    size_t at = 0;
    for (const ChunkRecord& record : records) {
      const auto size = static_cast<size_t>(chunk_total_bytes(record.header));
      parts.push_back({record.offset, std::span(all).subspan(at, size)});
      at += size;
    }
    records.clear();
    bytes = 0;
    return source_->read_many(parts);
  };
  for (const ChunkRecord& record : file_->records()) {
    const bool of_piece =
        record.header.type == ChunkType{'P', 'I', 'E', 'C'} ||
        ((numbered || has_numbers_wanted()) && record.header.type == ChunkType{'G', 'I', 'D', 'S'});
    const bool of_step =
        record.header.type == ChunkType{'S', 'V', 'A', 'L'} && is_needed(record.header.patch);
    const uint32_t piece = of_step ? record.header.number : record.header.patch;
    if (!of_piece && !of_step) continue;
    if (piece >= wanted.size() || wanted[piece] == 0) continue;
    const auto size = static_cast<size_t>(chunk_total_bytes(record.header));
    if (bytes + size > most) MAILLE_CHECK(read());
    records.push_back(record);
    bytes += size;
  }
  return read();
}

/// Whether a piece is what file and index say of it. Everything after relies on types and counts being these.
Result<> PieceReader::check(const DecodedPiece& piece, const PieceRecord& record) const {
  const StreamDescription& description = header_.description;
  bool fits =
      piece.mesh.points.type == description.positions.type && piece.blocks.size() == piece.mesh.blocks.size();
  if (indexed_)
    fits = fits && piece.mesh.point_count() == record.points && piece.mesh.cell_count() == record.cells;
  for (size_t b = 0; fits && indexed_ && b < piece.blocks.size(); ++b) {
    fits = piece.blocks[b] < tail_.blocks.size() &&
           piece.mesh.blocks[b].type == tail_.blocks[piece.blocks[b]].type;
  }
  size_t next = 0;
  for (size_t i = 0; fits && i < description.arrays.size(); ++i) {
    if (wanted_[i] == 0) continue;
    fits = next < piece.mesh.arrays.size() && is_alike(description.arrays[i], piece.mesh.arrays[next]);
    ++next;
  }
  if (!fits || next != piece.mesh.arrays.size())
    return failure(ErrorCode::corrupt, "it is not what the file says of it");
  return {};
}

namespace {

/// Whether a range is within the one that is known. Rounding may take a little: one step of floats on each
/// side.
bool is_within(float low, float high, float known_low, float known_high) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  return low > high ||
         (low >= std::nextafter(known_low, -infinity) && high <= std::nextafter(known_high, infinity));
}

bool is_within(const PieceField& field, const PieceField& known) {
  for (size_t c = 0; c < field.components.size(); ++c) {
    const PieceField::Component &here = field.components[c], &there = known.components[c];
    if (!is_within(here.low, here.high, there.low, there.high)) return false;
  }
  return field.nans == known.nans;
}

}  // namespace

/// An index that promises too little makes queries miss cells, which nobody would notice: so those who read
/// everything (verify, decode into a sink) check it.
Result<> PieceReader::hold_against_index(uint32_t number, const DecodedPiece& piece) const {
  const PieceRecord& known = pieces_[number];
  PieceRecord found;
  enclose(piece.mesh.points, {}, found);
  bool fits = true;
  for (unsigned k = 0; k < 3; ++k)
    fits = fits && is_within(found.low[k], found.high[k], known.low[k], known.high[k]);
  size_t next = 0;
  for (size_t i = 0; fits && i < known.fields.size(); ++i) {
    if (wanted_[i] != 0) fits = is_within(describe_field(piece.mesh.arrays[next++], {}), known.fields[i]);
  }
  if (fits && !piece.numbers.cells.empty())
    fits = piece.numbers.cells.front() >= known.first_cell && piece.numbers.cells.back() <= known.last_cell;
  if (fits) return {};
  return failure(ErrorCode::corrupt, name_ + ": piece " + std::to_string(number) +
                                         ": its values are not what the index of pieces says of them, so "
                                         "queries may miss cells");
}

// As many as the index says, all rising (decode_rising()).
Result<PieceNumbers> PieceReader::read_numbers(uint32_t number) const {
  const std::vector<std::byte> numbers = MAILLE_TRY(file_->read_stream({"GIDS", number, 0}));
  return decode_numbers(numbers, pieces_[number].cells, pieces_[number].points);
}

// The steps of the group up to the one that is read.
bool PieceReader::is_needed(uint64_t step) const {
  return options_.step != 0 && step <= options_.step && step >= first_of_group(options_.step);
}

/// What stands behind a piece's own stream: each step as it was appended, so that the whole is a file with
/// steps.
Result<std::vector<std::byte>> PieceReader::with_steps(std::vector<std::byte> stream, uint32_t number,
                                                       uint64_t first, uint64_t last) const {
  for (uint64_t k = first; k <= last; ++k) {
    const StreamKey key = {"SVAL", static_cast<uint32_t>(k), number};
    const std::vector<std::byte> bytes = inverted(MAILLE_TRY(file_->read_stream(key)));
    stream.insert(stream.end(), bytes.begin(), bytes.end());
  }
  return stream;
}

Result<std::vector<std::byte>> PieceReader::read_stream(uint32_t number, uint64_t step) const {
  CodedPiece coded = MAILLE_TRY(decode_piece(MAILLE_TRY(file_->read_stream({"PIEC", number, 0}))));
  return with_steps(std::move(coded.file), number, first_of_group(step), step - 1);
}

// GIDS are read for these arrays even where nobody asks for numbers.
bool PieceReader::has_numbers_wanted() const {
  return std::any_of(numbered_.begin(), numbered_.end(),
                     [&](const auto& array) { return wanted_[array.first] != 0; });
}

/// Pieces have zeros in the stead of numbers.
void PieceReader::fill_numbers(DecodedPiece& piece) const {
  for (const auto& [i, values] : numbered_) {
    if (wanted_[i] == 0) continue;
    const auto before = std::count(wanted_.begin(), wanted_.begin() + static_cast<ptrdiff_t>(i), 1);
    Array& array = piece.mesh.arrays[static_cast<size_t>(before)];
    const auto& numbers = array.domain == Domain::point ? piece.numbers.points : piece.numbers.cells;
    for (size_t k = 0; k < numbers.size(); ++k)
      values.store(numbers[k], array.bytes.data() + k * values.number_size());
  }
}

/// A piece is a file within a chunk; it is decoded as any file, then held against the index. Its step has a
/// number within the group.
Result<DecodedPiece> PieceReader::read_coded(uint32_t number, bool numbered, uint64_t allowed) const {
  CodedPiece coded = MAILLE_TRY(decode_piece(MAILLE_TRY(file_->read_stream({"PIEC", number, 0}))));
  DecodedPiece piece;
  DecodeOptions options = options_;
  options.limits.mesh_bytes = allowed;
  std::vector<std::byte> stream = std::move(coded.file);
  if (options_.step != 0) {
    stream = MAILLE_TRY(with_steps(std::move(stream), number, first_of_group(options_.step), options_.step));
    // The number that the step has behind the piece's own stream.
    options.step = (options_.step - 1) % key_steps + 1;
  }
  Result<Mesh> mesh = decode_stream(*memory_source(std::move(stream)), options);
  // The file says that there is the step, but its values do not follow on what the piece holds.
  if (!mesh && mesh.error().code == ErrorCode::usage)
    return failure(ErrorCode::corrupt, "its values at step " + std::to_string(options_.step) +
                                           " are damaged, or those of another piece");
  piece.mesh = MAILLE_TRY(std::move(mesh));
  piece.blocks = std::move(coded.blocks);
  MAILLE_CHECK(check(piece, pieces_[number]));
  const auto points = static_cast<uint32_t>(piece.mesh.point_count());
  // Points without cells are a piece that has no border: none of them is shared.
  const std::vector<uint32_t> border =
      piece.blocks.empty() ? std::vector<uint32_t>() : border_points(piece.mesh);
  const std::vector<uint8_t> on_side =
      coded.shared.empty() ? std::vector<uint8_t>() : on_sides(piece.mesh.points, border);
  piece.shared = MAILLE_TRY(decode_shared(coded.shared, points, border, on_side));
  if (!numbered && !has_numbers_wanted()) return piece;
  const std::vector<std::byte> numbers = MAILLE_TRY(file_->read_stream({"GIDS", number, 0}));
  piece.numbers = MAILLE_TRY(decode_numbers(numbers, piece.mesh.cell_count(), points));
  fill_numbers(piece);
  return piece;
}

/// A stream that is not in pieces is decoded whole; its order is restored, so that numbers are places.
Result<DecodedPiece> PieceReader::read_whole(bool numbered, uint64_t allowed) const {
  DecodedPiece piece;
  DecodeOptions options = options_;
  options.limits.mesh_bytes = allowed;
  piece.mesh = MAILLE_TRY(decode_stream(*source_, options));
  const auto of_mesh = [](const Array& array) { return array.domain == Domain::mesh; };
  piece.mesh.arrays.erase(std::remove_if(piece.mesh.arrays.begin(), piece.mesh.arrays.end(), of_mesh),
                          piece.mesh.arrays.end());
  piece.blocks.resize(piece.mesh.blocks.size());
  std::iota(piece.blocks.begin(), piece.blocks.end(), 0u);
  MAILLE_CHECK(check(piece, pieces_[0]));
  if (!numbered) return piece;
  piece.numbers.cells.resize(piece.mesh.cell_count());
  piece.numbers.points.resize(piece.mesh.point_count());
  std::iota(piece.numbers.cells.begin(), piece.numbers.cells.end(), 0u);
  std::iota(piece.numbers.points.begin(), piece.numbers.points.end(), 0u);
  return piece;
}

/// An error names the piece, as the file within has no name of its own.
Result<DecodedPiece> PieceReader::read(uint32_t number, bool numbered, uint64_t allowed) const {
  auto piece = in_pieces_ ? read_coded(number, numbered, allowed) : read_whole(numbered, allowed);
  if (piece || !in_pieces_) return piece;
  Error error = std::move(piece).error();
  error.message = name_ + ": piece " + std::to_string(number) + ": " + error.message;
  return tl::unexpected(std::move(error));
}

namespace {

/// With what joining takes for its shared points: a list of places that is sorted.
uint64_t memory_of_piece(const DecodedPiece& piece) {
  constexpr uint64_t bytes_per_number = 8;
  return size_in_memory(piece.mesh) + piece.mesh.blocks.size() * sizeof(CellBlock) +
         piece.shared.size() * bytes_to_join +
         (piece.numbers.cells.size() + piece.numbers.points.size()) * bytes_per_number;
}

Result<DecodedPiece> read_and_cut(const PieceReader& reader, std::span<const uint32_t> pieces, size_t i,
                                  bool numbered, uint64_t allowed, const CutPiece& cut) {
  DecodedPiece piece = MAILLE_TRY(reader.read(pieces[i], numbered, allowed));
  return cut ? cut(i, std::move(piece)) : std::move(piece);
}

}  // namespace

Result<> read_pieces(const PieceReader& reader, std::span<const uint32_t> pieces, bool numbered,
                     const DecodeOptions& options, const CutPiece& cut, const TakePiece& take) {
  // So that memory and progress are looked at now and then, by one thread; chosen, no sweep is on record.
  constexpr size_t at_once = 32;
  Executor& executor = options.executor ? *options.executor : serial_executor();
  uint64_t left = (options.limits.mesh_bytes - std::min(options.limits.mesh_bytes, reader.memory())) / 2;
  const auto is_too_large = [](const Result<DecodedPiece>& piece) {
    return !piece && piece.error().code == ErrorCode::memory_bound;
  };
  for (size_t first = 0; first < pieces.size(); first += at_once) {
    std::vector<Result<DecodedPiece>> found(std::min(at_once, pieces.size() - first));
    const uint64_t share = left / found.size();
    executor.parallel_for(found.size(), [&](size_t i) {
      found[i] = read_and_cut(reader, pieces, first + i, numbered, share, cut);
    });
    for (size_t i = 0; i < found.size(); ++i) {
      // One that needs more than its share may have all that is left: no other one is decoded beside it.
      if (is_too_large(found[i])) found[i] = read_and_cut(reader, pieces, first + i, numbered, left, cut);
      const uint64_t bytes = found[i] ? memory_of_piece(*found[i]) : 0;
      if (is_too_large(found[i]) || bytes > left) {
        return failure(ErrorCode::memory_bound,
                       reader.name() + ": the mesh, in pieces and as a whole, takes more than the " +
                           std::to_string(options.limits.mesh_bytes >> 20) + " MiB allowed");
      }
      if (!found[i] && found[i].error().code != ErrorCode::corrupt) return tl::unexpected(found[i].error());
      left -= bytes;
      MAILLE_CHECK(take(first + i, std::move(found[i])));
    }
  }
  return {};
}

}  // namespace maille
