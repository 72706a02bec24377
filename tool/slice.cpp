#include <fmt/format.h>
#include <maille/encode.h>
#include <maille/slice.h>

#include "part_output.h"
#include "result.h"
#include "text.h"
#include "verbs.h"
#include "volume_cells.h"

namespace maille::tool {

Result<int> run(const SliceOptions& options) {
  const Stopwatch whole;
  TOOL_CHECK(check_json_output(options.common, options.output));
  const std::string format = TOOL_TRY(part_format(options, "slice"));
  VolumeQuery query;
  query.plane = TOOL_TRY(plane_of(options.plane));
  VolumeInput input = TOOL_TRY(VolumeInput::open(options));
  const Mesh& mesh = *TOOL_TRY(input.cells(query));
  const Mesh sliced = slice(mesh, *query.plane);
  if (sliced.cell_count() == 0) {
    const bool surface = mesh.cell_count() > 0 && usual_mode(mesh) != Mode::stream;
    return failure(ErrorCode::usage,
                   fmt::format("{}: {}", input_name(options.input),
                               surface ? "has no volume cells to be cut; slice is for volumes"
                                       : "the plane passes no solid of the mesh"));
  }
  TOOL_CHECK(write_part(sliced, options.input, options, format, options.common));
  if (options.common.json) {
    Json json = {{"input", input_name(options.input)},
                 {"output", options.output},
                 {"points", sliced.point_count()},
                 {"polygons", sliced.cell_count()},
                 {"seconds", whole.seconds()}};
    add_fetched(input.input(), json);
    TOOL_CHECK(answer(dump(json)));
    return 0;
  }
  if (options.common.quiet) return 0;
  say(fmt::format("{} -> {}: {}, {}, {:.2f} s", input_name(options.input), output_name(options.output),
                  counted(sliced.point_count(), "point"), counted(sliced.cell_count(), "polygon"),
                  whole.seconds()));
  say_fetched(input.input());
  return 0;
}

}  // namespace maille::tool
