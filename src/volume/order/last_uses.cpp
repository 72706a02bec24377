#include "volume/order/last_uses.h"

#include <algorithm>
#include <array>

#include "base/bytes.h"
#include "base/pace.h"
#include "base/result.h"
#include "volume/order/working_memory.h"

namespace maille {
namespace {

constexpr CellType no_type = CellType{0};

/// How many points a pass looks at, with a bit each: a quarter of the memory, at least 8,192 points, and
/// whole words. A limit below what the process takes is refused in the end, with the least that will do; to
/// find that takes a megabyte, as hundreds of passes over a large mesh would take hours.
uint64_t most_points_of(const WorkingSpace& space) {
  constexpr uint64_t to_refuse = uint64_t{1} << 20;
  const uint64_t least = space.limit <= WorkingSpace::of_process ? to_refuse : 1024;
  return std::max(working_memory(space) / 4, least) / 8 * 64;
}

}  // namespace

Result<LastUses> LastUses::find(MeshSource& mesh, const WorkingSpace& space, const EncodeOptions& options) {
  const Progress& progress = options.progress;
  Executor& executor = options.executor != nullptr ? *options.executor : serial_executor();
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
    MAILLE_CHECK(uses.pass(mesh, first, std::min(most_points, description.points - first), executor));
  }
  for (CellType& type : uses.common_types_) type = type == no_type ? CellType::mixed : type;
  return uses;
}

/// One range of points. The first pass writes flags, later ones add theirs; the bits in the end tell points
/// without cells.
Result<> LastUses::pass(MeshSource& mesh, uint64_t first_point, uint64_t points, Executor& executor) {
  const MeshDescription& description = mesh.description();
  std::vector<uint64_t> seen((points + 63) / 64);
  std::array<CellPiece, 2> cells;
  const auto read_block = [&](uint64_t block) {
    const uint64_t first = block * step;
    return mesh.read_cells(first, std::min(step, description.cells - first), cells[block % 2]);
  };
  if (!begins_.empty()) MAILLE_CHECK(read_block(begins_.size() - 1));
  for (uint64_t block = begins_.size(); block-- > 0;) {
    Result<> marked, following;
    executor.parallel_for(block > 0 ? 2 : 1, [&](size_t task) {
      if (task == 1) {
        following = read_block(block - 1);
      } else {
        if (first_point == 0 && one_unknown_) note_types(cells[block % 2]);
        marked = mark(block, cells[block % 2], first_point, seen);
      }
    });
    MAILLE_CHECK(marked);
    MAILLE_CHECK(following);
  }
  return seen_.append(std::as_bytes(std::span(seen)));
}

// In the first pass only, as later ones see the same cells.
void LastUses::note_types(const CellPiece& cells) {
  CellType& common = common_types_[0];
  for (const uint8_t number : cells.types) {
    const auto type = static_cast<CellType>(number);
    common = common == no_type || common == type ? type : CellType::mixed;
  }
}

/// Finds what each block of cells adds to the points of a range that are in use.
Result<> LastUses::count_in_use(MeshSource& mesh, uint64_t first_point, uint64_t points,
                                std::vector<int64_t>& changes) {
  std::vector<bool> in_use(points);
  CellPiece cells;
  std::vector<uint8_t> last;
  for (uint64_t block = 0; block < begins_.size(); ++block) {
    const uint64_t first = block * step;
    MAILLE_CHECK(mesh.read_cells(first, std::min(step, mesh.description().cells - first), cells));
    MAILLE_CHECK(read(block, cells.connectivity.size(), last));
    // A point may come several times in a cell, at all of which it has its last use: only the first counts.
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

// The changes of all ranges are added up by block, so that the sum over blocks is what is in use after each.
Result<uint64_t> LastUses::most_in_use(MeshSource& mesh, const WorkingSpace& space) {
  std::vector<int64_t> changes(begins_.size());
  const uint64_t most_points = most_points_of(space);
  for (uint64_t first = 0; first < points_; first += most_points)
    MAILLE_CHECK(count_in_use(mesh, first, std::min(most_points, points_ - first), changes));
  int64_t in_use = 0, most = 0;
  for (const int64_t change : changes) most = std::max(most, in_use += change);
  return static_cast<uint64_t>(most);
}

/// Flags of one block for a range. Eight entries at a time, as a byte of flags may get bits of two such
/// groups.
Result<> LastUses::mark(uint64_t block, const CellPiece& cells, uint64_t first_point,
                        std::vector<uint64_t>& seen) {
  bits_.assign((cells.connectivity.size() + 7) / 8, std::byte{});
  if (first_point == 0) {
    // Blocks come from the last to the first, so that flags lie in the file the other way round.
    begins_[block] = flags_.size();
  } else {
    MAILLE_CHECK(flags_.read_at(begins_[block], bits_));
  }
  const uint64_t points = seen.size() * 64;  // numbers below the range wrap around
  const auto mark_eight = [&](uint64_t begin, uint64_t end) {
    unsigned last = 0;
    for (uint64_t i = begin; i < end; ++i) {
      const uint64_t point = cells.connectivity[i] - first_point;
      if (point < points) last |= static_cast<unsigned>(~(seen[point / 64] >> point % 64) & 1) << (i - begin);
    }
    last <<= begin % 8;
    bits_[begin / 8] |= static_cast<std::byte>(last);
    if (last > 0xff) bits_[begin / 8 + 1] |= static_cast<std::byte>(last >> 8);
  };
  for (size_t cell = cells.size(); cell-- > 0;) {
    const uint64_t begin = cells.offsets[cell], end = cells.offsets[cell + 1];
    // All corners where the point is: a cell may have it twice.
    for (uint64_t i = begin; i < end; i += 8) mark_eight(i, std::min(i + 8, end));
    for (uint64_t i = begin; i < end; ++i) {
      const uint64_t point = cells.connectivity[i] - first_point;
      if (point < points) seen[point / 64] |= uint64_t{1} << point % 64;
    }
  }
  return first_point == 0 ? flags_.append(bits_) : flags_.write_at(begins_[block], bits_);
}

// A byte for each corner, as writers take flags.
Result<> LastUses::read(uint64_t block, size_t corners, std::vector<uint8_t>& flags) {
  bits_.resize((corners + 7) / 8);
  MAILLE_CHECK(flags_.read_at(begins_[block], bits_));
  flags.resize(bits_.size() * 8);
  for (size_t i = 0; i < bits_.size(); ++i) {
    // Of eight copies of the byte each keeps a bit of its own, which the sum moves to the top.
    const uint64_t own = std::to_integer<uint64_t>(bits_[i]) * 0x0101010101010101 & 0x8040201008040201;
    store(flags.data() + 8 * i, (own + 0x7f7f7f7f7f7f7f7f) >> 7 & 0x0101010101010101);
  }
  flags.resize(corners);
  return {};
}

/// In pieces of 256 K bits, as all bits may be more than memory.
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
