#include "volume/pieces/shared_numbers.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/hash.h"

namespace maille {
namespace {

/// Two seeds give two hashes, of which 64 and 32 bits are kept.
uint64_t hash_of(uint64_t seed, const Place& place, uint32_t copy) {
  uint64_t hash = split_mix(seed + copy);
  for (const uint64_t bits : place) hash = split_mix(hash ^ bits);
  return hash;
}

}  // namespace

bool LastPieces::Box::has(const std::array<double, 3>& at) const {
  for (unsigned k = 0; k < 3; ++k) {
    if (at[k] < static_cast<double>(low[k]) || at[k] > static_cast<double>(high[k])) return false;
  }
  return true;
}

void LastPieces::Box::add(const Box& other) {
  if (other.low[0] > other.high[0]) return;
  if (low[0] > high[0]) {
    *this = other;
    return;
  }
  for (unsigned k = 0; k < 3; ++k) {
    low[k] = std::min(low[k], other.low[k]);
    high[k] = std::max(high[k], other.high[k]);
  }
}

// Leaves are the pieces in their order; boxes above are unions.
LastPieces::LastPieces(const std::vector<PieceRecord>& pieces) {
  while (leaves_ < pieces.size()) leaves_ *= 2;
  boxes_.resize(size_t{2} * leaves_);
  for (size_t p = 0; p < pieces.size(); ++p) boxes_[leaves_ + p] = {pieces[p].low, pieces[p].high};
  for (size_t node = leaves_ - 1; node > 0; --node) {
    boxes_[node] = boxes_[2 * node];
    boxes_[node].add(boxes_[2 * node + 1]);
  }
}

/// From the root to the right first, so that the first leaf found is the last piece.
uint32_t LastPieces::last_with(const std::array<double, 3>& at) const {
  // A tree over boxes that hardly overlap is gone down once or twice; what a file claims must not cost more.
  unsigned looks = 256;
  uint32_t node = 1, first = 0, size = leaves_;  // of the pieces under the node
  while (true) {
    const bool there = boxes_[node].has(at);
    if (there && size == 1) return first;
    if (--looks == 0) return first + size - 1;
    if (there) {
      node = 2 * node + 1;
      size /= 2;
      first += size;
      continue;
    }
    // To the nearest node on the left that was not looked at.
    while (node % 2 == 0 && node > 1) {
      node /= 2;
      size *= 2;
    }
    if (node == 1) return 0;
    --node;
    first -= size;
  }
}

SharedNumbers::SharedNumbers(const std::vector<PieceRecord>& pieces)
    : last_pieces_(pieces), pieces_(static_cast<uint32_t>(pieces.size())) {
  for (Table& table : tables_) table.entries.resize(8);
}

// For tests of memory.
size_t SharedNumbers::capacity() const {
  size_t all = 0;
  for (const Table& table : tables_) all += table.entries.size();
  return all;
}

/// The entry of the hashes, or the free place where it belongs. There is always a free place, as a table is
/// at most four fifths full.
SharedNumbers::Entry& SharedNumbers::find(Table& table, uint64_t hash, uint32_t more_hash) {
  const size_t size = table.entries.size();
  // The lower half of the hash chooses the place; the upper six bits chose the table.
  size_t i = (hash & 0xffffffff) * size >> 32;
  while (true) {
    Entry& entry = table.entries[i];
    if (entry.last == none || (entry.hash == hash && entry.more_hash == more_hash)) return entry;
    i = i + 1 == size ? 0 : i + 1;
  }
}

uint64_t SharedNumbers::find_or_add(const Place& place, uint32_t copy, const std::array<double, 3>& at,
                                    uint64_t next) {
  const uint64_t hash = hash_of(0, place, copy);
  const auto more_hash = static_cast<uint32_t>(hash_of(1, place, copy));
  Table& table = tables_[hash >> 58];
  // Four fifths full at most, so that searches stay short and end.
  if (table.used * 5 >= table.entries.size() * 4) make_room(table);
  Entry& entry = find(table, hash, more_hash);
  if (entry.last != none) return entry.number;
  // What has no place may be in any piece.
  const bool placed = std::isfinite(at[0]) && std::isfinite(at[1]) && std::isfinite(at[2]);
  entry = {hash, next, more_hash, std::max(piece_, placed ? last_pieces_.last_with(at) : pieces_)};
  ++table.used;
  return next;
}

void SharedNumbers::make_room(Table& table) const {
  const auto is_in_use = [&](const Entry& entry) { return entry.last != none && entry.last >= piece_; };
  const auto in_use =
      static_cast<size_t>(std::count_if(table.entries.begin(), table.entries.end(), is_in_use));
  // Three places of eight are free afterwards, so that this is seldom.
  Table larger;
  larger.entries.resize(in_use * 8 / 5 + 8);
  larger.used = in_use;
  for (const Entry& entry : table.entries) {
    if (is_in_use(entry)) find(larger, entry.hash, entry.more_hash) = entry;
  }
  table = std::move(larger);
}

}  // namespace maille
