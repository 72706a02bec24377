#pragma once

#include <array>
#include <span>
#include <vector>

#include "base/unfilled.h"
#include "entropy/static_rans.h"
#include "surface/fan_machine.h"

namespace maille {

/// The static tables of fans, apart from what they code: one patch's own, or those of all charts of a file.
/// docs/format.md, "Fans" and "Tables of charts".
struct FanTables {
  StaticTables events;
  StaticTables numbers;
};

/// How often everything occurs.
class FanCounts {
 public:
  FanCounts();
  void add(std::span<const FanOperation> operations);
  /// What was added was a sample of what the tables are for.
  void spread();
  /// Writes them to `side`.
  FanTables make_tables(RansEncoder& side) const;

 private:
  std::vector<Histogram> events_, numbers_;
};
/// Inverse. Any bytes give valid tables; the caller looks at side.exhausted().
FanTables read_fan_tables(RansDecoder& side);

/// The operations alone. `tables` have been made with all of them.
std::vector<std::byte> write_fans(std::span<const FanOperation> operations, const FanTables& tables);

/// Do the tables have all that the operations need? Those made with other operations may not.
bool can_write_fans(std::span<const FanOperation> operations, const FanTables& tables);

/// The tables laid out for a decoder; several may use them at once.
class FanSlots {
 public:
  explicit FanSlots(const FanTables& tables);

  static constexpr uint32_t slots_per_table = 1 << fan_slot_bits;
  Unfilled<StaticSlot> events, numbers;
  std::array<uint32_t, number_contexts> number_at;
  std::array<uint32_t, 1 << 12> table_at;  ///< first slot, by what head, next and last have seen, 4 bits each

 private:
  void fill_table_at(const StaticTables& tables, uint32_t idle);
};

}  // namespace maille
