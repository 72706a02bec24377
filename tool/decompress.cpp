#include <fmt/format.h>
#include <fmt/ranges.h>
#include <maille/decode.h>
#include <maille/file.h>
#include <maille/io.h>

#include <algorithm>
#include "files.h"
#include "result.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

// Beside the input; where no format was asked for, in one that holds everything: VTU for cells of all kinds,
// else PLY.
Result<std::string> name_beside(const Input& input, const std::string& format) {
  if (!format.empty()) return with_extension(input.path, "." + format);
  const FileInfo info = TOOL_TRY(inspect(*input.source));
  return with_extension(input.path, info.mode == Mode::stream ? ".vtu" : ".ply");
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

Result<> report(const DecompressOptions& options, const std::string& output, const Mesh& mesh,
                uint64_t before, uint64_t after, double seconds) {
  if (options.common.json) {
    return answer(dump({{"input", input_name(options.input)},
                        {"output", output},
                        {"input_bytes", before},
                        {"output_bytes", after},
                        {"points", mesh.point_count()},
                        {"cells", mesh.cell_count()},
                        {"seconds", seconds}}));
  }
  if (options.common.quiet) return {};
  say(fmt::format("{} -> {}: {}, {}; {} -> {}, {:.2f} s", input_name(options.input), output_name(output),
                  counted(mesh.point_count(), "point"), counted(mesh.cell_count(), cell_word(mesh)),
                  human_bytes(static_cast<double>(before)), human_bytes(static_cast<double>(after)),
                  seconds));
  return {};
}

}  // namespace

Result<int> run(const DecompressOptions& options) {
  const Stopwatch whole;
  std::string output = options.output.empty() && options.input == "-" ? "-" : options.output;
  if (options.common.json && output == "-") {
    return failure(ErrorCode::usage,
                   "--json and the output '-' both want standard output; name an output file");
  }
  // Before the input is opened: a pipe may take its time.
  if (!output.empty()) TOOL_CHECK(format_to_write(options, output));
  const Input input = TOOL_TRY(open_maille(options.input));
  if (output.empty()) output = TOOL_TRY(name_beside(input, options.output_format));
  const std::string format = TOOL_TRY(format_to_write(options, output));
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
  TOOL_CHECK(report(options, output, mesh, input.source->size(), sink.count(), whole.seconds()));
  return 0;
}

}  // namespace maille::tool
