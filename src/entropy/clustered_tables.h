#pragma once

#include <span>

#include "entropy/static_rans.h"

namespace maille {

// Static tables (static_rans.h) for contexts that are too many to compare each with each: contexts that
// behave alike are grouped first, and a map tells which table a context uses. docs/format.md, 10.3.

inline constexpr unsigned clustered_bits = 10;

/// Tables for these counts, and their map, written to `side`. Contexts are a grid of so many columns, whose
/// neighbours are expected to behave alike. `shared`: the tables are for other symbols than those counted,
/// too: all symbols below `symbols` that occur in any context, and the last one, are possible in each.
StaticTables make_clustered_tables(std::span<const Histogram> counts, unsigned symbols, unsigned columns,
                                   unsigned most_tables, bool shared, RansEncoder& side);
/// Inverse. Any bytes give valid tables; the caller looks at side.exhausted().
StaticTables read_clustered_tables(size_t contexts, unsigned symbols, unsigned columns, unsigned most_tables,
                                   RansDecoder& side);

}  // namespace maille
