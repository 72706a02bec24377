#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/hash.h"
#include "base/held_bytes.h"

namespace maille {

inline constexpr uint32_t no_slot = 0xffffffff;

/// Slots of the points that are alive, by their number. Numbers come in runs in nearly every mesh, so there
/// is one entry for a page of them, and each corner remembers the page it had last: a look-up is mostly one
/// comparison. Pages are small, as of a row often only the ends are alive, where blocks of a mesh meet: with
/// eight instead of 32 numbers, and fewer holes in Slots, ten million hexahedra took 59 instead of 78 MB, at
/// a tenth more time (4e69faa).
/// Looking pages up takes 5 % of encoding and 3.5 % of decoding (docs/history.md). Keys are numbers divided
/// by eight, so that none is no_key.
class PointTable {
 public:
  PointTable() : table_(64, no_page) {}

  /// no_slot if the number is not in memory. `corner` tells apart who asks, as below.
  [[gnu::always_inline]] uint32_t find(uint64_t number, unsigned corner) {
    const uint32_t page = page_of(number / per_page, corner);
    return page == no_page ? no_slot : pages_[page].slot[number % per_page];
  }
  /// False: it is there already. `corner` tells apart who asks, below 32: each goes through numbers of its
  /// own.
  [[gnu::always_inline]] bool insert(uint64_t number, uint32_t slot, unsigned corner = 0) {
    uint32_t page = page_of(number / per_page, corner);
    if (page == no_page) [[unlikely]]
      page = last_[corner] = add_page(number / per_page);
    uint32_t& place = pages_[page].slot[number % per_page];
    if (place != no_slot) return false;
    place = slot;
    ++pages_[page].used;
    return true;
  }
  /// Removes a number that is in memory: leave_point() never asks for another.
  [[gnu::always_inline]] void erase(uint64_t number, unsigned corner = 0) {
    const uint32_t page = page_of(number / per_page, corner);
    pages_[page].slot[number % per_page] = no_slot;
    if (--pages_[page].used == 0) [[unlikely]]
      remove_page(page);
  }

  uint64_t bytes() const { return bytes_held(table_) + bytes_held(pages_) + bytes_held(unused_); }

 private:
  static constexpr uint64_t per_page = 8;
  static constexpr uint32_t no_page = 0xffffffff;
  static constexpr uint64_t no_key = ~uint64_t{0};
  struct Page {
    uint64_t key = no_key;
    // How many of the eight are in memory: at 0 the page is free again.
    uint32_t used = 0;
    std::array<uint32_t, per_page> slot{};
  };

  size_t home(uint64_t key) const { return hash_mix(key, 0) & (table_.size() - 1); }
  [[gnu::always_inline]] uint32_t page_of(uint64_t key, unsigned corner) {
    const uint32_t last = last_[corner % last_.size()];
    return pages_[last].key == key ? last : search(key, last_[corner % last_.size()]);
  }
  [[gnu::noinline]] uint32_t search(uint64_t key, uint32_t& last) {
    for (size_t at = home(key); table_[at] != no_page; at = (at + 1) & (table_.size() - 1)) {
      if (pages_[table_[at]].key == key) return last = table_[at];
    }
    return no_page;
  }
  [[gnu::noinline]] uint32_t add_page(uint64_t key) {
    // At most half of the table is used, so that searches are short and always meet an empty place.
    if (2 * (pages_.size() - unused_.size() + 1) > table_.size()) grow();
    uint32_t page = static_cast<uint32_t>(pages_.size());
    if (unused_.empty()) {
      pages_.emplace_back();
    } else {
      page = unused_.back();
      unused_.pop_back();
    }
    pages_[page].key = key;
    pages_[page].slot.fill(no_slot);
    put(page);
    return page;
  }
  void put(uint32_t page) {
    size_t at = home(pages_[page].key);
    while (table_[at] != no_page) at = (at + 1) & (table_.size() - 1);
    table_[at] = page;
  }
  void grow() {
    // Never shrinks: it follows the largest front.
    table_.assign(table_.size() * 2, no_page);
    for (uint32_t page = 0; page < pages_.size(); ++page) {
      if (pages_[page].key != no_key) put(page);
    }
  }
  /// Entries behind move up into the gap, so that no search stops early (Knuth, volume 3, 6.4, algorithm R).
  [[gnu::noinline]] void remove_page(uint32_t page) {
    const size_t mask = table_.size() - 1;
    size_t gap = home(pages_[page].key);
    while (table_[gap] != page) gap = (gap + 1) & mask;
    for (size_t at = (gap + 1) & mask; table_[at] != no_page; at = (at + 1) & mask) {
      const size_t wanted = home(pages_[table_[at]].key);
      if (((at - wanted) & mask) >= ((at - gap) & mask)) {
        table_[gap] = table_[at];
        gap = at;
      }
    }
    table_[gap] = no_page;
    pages_[page].key = no_key;
    unused_.push_back(page);
  }

  std::vector<uint32_t> table_;
  std::vector<Page> pages_ =
      std::vector<Page>(1);  ///< the first has no numbers: `last_` is always one of them
  std::vector<uint32_t> unused_;
  std::array<uint32_t, 32> last_{};
};

}  // namespace maille
