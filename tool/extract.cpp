#include <fmt/format.h>
#include <maille/decode.h>
#include <maille/random_access.h>

#include <algorithm>

#include "extract_volume.h"
#include "part_output.h"
#include "result.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

/// A screen of 1080 rows and a vertical field of view of 60 degrees: pixels / (2 tan 30 degrees).
std::optional<View> view_of(const ExtractOptions& options) {
  if (options.eye.empty()) return std::nullopt;
  constexpr double pixels_per_radian = 1080 / (2 * 0.57735026918962576);  // 60 degrees
  return View{{{options.eye[0], options.eye[1], options.eye[2]}}, pixels_per_radian, options.pixel_error};
}

Result<Selection> choose(File& file, const Region& region, const ExtractOptions& options) {
  const std::optional<View> view = view_of(options);
  if (options.triangles) return file.select(region, *options.triangles, view);
  Detail detail = Detail::full();
  if (options.error || options.level || view) detail = {};
  detail.view = view;
  if (options.error) detail.bound = *options.error;
  if (options.level) {
    if (*options.level >= file.levels()) {
      return failure(ErrorCode::usage,
                     fmt::format("--level {}: the coarsest level is {}", *options.level, file.levels() - 1));
    }
    detail.level = *options.level;
  }
  return file.select(region, detail);
}

/// Which chart each cell is of: in each block come those of chart after chart.
Result<> add_chart_numbers(File& file, const Selection& selection, Mesh& mesh) {
  // Joined blocks hold the cells of chart after chart, so counts by block and chart are enough to number
  // them. Each chart is decoded once more for its counts.
  std::vector<std::vector<uint64_t>> cells(mesh.blocks.size());
  for (const ChartPlace& place : selection.charts) {
    const Mesh chart = TOOL_TRY(file.read(place));
    std::vector<uint64_t> in_block(cells.size());
    for (size_t b = 0; b < chart.blocks.size(); ++b)
      in_block[std::min(b, cells.size() - 1)] += chart.blocks[b].size();
    for (size_t b = 0; b < cells.size(); ++b) cells[b].push_back(in_block[b]);
  }
  Array numbers = make_array("chart", Domain::cell, Scalar::u32, 1, Role::label);
  numbers.resize(mesh.cell_count());
  size_t cell = 0;
  for (const std::vector<uint64_t>& block : cells) {
    for (uint32_t chart = 0; chart < block.size(); ++chart) {
      for (uint64_t i = 0; i < block[chart] && cell < mesh.cell_count(); ++i)
        numbers.values<uint32_t>()[cell++] = chart;
    }
  }
  mesh.arrays.push_back(std::move(numbers));
  return {};
}

/// Raises the limit of what may be fetched by the size of the charts that were asked for: the limit guards
/// against surprises, and the user has chosen these.
Result<> allow(File& file, const Selection& selection, const Input& input) {
  if (input.remote == nullptr) return {};
  uint64_t bytes = 0;
  for (const ChartPlace& place : selection.charts) bytes += TOOL_TRY(file.info(place)).bytes;
  input.remote->allow(bytes);
  return {};
}

Result<> report(const ExtractOptions& options, const Input& input, const Selection& selection,
                const Mesh& mesh, size_t damaged, double seconds) {
  if (options.common.json) {
    Json json = {{"input", input_name(options.input)}, {"output", options.output},
                 {"charts", selection.charts.size()},  {"faces_read", selection.faces},
                 {"damaged_charts", damaged},          {"points", mesh.point_count()},
                 {"cells", mesh.cell_count()},         {"seconds", seconds}};
    add_fetched(input, json);
    return answer(dump(json));
  }
  if (options.common.quiet) return {};
  say(fmt::format("{} -> {}: {}, {}, of {}, {:.2f} s", input_name(options.input), output_name(options.output),
                  counted(mesh.point_count(), "point"), counted(mesh.cell_count(), cell_word(mesh)),
                  counted(selection.charts.size(), "chart"), seconds));
  say_fetched(input);
  return {};
}

/// What was asked for, and what was read for it.
struct Extracted {
  Mesh mesh;
  Selection selection;
  std::vector<std::string> problems;
};

bool is_of_everything(const ExtractOptions& options) {
  return options.box.empty() && options.sphere.empty() && !options.error && !options.level &&
         !options.triangles && options.eye.empty() && !options.chart_numbers;
}

Result<Extracted> extract_region(File& file, const ExtractOptions& options, const Input& input,
                                 const DecodeOptions& decoding) {
  const Region region = TOOL_TRY(region_of(options));
  Extracted extracted;
  extracted.selection = TOOL_TRY(choose(file, region, options));
  TOOL_CHECK(allow(file, extracted.selection, input));
  if (is_of_everything(options)) {
    // In the input's order, if the file has it: parts know none.
    auto mesh = decode(*input.source, decoding);
    if (mesh) {
      extracted.mesh = std::move(*mesh);
      return extracted;
    }
    if (mesh.error().code != ErrorCode::corrupt) return tl::unexpected(std::move(mesh).error());
  }
  if (extracted.selection.charts.empty()) {
    return failure(ErrorCode::usage,
                   fmt::format("{}: nothing of the mesh lies there", input_name(options.input)));
  }
  extracted.mesh = TOOL_TRY(file.salvage(extracted.selection, extracted.problems));
  if (options.chart_numbers && extracted.problems.empty())
    TOOL_CHECK(add_chart_numbers(file, extracted.selection, extracted.mesh));
  if (!options.whole_charts) extracted.mesh = clip(extracted.mesh, region);
  return extracted;
}

/// Everything connected with the surface point nearest to a place.
Result<Extracted> extract_component(File& file, const ExtractOptions& options) {
  const std::vector<double>& near = options.component;
  const auto start = TOOL_TRY(file.nearest({{near[0], near[1], near[2]}}));
  if (!start) return failure(ErrorCode::usage, fmt::format("{}: has no faces", input_name(options.input)));
  const Component component = TOOL_TRY(file.component(start->chart, start->corners[0]));
  Extracted extracted;
  for (const Component::Part& part : component.parts) {
    extracted.selection.charts.push_back(part.chart);
    extracted.selection.faces += TOOL_TRY(file.info(part.chart)).faces;
  }
  extracted.mesh = TOOL_TRY(file.extract(component));
  return extracted;
}

Array empty_like(const Array& array) {
  Array empty = make_array(array.name, array.domain, array.type, array.components, array.role);
  empty.labels = array.labels;
  return empty;
}
void append_tuple(Array& to, const Array& from, uint64_t tuple) {
  const auto size = static_cast<ptrdiff_t>(from.tuple_size());
  const auto begin = from.bytes.begin() + static_cast<ptrdiff_t>(tuple) * size;
  to.bytes.insert(to.bytes.end(), begin, begin + size);
}

/// A point of a chart, with its arrays.
void append_point(Mesh& mesh, const Mesh& chart, uint32_t point) {
  if (mesh.point_count() == 0) {
    mesh.points = empty_like(chart.points);
    mesh.arrays.clear();
    for (const Array& array : chart.arrays) {
      if (array.domain == Domain::point) mesh.arrays.push_back(empty_like(array));
    }
  }
  append_tuple(mesh.points, chart.points, point);
  for (Array& array : mesh.arrays) append_tuple(array, *chart.find(array.name, Domain::point), point);
}

/// Points with their arrays, and how far each is.
Result<Extracted> extract_nearest(File& file, const ExtractOptions& options) {
  const std::vector<double>& near = options.nearest;
  const auto points = TOOL_TRY(file.nearest_points({{near[0], near[1], near[2]}}, options.count));
  Extracted extracted;
  Mesh& mesh = extracted.mesh;
  std::vector<ChartPlace>& places = extracted.selection.charts;
  std::vector<Mesh> charts;
  Array distance = make_array("distance", Domain::point, Scalar::f64, 1);
  distance.resize(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    // Nearest points lie in few charts, so a list is searched; each chart is read once.
    const auto known = std::find(places.begin(), places.end(), points[i].chart);
    const auto number = static_cast<size_t>(known - places.begin());
    if (known == places.end()) {
      places.push_back(points[i].chart);
      charts.push_back(TOOL_TRY(file.read(points[i].chart)));
      extracted.selection.faces += charts.back().cell_count();
    }
    append_point(mesh, charts[number], points[i].point);
    distance.values<double>()[i] = points[i].distance;
  }
  // A mesh may have such an array of its own; that one stays.
  if (mesh.find(distance.name, Domain::point) == nullptr) mesh.arrays.push_back(std::move(distance));
  return extracted;
}

}  // namespace

Result<int> run(const ExtractOptions& options) {
  const Stopwatch whole;
  TOOL_CHECK(check_json_output(options.common, options.output));
  const std::string format = TOOL_TRY(part_format(options, "extract"));
  const Input input = TOOL_TRY(open_maille(options.input, options.fetch_limit));
  if (TOOL_TRY(mode_of(*input.source)) == Mode::stream) return extract_volume(options, input, format);
  TOOL_CHECK(check_no_volume_options(options));
  const Threads threads(options.common.threads);
  DecodeOptions decoding;
  decoding.limits.mesh_bytes = options.common.memory;
  decoding.executor = threads.executor();
  File file = TOOL_TRY(File::open(*input.source, decoding));
  const Extracted extracted =
      TOOL_TRY(!options.nearest.empty()     ? extract_nearest(file, options)
               : !options.component.empty() ? extract_component(file, options)
                                            : extract_region(file, options, input, decoding));
  const auto& [mesh, selection, problems] = extracted;
  TOOL_CHECK(write_part(mesh, options.input, options, format, options.common));
  for (const std::string& problem : problems) complain(problem);
  TOOL_CHECK(report(options, input, selection, mesh, problems.size(), whole.seconds()));
  return problems.empty() ? 0 : static_cast<int>(ErrorCode::corrupt);
}

}  // namespace maille::tool
