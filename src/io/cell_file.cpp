#include "io/cell_file.h"

#include <algorithm>

#include "base/result.h"

namespace maille {
namespace {

/// A difference of either sign as a count, small ones small: 0, -1, 1, -2, 2 become 0, 1, 2, 3, 4. The
/// difference of two 32-bit numbers takes 33 bits, so the count always fits.
uint64_t folded(uint32_t value, uint32_t last) {
  const auto difference = static_cast<int64_t>(value) - static_cast<int64_t>(last);
  return (static_cast<uint64_t>(difference) << 1) ^ static_cast<uint64_t>(difference >> 63);
}

// The inverse. Modulo 2^32 the sum is exact, so a damaged file gives a wrong number but no overflow.
uint32_t unfolded(uint64_t code, uint32_t last) {
  return last + static_cast<uint32_t>((code >> 1) ^ (0 - (code & 1)));
}

// Polygons, polyhedra and poly-lines: types whose nodes must be counted in the file.
bool has_length(CellType type) {
  return nodes_of(type) == 0;
}

/// Keeps the memory for the next cells. Where the allocator gives large blocks back at once
/// (keep_memory_small() of the command), pages of new vectors for every block cost more than all the rest.
void clear(CellPiece& piece) {
  piece.types.clear();
  piece.offsets.assign(1, 0);
  piece.connectivity.clear();
  piece.face_sizes.clear();
  piece.cell_faces.clear();
}

}  // namespace

// Offsets of `from` are those of its own connectivity and are moved behind what `out` holds. Faces are told
// apart from cells: `cell_faces` exists in a piece as soon as one polyhedron is in it, with an empty range
// for all others.
void append_cells(const CellPiece& from, uint64_t first, uint64_t count, CellPiece& out) {
  if (out.offsets.empty()) out.offsets.push_back(0);
  const auto place = [](uint64_t i) { return static_cast<ptrdiff_t>(i); };
  const auto copy = [&](const auto& list, uint64_t begin, uint64_t end, auto& to) {
    to.insert(to.end(), list.begin() + place(begin), list.begin() + place(end));
  };
  copy(from.types, first, first + count, out.types);
  const uint64_t begin = from.offsets[first], behind = out.connectivity.size();
  copy(from.connectivity, begin, from.offsets[first + count], out.connectivity);
  for (uint64_t i = first; i < first + count; ++i)
    out.offsets.push_back(behind + from.offsets[i + 1] - begin);
  if (from.cell_faces.empty() && out.cell_faces.empty()) return;
  // The cells that were in `out` before the first polyhedron came get empty ranges.
  out.cell_faces.resize(out.types.size() - count + 1, out.face_sizes.size());
  if (!from.cell_faces.empty())
    copy(from.face_sizes, from.cell_faces[first], from.cell_faces[first + count], out.face_sizes);
  for (uint64_t i = first; i < first + count; ++i) {
    const uint64_t faces = from.cell_faces.empty() ? 0 : from.cell_faces[i + 1] - from.cell_faces[i];
    out.cell_faces.push_back(out.cell_faces.back() + faces);
  }
}

Result<CellFile> CellFile::create(const std::string& folder) {
  return CellFile(MAILLE_TRY(ScratchFile::create(folder)));
}

Result<> CellFile::add(CellType type, std::span<const uint32_t> nodes, std::span<const uint32_t> face_sizes) {
  // A cell is: type, number of nodes where the type does not tell it, nodes as differences to the node
  // before, and of a polyhedron the sizes of its faces. Neighbouring cells share points, so most differences
  // take one or two bytes.
  block_.put(static_cast<uint8_t>(type));
  if (has_length(type)) block_.put_count(nodes.size());
  for (const uint32_t node : nodes) {
    block_.put_count(folded(node, last_));
    last_ = node;
  }
  if (type == CellType::polyhedron) {
    block_.put_count(face_sizes.size());
    for (const uint32_t size : face_sizes) block_.put_count(size);
  }
  ++cells_;
  corners_ += nodes.size();
  const bool full = ++cells_in_block_ == cells_per_block || block_.size() >= bytes_per_block;
  return full ? flush() : Result<>();
}

Result<> CellFile::flush() {
  if (cells_in_block_ == 0) return {};
  blocks_.push_back({cells_ - cells_in_block_, file_.size()});
  MAILLE_CHECK(file_.append(block_.bytes()));
  block_ = {};
  cells_in_block_ = 0;
  // Each block begins anew, so that it can be read alone.
  last_ = 0;
  return {};
}

void CellFile::take_cell(ByteReader& in) {
  const auto type = static_cast<CellType>(in.get<uint8_t>());
  const uint64_t nodes = has_length(type) ? in.get_count() : nodes_of(type);
  // in.ok() ends the loop with the block, whatever the count says.
  for (uint64_t i = 0; i < nodes && in.ok(); ++i) {
    last_ = unfolded(in.get_count(), last_);
    loaded_.connectivity.push_back(last_);
  }
  loaded_.types.push_back(static_cast<uint8_t>(type));
  loaded_.offsets.push_back(loaded_.connectivity.size());
  const uint64_t faces = type == CellType::polyhedron ? in.get_count() : 0;
  if (type != CellType::polyhedron && loaded_.cell_faces.empty()) return;
  loaded_.cell_faces.resize(loaded_.types.size(), loaded_.face_sizes.size());
  for (uint64_t i = 0; i < faces && in.ok(); ++i)
    loaded_.face_sizes.push_back(static_cast<uint32_t>(in.get_count()));
  loaded_.cell_faces.push_back(loaded_.face_sizes.size());
}

Result<> CellFile::load(size_t block) {
  const bool is_last = block + 1 == blocks_.size();
  const uint64_t end = is_last ? file_.size() : blocks_[block + 1].at;
  std::vector<std::byte> bytes(end - blocks_[block].at);
  // No block counts as loaded should reading fail half-way.
  loaded_block_ = ~size_t{0};
  MAILLE_CHECK(file_.read_at(blocks_[block].at, bytes));
  clear(loaded_);
  last_ = 0;
  for (ByteReader in(bytes); in.ok() && in.remaining() > 0;) take_cell(in);
  loaded_block_ = block;
  return {};
}

Result<> CellFile::read(uint64_t first, uint64_t count, CellPiece& out) {
  clear(out);
  if (count > cells_ || first > cells_ - count)
    return failure(ErrorCode::usage, "more cells were asked for than there are");
  while (count > 0) {
    // The block that holds `first` is the last one that begins at or before it. Each round takes at least one
    // cell, as every block but an empty file's holds one.
    const auto behind = std::upper_bound(blocks_.begin(), blocks_.end(), first,
                                         [](uint64_t cell, const Block& b) { return cell < b.first_cell; });
    const auto block = static_cast<size_t>(behind - blocks_.begin()) - 1;
    if (block != loaded_block_) MAILLE_CHECK(load(block));
    const uint64_t skipped = first - blocks_[block].first_cell;
    const uint64_t here = std::min<uint64_t>(count, loaded_.size() - skipped);
    append_cells(loaded_, skipped, here, out);
    first += here;
    count -= here;
  }
  return {};
}

}  // namespace maille
