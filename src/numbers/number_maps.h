#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/bytes.h"
#include "numbers/number_map.h"

namespace maille {

/// A number map as streams of arrays have it. `tables`: where mode `stream` has its tables, of at most
/// most_streamed_numbers each.
void write_map(ByteWriter& out, const NumberMap& map, ByteWriter* tables = nullptr);
/// Inverse. Error: corrupt, for a map that choose_maps() cannot make for this type. In mode `stream` the bits
/// of floats may have a factor, too, as NumberSpace has it.
Result<NumberMap> read_map(ByteReader& in, Scalar type, ByteReader* tables = nullptr);

inline constexpr uint64_t most_streamed_numbers = 1 << 16;

/// Has any of the maps a table?
bool has_tables(std::span<const NumberMap> maps);

/// The same maps, with tables of their numbers where these save more than they take. `source`: the tuples of
/// the array that are coded, and none. `savings`, if given: for each map how many bits its table saves, in
/// 1/1024.
std::vector<NumberMap> with_tables(const Array& array, std::vector<NumberMap> maps,
                                   std::span<const uint32_t> source, std::vector<int64_t>* savings = nullptr);

/// log2(x) in 1/1024, from below and to 1/11; integers, so the same everywhere. x is positive.
int64_t logarithm(uint64_t x);

}  // namespace maille
