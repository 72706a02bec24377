#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace maille {

/// Numbers tuples of bytes: equal ones get the same number, new ones the next. For formats that repeat points
/// for each face (STL) or name numbers apart for each corner (OBJ). An open hash table with linear probing;
/// the numbers depend only on the order of the tuples, never on hashes. -0 and 0 are different, as their
/// bytes are.
class TupleIndex {
 public:
  /// `size`: bytes of a tuple; `expected`: how many different ones there may be, a hint.
  TupleIndex(size_t size, uint64_t expected);

  /// The number of the tuple at `from`. There may be fewer than 2^32 - 1 different tuples.
  uint32_t number_of(const std::byte* from);
  /// Number of different tuples so far.
  uint32_t count() const { return count_; }
  /// The different tuples, one behind the other.
  std::vector<std::byte> take_tuples() { return std::move(tuples_); }
  const std::vector<std::byte>& tuples() const { return tuples_; }

 private:
  size_t slot_of(const std::byte* from) const;
  void grow();

  size_t size_;
  uint32_t count_ = 0;
  std::vector<std::byte> tuples_;
  std::vector<uint32_t> slots_;  // number + 1; 0: free. At most half are taken.
};

}  // namespace maille
