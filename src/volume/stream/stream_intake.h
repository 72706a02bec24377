#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_set>
#include <vector>

#include "volume/cells/point_table.h"
#include "volume/cells/slots.h"
#include "volume/stream/stream_layout.h"

namespace maille {

/// Cells as they were given, until there is a block of them: at most cells_per_block records, in the caller's
/// order. StreamWriter fills it, StreamBatches empties it.
struct Intake {
  // A cell, a point without cells, or the end of a point, as the coder takes it; its numbers, flags and faces
  // stand in the lists below, one record's behind another's.
  struct Record {
    uint8_t kind;
    CellType type;
    uint32_t nodes;
    uint32_t faces;  ///< of a polyhedron
  };
  std::vector<Record> records;
  std::vector<uint64_t> numbers;
  std::vector<uint32_t> face_sizes;
  std::vector<uint8_t> last_use;
  std::vector<std::vector<std::byte>> cell_arrays;
  std::vector<BlockStart> blocks;
  std::unordered_set<uint64_t> ended;  ///< points told to be used no more; only looked up
  std::vector<uint64_t> told;          ///< the same as they were told
  /// A whole block at once stays where the caller has it, which saves a copy of 64 bytes a hexahedron. Valid
  /// only until run() returns.
  std::span<const uint64_t> given_numbers;
  std::span<const uint8_t> given_last_use;

  const uint64_t* all_numbers() const {
    return given_numbers.empty() ? numbers.data() : given_numbers.data();
  }
  const uint8_t* all_last_uses() const {
    return given_numbers.empty() ? last_use.data() : given_last_use.data();
  }
  /// `last` may be empty: no point is used for the last time then.
  void add(unsigned kind, CellType type, std::span<const uint64_t> points, std::span<const uint8_t> last) {
    records.push_back({static_cast<uint8_t>(kind), type, static_cast<uint32_t>(points.size()), 0});
    numbers.insert(numbers.end(), points.begin(), points.end());
    last_use.insert(last_use.end(), last.begin(), last.end());
    last_use.resize(numbers.size());
  }
  void clear() {
    given_numbers = {};
    given_last_use = {};
    records.clear();
    numbers.clear();
    face_sizes.clear();
    last_use.clear();
    for (auto& array : cell_arrays) array.clear();
    blocks.clear();
    ended.clear();
    told.clear();
  }
};

/// Points that were given and not used yet, with their values side by side. The table follows the largest
/// number of points that wait at once; slots are used again.
class WaitingPoints {
 public:
  explicit WaitingPoints(size_t stride) : stride_(stride) {}
  bool has(uint64_t number) { return table_.find(number, 0) != no_slot; }
  /// Room for the values of a point that does not wait yet; valid until the next call.
  std::byte* add(uint64_t number) {
    const uint32_t slot = slots_.take();
    if (slot >= numbers_.size()) {
      numbers_.resize(slots_.capacity());
      bytes_.resize(size_t{slots_.capacity()} * stride_);
    }
    table_.insert(number, slot);
    numbers_[slot] = number + 1;
    return bytes_.data() + slot * stride_;
  }
  /// The values of a point, which waits no more. False: it does not wait.
  bool take(uint64_t number, std::byte* out) {
    const uint32_t slot = table_.find(number, 0);
    if (slot == no_slot) return false;
    std::copy_n(bytes_.data() + slot * stride_, stride_, out);
    table_.erase(number);
    numbers_[slot] = 0;
    slots_.give_back(slot);
    return true;
  }
  /// Those that wait, rising: what is left at the end is used by no cell, and has to come in an order that
  /// does not depend on slots.
  std::vector<uint64_t> numbers() const {
    std::vector<uint64_t> found;
    for (const uint64_t number : numbers_) {
      if (number != 0) found.push_back(number - 1);
    }
    std::sort(found.begin(), found.end());
    return found;
  }

 private:
  size_t stride_;
  PointTable table_;
  Slots slots_;
  std::vector<uint64_t> numbers_;  ///< number + 1; 0: free
  std::vector<std::byte> bytes_;
};

}  // namespace maille
