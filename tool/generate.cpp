#include <fmt/format.h>
#include <maille/encode.h>
#include <maille/generate.h>
#include <maille/io.h>
#include <maille/out_of_core.h>

#include <algorithm>

#include "files.h"
#include "generate_counts.h"
#include "generate_in_parts.h"
#include "generate_stream.h"
#include "in_parts.h"
#include "result.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

Result<int> count(const GenerateOptions& options, const BlockDescription& description) {
  const Stopwatch step;
  GeneratedCounts counter;
  TOOL_CHECK(generate(description, options.generation, counter));
  step.done(options.common.verbose, "generating");
  if (options.common.json) {
    Json json = counter.json();
    json["most_points_in_use"] = counter.most_alive;
    TOOL_CHECK(answer(dump(json)));
    return 0;
  }
  TOOL_CHECK(answer(counter.text() + "\n"));
  if (!options.common.quiet)
    say(fmt::format("at most {} in use at a time", counted(counter.most_alive, "point")));
  return 0;
}

Result<> encode_mesh(const Mesh& mesh, Sink& sink, const GenerateOptions& options) {
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  const Threads threads(options.common.threads);
  EncodeOptions encoding;
  encoding.mode = usual_mode(mesh);
  encoding.order = options.generation.streaming_order ? Order::canonical : Order::keep;
  encoding.executor = threads.executor();
  encoding.progress = progress.watch(static_cast<double>(mesh.cell_count()), "cells");
  TOOL_CHECK(encode(mesh, sink, encoding));
  return {};
}

/// Above, a .maille file is written as the mesh comes: so many cells take 32 MB in memory. Below, the encoder
/// sees the mesh and chooses mode and order itself. Other formats have no such choice.
constexpr double most_cells_in_memory = 250000;

/// A rough count that only decides whether to work in memory, in doubles as it may pass 2^64; generate()
/// checks divisions and counts exactly.
double cells_of(const BlockDescription& description, uint64_t refine) {
  double cells = 0;
  for (const HexBlock& block : description.blocks) {
    double of_block = 1;
    for (const uint32_t division : block.divisions)
      of_block *= static_cast<double>(refine) * static_cast<double>(division);
    cells += of_block;
  }
  return cells;
}

/// The most points in use at once decide; counting takes a tenth of the time of writing.
Result<> check_points_in_use(const GenerateOptions& options, const BlockDescription& description) {
  // A point in use and the cells around it: 350 at most, in kept order of many blocks.
  constexpr uint64_t bytes_of_point = 352;
  const uint64_t memory = options.common.memory;
  if (memory == Limits{}.mesh_bytes) return {};
  GeneratedCounts counter;
  // What the process itself takes is not available for points.
  counter.most_allowed = (memory - std::min(memory, WorkingSpace::of_process)) / bytes_of_point;
  const auto counted_all = generate(description, options.generation, counter);
  const bool stopped = !counted_all && counted_all.error().code == ErrorCode::memory_bound;
  if (!counted_all && !stopped) return counted_all;
  if (counter.most_alive <= counter.most_allowed) return {};
  const uint64_t least = WorkingSpace::of_process + counter.most_alive * bytes_of_point;
  return failure(ErrorCode::memory_bound,
                 fmt::format("{0}: {3}{1} points are in use at once: {3}{2} MiB of memory are the least that "
                             "will do",
                             input_name(options.input), counter.most_alive, (least >> 20) + 1,
                             stopped ? "more than " : ""));
}

Result<int> write_stream(const GenerateOptions& options, const BlockDescription& description) {
  TOOL_CHECK(check_points_in_use(options, description));
  const auto file = TOOL_TRY(open_output({options.output, options.input, options.force, true}));
  CountingSink sink(*file);
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  const StreamReport report = TOOL_TRY(generate_stream(description, options, sink, progress));
  progress.clear();
  if (options.common.json) {
    TOOL_CHECK(answer(dump({{"points", report.points},
                            {"cells", report.cells},
                            {"most_points_in_use", report.most_live_points},
                            {"output", options.output},
                            {"output_bytes", sink.count()}})));
  } else if (!options.common.quiet) {
    say(fmt::format("{} -> {}: {}, {}, patches as labels of array \"patch\"; at most {} in use; {}",
                    input_name(options.input), output_name(options.output), counted(report.points, "point"),
                    counted(report.cells, "cell") + " and outer faces",
                    counted(report.most_live_points, "point"),
                    human_bytes(static_cast<double>(sink.count()))));
  }
  return 0;
}

Result<int> write_pieces(const GenerateOptions& options, const BlockDescription& description) {
  const auto file = TOOL_TRY(open_output({options.output, options.input, options.force, true}));
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  const EncodeReport report = TOOL_TRY(generate_pieces(description, options, *file, progress));
  progress.clear();
  if (options.common.json) {
    TOOL_CHECK(answer(dump({{"points", report.points},
                            {"cells", report.cells},
                            {"output", options.output},
                            {"output_bytes", report.file_bytes}})));
  } else if (!options.common.quiet) {
    say(fmt::format("{} -> {}: {}, {} and outer faces, patches as labels of array \"patch\"; {}",
                    input_name(options.input), output_name(options.output), counted(report.points, "point"),
                    counted(report.cells, "cell"), human_bytes(static_cast<double>(report.file_bytes))));
  }
  return 0;
}

Result<int> written(const GenerateOptions& options, const GeneratedCounts& counts, uint64_t bytes) {
  if (options.common.json) {
    Json json = counts.json();
    json["output"] = options.output;
    json["output_bytes"] = bytes;
    TOOL_CHECK(answer(dump(json)));
  } else if (!options.common.quiet) {
    say(fmt::format("{} -> {}: {}; {}", input_name(options.input), output_name(options.output), counts.text(),
                    human_bytes(static_cast<double>(bytes))));
  }
  return 0;
}

Result<int> write(const GenerateOptions& options, const BlockDescription& description) {
  const std::string format =
      TOOL_TRY(output_format(options.output, options.output_format, options.output == "-" ? "maille" : ""));
  if (cells_of_piece(options.pieces)) {
    if (format == "maille") return write_pieces(options, description);
    return failure(ErrorCode::usage, fmt::format("{}: only .maille files are in pieces", options.output));
  }
  const bool many = cells_of(description, options.generation.refine) > most_cells_in_memory;
  if (format == "maille" && (many || options.output == "-")) return write_stream(options, description);
  // In parts outer faces come in the order of the sweep; those of a small polyMesh are to be blockMesh's.
  if (format != "maille" && (many || !is_folder_format(format))) {
    const auto parts = TOOL_TRY(generate_in_parts(description, options, format));
    if (parts) return written(options, parts->counts, parts->output_bytes);
  }
  const auto file = TOOL_TRY(open_output(
      {options.output, options.input, options.force, is_binary(format, false), is_folder_format(format)}));
  CountingSink sink(*file);
  const Stopwatch step;
  const Mesh mesh = TOOL_TRY(generate_mesh(description, options.generation, {options.common.memory}));
  step.done(options.common.verbose, "generating");
  if (format == "maille") {
    TOOL_CHECK(encode_mesh(mesh, sink, options));
  } else {
    const auto notes = TOOL_TRY(write_mesh(mesh, sink, {.format = format}));
    TOOL_CHECK(sink.commit());
    say_notes(output_name(options.output), notes, options.common.quiet);
  }
  return written(options, GeneratedCounts::of(mesh), sink.count());
}

/// A mesh in the place of a dictionary breaks rules that mean nothing to whoever named it.
Error about_dictionary(const GenerateOptions& options, Error error) {
  if (error.code != ErrorCode::malformed_input || options.input == "-") return error;
  const auto input = open_input(options.input);
  if (!input) return error;
  const auto format = format_of(*input->source);
  // A dictionary is recognised as one of OpenFOAM's own files, and what is wrong in it is the answer.
  if (!format || *format == "polymesh") return error;
  return {ErrorCode::usage, fmt::format("{}: this is a file of format {}; generate takes a blockMeshDict of "
                                        "OpenFOAM",
                                        options.input, *format)};
}

Result<BlockDictionary> read_input(const GenerateOptions& options) {
  const Limits limits{options.common.memory};
  if (options.input != "-") return read_block_dictionary(options.input, limits);
  const Input input = TOOL_TRY(open_input(options.input));
  return read_block_dictionary(*input.source, limits);
}

}  // namespace

Result<int> run(const GenerateOptions& options) {
  if (options.count != options.output.empty()) {
    return failure(ErrorCode::usage, options.count ? "--count writes nothing; leave OUT away"
                                                   : "name a file to write, or give --count");
  }
  TOOL_CHECK(check_json_output(options.common, options.output));
  auto read = read_input(options);
  if (!read) return tl::unexpected(about_dictionary(options, std::move(read).error()));
  const BlockDictionary blocks = *std::move(read);
  say_notes(input_name(options.input), blocks.notes, options.common.quiet);
  auto result = options.count ? count(options, blocks.description) : write(options, blocks.description);
  // Generating happens after reading, so the library no longer knows the name of the dictionary.
  const bool about_input = !result && (result.error().code == ErrorCode::malformed_input ||
                                       result.error().code == ErrorCode::unsupported);
  if (about_input)
    return failure(result.error().code, input_name(options.input) + ": " + result.error().message);
  return result;
}

}  // namespace maille::tool
