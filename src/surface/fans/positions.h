#pragma once

#include <maille/error.h>
#include <maille/mesh.h>
#include <maille/source.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "code/efforts.h"
#include "numbers/number_map.h"
#include "numbers/refined_numbers.h"
#include "surface/fans/fan_connectivity.h"
#include "surface/fans/placed_weights.h"

namespace maille {

/// Positions of the vertices of fans: what is expected of each follows from rows of weights over its
/// references, what is left is one symbol with a static table for each coordinate, and raw bits.
/// docs/format.md, 12.3.

/// Is this an array that the coder takes: one to four codes for each point, and no map of unit vectors?
bool fits_positions(const Array& array, const ArrayMaps& maps);

/// Codes the positions of `source.size()` points: those of the fans by vertex, then others, each by its tuple
/// in the array. The fans have references, kinds and valences. No errors.
std::vector<std::byte> encode_positions(const FanSurface& fans, const Array& array, const ArrayMaps& maps,
                                        std::span<const uint32_t> source, const Effort& effort);

/// Inverse: fills `array.bytes`, whose type is known, with `points` tuples, and decodes the fans as far as
/// positions need them: all of them where weights follow valences, else a window at a time. Safe on any
/// bytes. Error: corrupt.
Result<> decode_positions(FanDecoder& fans, Bytes bytes, uint32_t points, Array& array);

/// The same for an array of 1 to 4 components whose elements are not fans' vertices: `around` says what is
/// around them. `places`: where they are, if that is known. Whatever pays is used, as all connectivity is
/// known.
std::vector<std::byte> encode_numbers(const FanSurface& around, const Array& array, const ArrayMaps& maps,
                                      std::span<const uint32_t> source, const ElementPlaces& places);
Result<> decode_numbers(FanDecoder& around, Bytes bytes, const ElementPlaces& places, uint32_t elements,
                        Array& array);

/// Numbers that have no code, by their places: components * element + component. `exceptions`: the same in
/// the array.
std::vector<std::byte> write_exceptions(const Array& array, const std::vector<uint64_t>& exceptions,
                                        std::span<const uint32_t> source);
/// Inverse, once the others are there. Safe on any bytes.
Result<> read_exceptions(Bytes bytes, Array& array);

/// Positions of many patches that share maps, rows, dictionaries and tables (docs/format.md, 17.7), made for
/// a sample of the patches: `sample` are the vertices of some, `array` their positions in this order. Codes
/// of patches to come lie within `most_range` of those of the sample. `refined`: where the maps are its
/// coarse ones. encode() may be called by several threads at once.
class SharedPositions {
 public:
  SharedPositions(const FanSurface& sample, const Array& array, const ArrayMaps& maps, const Effort& effort,
                  uint64_t most_range, RefinedMaps refined = {});
  SharedPositions(SharedPositions&&) noexcept;
  SharedPositions& operator=(SharedPositions&&) noexcept;
  ~SharedPositions();

  const std::vector<std::byte>& tables() const { return tables_; }
  /// About the bytes of so many points, with the tables.
  double size_of(uint64_t points) const;
  /// `exceptions`: those of `array`. None where codes lie too far away.
  std::optional<std::vector<std::byte>> encode(const FanSurface& fans, const Array& array,
                                               const std::vector<uint64_t>& exceptions,
                                               std::span<const uint32_t> source) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
  std::vector<std::byte> tables_;
};

/// Ready for decoders; several may use it at once.
struct PositionTables;
/// `type`: of the positions. Safe on any bytes. Error: corrupt.
Result<std::shared_ptr<const PositionTables>> read_position_tables(Bytes bytes, Scalar type);
/// Then the fans are, too.
bool are_of_polygons(const PositionTables& tables);
Result<> decode_shared_positions(FanDecoder& fans, Bytes bytes, const PositionTables& tables, uint32_t points,
                                 Array& array);

}  // namespace maille
