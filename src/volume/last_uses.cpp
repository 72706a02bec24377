#include "volume/last_uses.h"

#include <algorithm>

#include "base/pace.h"
#include "base/result.h"

namespace maille {
namespace {

constexpr CellType no_type = CellType{0};

/// With a bit each: a quarter of the memory, at least something, and whole words.
uint64_t most_points_of(const WorkingSpace& space) {
  return std::max<uint64_t>(space.memory / 4, 1024) / 8 * 64;
}

}  // namespace

Result<LastUses> LastUses::find(MeshSource& mesh, const WorkingSpace& space, const Progress& progress) {
  ScratchFile flags = MAILLE_TRY(ScratchFile::create(space.folder));
  ScratchFile seen = MAILLE_TRY(ScratchFile::create(space.folder));
  LastUses uses(std::move(flags), std::move(seen));
  const MeshDescription& description = mesh.description();
  uses.points_ = description.points;
  uses.begins_.assign((description.cells + step - 1) / step, 0);
  // One mixed block without a name is what a file has that tells nothing of blocks.
  const auto& blocks = description.blocks;
  uses.one_unknown_ = blocks.size() == 1 && blocks[0].name.empty() && blocks[0].type == CellType::mixed;
  for (const MeshDescription::Block& block : description.blocks) {
    uses.common_types_.push_back(uses.one_unknown_ ? no_type : block.type);
  }
  const uint64_t most_points = most_points_of(space);
  for (uint64_t first = 0; first == 0 || first < description.points; first += most_points) {
    if (progress && !progress({"last uses",
                               static_cast<double>(first) / (1.0 + static_cast<double>(description.points))}))
      return cancelled();
    MAILLE_CHECK(uses.pass(mesh, first, std::min(most_points, description.points - first)));
  }
  for (CellType& type : uses.common_types_) type = type == no_type ? CellType::mixed : type;
  return uses;
}

Result<> LastUses::pass(MeshSource& mesh, uint64_t first_point, uint64_t points) {
  const MeshDescription& description = mesh.description();
  std::vector<uint64_t> seen((points + 63) / 64);
  CellPiece cells;
  for (uint64_t block = begins_.size(); block-- > 0;) {
    const uint64_t first = block * step;
    MAILLE_CHECK(mesh.read_cells(first, std::min(step, description.cells - first), cells));
    if (first_point == 0 && one_unknown_) note_types(cells);
    MAILLE_CHECK(mark(block, cells, first_point, seen));
  }
  return seen_.append(std::as_bytes(std::span(seen)));
}

void LastUses::note_types(const CellPiece& cells) {
  CellType& common = common_types_[0];
  for (const uint8_t number : cells.types) {
    const auto type = static_cast<CellType>(number);
    common = common == no_type || common == type ? type : CellType::mixed;
  }
}

/// What each block of cells adds to the points of a range that are in use.
Result<> LastUses::count_in_use(MeshSource& mesh, uint64_t first_point, uint64_t points,
                                std::vector<int64_t>& changes) {
  std::vector<bool> in_use(points);
  CellPiece cells;
  std::vector<uint8_t> last;
  for (uint64_t block = 0; block < begins_.size(); ++block) {
    const uint64_t first = block * step;
    MAILLE_CHECK(mesh.read_cells(first, std::min(step, mesh.description().cells - first), cells));
    MAILLE_CHECK(read(block, cells.connectivity.size(), last));
    for (size_t i = 0; i < last.size(); ++i) {
      const uint64_t point = cells.connectivity[i] - first_point;
      if (point >= points) continue;
      if (!in_use[point]) ++changes[block];
      in_use[point] = last[i] == 0;
      if (last[i] != 0) --changes[block];
    }
  }
  return {};
}

Result<uint64_t> LastUses::most_in_use(MeshSource& mesh, const WorkingSpace& space) {
  std::vector<int64_t> changes(begins_.size());
  const uint64_t most_points = most_points_of(space);
  for (uint64_t first = 0; first < points_; first += most_points)
    MAILLE_CHECK(count_in_use(mesh, first, std::min(most_points, points_ - first), changes));
  int64_t in_use = 0, most = 0;
  for (const int64_t change : changes) most = std::max(most, in_use += change);
  return static_cast<uint64_t>(most);
}

Result<> LastUses::mark(uint64_t block, const CellPiece& cells, uint64_t first_point,
                        std::vector<uint64_t>& seen) {
  std::vector<std::byte> bits((cells.connectivity.size() + 7) / 8);
  if (first_point == 0) {
    begins_[block] = flags_.size();
  } else {
    MAILLE_CHECK(flags_.read_at(begins_[block], bits));
  }
  const uint64_t points = seen.size() * 64;  // numbers below the range wrap around
  const auto in_range = [&](uint64_t i) { return cells.connectivity[i] - first_point < points; };
  for (size_t cell = cells.size(); cell-- > 0;) {
    const uint64_t begin = cells.offsets[cell], end = cells.offsets[cell + 1];
    // All corners where the point is: a cell may have it twice.
    for (uint64_t i = begin; i < end; ++i) {
      const uint64_t point = cells.connectivity[i] - first_point;
      if (in_range(i) && (seen[point / 64] >> point % 64 & 1) == 0) bits[i / 8] |= std::byte{1} << i % 8;
    }
    for (uint64_t i = begin; i < end; ++i) {
      const uint64_t point = cells.connectivity[i] - first_point;
      if (in_range(i)) seen[point / 64] |= uint64_t{1} << point % 64;
    }
  }
  return first_point == 0 ? flags_.append(bits) : flags_.write_at(begins_[block], bits);
}

Result<> LastUses::read(uint64_t block, size_t corners, std::vector<uint8_t>& flags) {
  std::vector<std::byte> bits((corners + 7) / 8);
  MAILLE_CHECK(flags_.read_at(begins_[block], bits));
  flags.resize(corners);
  for (size_t i = 0; i < corners; ++i)
    flags[i] = static_cast<uint8_t>(std::to_integer<unsigned>(bits[i / 8]) >> i % 8 & 1);
  return {};
}

Result<std::vector<uint64_t>> LastUses::unused(uint64_t first) {
  constexpr uint64_t words_at_once = 4096;
  std::vector<uint64_t> found, words;
  for (uint64_t at = first / 64; at * 64 < points_ && found.empty(); at += words_at_once) {
    words.resize(std::min(words_at_once, (points_ + 63) / 64 - at));
    MAILLE_CHECK(seen_.read_at(at * 8, std::as_writable_bytes(std::span(words))));
    for (size_t w = 0; w < words.size(); ++w) {
      for (uint64_t none = ~words[w]; none != 0; none &= none - 1) {
        const uint64_t point = (at + w) * 64 + static_cast<uint64_t>(__builtin_ctzll(none));
        if (point >= first && point < points_) found.push_back(point);
      }
    }
  }
  return found;
}

}  // namespace maille
