#include "placement.h"

#include <algorithm>
#include <cstring>

namespace maille::wasm {
namespace {

template <class T>
T number_at(const std::byte* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

/// Written for each type, as this is done for every vertex of a chart.
template <class T>
void place_as(const Array& positions, std::span<const uint32_t> tuples, const std::optional<Vector3>& given,
              Drawable& drawable) {
  const size_t tuple = positions.components * sizeof(T), vertices = drawable.positions.size() / 3;
  const uint32_t components = std::min<uint32_t>(positions.components, 3);
  const std::byte* bytes = positions.bytes.data();
  float* to = drawable.positions.data();
  if (given) drawable.origin = *given;
  if (vertices == 0) return;
  const std::byte* first = bytes + (tuples.empty() ? 0 : tuples[0] * tuple);
  for (uint32_t k = 0; k < components && !given; ++k) {
    const auto value = static_cast<double>(number_at<T>(first + k * sizeof(T)));
    // Not finite: then nothing is.
    drawable.origin[k] = value - value == 0 ? value : 0;
  }
  const Vector3 origin = drawable.origin;
  if (tuples.empty() && positions.components == 3) {
    for (size_t i = 0; i < vertices; ++i, bytes += tuple, to += 3) {
      for (unsigned k = 0; k < 3; ++k)
        to[k] = static_cast<float>(static_cast<double>(number_at<T>(bytes + k * sizeof(T))) - origin[k]);
    }
    return;
  }
  for (size_t i = 0; i < vertices; ++i, to += 3) {
    const std::byte* at = bytes + (tuples.empty() ? i : tuples[i]) * tuple;
    for (uint32_t k = 0; k < components; ++k)
      to[k] = static_cast<float>(static_cast<double>(number_at<T>(at + k * sizeof(T))) - origin[k]);
  }
}

}  // namespace

void place(const Array& positions, std::span<const uint32_t> tuples, const std::optional<Vector3>& origin,
           Drawable& drawable) {
  drawable.positions.resize((tuples.empty() ? positions.count() : tuples.size()) * 3);
  if (positions.components < 3) std::fill(drawable.positions.begin(), drawable.positions.end(), 0.f);
  switch (positions.type) {
    case Scalar::i8:
      return place_as<int8_t>(positions, tuples, origin, drawable);
    case Scalar::u8:
      return place_as<uint8_t>(positions, tuples, origin, drawable);
    case Scalar::i16:
      return place_as<int16_t>(positions, tuples, origin, drawable);
    case Scalar::u16:
      return place_as<uint16_t>(positions, tuples, origin, drawable);
    case Scalar::i32:
      return place_as<int32_t>(positions, tuples, origin, drawable);
    case Scalar::u32:
      return place_as<uint32_t>(positions, tuples, origin, drawable);
    case Scalar::i64:
      return place_as<int64_t>(positions, tuples, origin, drawable);
    case Scalar::u64:
      return place_as<uint64_t>(positions, tuples, origin, drawable);
    case Scalar::f32:
      return place_as<float>(positions, tuples, origin, drawable);
    case Scalar::f64:
      return place_as<double>(positions, tuples, origin, drawable);
  }
}

}  // namespace maille::wasm
