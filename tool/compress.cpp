#include <fmt/format.h>
#include <fmt/ranges.h>
#include <maille/encode.h>
#include <maille/io.h>
#include <maille/path.h>
#include <maille/version.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "batch.h"
#include "compress_one.h"
#include "files.h"
#include "gltf.h"
#include "in_parts.h"
#include "recode.h"
#include "result.h"
#include "summary.h"
#include "text.h"
#include "tolerance.h"
#include "verbs.h"

namespace maille::tool {

namespace {

// There is no date, no folder and no number of threads in it: the same input and settings give the same file
// anywhere. Bounds are recorded because they cannot be recovered from a mesh that was rounded.
std::string provenance_of(const CompressOptions& options) {
  const std::string& input = options.series.empty() ? options.input : options.series;
  const std::string name = input.substr(begin_of_name(input));
  std::string text = fmt::format("maille {}: {}", library_version(), input_name(name));
  for (const BoundOption& option : bound_options) {
    const auto texts = options.bounds.find(option.kind);
    if (texts == options.bounds.end()) continue;
    for (const std::string& value : texts->second) text += std::string(" ") + option.name + " " + value;
  }
  return text;
}

bool wants_pieces(const CompressOptions& options) {
  return cells_of_piece(options.pieces).has_value();
}

EncodeOptions encode_options(const CompressOptions& options, const Tolerances& tolerances, bool volume) {
  EncodeOptions encode;
  encode.mode = options.mode.value_or(volume ? Mode::stream : Mode::single);
  encode.effort = options.effort;
  // A stream keeps the order of its cells: what a solver wrote is mostly a sweep, and fields go with it.
  const bool keep = options.keep_order || (encode.mode == Mode::stream && !options.any_order);
  encode.order = keep ? Order::keep : Order::canonical;
  encode.positions = tolerances.positions.value_or(Tolerance{});
  encode.arrays = tolerances.arrays;
  // Charts have a size that suits most uses where none is given.
  if (encode.mode != Mode::random || options.pieces != "auto")
    encode.most_cells_per_part = cells_of_piece(options.pieces);
  if (encode.mode == Mode::stream) encode.time = options.time;
  if (options.provenance) encode.provenance = provenance_of(options);
  return encode;
}

Result<> check(const CompressOptions& options, const std::string& output) {
  // With -f and a pattern of the shell, `compress -f *.off` would overwrite the second mesh.
  if (const auto format = foreign_format(output)) {
    return failure(
        ErrorCode::usage,
        fmt::format("{}: its name says {}, but compress writes .maille files; give it another name, "
                    "or use `maille convert` to write {}",
                    output, *format, *format));
  }
  // The output is no gzip file, and programs that go by the name would refuse it.
  if (output.ends_with(".gz")) {
    return failure(ErrorCode::usage,
                   fmt::format("{}: .maille files are packed as they are; leave the .gz away", output));
  }
  if (options.delay > 0 && options.mode.value_or(Mode::stream) != Mode::stream)
    return failure(ErrorCode::usage, "--delay is for mode stream: other modes have orders of their own");
  if (wants_pieces(options) && options.mode == Mode::single)
    return failure(ErrorCode::usage, "--pieces is for modes stream and random: mode single has no pieces");
  if (wants_pieces(options) && options.delay > 0)
    return failure(ErrorCode::usage,
                   "--pieces and --delay exclude each other: a piece is put in order as a whole");
  return check_json_output(options.common, output);
}

/// What was compressed, for the report.
struct Compressed {
  EncodeReport report;
  uint64_t input_bytes = 0;
  const char* cell_word = "cell";
  bool left_out = false;  ///< something of the input, as notes said
  std::optional<AppendedSteps> steps = {};
};

/// Says what normals take if it is a quarter of the file or more: programs that show or print a mesh compute
/// them.
std::string hint_at_normals(const EncodeReport& report) {
  for (const ArrayReport& array : report.arrays) {
    if (array.name != "normal" || !array.lossless || array.coded_bytes < report.file_bytes / 4) continue;
    return fmt::format(
        "normals are {} % of that; --drop normal leaves them out, --bits normal=10 rounds them\n",
        100 * array.coded_bytes / std::max<uint64_t>(report.file_bytes, 1));
  }
  return "";
}

Result<> report(const CompressOptions& options, const Compressed& done, const std::string& input,
                const std::string& output, double seconds) {
  if (options.common.json) {
    Json json = summary_json(done.report, input, output, done.input_bytes, seconds);
    if (done.steps) json.update({{"steps", done.steps->count}, {"step_bytes", done.steps->coded_bytes}});
    return answer(dump(json));
  }
  if (options.common.quiet) return {};
  std::string text = summary_text(done.report, input, output_name(output), done.input_bytes, seconds,
                                  options.common.verbose, done.cell_word);
  if (options.brief && !options.common.verbose) text.resize(text.find('\n') + 1);
  if (done.steps) {
    text += fmt::format("{} of time: {}\n", counted(done.steps->count, "step"),
                        human_bytes(static_cast<double>(done.steps->coded_bytes)));
  }
  const bool exact = !options.brief && std::all_of(options.bounds.begin(), options.bounds.end(),
                                                   [](const auto& texts) { return texts.second.empty(); });
  if (!options.lossless && exact && options.arrays.takes_all()) {
    const bool left_out = done.left_out || (done.steps && done.steps->left_out);
    text += fmt::format("{} is kept bit for bit; -e or --bits makes smaller files\n",
                        left_out ? "everything else" : "every value");
  }
  if (!options.brief) text += hint_at_normals(done.report);
  text.pop_back();
  say(text);
  return {};
}

std::vector<Array> arrays_of(const StreamDescription& description) {
  std::vector<Array> arrays;
  for (const StreamArray& array : description.arrays)
    arrays.push_back(make_array(array.name, array.domain, array.type, array.components));
  return arrays;
}

Result<std::unique_ptr<Sink>> open_sink(const CompressOptions& options, const std::string& output) {
  return open_output({output, options.input, options.force, true});
}

/// Compresses a file that is read in parts and may be larger than memory.
Result<Compressed> compress_parts(InputInParts& input, const CompressOptions& options,
                                  const Tolerances& asked, const std::string& output) {
  const Tolerances tolerances =
      TOOL_TRY(tolerances_of(asked, input.mesh->description().arrays, input_name(options.input),
                             options.common.quiet || options.lenient));
  const auto sink = TOOL_TRY(open_sink(options, output));
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  const Threads threads(options.common.threads);
  EncodeOptions encoding = encode_options(options, tolerances, true);
  encoding.executor = threads.executor();
  const bool surface = encoding.mode == Mode::random;
  const Stopwatch step;
  EncodeReport report = TOOL_TRY(compress_in_parts(input, *sink, encoding, options, progress));
  progress.clear();
  step.done(options.common.verbose, "compressing");
  say_notes(input_name(options.input), input.mesh->notes(), options.common.quiet);
  return Compressed{std::move(report), input.bytes, surface ? "face" : "cell",
                    tell_of_loss(input.mesh->notes())};
}

/// Recodes a stream as a stream, with memory for the front only.
Result<Compressed> compress_cells(InputStream& input, const CompressOptions& options, const Tolerances& asked,
                                  const std::string& output, Executor* executor) {
  const Tolerances tolerances =
      TOOL_TRY(tolerances_of(asked, arrays_of(input.reader.description()), input_name(options.input),
                             options.common.quiet || options.lenient));
  const auto sink = TOOL_TRY(open_sink(options, output));
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  EncodeOptions encoding = encode_options(options, tolerances, true);
  encoding.executor = executor;
  encoding.time = input.reader.description().time;
  EncodeReport report = TOOL_TRY(compress_stream(input, *sink, encoding, options.delay, progress));
  progress.clear();
  return Compressed{std::move(report), input.bytes()};
}

/// Pieces of what comes once.
Result<Compressed> compress_spooled(InputStream& input, const CompressOptions& options,
                                    const Tolerances& tolerances, const std::string& output) {
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  const WorkingSpace space = space_for(options.common, output, false);
  InputInParts parts;
  parts.mesh = TOOL_TRY(spool_stream(input, space, progress));
  parts.bytes = input.bytes();
  progress.clear();
  return compress_parts(parts, options, tolerances, output);
}

/// Compresses a mesh that is held in memory, which is the usual way.
Result<Compressed> compress_whole(const Input& input, const CompressOptions& options, Tolerances asked,
                                  const std::string& output) {
  const auto sink = TOOL_TRY(open_sink(options, output));
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  LoadedMesh loaded = TOOL_TRY(load(input, options.common, progress));
  TOOL_CHECK(select_arrays(options.arrays, loaded.mesh, input_name(options.input)));
  // Fields of a case may begin at a later time: append_series() looks whether there is one.
  if (!options.series.empty()) {
    std::erase_if(asked.arrays, [&](const auto& bound) {
      return std::none_of(loaded.mesh.arrays.begin(), loaded.mesh.arrays.end(),
                          [&](const Array& array) { return array.name == bound.first; });
    });
  }
  const std::string format = input.format.empty() ? format_of(*input.source).value_or("") : input.format;
  const Tolerances tolerances =
      TOOL_TRY(tolerances_of(asked, loaded.mesh.arrays, input_name(options.input),
                             options.common.quiet || options.lenient, metres_of_unit(loaded.mesh, format)));
  if (const auto note = note_of_size(tolerances, loaded.mesh))
    say_notes(input_name(options.input), {*note}, options.common.quiet);
  say_notes(input_name(options.input), notes_of_ranges(tolerances, loaded.mesh), options.common.quiet);
  const Threads threads(options.common.threads);
  const bool volume = usual_mode(loaded.mesh) == Mode::stream;
  EncodeOptions encoding = encode_options(options, tolerances, volume);
  encoding.executor = threads.executor();
  if (encoding.mode == Mode::stream && !encoding.time) encoding.time = time_of(loaded.mesh);
  if (wants_pieces(options) && encoding.mode == Mode::single) {
    return failure(ErrorCode::usage,
                   fmt::format("{}: --pieces is for volumes, and for surfaces with --mode random",
                               input_name(options.input)));
  }
  TOOL_CHECK(check_memory(loaded.mesh, *encoding.mode, options.common, input_name(options.input)));
  encoding.progress =
      progress.watch(static_cast<double>(loaded.mesh.cell_count()), volume ? "cells" : "faces");
  const Stopwatch step;
  EncodeReport report = TOOL_TRY(encode(loaded.mesh, *sink, encoding));
  progress.clear();
  step.done(options.common.verbose, "compressing");
  return Compressed{std::move(report), bytes_of_input(input, loaded.files_beside), volume ? "cell" : "face",
                    tell_of_loss(loaded.notes)};
}

/// What is known of a .maille file of mode stream, which unlike a pipe can be read twice. What is wrong with
/// a file is told by its decoder.
std::optional<FileInfo> stream_info(const std::string& path, const Limits& limits) {
  if (path == "-" || !is_regular(path)) return std::nullopt;
  const auto source = unmapped_source(path);
  if (!source || !is_maille(**source)) return std::nullopt;
  auto info = inspect(**source, limits);
  if (!info || info->mode != Mode::stream) return std::nullopt;
  return *std::move(info);
}

/// Tries the ways from the least memory to the most: in parts if the input can be read so, from stream to
/// stream if it is a .maille stream that is piped or large, and otherwise with the whole mesh in memory. An
/// empty value means that a way does not apply.
Result<Compressed> compress(const CompressOptions& options, const Tolerances& tolerances,
                            const std::string& output) {
  auto parts = TOOL_TRY([&] {
    ProgressDisplay progress(options.common.progress, options.common.quiet);
    return open_in_parts(options, progress);
  }());
  if (parts) {
    parts->mesh = TOOL_TRY(select_arrays(options.arrays, std::move(parts->mesh), input_name(options.input)));
    return compress_parts(*parts, options, tolerances, output);
  }
  // Standard input cannot be read twice, so the bytes that were read to recognise a stream are passed on to
  // the next way.
  std::vector<std::byte> begin;
  const auto known = stream_info(options.input, {options.common.memory});
  if (known) say_notes(input_name(options.input), notes_of_steps(*known), options.common.quiet);
  const bool in_memory = known && options.delay == 0 &&
                         fits_in_memory(known->points, known->corners, known->file_bytes, options.common);
  const bool may_be_stream = !in_memory &&
                             (options.input_format.empty() || options.input_format == "maille") &&
                             (!options.mode || options.mode == Mode::stream) && options.arrays.takes_all() &&
                             (!options.any_order || options.delay > 0 || wants_pieces(options));
  if (may_be_stream) {
    const Threads threads(options.common.threads);
    if (auto stream = TOOL_TRY(open_stream(options.input, options.common, threads.executor(), begin)))
      return wants_pieces(options) ? compress_spooled(*stream, options, tolerances, output)
                                   : compress_cells(*stream, options, tolerances, output, threads.executor());
  }
  if (!begin.empty()) {
    std::unique_ptr<Source> rest = TOOL_TRY(rest_of_stdin(std::move(begin)));
    return compress_whole(make_input(std::move(rest), options.input, options.input_format), options,
                          tolerances, output);
  }
  Input input = TOOL_TRY(open_input(options.input, options.input_format));
  input.step = options.step;
  CompressOptions as_known = options;
  if (known && !options.time) as_known.time = known->time;
  if (known && known->order == Order::canonical) as_known.any_order = !options.keep_order;
  return compress_whole(input, as_known, tolerances, output);
}

}  // namespace

namespace {

Result<uint64_t> compress_any(const CompressOptions& options) {
  if (names_compressed_gltf(options.output)) return compress_to_gltf(options);
  return is_series(options.input) ? compress_series(options) : compress_one(options);
}

Result<int> compress_all(const CompressOptions& options) {
  if (!options.output.empty())
    return failure(ErrorCode::usage, "--output is for one input; several go to --output-folder");
  const auto items = TOOL_TRY(
      items_of(options.batch, [](const std::string& path) { return foreign_format(path).has_value(); }));
  return run_batch(items, options.common, [&](const BatchItem& item) -> Result<BatchAnswer> {
    CompressOptions one = options;
    one.input = item.input;
    one.output = item.stem + ".maille";
    one.brief = true;
    const uint64_t input_bytes = TOOL_TRY(compress_any(one));
    return BatchAnswer{0, one.output, input_bytes};
  });
}

}  // namespace

Result<int> run(const CompressOptions& options) {
  if (!options.batch.inputs.empty()) return compress_all(options);
  TOOL_CHECK(compress_any(options));
  return 0;
}

namespace {

/// Writes the mesh and its steps under another name first, so that the output is complete when it appears.
/// That name is in the same folder, because a rename cannot cross file systems; if the output is a link, its
/// target is replaced and the link stays.
Result<Compressed> compress_with_steps(CompressOptions options, const Tolerances& tolerances,
                                       const std::string& output, const Series& series) {
  TOOL_CHECK(check_output({output, series.name, options.force, true}));
  std::error_code error, absent;
  const bool is_link = std::filesystem::is_symlink(to_path(output), absent);
  const auto target = is_link ? std::filesystem::canonical(to_path(output), error) : to_path(output);
  if (error) return failure(ErrorCode::write_failed, output + ": " + error.message());
  const std::string part = fmt::format("{}.{}.part", to_utf8(target), ::getpid());
  options.force = true;
  auto done = compress(options, tolerances, part);
  Result<AppendedSteps> steps =
      done ? series.append(part) : Result<AppendedSteps>(tl::unexpected(done.error()));
  if (steps) std::filesystem::rename(to_path(part), target, error);
  if (steps && !error) {
    done->report.file_bytes = steps->file_bytes;
    done->input_bytes = steps->input_bytes;
    done->steps = *steps;
    return done;
  }
  std::error_code ignored;
  std::filesystem::remove(to_path(part), ignored);
  if (!steps) return tl::unexpected(steps.error());
  return failure(ErrorCode::write_failed, output + ": " + error.message());
}

}  // namespace

Result<uint64_t> compress_one(const CompressOptions& options, const Series* series) {
  const Stopwatch whole;
  std::string output = options.output;
  if (output.empty()) output = options.input == "-" ? "-" : with_extension(options.input, ".maille");
  TOOL_CHECK(check(options, output));
  const Tolerances tolerances = TOOL_TRY(parse_tolerances(options));
  const Compressed done = TOOL_TRY(series ? compress_with_steps(options, tolerances, output, *series)
                                          : compress(options, tolerances, output));
  TOOL_CHECK(
      report(options, done, input_name(series ? series->name : options.input), output, whole.seconds()));
  return done.input_bytes;
}

}  // namespace maille::tool
