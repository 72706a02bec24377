#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace maille {

/// Numbers that mostly rise by one, in the order in which they came: 16 bytes for each run instead of 8 for
/// each number. operator[] searches, in the logarithm of the runs.
class FoamRuns {
 public:
  void add(uint64_t number) {
    if (runs_.empty() || number - runs_.back().number != size_ - runs_.back().at)
      runs_.push_back({size_, number});
    ++size_;
  }
  uint64_t size() const { return size_; }
  /// at < size().
  uint64_t operator[](uint64_t at) const {
    const auto behind = std::upper_bound(runs_.begin(), runs_.end(), at,
                                         [](uint64_t value, const Run& run) { return value < run.at; });
    const Run& run = *(behind - 1);
    return run.number + (at - run.at);
  }

 private:
  struct Run {
    uint64_t at, number;
  };
  std::vector<Run> runs_;
  uint64_t size_ = 0;
};

}  // namespace maille
