#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "entropy/bit_model.h"
#include "entropy/integer_model.h"

namespace maille {

/// Rising numbers as runs: so many one after the other, behind so many that are left out.
///
/// A piece cut out of a lattice has rows of it, and where rows come in layers so do their lengths and gaps. A
/// run is expected to be the one that came the last time when the same three came before it. Numbers that are
/// scattered have hardly any such run: what was not right the last time is not asked about. docs/format.md,
/// 16.14, GIDS.
template <class Coder>
class NumberRuns {
 public:
  struct Run {
    uint32_t gap = 0;  ///< of numbers between this run and the one before, which has at least one
    uint32_t length = 0;
    bool operator==(const Run& other) const { return gap == other.gap && length == other.length; }
  };

  /// Codes one run and returns it; `run` is read by an encoder only. `first`: nothing is before it, not even
  /// a gap.
  Run code(Coder& coder, Run run, bool first) {
    uint32_t& place = places_[hash_of_last()];
    const Run expected = place > 0 ? runs_[place - 1] : Run{};
    run.gap = code_gap(coder, run.gap, expected.gap, place > 0 && (gap_hits_ & 1) != 0, first);
    gap_hits_ = (gap_hits_ * 2 + (run.gap == expected.gap)) % hit_contexts;
    run.length = code_length(coder, run, expected.length,
                             place > 0 && (gap_hits_ & 1) != 0 && (length_hits_ & 1) != 0);
    length_hits_ = (length_hits_ * 2 + (run.length == expected.length)) % hit_contexts;
    runs_.push_back(run);
    place = static_cast<uint32_t>(runs_.size());
    return run;
  }

 private:
  static constexpr unsigned hit_contexts = 16, hash_bits = 14;

  /// Three runs before: what a row, a gap and a row of a layer are. Parts of the format, as are the
  /// constants.
  uint32_t hash_of_last() const {
    uint32_t hash = 0;
    for (size_t k = 1; k <= 3; ++k) {
      const Run run = k <= runs_.size() ? runs_[runs_.size() - k] : Run{};
      hash = (hash ^ run.gap) * 0x9e3779b1;
      hash = (hash ^ run.length) * 0x85ebca6b;
    }
    return hash >> (32 - hash_bits);
  }
  static unsigned context_of(uint32_t gap) { return std::min(bit_length(gap), 7u); }

  uint32_t code_gap(Coder& coder, uint32_t gap, uint32_t expected, bool trusted, bool first) {
    if (trusted && gap_hit_[gap_hits_].code(coder, gap == expected)) return expected;
    const bool alone = !runs_.empty() && runs_.back().length == 1;
    // A gap between two runs is at least one number, else they were one run; only the first may be 0.
    return gaps_[alone ? context_of(runs_.back().gap) : 0].code(coder, gap - !first) + !first;
  }
  uint32_t code_length(Coder& coder, Run run, uint32_t expected, bool trusted) {
    if (trusted && length_hit_[length_hits_].code(coder, run.length == expected)) return expected;
    return lengths_[context_of(run.gap)].code(coder, run.length - 1) + 1;
  }

  std::vector<Run> runs_;
  /// By the three runs before, 1 + the number of the run that followed them last; 0: none did.
  std::vector<uint32_t> places_ = std::vector<uint32_t>(size_t{1} << hash_bits);
  std::array<CountModel, 8> gaps_, lengths_;
  std::array<BitModel, hit_contexts> gap_hit_, length_hit_;
  unsigned gap_hits_ = 0, length_hits_ = 0;  ///< the last four, the latest lowest
};

/// Codes rising numbers, each once, below 2^32 - 1.
template <class Coder>
void encode_rising(Coder& coder, const std::vector<uint32_t>& numbers) {
  NumberRuns<Coder> runs;
  uint32_t next = 0;
  for (size_t begin = 0, end = 0; begin < numbers.size(); begin = end) {
    end = begin + 1;
    while (end < numbers.size() && numbers[end] == numbers[end - 1] + 1) ++end;
    runs.code(coder, {numbers[begin] - next, static_cast<uint32_t>(end - begin)}, begin == 0);
    next = numbers[end - 1] + 1;
  }
}

/// Decodes `count` rising numbers. False: these are not so many, all below 2^32 - 1. A run takes bits however
/// long it is, but its length is held against what is still to come, so that a damaged stream cannot make
/// more numbers than the piece has.
template <class Coder>
bool decode_rising(Coder& coder, std::vector<uint32_t>& numbers, uint64_t count) {
  NumberRuns<Coder> runs;
  uint64_t next = 0;
  while (numbers.size() < count && !coder.exhausted()) {
    const auto run = runs.code(coder, {}, next == 0);
    const uint64_t first = next + run.gap;
    next = first + run.length;
    if (run.length == 0 || run.length > count - numbers.size() || next > 0xffffffff) return false;
    for (uint64_t number = first; number < next; ++number) numbers.push_back(static_cast<uint32_t>(number));
  }
  return numbers.size() == count;
}

}  // namespace maille
