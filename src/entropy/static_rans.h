#pragma once

#include <maille/source.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "entropy/static_tables.h"

namespace maille {

// Asymmetric numeral systems with static tables (static_tables.h): fast to decode, as nothing is learnt on
// the way.

/// A decoder refuses streams that promise more than 16384 things a byte (and 16 bytes for nothing), so that
/// what it reserves is bounded by what it reads. Symbols that are alone in their tables take no bits: where
/// all are, a writer fills up with zeros, which nothing reads (a million points at one place took 60 bytes,
/// 00c9157).
inline constexpr uint64_t most_things_per_byte = 16384;
inline constexpr bool can_hold(uint64_t bytes, uint64_t things) {
  return things / most_things_per_byte <= bytes + 16;
}
inline void fill_up(std::vector<std::byte>& bytes, uint64_t things) {
  while (!can_hold(bytes.size(), things)) bytes.push_back(std::byte{0});
}

/// A distribution as decoders want it: for each of 2^bits slots the symbol, and for each symbol its slots.
/// All of it in every slot would be one look-up less, but four times as large, and the tables of a file would
/// not stay in a processor's first cache. Frequencies sum up to 2^bits whatever a file holds
/// (frequencies_of()), so all slots are filled and any state finds a symbol.
template <unsigned bits, unsigned symbols>
struct StaticDecoderTable {
  static_assert(bits <= 10 && symbols <= most_static_symbols);
  struct Interval {
    uint16_t frequency, start;
  };
  std::array<Interval, symbols> intervals;
  std::array<uint8_t, size_t{1} << bits> symbol_of;

  /// A distribution of so many symbols.
  void fill(const Frequencies& table) {
    for (unsigned s = 0; s < symbols; ++s) {
      intervals[s] = {table.frequency[s], table.start[s]};
      __builtin_memset(symbol_of.data() + table.start[s], static_cast<int>(s), table.frequency[s]);
    }
  }
  /// A distribution of one symbol: states do not change.
  void fill(unsigned symbol) {
    intervals.fill({});
    intervals[symbol] = {1 << bits, 0};
    symbol_of.fill(static_cast<uint8_t>(symbol));
  }

  /// The symbol that a state stands for, and the state behind it.
  [[gnu::always_inline]] unsigned symbol(uint64_t state) const { return symbol_of[slot(state)]; }
  [[gnu::always_inline]] uint64_t next(uint64_t state, unsigned symbol) const {
    const Interval at = intervals[symbol];
    return at.frequency * (state >> bits) + slot(state) - at.start;
  }

 private:
  static uint64_t slot(uint64_t state) { return state & ((uint64_t{1} << bits) - 1); }
};

/// One state of 64 bits, words of 32: for symbols that are decoded one after the other. The state is in
/// [2^31, 2^63) between operations.
inline constexpr uint64_t lowest_static_state = uint64_t{1} << 31;

/// What an encoder keeps until it works backwards: an interval of 2^bits.
struct StaticOperation {
  uint16_t start;
  uint16_t frequency;
  uint8_t bits;
};
inline StaticOperation operation_of(const Frequencies& table, unsigned bits, unsigned symbol) {
  return {table.start[symbol], table.frequency[symbol], static_cast<uint8_t>(bits)};
}

class StaticRansEncoder {
 public:
  void put(const Frequencies& table, unsigned bits, unsigned symbol) {
    operations_.push_back(operation_of(table, bits, symbol));
  }
  /// At most 16 bits at equal odds.
  void put_raw(uint32_t value, unsigned count) {
    operations_.push_back({static_cast<uint16_t>(value), 1, static_cast<uint8_t>(count)});
  }
  std::vector<std::byte> finish();

 private:
  std::vector<StaticOperation> operations_;
};

/// Safe on any bytes: past their end it reads zeros and is exhausted().
class StaticRansDecoder {
 public:
  explicit StaticRansDecoder(Bytes bytes);

  uint32_t get_raw(unsigned count) {
    const auto value = static_cast<uint32_t>(state & ((uint64_t{1} << count) - 1));
    state >>= count;
    refill();
    return value;
  }
  template <class Table>
  unsigned get(const Table& table) {
    const unsigned symbol = table.symbol(state);
    state = table.next(state, symbol);
    refill();
    return symbol;
  }
  bool exhausted() const { return exhausted_; }
  [[gnu::always_inline]] void refill() {
    if (state < lowest_static_state) state = state << 32 | next_word();
  }

  // Open, so that a hot loop can keep them in registers.
  uint64_t state = 0;
  struct Words {
    const std::byte* next;
    const std::byte* end;
  } words;

 private:
  uint32_t next_word() {
    if (words.end - words.next < 4) [[unlikely]] {
      exhausted_ = true;
      return 0;
    }
    uint32_t word;
    __builtin_memcpy(&word, words.next, 4);
    words.next += 4;
    return word;
  }

  bool exhausted_ = false;
};

}  // namespace maille
