// Reads files of mode `random` whole, and says what is in them.
#include <algorithm>
#include <numeric>

#include "base/result.h"
#include "description/element_order.h"
#include "random/random_file.h"
#include "random/read/join_charts.h"
#include "random/read/random_reader.h"
#include "random/read/selection.h"
#include "surface/mesh_description.h"

namespace maille {
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
  MAILLE_CHECK(reader.read_mesh_arrays(mesh));
  if (description.order == Order::keep) {
    const FileReader& file = MAILLE_TRY(reader.whole_file());
    const ElementOrder order =
        MAILLE_TRY(decode_order(MAILLE_TRY(file.read_stream(random_order_key)), description.points,
                                static_cast<uint32_t>(description.cells())));
    mesh = MAILLE_TRY(restore_order(std::move(mesh), order));
  }
  return mesh;
}

namespace {

/// The index says of groups what the charts that they replace are off by: those of the next coarser level.
Result<> find_errors(RandomReader& reader, FileInfo& info) {
  std::vector<uint32_t> pages(reader.index().pages());
  std::iota(pages.begin(), pages.end(), 0u);
  MAILLE_CHECK(reader.load_index_pages(pages));
  const uint32_t levels = reader.directory().levels;
  info.view_error_of_level.assign(levels, 0);
  info.bound_of_level.assign(levels, 0);
  for (uint32_t number = 1; number < reader.index().size(); ++number) {
    const IndexedGroup& group = reader.index().group(number);
    const auto raise = [&](double& error, double found) { error = std::max(error, found); };
    if (group.level + 1 >= levels) continue;
    raise(info.view_error_of_level[group.level + 1], group.view_error);
    raise(info.bound_of_level[group.level + 1], group.bound);
  }
  return {};
}

}  // namespace

Result<FileInfo> inspect_random(const Source& source) {
  RandomReader reader = MAILLE_TRY(RandomReader::open(source, {}));
  FileInfo errors;
  MAILLE_CHECK(find_errors(reader, errors));
  const ChartDirectory& directory = reader.directory();
  FileInfo info = file_info(reader.description());
  info.format_major = reader.header().major;
  info.format_minor = reader.header().minor;
  info.mode = Mode::random;
  info.file_bytes = source.size();
  info.connectivity.coded_bytes = directory.finest.topology + directory.coarser.topology;
  info.faces_of_level = directory.faces;
  info.charts_of_level = directory.charts;
  info.view_error_of_level = std::move(errors.view_error_of_level);
  info.bound_of_level = std::move(errors.bound_of_level);
  uint64_t coarse = 0;
  const auto coded = [&](size_t i, Domain domain) {
    uint64_t bytes = directory.finest.arrays[i];
    if (domain != Domain::mesh && coarse < directory.coarser.arrays.size())
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
  if (reader.rebuilt() > 0)
    info.problems.push_back("the index of charts is damaged; it was made anew from the charts");
  return info;
}

}  // namespace maille
