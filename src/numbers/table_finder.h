#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace maille {

/// The nearest number of a table, of the first one that is not below the value and the one before.
inline int64_t nearer_rank(const std::vector<double>& table, const double* above, double value) {
  const int64_t rank = above - table.data();
  if (rank == 0) return 0;
  if (rank == static_cast<int64_t>(table.size())) return rank - 1;
  return rank - (value - above[-1] < *above - value ? 1 : 0);
}

/// NumberMap::nearest_code() of a map with a table, for many values: the range of its numbers is cut into as
/// many equal buckets as there are numbers, and the search looks into one of them. The table must outlive it.
class TableFinder {
 public:
  TableFinder() = default;
  explicit TableFinder(const std::vector<double>& table) : table_(&table), begin_(table.size() + 2) {
    low_ = table.front();
    const double range = table.back() - low_;
    const auto buckets = static_cast<double>(table.size());
    scale_ = range > 0 && buckets / range < 1e300 ? buckets / range : 0;
    uint32_t i = 0;
    for (size_t b = 0; b < begin_.size(); ++b) {
      while (i < table.size() && bucket(table[i]) < b) ++i;
      begin_[b] = i;
    }
  }

  bool empty() const { return table_ == nullptr; }
  int64_t nearest(double value) const {
    if (!(value == value)) value = 0;
    // Buckets rise with their numbers, so that those of lower ones are below the value, of higher ones above.
    const size_t b = bucket(value);
    const double* const numbers = table_->data();
    return nearer_rank(*table_, std::lower_bound(numbers + begin_[b], numbers + begin_[b + 1], value), value);
  }

 private:
  size_t bucket(double value) const {
    const double at = (value - low_) * scale_;
    return at > 0 ? static_cast<size_t>(std::min(at, static_cast<double>(begin_.size() - 2))) : 0;
  }

  const std::vector<double>* table_ = nullptr;
  std::vector<uint32_t> begin_;  ///< by bucket: the first number of this one or a later one
  double low_ = 0, scale_ = 0;
};

}  // namespace maille
