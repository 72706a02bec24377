#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "entropy/bit_model.h"
#include "entropy/symbol_model.h"

namespace maille {

/// Codes that one coordinate takes often, ascending: the planes of a voxel lattice, the levels of a machine
/// part. Positions over fans and mixed positions share it. An empty dictionary is valid, but only size(),
/// find(), tabulate() and code() may be called on it.
class Dictionary {
 public:
  // Indices have 16 bits, and 0xffff stands for no index (Indices::no_index).
  static constexpr uint32_t most = 0xfff0;
  static constexpr uint32_t parts = 8;
  // Gaps and the whole range stay below 2^63, so that differences of entries fit a signed integer. The
  // decoder refuses more, the encoder makes none.
  static constexpr unsigned most_length = 62;  ///< bits of a gap
  static constexpr uint64_t most_range = uint64_t{1} << 62;

  uint32_t size() const { return static_cast<uint32_t>(values_.size()); }
  int64_t operator[](uint32_t i) const { return values_[i]; }
  std::span<const int64_t> entries() const { return values_; }
  void set(std::vector<int64_t> values) {
    values_ = std::move(values);
    index();
  }

  /// The entry nearest to a code, the lower of two; the dictionary is not empty.
  [[gnu::always_inline]] uint32_t nearest(int64_t code) const {
    // Unsigned, as the difference of two signed codes may not fit a signed integer.
    const uint64_t above =
        code <= values_.front() ? 0 : static_cast<uint64_t>(code) - static_cast<uint64_t>(values_.front());
    const uint64_t bucket = std::min<uint64_t>(above >> shift_, begin_.size() - 1);
    uint32_t near = begin_[bucket];
    // Most buckets have one change of entries at most.
    near += code > last_of_[near];
    // This ends at the last entry, to which all codes up to INT64_MAX are nearest.
    while (code > last_of_[near]) [[unlikely]]++ near;
    return near;
  }
  /// The entry that is this code, or size().
  uint32_t find(int64_t code) const {
    if (values_.empty()) return 0;
    const uint32_t near = nearest(code);
    return values_[near] == code ? near : size();
  }
  /// Where a code lies between the nearest entry and the next one on its side: 3 to 0 below, 4 to 7 above, in
  /// eighths of the gap.
  [[gnu::always_inline]] unsigned part(uint32_t near, int64_t code) const {
    // Without branches: nobody can guess the side.
    const int64_t side = code < values_[near] ? -1 : 0;
    const uint64_t difference = static_cast<uint64_t>(code) - static_cast<uint64_t>(values_[near]);
    const uint64_t beyond = (difference ^ static_cast<uint64_t>(side)) - static_cast<uint64_t>(side);
    const float scale = eighths_[near + 1 + static_cast<uint64_t>(side)];
    // Halved, so that it fits a signed integer, which converts to a float in one instruction; eighths_
    // therefore holds 16 / gap instead of 8 / gap.
    const auto eighth =
        static_cast<uint32_t>(std::min(3.0f, static_cast<float>(static_cast<int64_t>(beyond >> 1)) * scale));
    return (eighth ^ static_cast<uint32_t>(side)) + 4;
  }

  /// Makes near_part() one look-up, if codes span few (at most 2^16, so the table has 256 kB): for decoders,
  /// which look up many codes. It saves 7 to 13 % of the time of meshes with repeats (cheese, 73416, ogre at
  /// -3; 239a478).
  void tabulate();
  /// nearest(), and the part() of that.
  [[gnu::always_inline]] std::pair<uint32_t, uint32_t> near_part(int64_t code) const {
    if (near_parts_.empty()) {
      const uint32_t near = nearest(code);
      return {near, part(near, code)};
    }
    const uint32_t found = near_parts_[static_cast<size_t>(std::clamp(code, first_, last_) - first_)];
    return {found / parts, found % parts};
  }

  /// False: the coded numbers are not ascending, or too many (of damaged bytes).
  template <class Coder>
  bool code(Coder& coder);

 private:
  void index() {
    if (values_.empty()) return;
    const size_t count = values_.size();
    last_of_.resize(count);
    // Beyond the ends nothing is nearer: four eighths and more.
    eighths_.assign(count + 1, 1e30f);
    for (size_t i = 0; i < count; ++i) {
      if (i + 1 == count) {
        last_of_[i] = INT64_MAX;
        break;
      }
      const uint64_t gap = static_cast<uint64_t>(values_[i + 1]) - static_cast<uint64_t>(values_[i]);
      last_of_[i] = static_cast<int64_t>(static_cast<uint64_t>(values_[i]) + gap / 2);
      eighths_[i + 1] = 16.0f / static_cast<float>(static_cast<int64_t>(gap));
    }
    // Buckets are as wide as a power of two, so that a look-up is a shift, and at most eight for each entry,
    // so that memory is bounded by what the file really holds.
    const uint64_t range = static_cast<uint64_t>(values_.back()) - static_cast<uint64_t>(values_.front());
    shift_ = 0;
    while (range >> shift_ > 8 * count) ++shift_;
    begin_.resize((range >> shift_) + 1);
    uint32_t near = 0;
    for (size_t b = 0; b < begin_.size(); ++b) {
      const auto first =
          static_cast<int64_t>(static_cast<uint64_t>(values_.front()) + (uint64_t{b} << shift_));
      while (first > last_of_[near]) ++near;
      begin_[b] = near;
    }
  }

  /// Appends the codes from an entry up to the one before the next entry.
  void tabulate_gap(uint32_t below);

  std::vector<int64_t> values_;
  std::vector<int64_t> last_of_;  ///< by entry: the last code that it is nearest to
  std::vector<float> eighths_;    ///< by entry: 16 / the gap below it
  std::vector<uint32_t> begin_;   ///< by bucket: the entry nearest to its first code
  unsigned shift_ = 0;
  // By code: parts * nearest() + part(). From two codes beyond the ends on all are alike.
  std::vector<uint32_t> near_parts_;
  int64_t first_ = 0, last_ = 0;
};

inline void Dictionary::tabulate() {
  constexpr int64_t most_codes = 1 << 16, far = int64_t{1} << 62;
  if (values_.empty() || values_.front() < -far || values_.back() > far ||
      values_.back() - values_.front() > most_codes)
    return;
  first_ = values_.front() - 2;
  last_ = values_.back() + 2;
  // Two codes beyond either end are enough: from there on part() has reached its last eighth.
  near_parts_.reserve(static_cast<size_t>(last_ - first_ + 1));
  const auto add = [&](uint32_t near, int64_t code) {
    near_parts_.push_back(near * parts + part(near, code));
  };
  for (int64_t code = first_; code < values_.front(); ++code) add(0, code);
  for (uint32_t i = 0; i + 1 < size(); ++i) tabulate_gap(i);
  for (int64_t code = values_.back(); code <= last_; ++code) add(size() - 1, code);
}

inline void Dictionary::tabulate_gap(uint32_t below) {
  const int64_t begin = values_[below], end = values_[below + 1], middle = last_of_[below];
  // Up to the code before `code`.
  const auto fill = [&](int64_t code, uint32_t found) {
    const int64_t next = first_ + static_cast<int64_t>(near_parts_.size());
    if (next < code) near_parts_.insert(near_parts_.end(), static_cast<size_t>(code - next), found);
  };
  // Where eighths begin is asked of part() itself: its floats may be off by one, and the table must agree
  // with it on every code.
  std::array<int64_t, 5> from{0, 0, 0, 0, end - begin};
  for (unsigned j = 1; j < 4; ++j) {
    from[j] = std::max<int64_t>(from[j - 1], (end - begin) * j / 8 - 2);
    while (from[j] < end - begin && part(below, begin + from[j]) < 4 + j) ++from[j];
  }
  for (unsigned j = 0; j < 4; ++j) fill(std::min(begin + from[j + 1], middle + 1), below * parts + 4 + j);
  fill(middle + 1, below * parts + 7);
  for (unsigned j = 4; j-- > 0;) fill(std::min(end, end - from[j] + 1), (below + 1) * parts + 3 - j);
}

template <class Coder>
bool Dictionary::code(Coder& coder) {
  // The format's order (12.3, "Dictionaries"): count, first value, then gaps with their lengths as symbols.
  const uint32_t count = coder.code_raw(size(), 16);
  if (count > most) return false;
  const auto raw = [&coder](uint64_t value, unsigned bits) {
    const unsigned low = bits < 32 ? bits : 32;
    const uint64_t below = coder.code_raw(static_cast<uint32_t>(value & 0xffffffff), low);
    return below | uint64_t{coder.code_raw(static_cast<uint32_t>(value >> low), bits - low)} << low;
  };
  std::array<SymbolModel, 16> length;
  unsigned before = 0;
  std::vector<int64_t> values;
  for (uint32_t i = 0; i < count; ++i) {
    const int64_t wanted = Coder::encoding ? values_[i] : 0;
    if (i == 0) {
      values.push_back(static_cast<int64_t>(raw(static_cast<uint64_t>(wanted), 64)));
      continue;
    }
    uint64_t gap =
        Coder::encoding ? static_cast<uint64_t>(wanted) - static_cast<uint64_t>(values_[i - 1]) - 1 : 0;
    unsigned bits = bit_length(gap);
    before = length[before].code(coder, bits < 15 ? bits : 15);
    bits = before < 15 ? before : 15 + coder.code_raw(bits - 15, 6);
    if (bits > most_length) return false;
    if (bits > 0) {
      const uint64_t top = uint64_t{1} << (bits - 1);
      gap = top + raw(gap - top, bits - 1);
    }
    // Checked before the sum, which would overflow. A stream that has ended makes no entries: memory grows
    // only with bytes that are there.
    const uint64_t room = static_cast<uint64_t>(INT64_MAX) - static_cast<uint64_t>(values.back());
    if (gap >= room || coder.exhausted()) return false;
    values.push_back(static_cast<int64_t>(static_cast<uint64_t>(values.back()) + gap + 1));
  }
  if (!values.empty() &&
      static_cast<uint64_t>(values.back()) - static_cast<uint64_t>(values.front()) > most_range)
    return false;
  if constexpr (!Coder::encoding) set(std::move(values));
  return true;
}

}  // namespace maille
