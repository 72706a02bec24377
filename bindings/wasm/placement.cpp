#include "placement.h"

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

double any_number_at(Scalar type, const std::byte* bytes) {
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

/// Three numbers of the usual type for every vertex of a chart.
void place_floats(const std::byte* bytes, size_t vertices, const Vector3& origin, float* to) {
  for (size_t i = 0; i < vertices; ++i, bytes += 3 * sizeof(float), to += 3) {
    for (unsigned k = 0; k < 3; ++k)
      to[k] = static_cast<float>(number_at<float>(bytes + k * sizeof(float)) - origin[k]);
  }
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
  const std::vector<uint32_t>& corners = mesh.blocks[0].connectivity;
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
  for (size_t i = 0; i < corners.size(); ++i) to[i] = static_cast<uint16_t>(corners[i]);
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
