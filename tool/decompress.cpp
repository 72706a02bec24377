#include <fmt/format.h>
#include <fmt/ranges.h>
#include <maille/decode.h>
#include <maille/file.h>
#include <maille/io.h>
#include <maille/series.h>

#include <algorithm>
#include <cmath>
#include "batch.h"
#include "files.h"
#include "gltf.h"
#include "in_parts.h"
#include "result.h"
#include "spelling.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

// Beside the input; where no format was asked for, in one that holds everything: VTU for cells of all kinds,
// else PLY.
Result<std::string> usual_extension(const Input& input, const std::string& format) {
  if (is_folder_format(format)) return std::string();
  if (!format.empty()) return "." + format;
  const Mode mode = TOOL_TRY(mode_of(*input.source));
  return std::string(mode == Mode::stream ? ".vtu" : ".ply");
}

Result<std::string> name_beside(const Input& input, const std::string& format) {
  return with_extension(input.path, TOOL_TRY(usual_extension(input, format)));
}

Result<std::string> format_to_write(const DecompressOptions& options, const std::string& output) {
  // A device or a pipe has no extension, and PLY holds everything.
  const bool named = output != "-" && output.rfind("/dev/", 0) != 0;
  const bool given = !options.output.empty() && named;
  const std::string format = TOOL_TRY(output_format(output, options.output_format, given ? "" : "ply"));
  if (format == "maille") {
    return failure(ErrorCode::usage,
                   fmt::format("{}: decompress writes other formats; `maille convert` writes "
                               ".maille again",
                               output));
  }
  return format;
}

/// The step asked for by number or by time; 0 for the mesh's own arrays.
Result<uint64_t> step_of(const DecompressOptions& options, const Source& source) {
  if (!options.time) return options.step.value_or(0);
  const FileInfo info = TOOL_TRY(inspect(source, {options.common.memory}));
  std::vector<double> times;
  std::optional<uint64_t> near;
  for (const FileTime& time : times_of(info)) {
    if (time.time == *options.time) return time.step;
    // Solvers add up their steps of time: 0.30000000000000004 is what a user calls 0.3. 1e-9 is far above
    // such roundings, and far below the distance of any two times.
    if (std::abs(time.time - *options.time) <= 1e-9 * std::abs(*options.time)) near = time.step;
    times.push_back(time.time);
  }
  if (near) return *near;
  // A message of more times than these would be no help; then the two nearest are named.
  constexpr size_t most_named = 10;
  const bool all = times.size() <= most_named;
  if (!all) {
    const auto distance = [&](double time) { return std::abs(time - *options.time); };
    std::stable_sort(times.begin(), times.end(),
                     [&](double a, double b) { return distance(a) < distance(b); });
    times.resize(2);
  }
  if (times.empty())
    return failure(ErrorCode::usage,
                   fmt::format("{}: has no steps of time; leave out --time", source.name()));
  const std::string named = fmt::format("{:.12g}", fmt::join(times, ", "));
  return failure(ErrorCode::usage,
                 fmt::format("{}: has no step at time {}; {}", source.name(), *options.time,
                             all ? "it has: " + named
                                 : fmt::format("the nearest are {}; `maille info` lists all {}", named,
                                               info.steps.size())));
}

/// Whether the file has all arrays that are asked for.
Result<> check_arrays(const DecompressOptions& options, const Source& source, uint64_t step) {
  if (!options.arrays) return {};
  const FileInfo info = TOOL_TRY(inspect(source, {options.common.memory}));
  std::vector<std::string> known;
  if (step == 0 || step > info.steps.size()) {
    for (const ArrayInfo& array : info.arrays) known.push_back(array.name);
  } else {
    known = info.steps[step - 1].arrays;
  }
  return check_names(source.name(), *options.arrays, known);
}

/// One file holds one time: that there are more is said, unless one was asked for.
void note_steps(const DecompressOptions& options, const Source& source, const std::string& output,
                const std::string& format) {
  if (options.step || options.time || is_folder_format(format)) return;
  const auto info = inspect(source, {options.common.memory});
  if (!info || info->steps.empty()) return;
  say_notes(output_name(output),
            {fmt::format(
                "holds the mesh's own values; there are {} of time, which --step N or --time T chooses, and "
                "an output .pvd has all of them",
                counted(info->steps.size(), "step"))},
            options.common.quiet);
}

Result<> report(const DecompressOptions& options, const std::string& output, const PartsWritten& done,
                const char* cell_word, double seconds) {
  if (options.common.json) {
    return answer(dump({{"input", input_name(options.input)},
                        {"output", output},
                        {"input_bytes", done.input_bytes},
                        {"output_bytes", done.output_bytes},
                        {"points", done.points},
                        {"cells", done.cells},
                        {"seconds", seconds}}));
  }
  if (options.common.quiet) return {};
  say(fmt::format("{} -> {}: {}, {}; {} -> {}, {:.2f} s", input_name(options.input), output_name(output),
                  counted(done.points, "point"), counted(done.cells, cell_word),
                  human_bytes(static_cast<double>(done.input_bytes)),
                  human_bytes(static_cast<double>(done.output_bytes)), seconds));
  return {};
}

/// "1,024 of 4,096 cells", as far as the file still says how many there were.
std::string salvaged_text(const DecompressOptions& options, const Source& source, const Mesh& mesh) {
  const auto info = inspect(source, {options.common.memory});
  const std::string of = info && info->cells > 0 ? fmt::format(" of {}", info->cells) : "";
  return fmt::format("{} points, {}{} cells", mesh.point_count(), mesh.cell_count(), of);
}

/// Writes cells as they are decoded. False: this is no stream, or is damaged at its ends; nothing was
/// written.
Result<bool> write_parts(const DecompressOptions& options, const Source& source, const std::string& output,
                         const std::string& format, const Stopwatch& whole) {
  DecodeOptions wanted;
  wanted.arrays = options.arrays;
  wanted.limits = {options.common.memory};
  const auto mesh = describe(source, wanted);
  if (!mesh && is_unreadable(mesh.error())) return tl::unexpected(mesh.error());
  if (!mesh) return false;
  TOOL_CHECK(check_arrays(options, source, 0));
  const auto done = TOOL_TRY(decompress_in_parts(options, source, *mesh, output, format));
  if (!done) return false;
  note_steps(options, source, output, format);
  TOOL_CHECK(report(options, output, *done, "cell", whole.seconds()));
  return true;
}

/// The mesh; with --salvage what is left of it, and what is damaged.
Result<Salvaged> decode_whole(const DecompressOptions& options, const Source& source, uint64_t time_step) {
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  const Threads threads(options.common.threads);
  const DecodeOptions decoding{.limits = {.mesh_bytes = options.common.memory},
                               .arrays = options.arrays,
                               .step = time_step,
                               .executor = threads.executor(),
                               .progress = progress.watch(static_cast<double>(source.size()), "B")};
  const Stopwatch step;
  Salvaged decoded;
  if (options.salvage) {
    decoded = TOOL_TRY(salvage(source, decoding));
  } else {
    decoded.mesh = TOOL_TRY(decode(source, decoding));
  }
  progress.clear();
  step.done(options.common.verbose, "decompressing");
  return decoded;
}

/// Times that a case of OpenFOAM takes besides the mesh's own; 0 for other formats.
Result<uint64_t> times_for(const DecompressOptions& options, const std::string& format,
                           const Source& source) {
  if (!is_folder_format(format)) return 0;
  const auto info = inspect(source, {options.common.memory});
  return info ? info->steps.size() : 0;
}

/// The mesh and its fields at all times.
Result<std::vector<std::string>> write_case(const DecompressOptions& options, const Source& source,
                                            const Mesh& mesh, Sink& sink, uint64_t steps) {
  CaseWriter writer = TOOL_TRY(CaseWriter::begin(mesh, sink, options.ascii));
  for (uint64_t step = 1; step <= steps; ++step)
    TOOL_CHECK(writer.add(TOOL_TRY(decode_whole(options, source, step)).mesh));
  return writer.notes();
}

/// Without an extension, what was a case of OpenFOAM becomes one again.
bool was_a_case(const std::string& path, const DecompressOptions& options) {
  const std::string name = path.substr(begin_of_name(path));
  if (!options.output_format.empty() || name.empty() || name.find('.') != std::string::npos || path == "-")
    return false;
  const auto source =
      is_regular(options.input) ? file_source(options.input) : Result<std::unique_ptr<Source>>(nullptr);
  const auto info =
      source && *source ? inspect(**source, {options.common.memory}) : Result<FileInfo>(FileInfo{});
  if (!info) return false;
  return std::any_of(info->metadata.begin(), info->metadata.end(),
                     [](const auto& entry) { return entry.first.starts_with("openfoam."); });
}

}  // namespace

namespace {

// The output is written in parts where possible, which needs no memory for the whole mesh. Another format, a
// step of time, --salvage or damage leads to the usual way.
Result<int> decompress_one(const DecompressOptions& options) {
  if (const auto gltf = TOOL_TRY(open_compressed_gltf(options.input)))
    return decompress_gltf_file(options, *gltf);
  if (options.output.ends_with(".pvd") && options.output_format.empty()) return decompress_series(options);
  const Stopwatch whole;
  std::string output = options.output.empty() && options.input == "-" ? "-" : options.output;
  TOOL_CHECK(check_json_output(options.common, output));
  Input input;
  if (output.empty()) {
    input = TOOL_TRY(open_maille(options.input));
    output = TOOL_TRY(name_beside(input, options.output_format));
  }
  // Before an input that has to wait for it is opened: a pipe may take its time.
  const std::string format =
      was_a_case(output, options) ? "polymesh" : TOOL_TRY(format_to_write(options, output));
  bool plain = !options.salvage && !options.step && !options.time;
  // A case is written with all its times, one after the other.
  if (plain && is_folder_format(format)) {
    if (!input.source) input = TOOL_TRY(open_maille(options.input));
    plain = TOOL_TRY(times_for(options, format, *input.source)) == 0;
  }
  if (plain && can_write_in_parts(format, output, options.ascii)) {
    std::unique_ptr<Source> parts;
    if (!input.source || is_regular(options.input)) parts = TOOL_TRY(open_for_parts(options.input, output));
    if (TOOL_TRY(write_parts(options, parts ? *parts : *input.source, output, format, whole))) return 0;
    // Another mode, or damaged: the usual way tells which, of what can be read but once, too.
    if (!input.source && !is_regular(options.input)) input = make_input(std::move(parts), options.input);
  }
  if (!input.source) input = TOOL_TRY(open_maille(options.input));
  const uint64_t time_step = TOOL_TRY(step_of(options, *input.source));
  const uint64_t steps = TOOL_TRY(times_for(options, format, *input.source));
  TOOL_CHECK(check_arrays(options, *input.source, time_step));
  const auto file = TOOL_TRY(open_output(
      {output, options.input, options.force, is_binary(format, options.ascii), is_folder_format(format)}));

  CountingSink sink(*file);
  auto [mesh, damage] = TOOL_TRY(decode_whole(options, *input.source, time_step));
  const Stopwatch writing;
  const bool all_times = steps > 0 && !options.step && !options.time && !damage;
  std::vector<std::string> notes;
  TOOL_CHECK(show_scene(mesh, format, options.as_stored, notes));
  const auto more = all_times ? TOOL_TRY(write_case(options, *input.source, mesh, sink, steps))
                              : TOOL_TRY(write_mesh(mesh, sink, {.format = format, .ascii = options.ascii}));
  notes.insert(notes.end(), more.begin(), more.end());
  TOOL_CHECK(sink.commit());
  writing.done(options.common.verbose, "writing");
  say_notes(output_name(output), notes, options.common.quiet);
  note_steps(options, *input.source, output, format);
  const PartsWritten done = {mesh.point_count(), mesh.cell_count(), input.source->size(), sink.count()};
  TOOL_CHECK(report(options, output, done, cell_word(mesh), whole.seconds()));
  if (!damage) return 0;
  complain(damage->message + "; salvaged: " + salvaged_text(options, *input.source, mesh));
  return static_cast<int>(ErrorCode::corrupt);
}

Result<int> decompress_all(const DecompressOptions& options) {
  if (!options.output.empty())
    return failure(ErrorCode::usage, "--output is for one input; several go to --output-folder");
  const auto items =
      TOOL_TRY(items_of(options.batch, [](const std::string& path) { return path.ends_with(".maille"); }));
  return run_batch(items, options.common, [&](const BatchItem& item) -> Result<BatchAnswer> {
    DecompressOptions one = options;
    one.input = item.input;
    const Input input = TOOL_TRY(open_maille(item.input));
    one.output = item.stem + TOOL_TRY(usual_extension(input, options.output_format));
    const int code = TOOL_TRY(decompress_one(one));
    return BatchAnswer{code, one.output, input.source->size()};
  });
}

}  // namespace

Result<int> run(const DecompressOptions& options) {
  return options.batch.inputs.empty() ? decompress_one(options) : decompress_all(options);
}

}  // namespace maille::tool
