#include "mesh_info.h"

#include <fmt/format.h>
#include <maille/with_type.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "text.h"

namespace maille::tool {

namespace {

/// A side of a face: the lower point in the high half, so that the two sides of an edge come together when
/// sorted; then the higher one. Which of the two comes first is in the lowest bit.
constexpr uint64_t side(uint32_t from, uint32_t to) {
  const uint64_t low = std::min(from, to), high = std::max(from, to);
  return low << 33 | high << 1 | (from > to ? 1 : 0);
}

/// Calls `visit(type, corners)` for each cell.
template <class Visit>
void for_each_cell(const Mesh& mesh, Visit visit) {
  for (const CellBlock& block : mesh.blocks) {
    for (size_t i = 0; i < block.size(); ++i) visit(block.type_of(i), block.cell(i));
  }
}

/// Ordered by type, so that the output does not depend on the order of the cells.
std::map<CellType, uint64_t> count_types(const Mesh& mesh) {
  std::map<CellType, uint64_t> counts;
  for_each_cell(mesh, [&](CellType type, std::span<const uint32_t>) { ++counts[type]; });
  return counts;
}

struct Range {
  double low = 0, high = 0;
  uint64_t finite = 0;
};

template <class T>
Range range_of(std::span<const T> values, size_t components, size_t component) {
  Range range;
  for (size_t i = component; i < values.size(); i += components) {
    const auto value = static_cast<double>(values[i]);
    if (!std::isfinite(value)) continue;
    range.low = range.finite == 0 ? value : std::min(range.low, value);
    range.high = range.finite == 0 ? value : std::max(range.high, value);
    ++range.finite;
  }
  return range;
}

Range range_of(const Array& array, size_t component) {
  return with_type(array.type, [&](auto zero) {
    return range_of(array.values<decltype(zero)>(), array.components, component);
  });
}

/// More components than these are tables or texts, whose ranges say nothing.
constexpr size_t most_ranges = 9;

std::vector<Range> ranges_of(const Array& array) {
  std::vector<Range> ranges;
  if (array.components > most_ranges) return ranges;
  for (size_t k = 0; k < array.components; ++k) ranges.push_back(range_of(array, k));
  return ranges;
}

std::string ranges_text(const Array& array) {
  std::string text;
  for (const Range& range : ranges_of(array)) {
    if (!text.empty()) text += ", ";
    text += range.finite == 0 ? "none" : number(range.low) + ".." + number(range.high);
  }
  return text;
}

/// Values that are no numbers; of the positions and arrays of floats.
uint64_t count_not_finite(const Array& array) {
  uint64_t count = 0;
  // Only floats can be infinite or no number.
  for (size_t k = 0; is_float(array.type) && k < array.components; ++k)
    count += array.count() - range_of(array, k).finite;
  return count;
}

std::string edges_text(const EdgeCounts& edges) {
  if (edges.faces == 0) return "";
  if (edges.is_closed())
    return fmt::format("closed:  yes, each of {} edges has two faces of one orientation\n", edges.edges);
  std::string text = "closed:  no";
  if (edges.border > 0) text += fmt::format(", {} with one face", counted(edges.border, "edge"));
  if (edges.crowded > 0) text += fmt::format(", {} with more than two", counted(edges.crowded, "edge"));
  if (edges.turned > 0)
    text += fmt::format(", {} between faces of opposite orientation", counted(edges.turned, "edge"));
  return text + "\n";
}

/// Some files begin with a page of comments; --json has them all.
constexpr size_t most_lines = 8;

std::string metadata_text(const Mesh& mesh) {
  std::string text;
  for (size_t i = 0; i < std::min(mesh.metadata.size(), most_lines); ++i) {
    const auto& [key, value] = mesh.metadata[i];
    text += metadata_line(key, value);
  }
  if (mesh.metadata.size() > most_lines)
    text += fmt::format("metadata: {} more\n", mesh.metadata.size() - most_lines);
  return text;
}

void add_row(Table& table, const Array& array, const char* domain) {
  table.row({array.name, domain, type_text(array.type, array.components), maille::name_of(array.role),
             fmt::format("{}", array.count()), fmt::format("{}", array.bytes.size()),
             fmt::format("{}", count_not_finite(array)), ranges_text(array)});
}

}  // namespace

EdgeCounts count_edges(const Mesh& mesh) {
  EdgeCounts counts;
  // Eight bytes a corner for the time of the count.
  std::vector<uint64_t> sides;
  for_each_cell(mesh, [&](CellType type, std::span<const uint32_t> corners) {
    if (!is_face(type)) return;
    ++counts.faces;
    for (size_t k = 0; k < corners.size(); ++k)
      sides.push_back(side(corners[k], corners[(k + 1) % corners.size()]));
  });
  // Sorting brings the sides of each edge together. Two sides of the same direction belong to faces that
  // disagree about which side is up.
  std::sort(sides.begin(), sides.end());
  for (size_t i = 0, end; i < sides.size(); i = end) {
    for (end = i + 1; end < sides.size() && sides[end] >> 1 == sides[i] >> 1;) ++end;
    ++counts.edges;
    if (end - i == 1) ++counts.border;
    if (end - i > 2) ++counts.crowded;
    if (end - i == 2 && sides[i] == sides[i + 1]) ++counts.turned;
  }
  return counts;
}

std::string mesh_info_text(const Mesh& mesh, const std::string& name, const std::string& format,
                           uint64_t bytes) {
  const char* word = cell_word(mesh);
  std::string text = fmt::format("{}: {}\nsize:    {} bytes ({})\npoints:  {}\n{}s:   {} ({})\n", name,
                                 format, bytes, human_bytes(static_cast<double>(bytes)), mesh.point_count(),
                                 word, mesh.cell_count(), counted(mesh.corner_count(), "corner"));
  std::string types;
  for (const auto& [type, count] : count_types(mesh))
    types += fmt::format("{}{} {}", types.empty() ? "" : ", ", maille::name_of(type), count);
  if (!types.empty()) text += "types:   " + types + "\n";
  const Mode mode = usual_mode(mesh);
  if (mode == Mode::single) text += edges_text(count_edges(mesh));
  for (const CellBlock& block : mesh.blocks) {
    if (!block.name.empty())
      text += fmt::format("block:   {}: {}\n", block.name, counted(block.size(), word));
  }
  text += metadata_text(mesh);
  text += fmt::format(
      "`maille compress` takes mode {} for it{}\n", name_of(mode),
      mode == Mode::stream ? ", in this order of cells and points" : ", in any order of points and faces");
  Table table({"array", "domain", "type", "role", "elements", "bytes", "not finite", "range"}, 4, true);
  add_row(table, mesh.points, "point");
  for (const Array& array : mesh.arrays) add_row(table, array, maille::name_of(array.domain));
  return text + table.str();
}

namespace {

Json json_of(const Array& array) {
  Json ranges = Json::array();
  for (const Range& range : ranges_of(array))
    ranges.push_back(range.finite == 0 ? Json() : Json({range.low, range.high}));
  return {{"name", array.name},
          {"domain", maille::name_of(array.domain)},
          {"type", maille::name_of(array.type)},
          {"components", array.components},
          {"role", maille::name_of(array.role)},
          {"count", array.count()},
          {"bytes", array.bytes.size()},
          {"not_finite", count_not_finite(array)},
          {"ranges", ranges}};
}

}  // namespace

Json mesh_info_json(const Mesh& mesh, const std::string& name, const std::string& format, uint64_t bytes) {
  const EdgeCounts edges = count_edges(mesh);
  Json types = Json::array(), blocks = Json::array(), arrays = Json::array(), metadata = Json::array();
  for (const auto& [type, count] : count_types(mesh))
    types.push_back({{"type", maille::name_of(type)}, {"cells", count}});
  for (const CellBlock& block : mesh.blocks)
    blocks.push_back({{"name", block.name}, {"cells", block.size()}});
  for (const Array& array : mesh.arrays) arrays.push_back(json_of(array));
  for (const auto& [key, value] : mesh.metadata) metadata.push_back({{"key", key}, {"value", value}});
  return {{"file", name},
          {"format", format},
          {"file_bytes", bytes},
          {"points", mesh.point_count()},
          {"cells", mesh.cell_count()},
          {"corners", mesh.corner_count()},
          {"types", types},
          {"edges",
           {{"faces", edges.faces},
            {"edges", edges.edges},
            {"with_one_face", edges.border},
            {"with_more_than_two", edges.crowded},
            {"of_opposite_orientation", edges.turned},
            {"closed", edges.is_closed()}}},
          {"mode", name_of(usual_mode(mesh))},
          {"blocks", blocks},
          {"positions", json_of(mesh.points)},
          {"arrays", arrays},
          {"metadata", metadata}};
}

}  // namespace maille::tool
