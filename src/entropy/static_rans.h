#pragma once

#include <maille/source.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "entropy/rans.h"

namespace maille {

/// Asymmetric numeral systems with distributions that are known before the first symbol: fast to decode, as
/// nothing is learnt on the way. The encoder counts first, makes tables, and writes these beside the symbols.
inline constexpr unsigned most_static_symbols = 64;
inline constexpr unsigned most_static_tables = 256;

using Histogram = std::array<uint32_t, most_static_symbols>;

/// A distribution over 2^bits slots. A frequency of 0 is a symbol that does not occur.
struct Frequencies {
  std::array<uint16_t, most_static_symbols> frequency{};
  std::array<uint16_t, most_static_symbols> start{};
};

/// Contexts and the table each of them uses: similar contexts share one.
struct StaticTables {
  unsigned bits = 10;             ///< slots are 2^bits, at most 2^10
  unsigned symbols = 0;           ///< of the alphabet
  std::vector<uint8_t> table_of;  ///< by context
  std::vector<Frequencies> tables;

  const Frequencies& of(unsigned context) const { return tables[table_of[context]]; }
};

/// A decoder refuses streams that promise more than 16384 things a byte (and 16 bytes for nothing), so that
/// what it reserves is bounded by what it reads. Symbols that are alone in their tables take no bits: where
/// all are, a writer fills up with zeros, which nothing reads.
inline constexpr uint64_t most_things_per_byte = 16384;
inline constexpr bool can_hold(uint64_t bytes, uint64_t things) {
  return things / most_things_per_byte <= bytes + 16;
}
inline void fill_up(std::vector<std::byte>& bytes, uint64_t things) {
  while (!can_hold(bytes.size(), things)) bytes.push_back(std::byte{0});
}

/// Counts of a sample, for tables that others use as well: what occurs in one context may occur in all that
/// there are. `rising`: symbols are sizes, where those between, and the next one, may occur, too.
void spread_symbols(std::span<Histogram> counts, unsigned symbols, bool rising);

/// What one more table must save in bits beyond what its symbols take: a microsecond of a decoder's time.
inline constexpr uint64_t price_of_table = 80;
/// Tables for these counts, by context, such that tables and symbols together are small. Writes them to
/// `coder`.
StaticTables make_tables(std::span<const Histogram> counts, unsigned symbols, unsigned bits,
                         unsigned most_tables, RansEncoder& coder, uint64_t price = price_of_table);
/// Its two steps: counts that share a table are summed up; then tables are chosen and written.
std::vector<Histogram> merge_alike(std::span<const Histogram> counts, unsigned symbols, unsigned most_tables,
                                   uint64_t price, std::vector<uint8_t>& table_of);
StaticTables write_tables(std::span<const Histogram> counts, std::vector<uint8_t> table_of, unsigned symbols,
                          unsigned bits, unsigned most_tables, RansEncoder& coder);
/// Inverse. Any bytes give valid tables; the caller looks at coder.exhausted().
StaticTables read_tables(size_t contexts, unsigned symbols, unsigned bits, unsigned most_tables,
                         RansDecoder& coder);

/// What symbols cost with these tables, in 1/65536 bits.
uint64_t cost_of(const Histogram& counts, const Frequencies& table, unsigned bits);
/// log2(n) * 65536, rounded down to about 16 bits; 0 for 0.
uint32_t log2_fixed(uint32_t n);

/// A distribution as decoders want it: for each of 2^bits slots the symbol, and for each symbol its slots.
/// All of it in every slot would be one look-up less, but four times as large, and the tables of a file would
/// not stay in a processor's first cache.
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
