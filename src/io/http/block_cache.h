#pragma once

#include <maille/source.h>

#include <list>
#include <unordered_map>
#include <vector>

namespace maille {

/// Blocks of a file, as many as a budget allows: the least recently used go first. Blocks begin at multiples
/// of block_bytes; the last one of a file may be shorter. Spans that find() returns last until the next put()
/// or drop(). Not for several threads at once.
class BlockCache {
 public:
  // Chosen, not swept (b9d6c24). A smaller block fetches less beside what is wanted but costs more entries.
  // The gap below which ranges are joined was measured (docs/history.md) and matters more.
  static constexpr uint64_t block_bytes = 4096;

  explicit BlockCache(uint64_t budget) : budget_(budget) {}

  /// Empty where it is not there; else its bytes, and it counts as used.
  Bytes find(uint64_t block);
  // Keeps a copy.
  void put(uint64_t block, Bytes bytes);
  // Drops blocks first ... end - 1.
  void drop(uint64_t first, uint64_t end);

 private:
  struct Entry {
    uint64_t block;
    std::vector<std::byte> bytes;
  };
  uint64_t budget_;
  uint64_t used_ = 0;
  std::list<Entry> entries_;  ///< last used first
  std::unordered_map<uint64_t, std::list<Entry>::iterator> places_;
};

}  // namespace maille
