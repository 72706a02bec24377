#include <fmt/format.h>
#include <maille/encode.h>
#include <maille/io.h>

#include "files.h"
#include "gltf.h"
#include "in_parts.h"
#include "result.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

// Lossless and at the default effort; compress has the choices. The input's order is kept, as by any other
// conversion.
Result<> write_maille(const Mesh& mesh, Sink& sink, const CommonOptions& common, ProgressDisplay& progress) {
  const Threads threads(common.threads);
  EncodeOptions options;
  options.mode = usual_mode(mesh);
  options.order = Order::keep;
  options.executor = threads.executor();
  options.progress =
      progress.watch(static_cast<double>(mesh.cell_count()), std::string(cell_word(mesh)) + "s");
  TOOL_CHECK(encode(mesh, sink, options));
  return {};
}

Result<> report(const ConvertOptions& options, const Mesh& mesh, uint64_t before, uint64_t after,
                const std::vector<std::string>& notes) {
  if (options.common.json) {
    return answer(dump({{"input", input_name(options.input)},
                        {"output", options.output},
                        {"input_bytes", before},
                        {"output_bytes", after},
                        {"points", mesh.point_count()},
                        {"cells", mesh.cell_count()},
                        {"notes", notes}}));
  }
  if (options.common.quiet) return {};
  say(fmt::format("{} -> {}: {}, {}; {} -> {}", input_name(options.input), output_name(options.output),
                  counted(mesh.point_count(), "point"), counted(mesh.cell_count(), cell_word(mesh)),
                  human_bytes(static_cast<double>(before)), human_bytes(static_cast<double>(after))));
  return {};
}

}  // namespace

Result<int> run(const ConvertOptions& options) {
  TOOL_CHECK(check_json_output(options.common, options.output));
  const std::string format = TOOL_TRY(output_format(options.output, options.output_format, ""));
  const Input input = TOOL_TRY(open_input(options.input, options.input_format));
  const auto file = TOOL_TRY(open_output({options.output, options.input, options.force,
                                          is_binary(format, options.ascii), is_folder_format(format)}));

  // encode() and write_mesh() commit differently: the one by itself, the other leaves it to the caller.
  CountingSink sink(*file);
  LoadedMesh loaded;
  std::vector<std::string> notes;
  {
    ProgressDisplay progress(options.common.progress, options.common.quiet);
    loaded = TOOL_TRY(load(input, options.common, progress));
    if (format == "maille") {
      TOOL_CHECK(write_maille(loaded.mesh, sink, options.common, progress));
    } else {
      TOOL_CHECK(show_scene(loaded.mesh, format, options.as_stored, notes));
      const auto more = TOOL_TRY(write_mesh(loaded.mesh, sink, {.format = format, .ascii = options.ascii}));
      notes.insert(notes.end(), more.begin(), more.end());
      TOOL_CHECK(sink.commit());
    }
  }
  if (input.is_maille)
    say_notes(input_name(options.input),
              notes_of_steps(TOOL_TRY(inspect(*input.source, {options.common.memory}))),
              options.common.quiet);
  say_notes(output_name(options.output), notes, options.common.quiet);
  TOOL_CHECK(report(options, loaded.mesh, bytes_of_input(input, loaded.files_beside), sink.count(), notes));
  return 0;
}

}  // namespace maille::tool
