#include <fmt/format.h>
#include <maille/compare.h>
#include <maille/decode.h>
#include <maille/file.h>
#include <maille/series.h>

#include <algorithm>
#include <limits>

#include "files.h"
#include "gltf.h"
#include "in_parts.h"
#include "recode.h"
#include "result.h"
#include "summary.h"
#include "system.h"
#include "text.h"
#include "verbs.h"
#include "verdict.h"

namespace maille::tool {

namespace {

/// What the file promises for the arrays of a step. Bounds relative to a range were made from that step's
/// own, which the file's description does not have: their largest errors are not judged.
FileInfo info_of_step(const FileInfo& info, const Mesh& step) {
  FileInfo of_step = info;
  of_step.arrays.clear();
  for (const Array& array : step.arrays) {
    const auto found = std::find_if(info.arrays.begin(), info.arrays.end(), [&](const ArrayInfo& known) {
      return known.name == array.name && known.domain == array.domain;
    });
    ArrayInfo promised;
    promised.name = array.name;
    promised.domain = array.domain;
    promised.type = array.type;
    promised.components = array.components;
    if (found != info.arrays.end()) promised = *found;
    const auto kind = promised.asked.kind;
    if (!promised.lossless &&
        (kind == Tolerance::Kind::relative || kind == Tolerance::Kind::bits || kind == Tolerance::Kind::psnr))
      promised.bound = std::numeric_limits<double>::infinity();
    of_step.arrays.push_back(promised);
  }
  return of_step;
}

/// Each time of a series against the step of its number.
Result<> hold_series_against(const std::vector<SeriesEntry>& series, const Source& source,
                             const FileInfo& info, const CommonOptions& common, Verdict& verdict) {
  if (series.size() != info.steps.size()) {
    differs(verdict, {fmt::format("the series has {}, the file {}", counted(series.size(), "step"),
                                  counted(info.steps.size(), "step"))});
    return {};
  }
  for (size_t i = 0; i < series.size() && verdict.same; ++i) {
    DecodeOptions decoding;
    decoding.limits.mesh_bytes = common.memory;
    decoding.step = i + 1;
    const Mesh decoded = TOOL_TRY(decode(source, decoding));
    ReadOptions reading;
    reading.limits.mesh_bytes = common.memory;
    const Mesh original = TOOL_TRY(read_series_entry(series[i], reading)).mesh;
    Verdict step;
    TOOL_CHECK(hold_against(original, decoded, info_of_step(info, decoded), common, step));
    if (step.same) continue;
    for (std::string& difference : step.differences)
      difference = fmt::format("step {}: {}", i + 1, difference);
    differs(verdict, std::move(step.differences));
  }
  return {};
}

std::string text_of(const Verdict& verdict, const VerifyOptions& options) {
  const std::string name = input_name(options.input);
  if (!verdict.damage.empty()) {
    std::string text = fmt::format("{}: damaged\n", name);
    for (const std::string& damage : verdict.damage) text += fmt::format("  {}\n", damage);
    return text;
  }
  std::string text = fmt::format("{}: checksums good, decodes to {}, {}\n", name,
                                 counted(verdict.points, "point"), counted(verdict.cells, verdict.word));
  if (!verdict.compared) return text;
  text +=
      fmt::format("against {}: {}\n", input_name(options.original),
                  verdict.same ? fmt::format("the same mesh{}, every array as exact as promised",
                                             verdict.steps == 0 ? "" : ", " + counted(verdict.steps, "step"))
                               : "different (A is the original, B the file)");
  for (const std::string& difference : verdict.differences) text += fmt::format("  {}\n", difference);
  if (verdict.arrays.empty()) return text;
  return text + table_of(verdict.arrays);
}

Json json_of(const Verdict& verdict, const VerifyOptions& options) {
  Json json = {{"file", input_name(options.input)},
               {"damage", verdict.damage},
               {"points", verdict.points},
               {"cells", verdict.cells}};
  if (verdict.compared) {
    json["against"] = input_name(options.original);
    json["same"] = verdict.same;
    json["differences"] = verdict.differences;
    json["arrays"] = json_of(verdict.arrays);
  }
  return json;
}

/// The step of a series whose values the mesh itself has: of its time, where the file tells it, else the one
/// that compress takes, the first file or the last step of a single one.
SeriesEntry own_entry(const std::vector<SeriesEntry>& series, const FileInfo& info) {
  const auto same = std::find_if(series.begin(), series.end(),
                                 [&](const SeriesEntry& entry) { return info.time == entry.time; });
  if (same != series.end()) return *same;
  return is_regular(series.front().path) && series.front().step ? series.back() : series.front();
}

/// Checksums come first, because they name every damaged chunk while decoding stops at the first one.
Result<Verdict> judge_whole(const Input& input, const VerifyOptions& options) {
  Verdict verdict;
  verdict.damage = TOOL_TRY(verify_checksums(*input.source));
  if (!verdict.damage.empty()) return verdict;
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  const Mesh decoded = TOOL_TRY(load(input, options.common, progress)).mesh;
  verdict.points = decoded.point_count();
  verdict.cells = decoded.cell_count();
  verdict.word = cell_word(decoded);
  const size_t steps = TOOL_TRY(inspect(*input.source, {options.common.memory})).steps.size();
  for (size_t step = 1; step <= steps; ++step) {
    DecodeOptions decoding;
    decoding.limits.mesh_bytes = options.common.memory;
    decoding.step = step;
    TOOL_TRY(decode(*input.source, decoding));
  }
  if (options.original.empty()) return verdict;
  const bool of_times = is_series(options.original);
  const auto series = of_times ? TOOL_TRY(read_series(options.original)) : std::vector<SeriesEntry>();
  const FileInfo info = TOOL_TRY(inspect(*input.source, {options.common.memory}));
  const SeriesEntry own = series.empty() ? SeriesEntry{options.original} : own_entry(series, info);
  Input original = TOOL_TRY(open_input(own.path, options.original_format));
  if (is_regular(own.path)) original.step = own.step;
  const LoadedMesh loaded = TOOL_TRY(load(original, options.common, progress));
  TOOL_CHECK(hold_against(loaded.mesh, decoded, info, options.common, verdict));
  verdict.steps = series.size();
  if (of_times && verdict.same)
    TOOL_CHECK(hold_series_against(series, *input.source, info, options.common, verdict));
  return verdict;
}

/// What decoding the mesh from front to back does not see: the index, and steps of time, which stand behind
/// it.
Result<std::vector<std::string>> damage_behind_mesh(const Source& source, const CommonOptions& common,
                                                    Executor* executor) {
  std::vector<std::string> damage = TOOL_TRY(verify_checksums(source));
  if (!damage.empty()) return damage;
  const size_t steps = TOOL_TRY(list_steps(source, true, {common.memory})).size();
  StreamPortion portion;
  for (size_t step = 1; step <= steps; ++step) {
    StreamReader reader =
        TOOL_TRY(StreamReader::open(source, step, {.limits = {common.memory}, .executor = executor}));
    while (TOOL_TRY(reader.next(portion))) {
    }
  }
  return damage;
}

/// Nothing where the file is no stream of cells, which is decoded as it comes, also from a pipe.
Result<std::optional<Verdict>> judge_stream(const VerifyOptions& options, std::vector<std::byte>& begin) {
  const Threads threads(options.common.threads);
  auto stream = TOOL_TRY(open_stream(options.input, options.common, threads.executor(), begin));
  if (!stream) return std::nullopt;
  Verdict verdict;
  verdict.word = "cell";
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  const Progress watch = progress.watch(0, "cells");
  StreamPortion portion;
  for (;;) {
    const auto more = stream->reader.next(portion);
    if (!more) {
      if (more.error().code != ErrorCode::corrupt) return tl::unexpected(more.error());
      if (stream->source) return std::nullopt;  // of a file every damaged chunk can be told
      verdict.damage.push_back(more.error().message);
      return verdict;
    }
    if (!*more) break;
    verdict.points += portion.points.size();
    verdict.cells += portion.cell_count();
    if (watch) watch({"cells", 0});
  }
  if (stream->source)
    verdict.damage = TOOL_TRY(damage_behind_mesh(*stream->source, options.common, threads.executor()));
  return verdict;
}

/// Takes a mesh and keeps nothing.
class NoSink final : public MeshSink {
 public:
  Result<> write_points(uint64_t, Bytes) override { return {}; }
  Result<> write_cells(const CellPiece&) override { return {}; }
  Result<> write_array(size_t, uint64_t, Bytes) override { return {}; }
  Result<> commit() override { return {}; }
};

/// A volume in pieces, some of which are in memory at once. Nothing where it is something else.
Result<std::optional<Verdict>> judge_pieces(const Input& input, const VerifyOptions& options) {
  const auto mesh = describe(*input.source);
  if (!mesh) return std::nullopt;
  Verdict verdict;
  verdict.word = "cell";
  verdict.damage = TOOL_TRY(verify_checksums(*input.source));
  if (!verdict.damage.empty()) return verdict;
  keep_memory_small();
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  const Threads threads(options.common.threads);
  DecodeOptions decoding;
  decoding.limits.mesh_bytes = options.common.memory;
  decoding.executor = threads.executor();
  decoding.progress = progress.watch(static_cast<double>(mesh->cells), "cells");
  const size_t steps = TOOL_TRY(list_steps(*input.source, true, {options.common.memory})).size();
  for (size_t step = 0; step <= steps && verdict.damage.empty(); ++step) {
    decoding.step = step;
    NoSink nowhere;
    const auto decoded = decode(*input.source, nowhere, decoding, space_for(options.common, "-", false));
    if (!decoded && decoded.error().code != ErrorCode::corrupt) return tl::unexpected(decoded.error());
    if (!decoded) verdict.damage.push_back(decoded.error().message);
  }
  verdict.points = mesh->points;
  verdict.cells = mesh->cells;
  return verdict;
}

// Without an original, streams are decoded as they arrive and pieces one after the other, so memory does not
// limit what can be verified. With an original, both meshes are in memory.
Result<Verdict> judge(const VerifyOptions& options) {
  std::vector<std::byte> begin;
  if (options.original.empty()) {
    if (auto verdict = TOOL_TRY(judge_stream(options, begin))) return *std::move(verdict);
  }
  if (!begin.empty()) {
    std::unique_ptr<Source> rest = TOOL_TRY(rest_of_stdin(std::move(begin)));
    return judge_whole(make_input(std::move(rest), options.input), options);
  }
  const Input input = TOOL_TRY(open_maille(options.input));
  if (options.original.empty()) {
    if (auto verdict = TOOL_TRY(judge_pieces(input, options))) return *std::move(verdict);
  }
  return judge_whole(input, options);
}
}  // namespace

Result<int> run(const VerifyOptions& options) {
  if (options.input == "-" && options.original == "-") {
    return failure(ErrorCode::usage,
                   "file and original are both standard input; name a file for one of them");
  }
  if (const auto gltf = TOOL_TRY(open_compressed_gltf(options.input))) return verify_gltf(options, *gltf);
  const Verdict verdict = TOOL_TRY(judge(options));
  if (options.common.json) {
    TOOL_CHECK(answer(dump(json_of(verdict, options))));
  } else if (!options.common.quiet) {
    TOOL_CHECK(answer(text_of(verdict, options)));
  }
  return verdict.exit_code();
}

}  // namespace maille::tool
