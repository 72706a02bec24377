// encode(), decode() and inspect(): each mode has its own.
#include "base/result.h"
#include "container/file_reader.h"
#include "file/single_file.h"
#include "random/random_file.h"
#include "volume/stream/stream_file.h"

namespace maille {
namespace {

Result<Mode> mode_of(const Source& source) {
  std::array<std::byte, file_header_bytes> front{};
  const auto size = static_cast<size_t>(std::min<uint64_t>(front.size(), source.size()));
  MAILLE_CHECK(source.read_at(0, std::span(front).first(size)));
  return MAILLE_TRY(read_file_header(Bytes(front).first(size), source.name())).mode;
}

/// Other modes have predictions in numbers, and no logarithms.
Result<> check_bounds(const EncodeOptions& options) {
  const auto is_pointwise = [](const Tolerance& bound) { return bound.kind == Tolerance::Kind::pointwise; };
  bool any = is_pointwise(options.positions);
  for (const auto& [name, bound] : options.arrays) any = any || is_pointwise(bound);
  if (!any || options.mode == Mode::stream) return {};
  return failure(ErrorCode::usage, "errors relative to each number are for files of mode \"stream\"");
}

}  // namespace

Result<EncodeReport> encode(const Mesh& mesh, Sink& sink, const EncodeOptions& options) {
  MAILLE_CHECK(check_bounds(options));
  if (options.mode == Mode::single) return encode_single(mesh, sink, options);
  if (options.mode == Mode::stream) return encode_stream(mesh, sink, options);
  return encode_random(mesh, sink, options);
}

Result<EncodeReport> encode(MeshSource& mesh, Sink& sink, const EncodeOptions& options,
                            const WorkingSpace& space) {
  MAILLE_CHECK(check_bounds(options));
  if (options.mode == Mode::stream) return encode_stream(mesh, sink, options, space);
  if (options.mode == Mode::random) return encode_random(mesh, sink, options, {.sizes = {}, .space = space});
  return failure(
      ErrorCode::usage,
      "mode \"single\" needs the whole mesh in memory; modes \"stream\" and \"random\" read it in parts");
}

Result<Mesh> decode(const Source& source, const DecodeOptions& options) {
  const Mode mode = MAILLE_TRY(mode_of(source));
  if (mode != Mode::stream && options.step != 0) {
    return failure(ErrorCode::usage,
                   source.name() + ": has no steps; only files of mode \"stream\" have them");
  }
  if (mode == Mode::single) return decode_single(source, options);
  if (mode == Mode::stream) return decode_stream(source, options);
  return decode_random(source, options);
}

Result<Salvaged> salvage(const Source& source, const DecodeOptions& options) {
  if (MAILLE_TRY(mode_of(source)) == Mode::stream) return salvage_stream(source, options);
  return failure(ErrorCode::unsupported, source.name() + ": only files of mode \"stream\" can be salvaged");
}

Result<FileInfo> inspect(const Source& source) {
  const Mode mode = MAILLE_TRY(mode_of(source));
  if (mode == Mode::single) return inspect_single(source);
  if (mode == Mode::stream) return inspect_stream(source);
  return inspect_random(source);
}

}  // namespace maille
