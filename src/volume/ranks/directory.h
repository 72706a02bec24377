#pragma once

#include <maille/ranks.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/result.h"
#include "volume/ranks/collective.h"
#include "volume/ranks/part_layout.h"

namespace maille {

/// Numbers without gaps for what ranks know by keys of 64 bits: 0, 1, ... by rising key. Each rank looks
/// after a stretch of all keys, and of the numbers: the first one of the lowest. Keys that are bunched in one
/// stretch burden one rank; numbers of points and cells mostly are spread. Two exchanges: keys there, numbers
/// back.
class Directory {
 public:
  /// What came to this rank under one key, from any rank. `payload` points into the directory's own buffers.
  struct Entry {
    uint64_t key = 0;
    unsigned from = 0;
    const std::byte* payload = nullptr;
  };

  /// Makes the directory, which all ranks do together. Each key comes with `payload_bytes` that `payload(i,
  /// out)` writes. All keys are below `keys`, which is the same in all ranks.
  static Directory make(Ranks& ranks, std::span<const uint64_t> keys_here, uint64_t keys,
                        size_t payload_bytes, const std::function<void(size_t, std::byte*)>& payload);

  /// By key that was given here, its number. Below 2^32 if total() is.
  const std::vector<uint32_t>& numbers() const { return numbers_; }
  /// All that came to this rank, by key and rank.
  const std::vector<Entry>& entries() const { return entries_; }
  /// Entries of number first() + i begin at places()[i]; one more behind the last.
  const std::vector<size_t>& places() const { return places_; }
  std::span<const Entry> of(size_t i) const {
    return std::span(entries_).subspan(places_[i], places_[i + 1] - places_[i]);
  }
  /// Numbers that this rank looks after.
  uint64_t first() const { return firsts_[rank_]; }
  uint64_t count() const { return places_.size() - 1; }
  uint64_t total() const { return firsts_.back(); }
  /// Who looks after a number.
  unsigned owner(uint64_t number) const;

 private:
  unsigned rank_ = 0;
  Buffers arrived_;
  std::vector<Entry> entries_;
  std::vector<size_t> places_;
  std::vector<uint64_t> firsts_;
  std::vector<uint32_t> numbers_;
};

/// The points of all ranks, with one tuple of values each: a point of several ranks must have the same
/// everywhere.
class PointDirectory {
 public:
  /// Made by all ranks together. Error: malformed_input, for a point with different values in different
  /// ranks, or the number 2^64 - 1; unsupported, for 2^32 points or more.
  static Result<PointDirectory> make(const RankPart& part, Ranks& ranks);

  const Directory& directory() const { return directory_; }
  /// The values of number directory().first() + i: the position, then the arrays on points. The byte before
  /// them says whether the sender's cells use the point.
  const std::byte* tuple(size_t i) const { return directory_.of(i)[0].payload + 1; }
  /// Whether any cell uses it.
  bool is_used(size_t i) const;

 private:
  Directory directory_;
};

/// The numbers of cells: block by block, in each by the given number. Error: malformed_input, for one that
/// comes twice; unsupported, for 2^32 cells or more.
Result<Directory> number_cells(const RankPart& part, const PartLayout& layout, Ranks& ranks);

}  // namespace maille
