#include "original_order.h"

#include <maille/compare.h>
#include <maille/decode.h>
#include <maille/encode.h>

#include <algorithm>

#include "files.h"
#include "result.h"

namespace maille::tool {

namespace {

/// Compresses and decodes the original with the settings of the file, but keeps its order. Coding is
/// deterministic, so the result has exactly the values of the file, in an order that can be compared element
/// by element.
Result<Mesh> compress_again(const Mesh& original, const FileInfo& info, const CommonOptions& common) {
  const Threads threads(common.threads);
  EncodeOptions encoding;
  encoding.effort = std::clamp(info.effort, 1, 9);
  encoding.order = Order::keep;
  encoding.positions = info.positions.asked;
  for (const ArrayInfo& array : info.arrays) {
    const Array* values = original.find(array.name, array.domain);
    if (values != nullptr && !array.lossless) encoding.arrays[array.name] = array.asked;
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
