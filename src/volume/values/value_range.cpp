#include "volume/values/value_range.h"

#include <maille/with_type.h>

#include <limits>

#include "base/bytes.h"

namespace maille {
namespace {

/// Every `stride`-th number from `at` on.
template <class T>
void widen_by(ValueRange::Component& component, uint64_t& nans, Bytes numbers, size_t at, size_t stride) {
  using Limits = std::numeric_limits<T>;
  T low = Limits::has_infinity ? Limits::infinity() : Limits::max();
  T high = Limits::has_infinity ? -Limits::infinity() : Limits::lowest();
  uint64_t missing = 0;
  for (size_t i = at; i < numbers.size() / sizeof(T); i += stride) {
    const T value = load<T>(numbers.data() + i * sizeof(T));
    low = value < low ? value : low;
    high = value > high ? value : high;
    missing += value != value ? 1 : 0;
  }
  nans += missing;
  if (low > high) return;
  const auto from = static_cast<double>(low), to = static_cast<double>(high);
  component.low = component.any && component.low < from ? component.low : from;
  component.high = component.any && component.high > to ? component.high : to;
  component.any = true;
}

}  // namespace

void widen(ValueRange& range, Scalar type, uint32_t components, Bytes tuples) {
  range.components.resize(components > most_ranges ? 1 : components);
  const size_t ranges = range.components.size();
  with_type(type, [&](auto number) {
    for (size_t k = 0; k < ranges; ++k)
      widen_by<decltype(number)>(range.components[k], range.nans, tuples, k, ranges);
  });
}

}  // namespace maille
