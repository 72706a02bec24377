#pragma once

#include <array>
#include <span>
#include <vector>

#include "base/unfilled.h"
#include "entropy/static_rans.h"
#include "surface/fans/fan_machine.h"

namespace maille {

/// The static tables of fans, apart from what they code: one patch's own, or those of all charts of a file.
/// docs/format.md, 12.2 and 17.7.
struct FanTables {
  bool polygons = false;
  StaticTables events;
  StaticTables numbers;
};

/// How often everything occurs in some operations, by context, and the tables that suit that.
class FanCounts {
 public:
  explicit FanCounts(bool polygons = false);
  void add(std::span<const FanOperation> operations);
  /// To be called when what was added is a sample of what the tables are for: what occurs in one context may
  /// occur in all of them. Symbols that the sample lacks still have no place; can_write_fans() tells.
  void spread();
  /// Writes them to `side`.
  FanTables make_tables(RansEncoder& side) const;

 private:
  bool polygons_;
  std::vector<Histogram> events_, numbers_;
};
/// Inverse. Any bytes give valid tables; the caller looks at side.exhausted().
FanTables read_fan_tables(RansDecoder& side, bool polygons = false);

/// The operations alone. `tables` have been made with all of them.
std::vector<std::byte> write_fans(std::span<const FanOperation> operations, const FanTables& tables,
                                  uint32_t triangles);

/// Do the tables have all that the operations need? Those made with other operations may not.
bool can_write_fans(std::span<const FanOperation> operations, const FanTables& tables);

/// The tables laid out for a decoder; several may use them at once.
class FanSlots {
 public:
  explicit FanSlots(const FanTables& tables);

  const bool polygons;

  using EventTable = StaticDecoderTable<fan_slot_bits, polygon_symbols>;
  using NumberTable = StaticDecoderTable<fan_slot_bits, number_symbols>;
  const EventTable& table_of(uint64_t context) const {
    const auto* const begin = reinterpret_cast<const std::byte*>(events.data());
    return *reinterpret_cast<const EventTable*>(begin + table_at[context]);
  }
  const NumberTable& table_of(FanNumber kind) const {
    return numbers[number_at[static_cast<unsigned>(kind)]];
  }

  Unfilled<EventTable> events;
  Unfilled<NumberTable> numbers;
  std::array<uint8_t, number_contexts> number_at;
  /// By context: where in `events` its table is, in bytes, so that the fast loop needs no multiplication. The
  /// assertion below keeps all places in 16 bits, the marker's table included.
  std::array<uint16_t, most_fan_contexts> table_at;
  static_assert((most_event_tables + 1) * sizeof(EventTable) < 1 << 16);

 private:
  void fill_table_at(const FanTables& tables);
};

/// Polygons all at once, with references, kinds and valences. Safe on any bytes.
Result<FanSurface> decode_polygon_fans(Bytes operations, const FanSlots& slots, uint32_t polygons,
                                       uint32_t corners, uint32_t vertices);

}  // namespace maille
