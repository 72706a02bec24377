#include "surface/fans/repeated_values.h"

#include <algorithm>

namespace maille {
namespace {

/// Counts by code, in memory of at most eight counters a value: sorting takes a tenth of the encoder's time.
ValueCounts count_near(std::span<const int64_t> values, int64_t low, uint64_t range) {
  std::vector<uint32_t> count(range);
  for (const int64_t value : values) ++count[static_cast<size_t>(value - low)];
  ValueCounts result;
  for (size_t i = 0; i < count.size(); ++i) {
    if (count[i] > 0) result.push_back({low + static_cast<int64_t>(i), count[i]});
  }
  return result;
}

}  // namespace

ValueCounts count_values(std::vector<int64_t>& values) {
  ValueCounts result;
  if (values.empty()) return result;
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const uint64_t range = static_cast<uint64_t>(*high) - static_cast<uint64_t>(*low);
  if (range < 8 * values.size()) return count_near(values, *low, range + 1);
  std::sort(values.begin(), values.end());
  for (size_t i = 0; i < values.size();) {
    size_t end = i;
    while (end < values.size() && values[end] == values[i]) ++end;
    result.push_back({values[i], static_cast<uint32_t>(end - i)});
    i = end;
  }
  return result;
}

uint64_t fill_dictionary(const ValueCounts& counts, const Often& often, Dictionary& dictionary) {
  // Sixteen values to either side are what a value is compared with: enough for a mean, few enough to follow
  // a mesh that is denser here than there. Chosen, not swept (8a243f9).
  constexpr size_t near = 16;
  std::vector<uint64_t> below{0};
  for (const auto& [value, count] : counts) below.push_back(below.back() + count);
  std::vector<int64_t> values;
  uint64_t covered = 0;
  for (size_t i = 0; i < counts.size(); ++i) {
    const auto& [value, count] = counts[i];
    const size_t first = i - std::min(i, near), end = std::min(i + near + 1, counts.size());
    // count >= times * mean, without a division. A count is below 2^32 and 33 values at most are compared, so
    // nothing overflows.
    const bool stands_out = count * (end - first) >= often.times * (below[end] - below[first]);
    if (count < often.least || !stands_out || values.size() == Dictionary::most) continue;
    values.push_back(value);
    covered += count;
  }
  // Farther apart than a dictionary goes are only numbers without any order.
  if (!values.empty() &&
      static_cast<uint64_t>(values.back()) - static_cast<uint64_t>(values.front()) > Dictionary::most_range)
    return 0;
  dictionary.set(std::move(values));
  return covered;
}

}  // namespace maille
