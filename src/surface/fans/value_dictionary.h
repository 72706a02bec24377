#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "entropy/bit_model.h"
#include "entropy/symbol_model.h"

namespace maille {

/// Codes that one coordinate has often, ascending: the planes of a voxel lattice, the levels of a machine
/// part.
class ValueDictionary {
 public:
  static constexpr uint32_t most = 0xfffe;

  uint32_t size() const { return static_cast<uint32_t>(values_.size()); }
  int32_t operator[](uint32_t i) const { return values_[i]; }
  void set(std::vector<int32_t> values) {
    values_ = std::move(values);
    index();
  }

  /// The entry nearest to a code, the lower of two; the dictionary is not empty.
  [[gnu::always_inline]] uint32_t nearest(int32_t code) const {
    const uint32_t i = first_not_below(code);
    if (i == size()) return i - 1;
    if (i == 0) return 0;
    const int64_t below = int64_t{code} - values_[i - 1];
    return i - static_cast<uint32_t>(below <= int64_t{values_[i]} - code);
  }
  /// The entry that is this code, or size().
  uint32_t find(int32_t code) const {
    const uint32_t i = first_not_below(code);
    return i < size() && values_[i] == code ? i : size();
  }

  /// False: the coded numbers are not ascending, or too many (of damaged bytes).
  template <class Coder>
  bool code(Coder& coder);

 private:
  [[gnu::always_inline]] uint32_t first_not_below(int32_t code) const {
    const int64_t above = int64_t{code} - values_.front();
    if (above <= 0) return 0;
    const auto bucket = static_cast<uint64_t>(above) >> shift_;
    if (bucket + 1 >= begin_.size()) return size();
    uint32_t low = begin_[bucket], high = begin_[bucket + 1];
    while (low < high) {
      const uint32_t middle = (low + high) / 2;
      const bool below = values_[middle] < code;
      low = below ? middle + 1 : low;
      high = below ? high : middle;
    }
    return low;
  }
  /// Buckets of equal width, about as many as entries.
  void index() {
    if (values_.empty()) return;
    const auto range = static_cast<uint64_t>(int64_t{values_.back()} - values_.front());
    shift_ = 0;
    while (range >> shift_ > 2 * values_.size()) ++shift_;
    begin_.assign((range >> shift_) + 2, size());
    for (uint32_t i = size(); i-- > 0;)
      begin_[static_cast<uint64_t>(int64_t{values_[i]} - values_.front()) >> shift_] = i;
    for (size_t b = begin_.size() - 1; b-- > 0;) begin_[b] = std::min(begin_[b], begin_[b + 1]);
  }

  std::vector<int32_t> values_;
  std::vector<uint32_t> begin_;  ///< by bucket: the first entry in it or above
  unsigned shift_ = 0;
};

template <class Coder>
bool ValueDictionary::code(Coder& coder) {
  const uint32_t count = coder.code_raw(size(), 16);
  if (count > most) return false;
  std::array<SymbolModel, 16> length;
  unsigned before = 0;
  std::vector<int32_t> values;
  for (uint32_t i = 0; i < count; ++i) {
    if (i == 0) {
      values.push_back(
          static_cast<int32_t>(coder.code_raw(Coder::encoding ? static_cast<uint32_t>(values_[0]) : 0, 32)));
      continue;
    }
    uint64_t gap = 0;
    if constexpr (Coder::encoding) gap = static_cast<uint64_t>(int64_t{values_[i]} - values_[i - 1]) - 1;
    unsigned bits = bit_length(gap);
    const unsigned symbol = length[before].code(coder, bits < 15 ? bits : 15);
    before = symbol;
    bits = symbol < 15 ? symbol : 15 + coder.code_raw(bits - 15, 5);
    if (bits > 32) return false;
    if (bits > 0) {
      const uint64_t top = uint64_t{1} << (bits - 1);
      gap = top + coder.code_raw(static_cast<uint32_t>(gap - top), bits - 1);
    }
    const int64_t value = int64_t{values.back()} + static_cast<int64_t>(gap) + 1;
    if (value > INT32_MAX || coder.exhausted()) return false;
    values.push_back(static_cast<int32_t>(value));
  }
  if constexpr (!Coder::encoding) set(std::move(values));
  return true;
}

}  // namespace maille
