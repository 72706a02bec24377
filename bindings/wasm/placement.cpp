#include "placement.h"

#include <emmintrin.h>
#include <wasm_simd128.h>

#include <algorithm>
#include <cstring>

namespace maille::wasm {
namespace {

template <class T>
double number_at(const std::byte* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<double>(value);
}

[[gnu::noinline]] double any_number_at(Scalar type, const std::byte* bytes) {
  switch (type) {
    case Scalar::i8:
      return number_at<int8_t>(bytes);
    case Scalar::u8:
      return number_at<uint8_t>(bytes);
    case Scalar::i16:
      return number_at<int16_t>(bytes);
    case Scalar::u16:
      return number_at<uint16_t>(bytes);
    case Scalar::i32:
      return number_at<int32_t>(bytes);
    case Scalar::u32:
      return number_at<uint32_t>(bytes);
    case Scalar::i64:
      return number_at<int64_t>(bytes);
    case Scalar::u64:
      return number_at<uint64_t>(bytes);
    case Scalar::f32:
      return number_at<float>(bytes);
    case Scalar::f64:
      return number_at<double>(bytes);
  }
  return 0;
}

/// Two lanes of double in single precision, in one instruction: clang 14 makes some for each lane of what it
/// has for this.
__m128 demoted(__m128d value) {
  __m128 result;
  asm("local.get %1\n f32x4.demote_zero_f64x2\n local.set %0" : "=r"(result) : "r"(value));
  return result;
}
__m128 relative_to(__m128d low, __m128d high, const std::byte* from) {
  const __m128 numbers = _mm_loadu_ps(reinterpret_cast<const float*>(from));
  const __m128d first = _mm_cvtps_pd(numbers), second = _mm_cvtps_pd(_mm_movehl_ps(numbers, numbers));
  return _mm_movelh_ps(demoted(_mm_sub_pd(first, low)), demoted(_mm_sub_pd(second, high)));
}

/// Three numbers of the usual type for every vertex of a chart; of four vertices there are three times four.
void place_floats(const std::byte* bytes, size_t vertices, const Vector3& origin, float* to) {
  const __m128d xy = _mm_set_pd(origin[1], origin[0]), zx = _mm_set_pd(origin[0], origin[2]),
                yz = _mm_set_pd(origin[2], origin[1]);
  size_t i = 0;
  for (; i + 4 <= vertices; i += 4, bytes += 48, to += 12) {
    _mm_storeu_ps(to, relative_to(xy, zx, bytes));
    _mm_storeu_ps(to + 4, relative_to(yz, xy, bytes + 16));
    _mm_storeu_ps(to + 8, relative_to(zx, yz, bytes + 32));
  }
  for (; i < vertices; ++i, bytes += 12, to += 3) {
    for (unsigned k = 0; k < 3; ++k)
      to[k] = static_cast<float>(number_at<float>(bytes + k * sizeof(float)) - origin[k]);
  }
}

/// Numbers below 2^16, eight at once: clang 14 makes no vectors of a loop over them.
void narrow(std::span<const uint32_t> from, uint16_t* to) {
  size_t i = 0;
  for (; i + 8 <= from.size(); i += 8) {
    const v128_t low = wasm_v128_load(from.data() + i), high = wasm_v128_load(from.data() + i + 4);
    wasm_v128_store(to + i, wasm_u16x8_narrow_i32x4(low, high));
  }
  for (; i < from.size(); ++i) to[i] = static_cast<uint16_t>(from[i]);
}

}  // namespace

Vector3 place(const Array& positions, std::span<const uint32_t> tuples, const std::optional<Vector3>& given,
              std::span<float> to) {
  const size_t size = size_of(positions.type), tuple = positions.tuple_size(), vertices = to.size() / 3;
  const uint32_t components = std::min<uint32_t>(positions.components, 3);
  const std::byte* const bytes = positions.bytes.data();
  Vector3 origin = given.value_or(Vector3{});
  if (vertices == 0) return origin;
  const auto tuple_at = [&](size_t i) { return bytes + (tuples.empty() ? i : tuples[i]) * tuple; };
  for (uint32_t k = 0; k < components && !given; ++k) {
    const double value = any_number_at(positions.type, tuple_at(0) + k * size);
    // Not finite: then nothing is.
    origin[k] = value - value == 0 ? value : 0;
  }
  if (positions.type == Scalar::f32 && positions.components == 3 && tuples.empty()) {
    place_floats(bytes, vertices, origin, to.data());
    return origin;
  }
  if (components < 3) std::fill(to.begin(), to.end(), 0.f);
  for (size_t i = 0; i < vertices; ++i) {
    for (uint32_t k = 0; k < components; ++k) {
      const double number = any_number_at(positions.type, tuple_at(i) + k * size);
      to[3 * i + k] = static_cast<float>(number - origin[k]);
    }
  }
  return origin;
}

void PackedChart::pack(const Mesh& mesh, const std::optional<Vector3>& given) {
  const std::span<const uint32_t> corners = mesh.blocks[0].connectivity;
  const size_t points = mesh.point_count(), size = 12 * points + 2 * corners.size();
  if (size > size_) {
    bytes_.reset(new std::byte[size]);
    size_ = size;
  }
  positions = {reinterpret_cast<float*>(bytes_.get()), 3 * points};
  origin = place(mesh.points, {}, given, positions);
  triangles = {};
  if (points > size_t{1} << 16) return;
  auto* const to = reinterpret_cast<uint16_t*>(bytes_.get() + 12 * points);
  narrow(corners, to);
  triangles = {to, corners.size()};
}

void PackedChart::release() {
  positions = {};
  triangles = {};
  if (size_ <= most_kept) return;
  bytes_.reset();
  size_ = 0;
}

}  // namespace maille::wasm
