#include "volume/stream/source_report.h"

#include <algorithm>

#include "base/result.h"
#include "volume/stream/stream_file.h"

namespace maille {
namespace {

ArrayReport report_of(const Array& array, uint64_t count) {
  ArrayReport report;
  report.name = array.name;
  report.domain = array.domain;
  report.type = array.type;
  report.components = array.components;
  report.elements = count;
  report.raw_bytes = count * array.tuple_size();
  return report;
}

}  // namespace

Result<StreamOptions> stream_options_of(const MeshDescription& mesh, const EncodeOptions& options) {
  StreamOptions stream;
  stream.positions.type = mesh.point_type;
  stream.positions.tolerance = options.positions;
  for (const Array& array : mesh.arrays) {
    stream.arrays.push_back({array.name, array.domain, array.type, array.components, array.role, array.labels,
                             tolerance_of(options, array.name), std::nullopt});
  }
  for (const auto& [name, tolerance] : options.arrays) {
    const auto same_name = [&name = name](const Array& array) { return array.name == name; };
    if (std::none_of(mesh.arrays.begin(), mesh.arrays.end(), same_name) &&
        std::none_of(mesh.mesh_arrays.begin(), mesh.mesh_arrays.end(), same_name))
      return failure(ErrorCode::usage, "the mesh has no array named \"" + name + "\"");
  }
  stream.mesh_arrays = mesh.mesh_arrays;
  return complete_options(mesh, options, std::move(stream));
}

EncodeReport report_of(const MeshDescription& mesh) {
  EncodeReport report;
  report.points = mesh.points;
  report.cells = mesh.cells;
  report.connectivity.name = "connectivity";
  report.connectivity.domain = Domain::cell;
  report.connectivity.type = Scalar::u32;
  report.connectivity.elements = mesh.cells;
  report.connectivity.raw_bytes = mesh.corners * 4;
  report.positions = report_of(make_array("position", Domain::point, mesh.point_type, 3), mesh.points);
  for (const Array& array : mesh.arrays) report.arrays.push_back(report_of(array, mesh.count_of(array)));
  for (const Array& array : mesh.mesh_arrays) report.arrays.push_back(report_of(array, array.count()));
  return report;
}

}  // namespace maille
