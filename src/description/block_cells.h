#pragma once

#include <cstdint>
#include <vector>

namespace maille {

// Parts and charts hold some of a mesh's blocks. A scene has thousands of them, and each chart a few. With a
// count, and a block in memory, for each of 3,025 blocks, charts of a million triangles took 17 % more bytes,
// and three times the time and memory to decode.

/// How many cells of a block a part has.
struct BlockCells {
  uint32_t block = 0;
  uint64_t cells = 0;  ///< not 0
};

/// The cells of each of `blocks` blocks in turn; behind a 0 the number of blocks after it that have none,
/// either. `cells`: of those that have some, rising. put(count) writes a number. docs/format.md, 11.1.
template <class Put>
void put_block_cells(const std::vector<BlockCells>& cells, uint64_t blocks, Put put) {
  uint64_t next = 0;
  const auto skip_to = [&](uint64_t block) {
    if (block == next) return;
    put(uint64_t{0});
    put(block - next - 1);
  };
  for (const BlockCells& here : cells) {
    skip_to(here.block);
    put(here.cells);
    next = uint64_t{here.block} + 1;
  }
  skip_to(blocks);
}

/// Inverse: calls add(block, cells) for each block that has cells, rising, and ends where it gives false.
/// get() reads a number. False: `ok()` was false, add() was, or blocks are skipped that there are not.
template <class Get, class Ok, class Add>
bool get_block_cells(uint64_t blocks, Get get, Ok ok, Add add) {
  for (uint64_t block = 0; block < blocks; ++block) {
    const uint64_t cells = get();
    if (!ok()) return false;
    if (cells > 0) {
      if (!add(static_cast<uint32_t>(block), cells)) return false;
      continue;
    }
    const uint64_t more = get();
    if (!ok() || more >= blocks - block) return false;
    block += more;
  }
  return true;
}

}  // namespace maille
