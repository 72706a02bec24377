#include "io/http/block_cache.h"

namespace maille {

Bytes BlockCache::find(uint64_t block) {
  const auto place = places_.find(block);
  if (place == places_.end()) return {};
  entries_.splice(entries_.begin(), entries_, place->second);
  return place->second->bytes;
}

// A block that is larger than the budget still goes in, alone: the reader that asked for it copies it next.
void BlockCache::put(uint64_t block, Bytes bytes) {
  drop(block, block + 1);
  while (!entries_.empty() && used_ + bytes.size() > budget_) {
    const uint64_t last = entries_.back().block;
    drop(last, last + 1);
  }
  entries_.push_front({block, {bytes.begin(), bytes.end()}});
  places_[block] = entries_.begin();
  used_ += bytes.size();
}

void BlockCache::drop(uint64_t first, uint64_t end) {
  const auto remove = [&](std::list<Entry>::iterator entry) {
    used_ -= entry->bytes.size();
    places_.erase(entry->block);
    return entries_.erase(entry);
  };
  // Whichever is shorter is walked: the range, or all that is kept.
  if (end - first <= places_.size()) {
    for (uint64_t block = first; block < end; ++block) {
      if (const auto place = places_.find(block); place != places_.end()) remove(place->second);
    }
    return;
  }
  for (auto entry = entries_.begin(); entry != entries_.end();)
    entry = entry->block >= first && entry->block < end ? remove(entry) : std::next(entry);
}

}  // namespace maille
