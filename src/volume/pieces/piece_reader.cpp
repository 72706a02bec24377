#include "volume/pieces/piece_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/result.h"
#include "description/description.h"
#include "volume/pieces/border_points.h"
#include "volume/pieces/coarse_level.h"
#include "volume/stream/step_chain.h"
#include "volume/stream/stream_file.h"
#include "volume/stream/time_steps.h"
#include "volume/values/value_range.h"

namespace maille {
namespace {

/// Pages until there is none.
Result<std::vector<PieceRecord>> read_index(const FileReader& file) {
  std::vector<PieceRecord> all;
  for (uint32_t page = 0; file.has_stream({"PIDX", page, 0}); ++page) {
    const std::vector<std::byte> bytes = MAILLE_TRY(file.read_stream({"PIDX", page, 0}));
    const std::vector<PieceRecord> records = MAILLE_TRY(decode_index(bytes));
    all.insert(all.end(), records.begin(), records.end());
    if (records.size() < pieces_per_page) break;
  }
  return all;
}

/// Index and end of a file lie together: a distant source fetches them at once.
Result<> fetch_end(const Source& source) {
  if (!source.view().empty()) return {};
  std::vector<std::byte> end(static_cast<size_t>(std::min<uint64_t>(source.size(), uint64_t{64} << 10)));
  return source.read_at(source.size() - end.size(), end);
}

bool is_alike(const StreamArray& array, const Array& decoded) {
  return array.name == decoded.name && array.domain == decoded.domain && array.type == decoded.type &&
         array.components == decoded.components;
}

}  // namespace

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
  reader.header_ = MAILLE_TRY(decode_header(MAILLE_TRY(file.read_stream({"DESC"}))));
  return reader;
}

Result<PieceReader> PieceReader::open(const Source& source, const DecodeOptions& options) {
  PieceReader reader = MAILLE_TRY(open_front(source, options));
  const FileReader& file = *reader.file_;
  reader.tail_ = MAILLE_TRY(decode_tail(MAILLE_TRY(file.read_stream({"TAIL"}))));
  if (options.step != 0) MAILLE_CHECK(reader.take_step());
  if (reader.in_pieces_) {
    reader.pieces_ = MAILLE_TRY(read_index(file));
    MAILLE_CHECK(reader.check_index());
  } else {
    PieceRecord& all = reader.pieces_.emplace_back();
    all.cells = reader.tail_.cells;
    all.points = reader.tail_.points;
  }
  reader.choose_arrays(options.arrays);
  return reader;
}

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
  reader.choose_arrays(options.arrays);
  return reader;
}

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

/// The arrays of the step in place of the mesh's.
Result<> PieceReader::take_step() {
  if (in_pieces_) return failure(ErrorCode::usage, name_ + ": has no steps; it is in pieces");
  const std::vector<StreamStep> steps = MAILLE_TRY(list_steps(*source_));
  if (options_.step > steps.size()) {
    return failure(ErrorCode::usage, name_ + ": has no step " + std::to_string(options_.step) +
                                         "; the last one is " + std::to_string(steps.size()));
  }
  header_.description.arrays = steps[options_.step - 1].arrays;
  const StepValues values = MAILLE_TRY(StepValues::open(*source_, options_.step));
  header_.description.metadata = MAILLE_TRY(values.metadata(header_));
  return {};
}

Result<> PieceReader::check_index() const {
  const size_t arrays = header_.description.arrays.size();
  const bool fits = std::all_of(pieces_.begin(), pieces_.end(), [&](const PieceRecord& record) {
    return record.fields.size() == arrays && record.coded_bytes.size() == arrays + 3;
  });
  if (!fits || pieces_.size() != tail_.batches)
    return failure(ErrorCode::corrupt, name_ + ": the index of pieces is damaged");
  for (const PieceRecord& record : pieces_) {
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

PieceReader PieceReader::with_arrays(std::optional<std::vector<std::string>> arrays) const {
  PieceReader other = *this;
  other.choose_arrays(std::move(arrays));
  return other;
}

Result<> PieceReader::fetch(std::span<const uint32_t> pieces, bool numbered) const {
  if (!in_pieces_ || !source_->view().empty()) return {};
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
    const bool of_piece = record.header.type == ChunkType{'P', 'I', 'E', 'C'} ||
                          (numbered && record.header.type == ChunkType{'G', 'I', 'D', 'S'});
    if (!of_piece || record.header.patch >= wanted.size() || wanted[record.header.patch] == 0) continue;
    const auto size = static_cast<size_t>(chunk_total_bytes(record.header));
    if (bytes + size > most) MAILLE_CHECK(read());
    records.push_back(record);
    bytes += size;
  }
  return read();
}

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

/// Rounding may take a little.
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

Result<DecodedPiece> PieceReader::read_coded(uint32_t number, bool numbered) const {
  const std::vector<std::byte> bytes = MAILLE_TRY(file_->read_stream({"PIEC", number, 0}));
  CodedPiece coded = MAILLE_TRY(decode_piece(bytes));
  DecodedPiece piece;
  piece.mesh = MAILLE_TRY(decode_stream(*memory_source(std::move(coded.file)), options_));
  piece.blocks = std::move(coded.blocks);
  MAILLE_CHECK(check(piece, pieces_[number]));
  const auto points = static_cast<uint32_t>(piece.mesh.point_count());
  // Points without cells are a piece that has no border.
  const std::vector<uint32_t> border =
      piece.blocks.empty() ? std::vector<uint32_t>() : border_points(piece.mesh);
  piece.shared = MAILLE_TRY(decode_shared(coded.shared, points, border));
  if (!numbered) return piece;
  const std::vector<std::byte> numbers = MAILLE_TRY(file_->read_stream({"GIDS", number, 0}));
  piece.numbers = MAILLE_TRY(decode_numbers(numbers, piece.mesh.cell_count(), points));
  return piece;
}

Result<DecodedPiece> PieceReader::read_whole(bool numbered) const {
  DecodedPiece piece;
  piece.mesh = MAILLE_TRY(decode_stream(*source_, options_));
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

Result<DecodedPiece> PieceReader::read(uint32_t number, bool numbered) const {
  auto piece = in_pieces_ ? read_coded(number, numbered) : read_whole(numbered);
  if (piece || !in_pieces_) return piece;
  Error error = std::move(piece).error();
  error.message = name_ + ": piece " + std::to_string(number) + ": " + error.message;
  return tl::unexpected(std::move(error));
}

}  // namespace maille
