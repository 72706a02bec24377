#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace maille {

/// How many rows a table by slot gets when it has none for this slot yet. Few at a time: a vector doubles its
/// room by itself, and room that nothing touches takes no memory, while rows that are made do. (An eighth and
/// a half more than needed took 6 of 66 MB for ten million hexahedra.)
/// Fewer at first, as thousands of arrays may have a few numbers each: with 1,024 rows one of three numbers
/// took 340 kB.
constexpr size_t rows_for(uint32_t slot) {
  return (size_t{slot} | (slot < 1024 ? 63 : 1023)) + 1;
}

/// Numbers for things that come and go: nearly the smallest table that holds all that are there at once.
/// Slots taken one after the other lie side by side, which is what keeps neighbours of a mesh near one
/// another in memory: slots come in blocks of sixteen that are used again when they are empty; holes in
/// blocks only when too many slots are holes. Single slots used again in any order scatter the mesh, at half
/// the speed (measured, after 100 layers).
/// The order in which slots are given is part of the format (docs/format.md, 16.3), as predictors may read
/// what a slot held before: take() and give_back() must be called alike in both directions.
class Slots {
 public:
  [[gnu::always_inline]] uint32_t take() {
    if (free_[current_] == 0) [[unlikely]]
      find_block();
    const auto bit = static_cast<unsigned>(__builtin_ctz(free_[current_]));
    free_[current_] = static_cast<uint16_t>(free_[current_] & (free_[current_] - 1u));
    ++taken_;
    return current_ * 16 + bit;
  }
  void give_back(uint32_t slot) {
    const uint32_t block = slot / 16;
    free_[block] = static_cast<uint16_t>(free_[block] | 1u << slot % 16);
    --taken_;
    // A block that is in the list, or current, must not enter it a second time: two takers would share its
    // slots.
    if (free_[block] == 0xffff && block != current_ && !listed_[block]) {
      listed_[block] = true;
      empty_.push_back(block);
    }
  }
  /// All slots are below.
  uint32_t capacity() const { return static_cast<uint32_t>(free_.size()) * 16; }
  uint32_t taken() const { return taken_; }

 private:
  [[gnu::noinline]] void find_block() {
    while (free_[current_] == 0) current_ = next_block();
  }
  uint32_t next_block() {
    if (!empty_.empty()) {
      const uint32_t block = empty_.back();
      empty_.pop_back();
      listed_[block] = false;
      return block;
    }
    return capacity() > most_slots() ? block_with_holes() : new_block();
  }
  /// Few holes where the table is large, as its memory counts; while it is small they cost a fifth of the
  /// speed and spare little (five blocks side by side, 110,000 points alive: 59 instead of 78 MB in all, at a
  /// tenth more time; 4e69faa).
  uint64_t most_slots() const {
    return std::min(2 * uint64_t{taken_} + 4096, uint64_t{taken_} + taken_ / 8 + 32768);
  }
  // Many slots are free and no block is empty, so a round meets many holes.
  uint32_t block_with_holes() {
    do {
      sweep_ = sweep_ + 1 < free_.size() ? sweep_ + 1 : 0;
    } while (free_[sweep_] == 0);
    return sweep_;
  }
  uint32_t new_block() {
    free_.push_back(0xffff);
    listed_.push_back(false);
    return static_cast<uint32_t>(free_.size() - 1);
  }

  std::vector<uint16_t> free_ = {0xffff};  ///< by block, a bit for each free slot
  std::vector<uint8_t> listed_ = {false};
  std::vector<uint32_t> empty_;
  uint32_t current_ = 0;
  uint32_t sweep_ = 0;
  uint32_t taken_ = 0;
};

}  // namespace maille
