// encode(), decode() and inspect(): each mode has its own.
#include <array>
#include <atomic>
#include <cstring>
#include <memory>

#include "base/result.h"
#include "container/file_reader.h"
#include "description/remains.h"
#include "file/single_file.h"
#include "random/random_file.h"
#include "volume/pieces/pieces_file.h"
#include "volume/stream/stream_file.h"

namespace maille {
namespace {

/// `in_pieces`: a file of mode stream that is in pieces.
struct Kind {
  Mode mode = Mode::single;
  bool in_pieces = false;
};
/// By the header alone: each mode opens the rest in its own way, and from a distance each read is a round
/// trip.
Result<Kind> kind_of_file(const Source& source) {
  std::array<std::byte, file_header_bytes> front{};
  const auto size = static_cast<size_t>(std::min<uint64_t>(front.size(), source.size()));
  MAILLE_CHECK(source.read_at(0, std::span(front).first(size)));
  const FileHeader header = MAILLE_TRY(read_file_header(Bytes(front).first(size), source.name()));
  return Kind{header.mode, (header.required_features & in_pieces_feature) != 0};
}

/// Other modes have predictions in numbers, and no logarithms.
Result<> check_bounds(const EncodeOptions& options) {
  const auto is_pointwise = [](const Tolerance& bound) { return bound.kind == Tolerance::Kind::pointwise; };
  bool any = is_pointwise(options.positions);
  for (const auto& [name, bound] : options.arrays) any = any || is_pointwise(bound);
  if (!any || options.mode == Mode::stream) return {};
  return failure(ErrorCode::usage,
                 "bounds relative to each number are for mode \"stream\" only; other modes take bounds "
                 "relative to the range of values");
}

bool is_solid(CellType type) {
  return dimension_of(type) == 3;
}

/// Single has no parts. A block that does not tell its types may have solids.
Mode usual_mode(const MeshDescription& mesh) {
  const bool faces = std::all_of(mesh.blocks.begin(), mesh.blocks.end(),
                                 [](const MeshDescription::Block& block) { return is_face(block.type); });
  return faces ? Mode::random : Mode::stream;
}

/// Of each thread another one: std::this_thread is not for the core.
const void* this_thread() {
  static thread_local char mark = 0;
  return &mark;
}

/// Observers of graphics and of Python take calls on their own thread only. Reports of others are dropped:
/// the calling thread works, too, and has its own to tell.
Progress on_this_thread(const Progress& progress) {
  if (!progress) return {};
  auto stopped = std::make_shared<std::atomic<bool>>(false);
  return [&progress, stopped, caller = this_thread()](const ProgressReport& report) {
    if (this_thread() == caller && !progress(report)) *stopped = true;
    return !*stopped;
  };
}

EncodeOptions complete(EncodeOptions options, Mode usual, const Progress& progress) {
  options.mode = options.mode.value_or(usual);
  options.progress = on_this_thread(progress);
  return options;
}

}  // namespace

Mode usual_mode(const Mesh& mesh) {
  const bool solids = std::any_of(mesh.blocks.begin(), mesh.blocks.end(), [&](const CellBlock& block) {
    return is_solid(block.type) || std::any_of(block.types.begin(), block.types.end(), [](uint8_t type) {
             return is_solid(static_cast<CellType>(type));
           });
  });
  // Streams of cells have no arrays on corners: mode single takes such meshes whole.
  const bool corners = std::any_of(mesh.arrays.begin(), mesh.arrays.end(),
                                   [](const Array& array) { return array.domain == Domain::corner; });
  return solids && !corners ? Mode::stream : Mode::single;
}

bool is_maille(const Source& source) {
  std::array<std::byte, file_magic.size()> first{};
  if (source.size() < first.size() || !source.read_at(0, first)) return false;
  return std::memcmp(first.data(), file_magic.data(), first.size()) == 0;
}

Result<Mode> mode_of(const Source& source) {
  return MAILLE_TRY(kind_of_file(source)).mode;
}

Result<EncodeReport> encode(const Mesh& mesh, Sink& sink, const EncodeOptions& asked) {
  const EncodeOptions options = complete(asked, usual_mode(mesh), asked.progress);
  MAILLE_CHECK(check_bounds(options));
  if (options.mode == Mode::single) return encode_single(mesh, sink, options);
  if (options.mode == Mode::stream && options.most_cells_per_part)
    return encode_in_pieces(mesh, sink, options, *options.most_cells_per_part);
  if (options.mode == Mode::stream) return encode_stream(mesh, sink, options);
  HierarchyOptions hierarchy;
  hierarchy.sizes = ChartSizes::of(options.most_cells_per_part);
  return encode_random(mesh, sink, options, hierarchy);
}

Result<EncodeReport> encode(MeshSource& mesh, Sink& sink, const EncodeOptions& asked,
                            const WorkingSpace& space) {
  const EncodeOptions options = complete(asked, usual_mode(mesh.description()), asked.progress);
  MAILLE_CHECK(check_bounds(options));
  if (options.mode == Mode::stream && options.most_cells_per_part)
    return encode_in_pieces(mesh, sink, options, *options.most_cells_per_part, space);
  if (options.mode == Mode::stream) return encode_stream(mesh, sink, options, space);
  if (options.mode == Mode::random) {
    return encode_random(mesh, sink, options,
                         {.sizes = ChartSizes::of(options.most_cells_per_part), .space = space});
  }
  return failure(
      ErrorCode::usage,
      "mode \"single\" needs the whole mesh in memory; modes \"stream\" and \"random\" read it in parts");
}

namespace {

/// `options.progress` is on_this_thread() already.
Result<Mesh> decode(const Source& source, const Kind& kind, const DecodeOptions& options) {
  const auto [mode, in_pieces] = kind;
  if (mode != Mode::stream && options.step != 0) {
    return failure(ErrorCode::usage,
                   source.name() + ": has no steps; only files of mode \"stream\" have them");
  }
  if (mode == Mode::single) return decode_single(source, options);
  if (mode == Mode::stream)
    return in_pieces ? decode_pieces(source, options) : decode_stream(source, options);
  return decode_random(source, options);
}

}  // namespace

Result<Mesh> decode(const Source& source, const DecodeOptions& asked) {
  DecodeOptions options = asked;
  options.progress = on_this_thread(asked.progress);
  return decode(source, MAILLE_TRY(kind_of_file(source)), options);
}

Result<> decode(const Source& source, MeshSink& sink, const DecodeOptions& options,
                const WorkingSpace& space) {
  const auto [mode, in_pieces] = MAILLE_TRY(kind_of_file(source));
  return in_pieces ? decode_pieces(source, sink, options, space) : decode_stream(source, sink, options);
}

Result<Salvaged> salvage(const Source& source, const DecodeOptions& asked) {
  DecodeOptions options = asked;
  options.progress = on_this_thread(asked.progress);
  const Kind kind = MAILLE_TRY(kind_of_file(source));
  if (kind.mode == Mode::stream)
    return kind.in_pieces ? salvage_pieces(source, options) : salvage_stream(source, options);
  Result<Mesh> whole = decode(source, kind, options);
  if (whole) return Salvaged{*std::move(whole), {}};
  if (whole.error().code != ErrorCode::corrupt) return tl::unexpected(std::move(whole).error());
  auto left = kind.mode == Mode::single ? salvage_single(source, options) : salvage_random(source, options);
  if (!left && left.error().code == ErrorCode::corrupt)
    left.error().message += "; nothing of it can be salvaged";
  Remains remains = MAILLE_TRY(std::move(left));
  Error damage = std::move(whole).error();
  damage.message += sentence_of(remains);
  return Salvaged{std::move(remains.mesh), std::move(damage)};
}

Result<FileInfo> inspect(const Source& source, const Limits& allowed) {
  Limits limits = allowed;
  limits.mesh_bytes /= 2;  // what is told is a copy
  const auto [mode, in_pieces] = MAILLE_TRY(kind_of_file(source));
  if (mode == Mode::single) return inspect_single(source, limits);
  if (mode == Mode::stream)
    return in_pieces ? inspect_pieces(source, limits) : inspect_stream(source, limits);
  return inspect_random(source, limits);
}

}  // namespace maille
