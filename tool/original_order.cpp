#include "original_order.h"

#include <maille/compare.h>
#include <maille/decode.h>
#include <maille/encode.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "files.h"
#include "result.h"

namespace maille::tool {

namespace {

template <class T>
void widest(const Array& array, double& width) {
  const auto values = array.values<T>();
  for (uint32_t c = 0; c < array.components; ++c) {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (size_t i = c; i < values.size(); i += array.components) {
      const auto value = static_cast<double>(values[i]);
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    if (low <= high) width = std::max(width, high - low);
  }
}

// Longest side of the box of all tuples.
double longest_side(const Array& array) {
  double width = 0;
  switch (array.type) {
    case Scalar::i8:
      widest<int8_t>(array, width);
      break;
    case Scalar::u8:
      widest<uint8_t>(array, width);
      break;
    case Scalar::i16:
      widest<int16_t>(array, width);
      break;
    case Scalar::u16:
      widest<uint16_t>(array, width);
      break;
    case Scalar::i32:
      widest<int32_t>(array, width);
      break;
    case Scalar::u32:
      widest<uint32_t>(array, width);
      break;
    case Scalar::i64:
      widest<int64_t>(array, width);
      break;
    case Scalar::u64:
      widest<uint64_t>(array, width);
      break;
    case Scalar::f32:
      widest<float>(array, width);
      break;
    case Scalar::f64:
      widest<double>(array, width);
      break;
  }
  return width;
}

// The tolerance that gives the step the file tells: --bits when the step is a whole power of two of the
// longest side, otherwise the bound itself.
Tolerance tolerance_of(const ArrayInfo& info, const Array& original) {
  if (info.lossless) return {};
  if (info.step > 0) {
    const double bits = std::log2(longest_side(original) / info.step);
    const double whole = std::round(bits);
    if (whole >= 1 && whole <= 52 && std::abs(bits - whole) < 1e-9) return {Tolerance::Kind::bits, whole};
  }
  return {Tolerance::Kind::absolute, info.bound};
}

Result<Mesh> compress_again(const Mesh& original, const FileInfo& info, const CommonOptions& common) {
  const Threads threads(common.threads);
  EncodeOptions encoding;
  encoding.effort = std::clamp(info.effort, 1, 9);
  encoding.order = Order::keep;
  encoding.positions = tolerance_of(info.positions, original.points);
  for (const ArrayInfo& array : info.arrays) {
    const Array* values = original.find(array.name, array.domain);
    if (values != nullptr && !array.lossless) encoding.arrays[array.name] = tolerance_of(array, *values);
  }
  encoding.executor = threads.executor();
  std::vector<std::byte> file;
  const auto sink = memory_sink(file);
  TOOL_CHECK(encode(original, *sink, encoding));
  return decode(*memory_source(Bytes(file)), {.limits = {.mesh_bytes = common.memory},
                                              .arrays = std::nullopt,
                                              .executor = threads.executor(),
                                              .progress = {}});
}

}  // namespace

bool all_lossless(const FileInfo& info) {
  return info.positions.lossless &&
         std::all_of(info.arrays.begin(), info.arrays.end(), [](const ArrayInfo& a) { return a.lossless; });
}

Result<std::optional<Mesh>> in_original_order(const Mesh& original, const Mesh& decoded, const FileInfo& info,
                                              const CommonOptions& common) {
  if (info.order == Order::keep) return std::optional<Mesh>(decoded);
  Mesh ordered = TOOL_TRY(compress_again(original, info, common));
  if (!compare(ordered, decoded).equal) return std::optional<Mesh>();
  return std::optional<Mesh>(std::move(ordered));
}

Mesh with_lossy_values(const Mesh& original, const Mesh& ordered, const FileInfo& info) {
  Mesh mixed = original;
  if (!info.positions.lossless) mixed.points = ordered.points;
  for (Array& array : mixed.arrays) {
    const bool lossy = std::any_of(info.arrays.begin(), info.arrays.end(), [&](const ArrayInfo& a) {
      return !a.lossless && a.name == array.name && a.domain == array.domain;
    });
    const Array* values = lossy ? ordered.find(array.name, array.domain) : nullptr;
    if (values != nullptr) array.bytes = values->bytes;
  }
  return mixed;
}

}  // namespace maille::tool
