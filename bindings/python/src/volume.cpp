// Files of mode stream, in parts.
#include <maille/volume_file.h>

#include "codec.h"
#include "handle.h"
#include "mesh.h"
#include "regions.h"
#include "values.h"

namespace maille::python {

namespace {

using Volume = Handle<VolumeFile>;
/// Name, least and largest value, component or None for the length of the tuple.
using GivenCondition = std::tuple<std::string, double, double, std::optional<uint32_t>>;

VolumeQuery query_of(const GivenRegion& region, const std::optional<GivenPlane>& plane,
                     const std::vector<GivenCondition>& conditions,
                     const std::optional<std::pair<uint64_t, uint64_t>>& cells,
                     const std::optional<std::vector<uint32_t>>& pieces) {
  VolumeQuery query;
  query.region = region_of(region);
  if (plane) query.plane = plane_of(*plane);
  for (const auto& [name, low, high, component] : conditions)
    query.conditions.push_back({name, low, high, component});
  query.cells = cells;
  query.pieces = pieces;
  return query;
}

std::unique_ptr<Volume> open_volume(const py::object& input, std::optional<std::vector<std::string>> arrays,
                                    uint64_t step, uint64_t memory) {
  auto opened = std::make_unique<Volume>(input);
  DecodeOptions options;
  options.limits.mesh_bytes = memory;
  options.arrays = std::move(arrays);
  options.step = step;
  options.executor = executor();
  opened->set(run(opened->input(), py::none(),
                  [&](const Progress&) { return VolumeFile::open(opened->input().source(), options); }));
  return opened;
}

/// The mesh, by cell and point their numbers in the input (empty: not kept), pieces and cells read, what is
/// damaged.
py::tuple extract(Volume& self, const GivenRegion& region, const std::optional<GivenPlane>& plane,
                  const std::vector<GivenCondition>& conditions,
                  const std::optional<std::pair<uint64_t, uint64_t>>& cells,
                  const std::optional<std::vector<uint32_t>>& pieces, const py::object& progress) {
  const VolumeQuery query = query_of(region, plane, conditions, cells, pieces);
  ExtractedVolume part = self.with(progress, [&](VolumeFile& file) { return file.extract(query); });
  return py::make_tuple(shared(std::move(part.mesh)), view_of(std::move(part.cell_numbers)),
                        view_of(std::move(part.point_numbers)), part.pieces, part.cells_read, part.problems);
}

std::vector<uint32_t> select(Volume& self, const GivenRegion& region, const std::optional<GivenPlane>& plane,
                             const std::vector<GivenCondition>& conditions,
                             const std::optional<std::pair<uint64_t, uint64_t>>& cells) {
  const VolumeQuery query = query_of(region, plane, conditions, cells, std::nullopt);
  return self.with(py::none(), [&](VolumeFile& file) { return file.select(query); });
}

py::tuple piece_info(Volume& self, uint32_t piece) {
  const PieceInfo info = self.with(py::none(), [&](VolumeFile& file) { return file.info(piece); });
  const py::object box =
      info.box ? py::object(py::make_tuple(info.box->low.x, info.box->high.x)) : py::none();
  py::list fields;
  for (const PieceInfo::Field& field : info.fields) {
    py::list components;
    for (const auto& each : field.components)
      components.append(py::make_tuple(each.low, each.high, each.mean));
    fields.append(py::make_tuple(field.name, name_of(field.domain), components));
  }
  return py::make_tuple(info.cells, info.points, info.bytes, box, fields);
}

}  // namespace

void bind_volume(py::module_& module) {
  py::class_<Volume>(module, "VolumeFile")
      .def(py::init(&open_volume), py::arg("input"), py::arg("arrays"), py::arg("step"), py::arg("memory"))
      .def_property_readonly("pieces", [](const Volume& self) { return self.file().pieces(); })
      .def("piece_info", &piece_info, py::arg("piece"))
      .def("select", &select, py::arg("region"), py::arg("plane"), py::arg("conditions"), py::arg("cells"))
      .def("extract", &extract, py::arg("region"), py::arg("plane"), py::arg("conditions"), py::arg("cells"),
           py::arg("pieces"), py::arg("progress"))
      .def("coarse", [](Volume& self) {
        return shared(self.with(py::none(), [](VolumeFile& file) { return file.coarse(); }));
      });
}

}  // namespace maille::python
