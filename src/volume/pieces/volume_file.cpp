#include <maille/volume_file.h>

#include <algorithm>

#include "base/result.h"
#include "base/sort_unique.h"
#include "description/description.h"
#include "volume/pieces/coarse_level.h"
#include "volume/pieces/piece_reader.h"
#include "volume/pieces/sub_mesh.h"
#include "volume/pieces/volume_query.h"

namespace maille {
namespace {

/// The part of a piece that is wanted, as a piece: shared points and numbers are those of what is left.
DecodedPiece part_of(const DecodedPiece& piece, const std::vector<uint32_t>& cells) {
  SubMesh sub = take_cells(piece.mesh, cells);
  DecodedPiece part;
  for (const uint32_t block : sub.block_numbers) part.blocks.push_back(piece.blocks[block]);
  for (const SharedPoint& shared : piece.shared) {
    const auto found = std::lower_bound(sub.points.begin(), sub.points.end(), shared.point);
    if (found != sub.points.end() && *found == shared.point)
      part.shared.push_back({static_cast<uint32_t>(found - sub.points.begin()), shared.copy});
  }
  if (!piece.numbers.points.empty()) {
    for (const uint32_t cell : cells) part.numbers.cells.push_back(piece.numbers.cells[cell]);
    for (const uint32_t point : sub.points) part.numbers.points.push_back(piece.numbers.points[point]);
  }
  part.mesh = std::move(sub.mesh);
  return part;
}

// Blocks without a cell that is wanted are not part of an extract.
void remove_empty_blocks(Mesh& mesh) {
  const auto is_empty = [](const CellBlock& block) { return block.size() == 0; };
  mesh.blocks.erase(std::remove_if(mesh.blocks.begin(), mesh.blocks.end(), is_empty), mesh.blocks.end());
}

// Floats of the index become doubles exactly.
PieceInfo::Field info_of(const StreamArray& array, const PieceField& field) {
  PieceInfo::Field info;
  info.name = array.name;
  info.domain = array.domain;
  for (const PieceField::Component& range : field.components) {
    info.components.push_back(
        {static_cast<double>(range.low), static_cast<double>(range.high), static_cast<double>(range.mean)});
  }
  info.nans = field.nans;
  return info;
}

/// The arrays that come, and those that conditions need besides; these are taken away in the end.
std::optional<std::vector<std::string>> arrays_for(const DecodeOptions& options, const VolumeQuery& query) {
  std::optional<std::vector<std::string>> arrays = options.arrays;
  for (const ValueCondition& condition : query.conditions) {
    if (arrays) arrays->push_back(condition.array);
  }
  return arrays;
}

// Arrays of the mesh as a whole come in any case.
void remove_unwanted(const DecodeOptions& options, Mesh& mesh) {
  if (!options.arrays) return;
  const auto is_unwanted = [&](const Array& array) {
    const bool of_elements = array.domain == Domain::point || array.domain == Domain::cell;
    return of_elements && !is_wanted(options, array.name);
  };
  mesh.arrays.erase(std::remove_if(mesh.arrays.begin(), mesh.arrays.end(), is_unwanted), mesh.arrays.end());
}

tl::unexpected<Error> no_piece(const PieceReader& reader, uint32_t piece) {
  return failure(ErrorCode::usage, reader.name() + ": has no piece " + std::to_string(piece));
}

}  // namespace

struct VolumeFile::State {
  DecodeOptions options;
  PieceReader reader;
};

VolumeFile::VolumeFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
VolumeFile::VolumeFile(VolumeFile&&) noexcept = default;
VolumeFile& VolumeFile::operator=(VolumeFile&&) noexcept = default;
VolumeFile::~VolumeFile() = default;

// Reads description, end and index. `source` must outlive the file.
Result<VolumeFile> VolumeFile::open(const Source& source, const DecodeOptions& options) {
  PieceReader reader = MAILLE_TRY(PieceReader::open(source, options));
  return VolumeFile(std::make_unique<State>(State{options, std::move(reader)}));
}

const StreamDescription& VolumeFile::description() const {
  return state_->reader.header().description;
}
uint64_t VolumeFile::cells() const {
  return state_->reader.tail().cells;
}
uint64_t VolumeFile::points() const {
  return state_->reader.tail().points;
}
uint32_t VolumeFile::pieces() const {
  return static_cast<uint32_t>(state_->reader.pieces().size());
}

// What the index says of a piece; its bytes are those of its chunks.
Result<PieceInfo> VolumeFile::info(uint32_t piece) const {
  const PieceReader& reader = state_->reader;
  if (piece >= pieces()) return no_piece(reader, piece);
  const PieceRecord& record = reader.pieces()[piece];
  PieceInfo info;
  info.cells = record.cells;
  info.points = record.points;
  info.bytes =
      reader.file().stream_bytes({"PIEC", piece, 0}) + reader.file().stream_bytes({"GIDS", piece, 0});
  if (record.low[0] <= record.high[0]) {
    info.box.emplace();
    for (unsigned k = 0; k < 3; ++k) {
      info.box->low[k] = static_cast<double>(record.low[k]);
      info.box->high[k] = static_cast<double>(record.high[k]);
    }
  }
  for (size_t i = 0; i < record.fields.size(); ++i)
    info.fields.push_back(info_of(description().arrays[i], record.fields[i]));
  return info;
}

/// By the index alone: no piece is read. Pieces may be among these that have no such cell.
Result<std::vector<uint32_t>> VolumeFile::select(const VolumeQuery& query) const {
  const CheckedQuery checked = MAILLE_TRY(CheckedQuery::check(query, state_->reader));
  std::vector<uint8_t> asked(pieces(), query.pieces ? 0 : 1);
  for (const uint32_t piece : query.pieces.value_or(std::vector<uint32_t>())) {
    if (piece >= pieces()) return no_piece(state_->reader, piece);
    asked[piece] = 1;
  }
  std::vector<uint32_t> found;
  for (uint32_t piece = 0; piece < pieces(); ++piece) {
    if (asked[piece] == 0) continue;
    const bool known = state_->reader.in_pieces();
    if (!known || checked.may_have(state_->reader.pieces()[piece])) found.push_back(piece);
  }
  return found;
}

// From the index alone, which was read on opening.
Result<Mesh> VolumeFile::coarse() const {
  const PieceReader& reader = state_->reader;
  if (!reader.in_pieces()) {
    return failure(
        ErrorCode::unsupported,
        reader.name() + ": has no coarse level; volumes that are compressed with --pieces have one");
  }
  Mesh mesh = coarse_mesh(reader.pieces(), description().arrays);
  remove_unwanted(state_->options, mesh);
  return mesh;
}

/// Pieces are fetched at once, decoded side by side and cut to what is wanted at once, so that memory follows
/// the result. A damaged piece is a problem that is told, not an error: the rest comes.
Result<ExtractedVolume> VolumeFile::extract(const VolumeQuery& query) const {
  const std::vector<uint32_t> selected = MAILLE_TRY(select(query));
  const PieceReader reader = state_->reader.with_arrays(arrays_for(state_->options, query));
  const CheckedQuery checked = MAILLE_TRY(CheckedQuery::check(query, reader));
  const bool kept = reader.kept();
  // Numbers only where the order is kept: without it no cell has one.
  MAILLE_CHECK(reader.fetch(selected, kept));
  ExtractedVolume extracted;
  std::vector<DecodedPiece> parts;
  std::vector<uint64_t> cells(selected.size());
  const auto cut = [&](size_t i, DecodedPiece piece) {
    cells[i] = piece.mesh.cell_count();
    return part_of(piece, checked.cells_of(piece));
  };
  const auto take = [&](size_t i, Result<DecodedPiece> piece) -> Result<> {
    if (!piece) {
      extracted.problems.push_back(piece.error().message);
      return {};
    }
    ++extracted.pieces;
    extracted.cells_read += cells[i];
    if (piece->mesh.cell_count() > 0) parts.push_back(*std::move(piece));
    return {};
  };
  MAILLE_CHECK(read_pieces(reader, selected, kept, state_->options, cut, take));
  extracted.mesh = MAILLE_TRY(join_pieces(parts, reader, kept, state_->options.executor));
  remove_empty_blocks(extracted.mesh);
  remove_unwanted(state_->options, extracted.mesh);
  for (const DecodedPiece& part : parts) {
    const PieceNumbers& numbers = part.numbers;
    extracted.cell_numbers.insert(extracted.cell_numbers.end(), numbers.cells.begin(), numbers.cells.end());
    extracted.point_numbers.insert(extracted.point_numbers.end(), numbers.points.begin(),
                                   numbers.points.end());
  }
  // Cells stand in the order of the input then (join_pieces()), so that sorted numbers are theirs in order.
  std::sort(extracted.cell_numbers.begin(), extracted.cell_numbers.end());
  std::vector<uint32_t>& points = extracted.point_numbers;
  sort_unique(points);
  return extracted;
}

}  // namespace maille
