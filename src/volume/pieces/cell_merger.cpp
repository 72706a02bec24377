#include "volume/pieces/cell_merger.h"

#include <algorithm>
#include <functional>
#include <queue>

#include "base/result.h"

namespace maille {
namespace {

/// So many cells are read at once of each piece, and so many written at once. 64: with 4,096 pieces a quarter
/// of a million cells wait. Chosen, no sweep is on record.
constexpr size_t cells_of_group = 64;
constexpr size_t cells_at_once = 4096;

}  // namespace

CellMerger::CellMerger(const MeshDescription& mesh, MeshSink& sink, bool numbered, ScratchLists lists)
    : mesh_(mesh), sink_(sink), numbered_(numbered), lists_(std::move(lists)), cursors_(lists_.count()) {
  for (size_t i = 0; i < mesh.arrays.size(); ++i) {
    if (mesh.arrays[i].domain != Domain::cell) continue;
    columns_.push_back(i);
    values_size_ += mesh.arrays[i].tuple_size();
  }
  values_.resize(columns_.size());
  block_end_ = mesh.blocks.empty() ? 0 : mesh.blocks[0].cells;
}

// Lists have no share of memory: a group is what they wait for.
Result<CellMerger> CellMerger::create(const MeshDescription& mesh, MeshSink& sink, size_t pieces,
                                      bool numbered, const std::string& folder) {
  ScratchLists lists = MAILLE_TRY(ScratchLists::create(folder, pieces, 0));
  return CellMerger(mesh, sink, numbered, std::move(lists));
}

Result<> CellMerger::add(size_t piece, uint64_t number, uint32_t block, uint8_t type,
                         std::span<const uint64_t> nodes, std::span<const uint32_t> faces, Bytes values) {
  packer_.pack(number, block, type, nodes, faces, group_);
  group_.put_bytes(values);
  return ++in_group_ < cells_of_group ? Result<>() : end_group(piece);
}

/// A group begins with its size, as cells have none; each group is packed by itself.
Result<> CellMerger::end_group(size_t piece) {
  if (in_group_ == 0) return {};
  const std::vector<std::byte> bytes = group_.take();
  const auto size = static_cast<uint32_t>(bytes.size());
  group_ = {};
  packer_ = {};
  in_group_ = 0;
  MAILLE_CHECK(lists_.append(piece, std::as_bytes(std::span(&size, 1))));
  return lists_.append(piece, bytes);
}

Result<> CellMerger::end_piece(size_t piece) {
  return end_group(piece);
}

/// Goes to the next cell of the piece; `cell` is nullptr behind the last one.
Result<> CellMerger::advance(size_t piece) {
  Cursor& cursor = cursors_[piece];
  cursor.cell = nullptr;
  if (!cursor.in || cursor.in->remaining() == 0) {
    uint32_t size = 0;
    if (MAILLE_TRY(lists_.read_some(piece, cursor.place, std::as_writable_bytes(std::span(&size, 1)))) == 0)
      return {};
    cursor.group.resize(size);
    MAILLE_TRY(lists_.read_some(piece, cursor.place, cursor.group));
    cursor.in.emplace(cursor.group);
    cursor.unpacker = {};
  }
  cursor.cell = &cursor.unpacker.unpack(*cursor.in);
  cursor.values = cursor.in->get_bytes(values_size_);
  return {};
}

// Without numbers cells go by block, then by piece: the order in which a decoder in memory has them.
CellMerger::Next CellMerger::next_of(size_t piece) const {
  const PackedCell& cell = *cursors_[piece].cell;
  return {numbered_ ? cell.number : cell.block, piece};
}

/// A heap of pieces by their next cell. The piece at its top goes on as long as it is first, as runs of cells
/// are long.
Result<bool> CellMerger::merge() {
  MAILLE_CHECK(lists_.finish());
  std::priority_queue<Next, std::vector<Next>, std::greater<>> waiting;
  for (size_t piece = 0; piece < cursors_.size(); ++piece) {
    MAILLE_CHECK(advance(piece));
    if (cursors_[piece].cell != nullptr) waiting.push(next_of(piece));
  }
  while (!waiting.empty()) {
    const size_t piece = waiting.top().piece;
    waiting.pop();
    Cursor& cursor = cursors_[piece];
    while (cursor.cell != nullptr && (waiting.empty() || waiting.top() > next_of(piece))) {
      if (!MAILLE_TRY(put(*cursor.cell, cursor.values))) return false;
      MAILLE_CHECK(advance(piece));
    }
    if (cursor.cell != nullptr) waiting.push(next_of(piece));
  }
  MAILLE_CHECK(flush());
  return first_ == mesh_.cells;
}

/// Each cell must be the next one of the mesh; blocks that end here are passed over.
Result<bool> CellMerger::put(const PackedCell& cell, Bytes values) {
  const uint64_t place = first_ + cells_.size();
  while (place >= block_end_ && block_ + 1 < mesh_.blocks.size()) block_end_ += mesh_.blocks[++block_].cells;
  const bool fits = place < mesh_.cells && cell.block == block_ && (!numbered_ || cell.number == place);
  if (!fits) return false;
  if (cells_.offsets.empty()) cells_.offsets.push_back(0);
  cells_.types.push_back(cell.type);
  cells_.connectivity.insert(cells_.connectivity.end(), cell.nodes.begin(), cell.nodes.end());
  cells_.offsets.push_back(cells_.connectivity.size());
  if (!cell.faces.empty() || !cells_.cell_faces.empty()) {
    cells_.cell_faces.resize(cells_.types.size(), cells_.face_sizes.size());
    cells_.face_sizes.insert(cells_.face_sizes.end(), cell.faces.begin(), cell.faces.end());
    cells_.cell_faces.push_back(cells_.face_sizes.size());
  }
  size_t at = 0;
  for (size_t k = 0; k < columns_.size(); ++k) {
    const size_t size = mesh_.arrays[columns_[k]].tuple_size();
    const Bytes tuple = values.subspan(at, size);
    values_[k].insert(values_[k].end(), tuple.begin(), tuple.end());
    at += size;
  }
  if (cells_.size() == cells_at_once) MAILLE_CHECK(flush());
  return true;
}

/// Writes cells behind their values: some formats have these within the cells.
Result<> CellMerger::flush() {
  if (cells_.size() == 0) return {};
  for (size_t k = 0; k < columns_.size(); ++k) {
    MAILLE_CHECK(sink_.write_array(columns_[k], first_, values_[k]));
    values_[k].clear();
  }
  MAILLE_CHECK(sink_.write_cells(cells_));
  first_ += cells_.size();
  cells_ = {};
  return {};
}

}  // namespace maille
