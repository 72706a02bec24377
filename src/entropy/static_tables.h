#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "entropy/rans.h"

namespace maille {

// Distributions that are known before the first symbol, for static_rans.h and lane_rans.h: an encoder counts
// first, makes tables, and writes these beside the symbols. docs/format.md, 10.3.

inline constexpr unsigned most_static_symbols = 64;

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

/// Counts of a sample, for tables that others use as well: what occurs in one context may occur in all that
/// there are. `rising`: symbols are sizes, where those between, and the next one, may occur, too. Contexts
/// without any counts stay without.
void spread_symbols(std::span<Histogram> counts, unsigned symbols, bool rising);

/// Tables for these counts, by context, such that tables and symbols together are small. Writes them to
/// `coder`. `symbols`: of the alphabet, at most most_static_symbols; `bits`: at most 10, and 2^bits no fewer
/// than symbols; `most_tables`: at most 64. `shared`: the tables are for other symbols than those counted,
/// too: all symbols that occur in any context, and the last one, are possible in each. Deterministic: ties go
/// to the first.
StaticTables make_tables(std::span<const Histogram> counts, unsigned symbols, unsigned bits,
                         unsigned most_tables, RansEncoder& coder, bool shared = false);
/// Inverse. Any bytes give valid tables; the caller looks at coder.exhausted().
StaticTables read_tables(size_t contexts, unsigned symbols, unsigned bits, unsigned most_tables,
                         RansDecoder& coder);

/// What symbols cost with these tables, in 1/65536 bits.
uint64_t cost_of(const Histogram& counts, const Frequencies& table, unsigned bits);
/// log2(n) * 65536, rounded down to about 16 bits; 0 for 0.
uint32_t log2_fixed(uint32_t n);

}  // namespace maille
