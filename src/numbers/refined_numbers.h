#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <span>
#include <vector>

#include "base/bytes.h"
#include "base/result.h"
#include "numbers/number_map.h"

namespace maille {

/// Doubles that a program computed lie near numbers of few digits, not on them: thirds of decimals, floats
/// times 0.001. A component that is *refined* has two maps: a coarse one, whose codes are predicted, and an
/// exact one. A *detail* is how many codes of the exact map a number is behind the one of its coarse code.
/// docs/format.md, 10.6. Positions at -9, against xz -9 of the raw doubles: lion_vase_poly 1.400 to 0.443,
/// refined_elephant 0.616 to 0.539 (docs/history.md).
struct RefinedMaps {
  std::vector<NumberMap> coarse;
  /// Of the components for which refined[k] holds; the maps of others are exact themselves.
  std::vector<NumberMap> exact;
  std::vector<bool> refined;

  bool any() const;
};

/// Refines the components of an array of doubles where it saves something, and more than a table does; the
/// others get their tables here. `source` as for with_tables(), `maps`: lossless ones.
RefinedMaps refine_maps(const Array& array, std::span<const NumberMap> maps,
                        std::span<const uint32_t> source);

/// Which components are refined, and their exact maps.
void write_exact_maps(ByteWriter& out, const RefinedMaps& maps);
/// Inverse. `coarse`: the maps read before. Error: corrupt.
Result<RefinedMaps> read_exact_maps(ByteReader& in, std::vector<NumberMap> coarse);

/// The details of the tuples; gaps have none.
std::vector<std::byte> encode_details(const RefinedMaps& maps, const Array& array,
                                      std::span<const uint32_t> source);
/// Turns codes into numbers (the bits of doubles), in place, for the components that are refined. `codes`:
/// tuple by tuple, in coded order. Error: corrupt, for details that end early, which is asked once a tuple.
Result<> store_refined(const RefinedMaps& maps, Bytes details, std::span<int64_t> codes);

}  // namespace maille
