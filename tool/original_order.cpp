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

/// How far the values of an array spread.
struct Extent {
  double longest = 0;   ///< longest side of the box of all tuples
  double diagonal = 0;  ///< of the same box
};

template <class T>
Extent extent(const Array& array) {
  const auto values = array.values<T>();
  Extent all;
  for (uint32_t c = 0; c < array.components; ++c) {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (size_t i = c; i < values.size(); i += array.components) {
      const auto value = static_cast<double>(values[i]);
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    if (!(low <= high)) continue;
    all.longest = std::max(all.longest, high - low);
    all.diagonal = std::hypot(all.diagonal, high - low);
  }
  return all;
}

Extent extent_of(const Array& array) {
  switch (array.type) {
    case Scalar::i8:
      return extent<int8_t>(array);
    case Scalar::u8:
      return extent<uint8_t>(array);
    case Scalar::i16:
      return extent<int16_t>(array);
    case Scalar::u16:
      return extent<uint16_t>(array);
    case Scalar::i32:
      return extent<int32_t>(array);
    case Scalar::u32:
      return extent<uint32_t>(array);
    case Scalar::i64:
      return extent<int64_t>(array);
    case Scalar::u64:
      return extent<uint64_t>(array);
    case Scalar::f32:
      return extent<float>(array);
    case Scalar::f64:
      return extent<double>(array);
  }
  return {};
}

bool is_whole(double value) {
  return std::abs(value - std::round(value)) < 1e-6;
}

// The tolerance that gives the step the file tells. An absolute bound has a step of twice that; --bits
// divides the longest side into 2^bits - 1 steps; a relative bound has one of the 16 steps to an octave.
Tolerance tolerance_of(const ArrayInfo& info, const Array& original) {
  if (info.lossless) return {};
  const Tolerance absolute{Tolerance::Kind::absolute, info.bound};
  if (!(info.step > 0) || std::abs(info.step - 2 * info.bound) < 1e-12 * info.step) return absolute;
  const Extent size = extent_of(original);
  const double bits = std::log2(size.longest / info.step + 1);
  if (bits > 0.5 && is_whole(bits)) return {Tolerance::Kind::bits, std::round(bits)};
  const double largest = original.components == 1 ? size.longest : size.diagonal;
  const bool relative = is_whole(16 * std::log2(info.step)) && largest > 0;
  return relative ? Tolerance{Tolerance::Kind::relative, info.bound / largest} : absolute;
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
