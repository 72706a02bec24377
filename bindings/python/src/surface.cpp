// Files of mode random, in parts.
#include <maille/random_access.h>

#include <cmath>

#include "codec.h"
#include "handle.h"
#include "mesh.h"
#include "regions.h"

namespace maille::python {

namespace {

using SurfaceFile = Handle<File>;
using Place = std::pair<uint32_t, uint32_t>;  ///< group and chart
/// bound, view error, level; eye, pixels per radian and pixels of a view: None where nothing is said.
using GivenView = std::optional<std::tuple<Triple, double, double>>;
using GivenDetail =
    std::tuple<std::optional<double>, std::optional<double>, std::optional<uint32_t>, GivenView>;

std::optional<View> view_of(const GivenView& given) {
  if (!given) return std::nullopt;
  const auto& [eye, pixels_per_radian, pixels] = *given;
  return View{Vector3{eye}, pixels_per_radian, pixels};
}

/// Where nothing is said: the mesh itself.
Detail detail_of(const GivenDetail& given) {
  const auto& [bound, view_error, level, view] = given;
  if (!bound && !view_error && !level && !view) return Detail::full();
  Detail detail;
  if (bound) detail.bound = *bound;
  if (view_error) detail.view_error = *view_error;
  if (level) detail.level = *level;
  detail.view = view_of(view);
  return detail;
}

Selection selection_of(const std::vector<Place>& places) {
  Selection selection;
  for (const auto& [group, chart] : places) selection.charts.push_back({group, chart});
  return selection;
}

std::unique_ptr<SurfaceFile> open_surface(const py::object& input,
                                          std::optional<std::vector<std::string>> arrays, uint64_t memory) {
  auto opened = std::make_unique<SurfaceFile>(input);
  DecodeOptions options;
  options.limits.mesh_bytes = memory;
  options.arrays = std::move(arrays);
  options.executor = executor();
  opened->set(run(opened->input(), py::none(),
                  [&](const Progress&) { return File::open(opened->input().source(), options); }));
  return opened;
}

std::pair<std::vector<Place>, uint64_t> select(SurfaceFile& self, const GivenRegion& region,
                                               const GivenDetail& detail,
                                               std::optional<uint64_t> most_faces) {
  const Selection selection = self.with(py::none(), [&](File& file) {
    if (most_faces) return file.select(region_of(region), *most_faces, view_of(std::get<GivenView>(detail)));
    return file.select(region_of(region), detail_of(detail));
  });
  std::vector<Place> places;
  for (const ChartPlace& place : selection.charts) places.emplace_back(place.group, place.chart);
  return {places, selection.faces};
}

SharedMesh extract(SurfaceFile& self, const std::vector<Place>& places, const py::object& progress) {
  return shared(self.with(progress, [&](File& file) { return file.extract(selection_of(places)); }));
}

std::pair<SharedMesh, std::vector<std::string>> salvage_charts(SurfaceFile& self,
                                                               const std::vector<Place>& places) {
  std::vector<std::string> problems;
  Mesh mesh = self.with(py::none(), [&](File& file) { return file.salvage(selection_of(places), problems); });
  return {shared(std::move(mesh)), problems};
}

py::tuple chart_info(SurfaceFile& self, const Place& place) {
  const ChartInfo info = self.with(py::none(), [&](File& file) {
    return file.info({place.first, place.second});
  });
  return py::make_tuple(info.level, info.faces, info.bytes, info.box.low.x, info.box.high.x);
}

py::object tuple_of(const std::optional<SurfacePoint>& point) {
  if (!point) return py::none();
  return py::make_tuple(point->position.x, point->distance, Place{point->chart.group, point->chart.chart},
                        point->face, point->corners, point->weights);
}

py::object nearest(SurfaceFile& self, const Triple& point) {
  return tuple_of(self.with(py::none(), [&](File& file) { return file.nearest(Vector3{point}); }));
}

py::object hit(SurfaceFile& self, const Triple& origin, const Triple& direction) {
  return tuple_of(
      self.with(py::none(), [&](File& file) { return file.hit(Vector3{origin}, Vector3{direction}); }));
}

py::list nearest_points(SurfaceFile& self, const Triple& point, uint64_t count) {
  py::list found;
  const auto points =
      self.with(py::none(), [&](File& file) { return file.nearest_points(Vector3{point}, count); });
  for (const NearPoint& each : points) found.append(py::make_tuple(each.position.x, each.distance));
  return found;
}

SharedMesh component(SurfaceFile& self, const Triple& near, const py::object& progress) {
  return shared(self.with(progress, [&](File& file) -> Result<Mesh> {
    const auto start = file.nearest(Vector3{near});
    if (!start) return tl::unexpected(start.error());
    if (!*start) return failure(ErrorCode::usage, "the mesh has no faces");
    const auto whole = file.component((*start)->chart, (*start)->corners[0]);
    if (!whole) return tl::unexpected(whole.error());
    return file.extract(*whole);
  }));
}

std::vector<std::pair<uint64_t, uint32_t>> levels_of(const SurfaceFile& self) {
  std::vector<std::pair<uint64_t, uint32_t>> levels;
  for (uint32_t level = 0; level < self.file().levels(); ++level)
    levels.emplace_back(self.file().faces(level), self.file().charts(level));
  return levels;
}

SharedMesh clip_mesh(const SharedMesh& mesh, const GivenRegion& region) {
  const Mesh& whole = looked_at(mesh);
  return shared(
      run(py::none(), [&](const Progress&) { return Result<Mesh>(clip(whole, region_of(region))); }));
}

}  // namespace

void bind_surface(py::module_& module) {
  py::class_<SurfaceFile>(module, "SurfaceFile")
      .def(py::init(&open_surface), py::arg("input"), py::arg("arrays"), py::arg("memory"))
      .def("levels", &levels_of)
      .def("select", &select, py::arg("region"), py::arg("detail"), py::arg("most_faces"))
      .def("extract", &extract, py::arg("charts"), py::arg("progress"))
      .def("salvage", &salvage_charts, py::arg("charts"))
      .def("chart_info", &chart_info, py::arg("chart"))
      .def("nearest", &nearest, py::arg("point"))
      .def("hit", &hit, py::arg("origin"), py::arg("direction"))
      .def("nearest_points", &nearest_points, py::arg("point"), py::arg("count"))
      .def("component", &component, py::arg("near"), py::arg("progress"));
  module.def("clip", &clip_mesh, py::arg("mesh"), py::arg("region"));
}

}  // namespace maille::python
