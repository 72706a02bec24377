#include "io/tuple_index.h"

#include <algorithm>
#include <cstring>
#include "base/hash.h"

namespace maille {
TupleIndex::TupleIndex(size_t size, uint64_t expected) : size_(size) {
  size_t slots = 16;
  // The hint may come from a header, so it allocates at most 2^24 slots (64 MiB); beyond that the table grows
  // as tuples come. Chosen, not swept (b342ddb).
  while (slots < expected * 2 && slots < (size_t{1} << 24)) slots *= 2;
  slots_.resize(slots);
}

size_t TupleIndex::slot_of(const std::byte* from) const {
  const size_t mask = slots_.size() - 1;
  // The loop ends: at least half of the slots are free.
  size_t slot = hash64({from, size_}) & mask;
  while (slots_[slot] != 0 && std::memcmp(tuples_.data() + (slots_[slot] - 1) * size_, from, size_) != 0) {
    slot = (slot + 1) & mask;
  }
  return slot;
}

uint32_t TupleIndex::number_of(const std::byte* from) {
  size_t slot = slot_of(from);
  if (slots_[slot] != 0) return slots_[slot] - 1;
  if ((size_t{count_} + 1) * 2 > slots_.size()) {
    grow();
    slot = slot_of(from);
  }
  tuples_.insert(tuples_.end(), from, from + size_);
  slots_[slot] = ++count_;
  return count_ - 1;
}

void TupleIndex::grow() {
  slots_.assign(slots_.size() * 2, 0);
  for (uint32_t number = 0; number < count_; ++number) {
    slots_[slot_of(tuples_.data() + number * size_)] = number + 1;
  }
}

}  // namespace maille
