#include <fmt/format.h>
#include <maille/io.h>
#include <maille/slice.h>

#include "result.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"
#include "volume_cells.h"

namespace maille::tool {

Result<int> run(const SliceOptions& options) {
  const Stopwatch whole;
  if (options.common.json && options.output == "-") {
    return failure(ErrorCode::usage,
                   "--json and the output '-' both want standard output; name an output file");
  }
  const bool named = options.output != "-" && options.output.rfind("/dev/", 0) != 0;
  const std::string format =
      TOOL_TRY(output_format(options.output, options.output_format, named ? "" : "ply"));
  if (format == "maille") {
    return failure(ErrorCode::usage,
                   fmt::format("{}: slice writes other formats; `maille compress` makes .maille of them",
                               options.output));
  }
  VolumeQuery query;
  query.plane = TOOL_TRY(plane_of(options.plane));
  const VolumeRequest request = {options.input, options.input_format, options.fetch_limit, options.arrays,
                                 options.step};
  const Mesh sliced = slice(TOOL_TRY(read_cells(request, query, options.common)), *query.plane);
  if (sliced.cell_count() == 0) {
    return failure(ErrorCode::usage,
                   fmt::format("{}: the plane passes no solid of the mesh", input_name(options.input)));
  }
  const auto output = TOOL_TRY(open_output({options.output, options.input, options.force,
                                            is_binary(format, options.ascii), is_folder_format(format)}));
  const std::vector<std::string> notes =
      TOOL_TRY(write_mesh(sliced, *output, {.format = format, .ascii = options.ascii}));
  TOOL_CHECK(output->commit());
  say_notes(output_name(options.output), notes, options.common.quiet);
  if (options.common.json) {
    TOOL_CHECK(answer(dump({{"input", input_name(options.input)},
                            {"output", options.output},
                            {"points", sliced.point_count()},
                            {"polygons", sliced.cell_count()},
                            {"seconds", whole.seconds()}})));
  } else if (!options.common.quiet) {
    say(fmt::format("{} -> {}: {}, {}, {:.2f} s", input_name(options.input), output_name(options.output),
                    counted(sliced.point_count(), "point"), counted(sliced.cell_count(), "polygon"),
                    whole.seconds()));
  }
  return 0;
}

}  // namespace maille::tool
