#include "surface/mesh_description.h"

#include <algorithm>
#include <map>
#include <string>

#include "base/result.h"
#include "surface/arrays/array_report.h"

namespace maille {
namespace {

/// What was asked for stands in the file only if there is loss: with it a decoded mesh can be encoded the
/// same way again.
ArrayDescription describe(const Array& array, const ArrayMaps& maps, const Tolerance& asked) {
  ArrayDescription description;
  description.name = array.name;
  description.domain = array.domain;
  description.type = array.type;
  description.components = array.components;
  description.role = array.role;
  description.labels = array.labels;
  if (array.domain == Domain::mesh) description.mesh_tuples = array.count();
  if (!maps.lossless) description.asked = asked;
  description.bound = maps.bound;
  description.step = maps.step;
  return description;
}

Description describe(const Mesh& mesh, const EncodeOptions& options) {
  Description description;
  description.effort = static_cast<uint8_t>(options.effort);
  description.order = options.order;
  description.points = static_cast<uint32_t>(mesh.point_count());
  description.corners = mesh.corner_count();
  for (const CellBlock& block : mesh.blocks) {
    // Sorted by type, as the format wants (11.1).
    std::map<CellType, uint64_t> types;
    for (const uint8_t type : block.types) ++types[static_cast<CellType>(type)];
    description.blocks.push_back({block.name, {block.type, block.size()}, {types.begin(), types.end()}});
  }
  description.metadata = mesh.metadata;
  description.provenance = options.provenance;
  return description;
}

}  // namespace

Result<> check_options(const Mesh& mesh, const EncodeOptions& options) {
  if (options.effort < 1 || options.effort > 9)
    return failure(ErrorCode::usage, "the effort must be from 1 to 9");
  if (options.most_cells_per_part == uint64_t{0})
    return failure(ErrorCode::usage, "parts must have a cell at least");
  for (const auto& [name, tolerance] : options.arrays) {
    const auto same_name = [&name = name](const Array& array) { return array.name == name; };
    if (std::none_of(mesh.arrays.begin(), mesh.arrays.end(), same_name)) {
      return failure(ErrorCode::usage, "the mesh has no array named \"" + name + "\"");
    }
  }
  for (const CellBlock& block : mesh.blocks) {
    if (!block.face_sizes.empty()) {
      return failure(ErrorCode::unsupported, "mode \"single\" does not hold polyhedra");
    }
  }
  for (const Array& array : mesh.arrays) {
    // The format's bounds (11.1); elements are numbered with 32 bits.
    if (array.components > 0xffff || array.count() >= none) {
      return failure(ErrorCode::unsupported,
                     "array \"" + array.name + "\" is too large for a file of mode single");
    }
  }
  return {};
}

/// Each array is one task, and may split into more; errors are those of the first array that has one,
/// whatever ends first.
Result<std::vector<ArrayToCode>> map_arrays(const Mesh& mesh, const EncodeOptions& options) {
  Executor& executor = options.executor != nullptr ? *options.executor : serial_executor();
  std::vector<Result<ArrayMaps>> maps(mesh.arrays.size() + 1);
  executor.parallel_for(maps.size(), [&](size_t i) {
    maps[i] = i == 0 ? choose_maps(mesh.points, options.positions, true, executor)
                     : choose_maps(mesh.arrays[i - 1], tolerance_of(options, mesh.arrays[i - 1].name), false,
                                   executor);
  });
  std::vector<ArrayToCode> arrays;
  for (size_t i = 0; i < maps.size(); ++i) {
    ArrayMaps chosen = MAILLE_TRY(std::move(maps[i]));
    arrays.push_back({i == 0 ? &mesh.points : &mesh.arrays[i - 1], std::move(chosen)});
  }
  return arrays;
}

Description describe(const Mesh& mesh, std::span<const ArrayToCode> arrays, const EncodeOptions& options) {
  Description description = describe(mesh, options);
  description.positions = describe(mesh.points, arrays[0].maps, options.positions);
  for (const ArrayToCode& coded : arrays.subspan(1)) {
    description.arrays.push_back(
        describe(*coded.array, coded.maps, tolerance_of(options, coded.array->name)));
  }
  return description;
}

ArrayReport report_of(const Array& array, const ArrayMaps& maps, size_t coded_bytes) {
  ArrayReport report = report_of(array);
  report.coded_bytes = coded_bytes;
  report.lossless = maps.lossless;
  report.bound = maps.bound;
  report.asked = maps.asked;
  report.extent = maps.extent;
  report.maximum_error = maps.maximum_error;
  report.step = maps.step;
  return report;
}

ElementOrder original_order(const Mesh& mesh, std::span<const PatchSources> patches,
                            const JoinedPoints& joined) {
  struct CodedCell {
    uint32_t cell;
    uint32_t first_corner;
  };
  const CellTable cells = table_cells(mesh);
  ElementOrder order;
  // A point that several parts have gets the same source from each.
  order.points.resize(joined.count);
  std::vector<CodedCell> coded;
  for (size_t p = 0; p < patches.size(); ++p) {
    const PatchSources& sources = patches[p];
    const std::vector<uint32_t> numbers = joined.parts[p].all_numbers();
    for (size_t i = 0; i < numbers.size(); ++i) order.points[numbers[i]] = sources.points[i];
    for (size_t i = 0; i < sources.cells.size(); ++i)
      coded.push_back({sources.cells[i], sources.first_corner[i]});
  }
  // The decoder writes block after block, in each of them patch after patch, each in coded order.
  std::stable_sort(coded.begin(), coded.end(), [&](const CodedCell& a, const CodedCell& b) {
    return cells.block[a.cell] < cells.block[b.cell];
  });
  for (const CodedCell& c : coded) {
    order.cells.push_back(c.cell);
    order.rotation.push_back(c.first_corner - cells.corner[c.cell]);
  }
  return order;
}

namespace {

std::vector<std::pair<CellType, uint64_t>> types_of(const Description& description) {
  std::map<CellType, uint64_t> cells;
  for (const CodedBlock& block : description.blocks) {
    if (block.shape.type != CellType::mixed) cells[block.shape.type] += block.shape.cells;
    for (const auto& [type, count] : block.types) cells[type] += count;
  }
  return {cells.begin(), cells.end()};
}

}  // namespace

/// Users are told of the mesh as it will be decoded: of a welded one, its points before welding.
FileInfo file_info(const Description& description) {
  FileInfo info;
  info.effort = description.effort;
  info.order = description.order;
  info.points = description.welded ? description.split_points : description.points;
  info.cells = description.cells();
  info.corners = description.corners;
  info.parts = std::max<uint64_t>(description.parts.size(), 1);
  for (const CodedBlock& block : description.blocks) {
    const std::string type = std::string("(") + name_of(block.shape.type) + ")";
    info.blocks.emplace_back(block.name.empty() ? type : block.name + " " + type, block.shape.cells);
  }
  info.types = types_of(description);
  info.connectivity.name = "connectivity";
  info.connectivity.domain = Domain::corner;
  info.connectivity.type = Scalar::u32;
  info.connectivity.count = description.corners;
  info.metadata = description.metadata;
  info.provenance = description.provenance;
  return info;
}

ArrayInfo array_info(const Description& description, const ArrayDescription& array, uint64_t coded_bytes) {
  ArrayInfo info;
  info.name = array.name;
  info.domain = array.by_twin ? Domain::point : array.domain;
  info.type = array.type;
  info.components = array.components;
  info.role = array.role;
  info.count = description.welded && info.domain == Domain::point ? description.split_points
                                                                  : description.tuples(array);
  info.coded_bytes = coded_bytes;
  info.lossless = array.asked.kind == Tolerance::Kind::lossless;
  info.asked = array.asked;
  info.step = array.step;
  info.bound = array.bound;
  return info;
}

}  // namespace maille
