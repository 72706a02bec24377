// Reads files of mode `random` whole, and says what is in them.
#include <algorithm>
#include <numeric>

#include "base/named_error.h"
#include "base/result.h"
#include "description/element_order.h"
#include "random/random_file.h"
#include "random/read/join_charts.h"
#include "random/read/random_reader.h"
#include "random/read/selection.h"
#include "surface/mesh_description.h"

namespace maille {
namespace {

/// The charts of the finest level. A damaged index may say of a coarser group that nothing refines it, but
/// its charts have other blocks and fewer arrays, so that they cannot be joined to the finest ones.
Result<Selection> all_charts(RandomReader& reader) {
  Selection all =
      MAILLE_TRY(reader.select([](const ChartIndex& index) { return select(index, {}, Detail::full()); }));
  std::erase_if(all.charts,
                [&](const ChartPlace& place) { return reader.index().group(place.group).level != 0; });
  return all;
}

Result<> check_memory_of_order(const Description& description, const Source& source,
                               const DecodeOptions& options) {
  if (description.order != Order::keep) return {};
  PatchesMemory memory{.meshes = memory_of(description), .after = ordering_memory(description)};
  MAILLE_TRY(with_name(memory.at_once(options.limits), source.name()));
  return {};
}

/// Charts that are missing from a damaged index leave no gap that anything else would notice.
bool is_whole(const Mesh& mesh, const Description& description) {
  return mesh.point_count() == description.points && mesh.cell_count() == description.cells();
}

Result<ElementOrder> read_order(const RandomReader& reader) {
  const Description& description = reader.description();
  const FileReader& file = MAILLE_TRY(reader.whole_file());
  return decode_order(MAILLE_TRY(file.read_stream(random_order_key)), description.points,
                      static_cast<uint32_t>(description.cells()));
}

}  // namespace

Result<Mesh> decode_random(const Source& source, const DecodeOptions& options) {
  RandomReader reader = MAILLE_TRY(RandomReader::open(source, options));
  MAILLE_CHECK(check_memory_of_order(reader.description(), source, options));
  const Selection all = MAILLE_TRY(all_charts(reader));
  std::vector<DecodedChart> charts = MAILLE_TRY(reader.read_charts(all.charts));
  Mesh mesh = MAILLE_TRY(join_finest(std::move(charts), reader, options, nullptr));
  if (!is_whole(mesh, reader.description()))
    return failure(ErrorCode::corrupt, source.name() + ": the charts are not all of the mesh");
  if (reader.description().order == Order::keep)
    mesh = MAILLE_TRY(restore_order(std::move(mesh), MAILLE_TRY(read_order(reader))));
  return mesh;
}

namespace {

/// Without an index that names all of them nobody knows how many charts there were.
std::string lost_charts(const RandomReader& reader, size_t lost, size_t all) {
  if (reader.rebuilt() > 0 || lost == 0) return "charts, and with the index how many";
  return std::to_string(lost) + " of " + std::to_string(all) + " charts";
}

}  // namespace

Result<Remains> salvage_random(const Source& source, const DecodeOptions& options) {
  RandomReader reader = MAILLE_TRY(RandomReader::open(source, options));
  MAILLE_CHECK(check_memory_of_order(reader.description(), source, options));
  const Selection all = MAILLE_TRY(all_charts(reader));
  std::vector<std::string> problems;
  std::vector<DecodedChart> charts = MAILLE_TRY(reader.read_charts(all.charts, &problems));
  const Description& description = reader.description();
  if (charts.empty() && description.points > 0)
    return failure(ErrorCode::corrupt, problems.empty() ? source.name() + ": has no charts" : problems[0]);
  const size_t lost = problems.size();
  Remains remains;
  remains.mesh = MAILLE_TRY(join_finest(std::move(charts), reader, options, &problems));
  if (lost > 0 || remains.mesh.cell_count() < description.cells())
    remains.lost.push_back(lost_charts(reader, lost, all.charts.size()));
  if (problems.size() > lost) remains.lost.push_back("the arrays of the mesh as a whole");
  if (description.order == Order::keep) {
    const FileReader& file = MAILLE_TRY(reader.whole_file());
    const auto order = file.read_stream(random_order_key);
    MAILLE_CHECK(put_in_order(order, description.points, description.cells(), remains));
  }
  if (auto valid = validate(remains.mesh); !valid)
    return failure(ErrorCode::corrupt, std::move(valid).error().message);
  return remains;
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
    // A damaged group may be of any level, also one that the directory does not have.
    if (group.level + 1 >= levels) continue;
    raise(info.view_error_of_level[group.level + 1], group.view_error);
    raise(info.bound_of_level[group.level + 1], group.bound);
  }
  return {};
}

}  // namespace

Result<FileInfo> inspect_random(const Source& source, const Limits& limits) {
  DecodeOptions options;
  options.limits = limits;
  RandomReader reader = MAILLE_TRY(RandomReader::open(source, options));
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
