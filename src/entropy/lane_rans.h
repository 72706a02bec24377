#pragma once

#include <maille/source.h>

#include <array>
#include <cstring>
#include <vector>

#include "entropy/static_rans.h"

namespace maille {

/// Static symbols on a few states side by side that share words of 16 bits: a processor works on all at once.
/// A state is in [2^24, 2^40) between symbols, of tables with 2^10 slots: so small that short streams do not
/// feel what the states take, and large enough that rounding them costs 1/10,000 bit. (A quotient of a state
/// by a frequency is at least 2^14, so that rounding it down loses one part in 2^14 at most.)
inline constexpr unsigned symbol_lanes = 4;
inline constexpr unsigned lane_table_bits = 10;
inline constexpr uint64_t lowest_lane_state = uint64_t{1} << 24;
inline constexpr size_t lane_state_bytes = 5;

class LaneRansEncoder {
 public:
  void put(const Frequencies& table, unsigned symbol, unsigned lane) {
    operations_.push_back({table.start[symbol], table.frequency[symbol], static_cast<uint16_t>(lane)});
  }
  /// The states of so many lanes, five bytes each, then the words.
  std::vector<std::byte> finish(unsigned lanes) const;

 private:
  struct Operation {
    uint16_t start;
    uint16_t frequency;
    uint16_t lane;
  };
  std::vector<Operation> operations_;
};

/// The inverse, open so that a hot loop keeps it in registers. Whoever makes it sees to it that words can be
/// read as far as symbols are decoded: each takes at most one word, as frequency * (state >> 10) is at least
/// 2^14 for states from 2^24 on; damaged states may be smaller, and give other symbols, but no other places
/// in memory.
struct LaneRansDecoder {
  std::array<uint64_t, symbol_lanes> states;
  const std::byte* words;

  LaneRansDecoder(const std::byte* bytes, unsigned lanes) : words(bytes + lane_state_bytes * lanes) {
    states.fill(lowest_lane_state);
    for (unsigned lane = 0; lane < lanes; ++lane) {
      states[lane] = 0;
      std::memcpy(&states[lane], bytes + lane_state_bytes * lane, lane_state_bytes);
    }
  }
  template <unsigned lane, class Table>
  [[gnu::always_inline]] unsigned get(const Table& table) {
    const uint64_t state = states[lane];
    const unsigned symbol = table.symbol(state);
    const uint64_t next = table.next(state, symbol);
    // Without a branch, which would be guessed wrong: of a conditional value gcc 12 makes one.
    uint16_t word;
    std::memcpy(&word, words, sizeof word);
    const uint64_t low = 0 - uint64_t{next < lowest_lane_state};
    const uint64_t more = next << 16 | word;
    states[lane] = next ^ ((next ^ more) & low);
    words += low & sizeof word;
    return symbol;
  }
};

}  // namespace maille
