#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/bytes.h"
#include "numbers/number_map.h"

namespace maille {

/// A number map as streams of arrays have it (docs/format.md, 10.6). `tables`: where mode `stream` has its
/// tables, of at most most_streamed_numbers each; without it a table stands behind the fields of its map.
void write_map(ByteWriter& out, const NumberMap& map, ByteWriter* tables = nullptr);
/// Inverse. Error: corrupt, for a map that choose_maps() cannot make for this type; so whoever uses a map
/// that was read need not ask again whether its exponent or digits are in range. In mode `stream` the bits of
/// floats may have a factor, too, as NumberSpace has it. A table takes memory in proportion to its bytes only
/// (see read_table()).
Result<NumberMap> read_map(ByteReader& in, Scalar type, ByteReader* tables = nullptr);

/// Mode `stream` promises bounded memory: a table of this many doubles takes half a megabyte a component.
inline constexpr uint64_t most_streamed_numbers = 1 << 16;

/// Has any of the maps a table?
bool has_tables(std::span<const NumberMap> maps);

/// The same maps, with tables of their numbers where these save more than they take. `source`: the tuples of
/// the array that are coded, and none. `savings`, if given: for each map how many bits its table saves, in
/// 1/1024. Only floats without loss get tables, and not those of kind `ordered`.
std::vector<NumberMap> with_tables(const Array& array, std::vector<NumberMap> maps,
                                   std::span<const uint32_t> source, std::vector<int64_t>* savings = nullptr);

/// log2(x) in 1/1024, from below and to 1/11; integers, so the same everywhere. x is positive. Linear between
/// powers of two: log2(1 + f) - f is at most 0.0861.
int64_t logarithm(uint64_t x);

}  // namespace maille
