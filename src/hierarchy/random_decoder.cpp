// Reads files of mode `random` whole, and says what is in them.
#include <algorithm>

#include "base/result.h"
#include "hierarchy/join_charts.h"
#include "hierarchy/random_file.h"
#include "hierarchy/random_reader.h"
#include "hierarchy/selection.h"
#include "surface/element_order.h"
#include "surface/mesh_description.h"

namespace maille {
namespace {

Result<> read_mesh_arrays(const RandomReader& reader, Mesh& mesh) {
  for (Array& array : mesh.arrays) {
    if (array.domain != Domain::mesh) continue;
    const auto& described = reader.description().arrays;
    const auto found = std::find_if(described.begin(), described.end(), [&](const ArrayDescription& d) {
      return d.domain == Domain::mesh && d.name == array.name;
    });
    const auto number = static_cast<uint32_t>(found - described.begin());
    const FileReader& file = MAILLE_TRY(reader.whole_file());
    const auto bytes = MAILLE_TRY(file.read_stream(mesh_array_key(number)));
    MAILLE_CHECK(decode_mesh_array(bytes, found->mesh_tuples, array));
  }
  return {};
}

}  // namespace

Result<Mesh> decode_random(const Source& source, const DecodeOptions& options) {
  RandomReader reader = MAILLE_TRY(RandomReader::open(source, options));
  const Selection all =
      MAILLE_TRY(reader.select([](const ChartIndex& index) { return select(index, {}, Detail::full()); }));
  Executor& executor = options.executor == nullptr ? serial_executor() : *options.executor;
  Mesh mesh =
      MAILLE_TRY(join_finest(MAILLE_TRY(reader.read_charts(all.charts)), reader.description(), executor));
  const Description& description = reader.description();
  if (mesh.point_count() != description.points || mesh.cell_count() != description.cells()) {
    return failure(ErrorCode::corrupt, source.name() + ": the charts are not all of the mesh");
  }
  MAILLE_CHECK(read_mesh_arrays(reader, mesh));
  if (description.order == Order::keep) {
    const FileReader& file = MAILLE_TRY(reader.whole_file());
    const ElementOrder order =
        MAILLE_TRY(decode_order(MAILLE_TRY(file.read_stream(random_order_key)), description.points,
                                static_cast<uint32_t>(description.cells())));
    mesh = MAILLE_TRY(restore_order(std::move(mesh), order));
  }
  return mesh;
}

Result<FileInfo> inspect_random(const Source& source) {
  const RandomReader reader = MAILLE_TRY(RandomReader::open(source, {}));
  const ChartDirectory& directory = reader.directory();
  FileInfo info = file_info(reader.description());
  info.format_major = reader.header().major;
  info.format_minor = reader.header().minor;
  info.mode = Mode::random;
  info.file_bytes = source.size();
  info.connectivity.coded_bytes = directory.finest.topology + directory.coarser.topology;
  info.faces_of_level = directory.faces;
  info.charts_of_level = directory.charts;
  uint64_t coarse = 0;
  const auto coded = [&](size_t i, Domain domain) {
    uint64_t bytes = directory.finest.arrays[i];
    if (domain == Domain::point && coarse < directory.coarser.arrays.size())
      bytes += directory.coarser.arrays[coarse++];
    return bytes;
  };
  const Description& description = reader.description();
  info.positions = array_info(description, description.positions, coded(0, Domain::point));
  for (size_t i = 0; i < description.arrays.size(); ++i) {
    info.arrays.push_back(
        array_info(description, description.arrays[i], coded(i + 1, description.arrays[i].domain)));
  }
  const FileReader& file = MAILLE_TRY(reader.whole_file());
  info.chunks = file.chunks();
  info.problems = file.problems();
  return info;
}

}  // namespace maille
