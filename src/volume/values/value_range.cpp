#include "volume/values/value_range.h"

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

using Widener = void (*)(ValueRange::Component&, uint64_t&, Bytes, size_t, size_t);

Widener widener_of(Scalar type) {
  switch (type) {
    case Scalar::i8:
      return widen_by<int8_t>;
    case Scalar::u8:
      return widen_by<uint8_t>;
    case Scalar::i16:
      return widen_by<int16_t>;
    case Scalar::u16:
      return widen_by<uint16_t>;
    case Scalar::i32:
      return widen_by<int32_t>;
    case Scalar::u32:
      return widen_by<uint32_t>;
    case Scalar::i64:
      return widen_by<int64_t>;
    case Scalar::u64:
      return widen_by<uint64_t>;
    case Scalar::f32:
      return widen_by<float>;
    default:
      return widen_by<double>;
  }
}

}  // namespace

void widen(ValueRange& range, Scalar type, uint32_t components, Bytes tuples) {
  range.components.resize(components > most_ranges ? 1 : components);
  const size_t ranges = range.components.size();
  for (size_t k = 0; k < ranges; ++k) widener_of(type)(range.components[k], range.nans, tuples, k, ranges);
}

}  // namespace maille
