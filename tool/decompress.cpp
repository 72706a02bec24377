#include <fmt/format.h>
#include <fmt/ranges.h>
#include <maille/decode.h>
#include <maille/file.h>
#include <maille/io.h>

#include <algorithm>
#include "files.h"
#include "in_parts.h"
#include "result.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

std::string output_of(const DecompressOptions& options) {
  if (!options.output.empty()) return options.output;
  if (options.input == "-") return "-";
  // Whatever is wrong with the input is said when it is opened.
  bool stream = false;
  if (const auto input = open_maille(options.input)) {
    const auto info = inspect(*input->source);
    stream = info && info->mode == Mode::stream;
  }
  return with_extension(options.input, stream ? ".vtu" : ".ply");
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

Result<> check_arrays(const Source& source, const std::vector<std::string>& wanted) {
  const FileInfo info = TOOL_TRY(inspect(source));
  for (const std::string& name : wanted) {
    const bool found = std::any_of(info.arrays.begin(), info.arrays.end(),
                                   [&](const ArrayInfo& a) { return a.name == name; });
    if (found) continue;
    std::vector<std::string> known;
    for (const ArrayInfo& array : info.arrays) known.push_back(array.name);
    return failure(ErrorCode::usage, fmt::format("{}: has no array '{}'; it has: {}", source.name(), name,
                                                 known.empty() ? "positions and faces only"
                                                               : fmt::format("{}", fmt::join(known, ", "))));
  }
  return {};
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
                  counted(done.points, "point"), cells_text(done.cells, cell_word),
                  human_bytes(static_cast<double>(done.input_bytes)),
                  human_bytes(static_cast<double>(done.output_bytes)), seconds));
  return {};
}

}  // namespace

Result<int> run(const DecompressOptions& options) {
  const Stopwatch whole;
  const std::string output = output_of(options);
  if (options.common.json && output == "-") {
    return failure(ErrorCode::usage,
                   "--json and the output '-' both want standard output; name an output file");
  }
  const std::string format = TOOL_TRY(format_to_write(options, output));
  std::unique_ptr<Source> spooled;
  if (can_write_in_parts(format, output, options.ascii)) {
    auto source = TOOL_TRY(open_for_parts(options.input, output));
    DecodeOptions wanted;
    wanted.arrays = options.arrays;
    if (const auto mesh = describe(*source, wanted)) {
      if (options.arrays) TOOL_CHECK(check_arrays(*source, *options.arrays));
      if (const auto done = TOOL_TRY(decompress_in_parts(options, *source, *mesh, output, format))) {
        TOOL_CHECK(report(options, output, *done, "cell", whole.seconds()));
        return 0;
      }
    }
    // To be written whole, of another mode, or damaged: the usual way tells which.
    if (options.input == "-") spooled = std::move(source);
  }
  const Input input =
      spooled ? make_input(std::move(spooled), options.input) : TOOL_TRY(open_maille(options.input));
  if (options.arrays) TOOL_CHECK(check_arrays(*input.source, *options.arrays));
  const auto file =
      TOOL_TRY(open_output({output, options.input, options.force, is_binary(format, options.ascii)}));

  CountingSink sink(*file);
  Mesh mesh;
  std::vector<std::string> notes;
  {
    ProgressDisplay progress(options.common.progress, options.common.quiet);
    const Threads threads(options.common.threads);
    const DecodeOptions decoding{.limits = {.mesh_bytes = options.common.memory},
                                 .arrays = options.arrays,
                                 .executor = threads.executor(),
                                 .progress = progress.watch(static_cast<double>(input.source->size()), "B")};
    const Stopwatch step;
    mesh = TOOL_TRY(decode(*input.source, decoding));
    progress.clear();
    step.done(options.common.verbose, "decompressing");
    const Stopwatch writing;
    notes = TOOL_TRY(write_mesh(mesh, sink, {.format = format, .ascii = options.ascii}));
    TOOL_CHECK(sink.commit());
    writing.done(options.common.verbose, "writing");
  }
  say_notes(output_name(output), notes, options.common.quiet);
  const PartsWritten done = {mesh.point_count(), mesh.cell_count(), input.source->size(), sink.count()};
  TOOL_CHECK(report(options, output, done, has_solids(mesh) ? "cell" : "face", whole.seconds()));
  return 0;
}

}  // namespace maille::tool
