#include <fmt/format.h>
#include <maille/encode.h>
#include <maille/generate.h>
#include <maille/io.h>
#include <maille/out_of_core.h>

#include <algorithm>

#include "files.h"
#include "generate_stream.h"
#include "in_parts.h"
#include "memory.h"
#include "result.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

/// Lets a mesh come by and counts it.
class Counter final : public GeneratedOutput {
 public:
  Result<> begin(const GeneratedSize& size) override {
    patches.resize(size.patches.size());
    for (size_t i = 0; i < patches.size(); ++i) patches[i] = {size.patches[i].name, size.patches[i].type, 0};
    too_long_ = size.cells > most_counted;
    return {};
  }
  Result<> points(uint64_t, std::span<const double> coordinates) override {
    point_count += coordinates.size() / 3;
    alive_ += coordinates.size() / 3;
    most_alive = std::max(most_alive, alive_);
    if (too_long_ && alive_ > most_allowed) return failure(ErrorCode::memory_bound, "");
    return {};
  }
  Result<> faces(uint32_t patch, CellType type, std::span<const uint64_t> nodes) override {
    patches[patch].faces += nodes.size() / nodes_of(type);
    return {};
  }
  Result<> cells(uint32_t, CellType type, std::span<const uint64_t> nodes,
                 std::span<const uint8_t> last_use) override {
    add(type, nodes.size() / nodes_of(type));
    for (const uint8_t last : last_use) alive_ -= last;
    return {};
  }

  void add(CellType type, uint64_t count) {
    const auto known =
        std::find_if(types.begin(), types.end(), [&](const auto& entry) { return entry.first == type; });
    if (known == types.end()) {
      types.emplace_back(type, count);
    } else {
      known->second += count;
    }
    cell_count += count;
  }

  struct Patch {
    std::string name;
    std::string type;
    uint64_t faces = 0;
  };
  uint64_t point_count = 0;
  uint64_t cell_count = 0;
  uint64_t most_alive = 0;  ///< points that are still needed, at any time
  /// Where more are needed, counting a mesh that takes long ends with memory_bound.
  uint64_t most_allowed = ~uint64_t{0};
  std::vector<std::pair<CellType, uint64_t>> types;
  std::vector<Patch> patches;

 private:
  static constexpr uint64_t most_counted = 1'000'000'000;  ///< cells: about a minute
  uint64_t alive_ = 0;
  bool too_long_ = false;
};

// The same counts of a mesh in memory. The order of patches is that of the metadata.
Counter counted_mesh(const Mesh& mesh) {
  Counter counter;
  counter.point_count = mesh.point_count();
  for (const auto& [key, type] : mesh.metadata) counter.patches.push_back({key.substr(6), type, 0});
  for (const CellBlock& block : mesh.blocks) {
    const CellType first = block.types.empty() ? block.type : static_cast<CellType>(block.types[0]);
    const bool volume = dimension_of(first) == 3;
    if (!volume) {
      for (auto& patch : counter.patches) patch.faces += patch.name == block.name ? block.size() : 0;
    } else if (block.types.empty()) {
      counter.add(block.type, block.size());
    } else {
      for (const uint8_t type : block.types) counter.add(static_cast<CellType>(type), 1);
    }
  }
  return counter;
}

Json json_of(const Counter& counter) {
  Json patches = Json::array();
  for (const Counter::Patch& patch : counter.patches) {
    patches.push_back({{"name", patch.name}, {"type", patch.type}, {"faces", patch.faces}});
  }
  Json types = Json::object();
  for (const auto& [type, count] : counter.types) types[maille::name_of(type)] = count;
  return {{"points", counter.point_count},
          {"cells", counter.cell_count},
          {"cell_types", types},
          {"patches", patches}};
}

std::string cell_text(CellType type, uint64_t count) {
  std::string name = maille::name_of(type);
  const size_t greek = name.rfind("hedron");
  if (count != 1) name = greek == std::string::npos ? name + "s" : name.substr(0, greek) + "hedra";
  return fmt::format("{} {}", count, name);
}

std::string text_of(const Counter& counter) {
  std::string text = counted(counter.point_count, "point");
  for (const auto& [type, count] : counter.types) text += ", " + cell_text(type, count);
  uint64_t faces = 0;
  for (const Counter::Patch& patch : counter.patches) faces += patch.faces;
  return text + fmt::format("; {} in {}", counted(faces, "outer face"),
                            counter.patches.size() == 1 ? "1 patch"
                                                        : fmt::format("{} patches", counter.patches.size()));
}

Result<int> count(const GenerateOptions& options, const BlockDescription& description) {
  const Stopwatch step;
  Counter counter;
  TOOL_CHECK(generate(description, options.generation, counter));
  step.done(options.common.verbose, "generating");
  if (options.common.json) {
    Json json = json_of(counter);
    json["most_points_in_use"] = counter.most_alive;
    TOOL_CHECK(answer(dump(json)));
    return 0;
  }
  TOOL_CHECK(answer(text_of(counter) + "\n"));
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

/// Above, a mesh is written as it comes: so many take 32 MB in memory.
constexpr uint64_t most_cells_in_memory = 250'000;

uint64_t cells_of(const BlockDescription& description, uint64_t refine) {
  uint64_t cells = 0;
  for (const HexBlock& block : description.blocks)
    cells += refine * block.divisions[0] * refine * block.divisions[1] * refine * block.divisions[2];
  return cells;
}

/// The most points in use at once decide; counting takes a tenth of the time of writing.
Result<> check_points_in_use(const GenerateOptions& options, const BlockDescription& description) {
  // A point in use and the cells around it: 350 at most, in kept order of many blocks.
  constexpr uint64_t bytes_of_point = 352;
  const uint64_t memory = options.common.memory;
  if (memory == default_memory()) return {};
  Counter counter;
  counter.most_allowed = (memory - std::min(memory, WorkingSpace::of_process)) / bytes_of_point;
  const auto counted_all = generate(description, options.generation, counter);
  const bool stopped = !counted_all && counted_all.error().code == ErrorCode::memory_bound;
  if (!counted_all && !stopped) return counted_all;
  if (counter.most_alive <= counter.most_allowed) return {};
  const uint64_t least = WorkingSpace::of_process + counter.most_alive * bytes_of_point;
  return failure(
      ErrorCode::memory_bound,
      fmt::format("{0}: {3}{1} points are in use at once: {3}{2} MiB of memory are the least that "
                  "will do",
                  options.input, counter.most_alive, (least >> 20) + 1, stopped ? "more than " : ""));
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
                    options.input, output_name(options.output), counted(report.points, "point"),
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
                    options.input, output_name(options.output), counted(report.points, "point"),
                    counted(report.cells, "cell"), human_bytes(static_cast<double>(report.file_bytes))));
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
  const Counter counter = counted_mesh(mesh);
  if (options.common.json) {
    Json json = json_of(counter);
    json["output"] = options.output;
    json["output_bytes"] = sink.count();
    TOOL_CHECK(answer(dump(json)));
  } else if (!options.common.quiet) {
    say(fmt::format("{} -> {}: {}; {}", options.input, output_name(options.output), text_of(counter),
                    human_bytes(static_cast<double>(sink.count()))));
  }
  return 0;
}

}  // namespace

Result<int> run(const GenerateOptions& options) {
  if (options.count != options.output.empty()) {
    return failure(ErrorCode::usage, options.count ? "--count writes nothing; leave OUT away"
                                                   : "name a file to write, or give --count");
  }
  TOOL_CHECK(check_json_output(options.common, options.output));
  const BlockDictionary blocks = TOOL_TRY(read_block_dictionary(options.input));
  say_notes(options.input, blocks.notes, options.common.quiet);
  auto result = options.count ? count(options, blocks.description) : write(options, blocks.description);
  const bool about_input = !result && (result.error().code == ErrorCode::malformed_input ||
                                       result.error().code == ErrorCode::unsupported);
  if (about_input) return failure(result.error().code, options.input + ": " + result.error().message);
  return result;
}

}  // namespace maille::tool
