#include "summary.h"

#include <fmt/format.h>
#include <algorithm>

#include "text.h"
#include "tolerance.h"

namespace maille::tool {

namespace {

/// Bits for each element: the measure in which mesh compression is compared.
std::string bits_each(uint64_t bytes, uint64_t elements) {
  return quotient(8.0 * static_cast<double>(bytes), static_cast<double>(elements));
}

/// "0.0125 (0.001 of 12.5)" for a relative bound.
std::string bound_text(bool lossless, double bound, const Tolerance& asked, const std::string& extent) {
  if (lossless) return "lossless";
  const std::string value = number(asked.value);
  switch (asked.kind) {
    case Tolerance::Kind::relative:
      return fmt::format("{} ({} of {})", number(bound), value, extent);
    case Tolerance::Kind::norm:
      return fmt::format("{} (norm {})", number(bound), value);
    case Tolerance::Kind::psnr:
      return fmt::format("{} ({} dB of {})", number(bound), value, extent);
    case Tolerance::Kind::pointwise:
      return fmt::format("{} of each", value);
    default:
      return number(bound);
  }
}

void add_row(Table& table, const ArrayReport& array) {
  table.row({array.name, maille::name_of(array.domain), type_text(array.type, array.components),
             fmt::format("{}", array.raw_bytes), fmt::format("{}", array.coded_bytes),
             bits_each(array.coded_bytes, array.elements),
             quotient(static_cast<double>(array.raw_bytes), static_cast<double>(array.coded_bytes)),
             bound_text(array.lossless, array.bound, array.asked, number(array.extent)),
             number(array.maximum_error)});
}

/// The kind is named like its option, without the two dashes.
Json json_of(const Tolerance& asked) {
  for (const BoundOption& option : bound_options) {
    if (option.kind == asked.kind) return {{"kind", option.name + 2}, {"value", asked.value}};
  }
  return {{"kind", "lossless"}, {"value", Json()}};
}

Json json_of(const ArrayReport& array) {
  return {{"name", array.name},
          {"domain", maille::name_of(array.domain)},
          {"type", maille::name_of(array.type)},
          {"components", array.components},
          {"elements", array.elements},
          {"raw_bytes", array.raw_bytes},
          {"coded_bytes", array.coded_bytes},
          {"bits_per_element", array.elements == 0 ? Json()
                                                   : Json(8.0 * static_cast<double>(array.coded_bytes) /
                                                          static_cast<double>(array.elements))},
          {"lossless", array.lossless},
          {"bound", array.bound},
          {"asked", json_of(array.asked)},
          {"extent", array.extent},
          {"maximum_error", array.maximum_error},
          {"step", array.step}};
}

Json json_of(const ArrayInfo& array) {
  Json ranges = Json::array();
  for (const auto& [low, high] : array.ranges) ranges.push_back(Json::array({low, high}));
  return {{"name", array.name},
          {"domain", maille::name_of(array.domain)},
          {"type", maille::name_of(array.type)},
          {"components", array.components},
          {"role", maille::name_of(array.role)},
          {"elements", array.count},
          {"coded_bytes", array.coded_bytes},
          {"lossless", array.lossless},
          {"bound", array.bound},
          {"asked", json_of(array.asked)},
          {"maximum_error", array.maximum_error},
          {"step", array.step},
          {"ranges", ranges},
          {"nans", array.nans}};
}

}  // namespace

// Names from files may be no valid UTF-8, which JSON cannot hold: bad bytes become U+FFFD instead of an
// exception.
std::string dump(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::vector<std::string> notes_of_steps(const FileInfo& info) {
  if (info.steps.empty()) return {};
  return {fmt::format("left out: {} of time; to keep them, decompress into a .pvd, and compress that",
                      counted(info.steps.size(), "step"))};
}

const char* cell_word(const Mesh& mesh) {
  const auto is_solid = [](uint8_t type) { return dimension_of(static_cast<CellType>(type)) == 3; };
  const bool solids = std::any_of(mesh.blocks.begin(), mesh.blocks.end(), [&](const CellBlock& block) {
    return dimension_of(block.type) == 3 || std::any_of(block.types.begin(), block.types.end(), is_solid);
  });
  return solids ? "cell" : "face";
}

namespace {

// A value or two that belong to the mesh as a whole, such as where the camera stood.
bool is_single_value(const ArrayReport& array) {
  return array.domain == Domain::mesh && array.elements <= 1 && array.lossless;
}

// Scanners write dozens of single values; one row for all of them keeps the table readable.
void add_single_values(Table& table, const std::vector<ArrayReport>& arrays) {
  uint64_t count = 0;
  uint64_t raw = 0;
  uint64_t coded = 0;
  for (const ArrayReport& array : arrays) {
    if (!is_single_value(array)) continue;
    ++count;
    raw += array.raw_bytes;
    coded += array.coded_bytes;
  }
  if (count == 0) return;
  table.row({fmt::format("({})", counted(count, "single value")), "mesh", "", fmt::format("{}", raw),
             fmt::format("{}", coded), "-", quotient(static_cast<double>(raw), static_cast<double>(coded)),
             "lossless", "0"});
}

}  // namespace

std::string summary_text(const EncodeReport& report, const std::string& input, const std::string& output,
                         uint64_t input_bytes, double seconds, bool every_array, const char* word) {
  const auto bytes = static_cast<double>(report.file_bytes);
  std::string text = fmt::format(
      "{} -> {}: {}, {}; {} -> {} (ratio {}), {} bits/point, {} bits/{}, {:.2f} s\n", input, output,
      counted(report.points, "point"), counted(report.cells, word),
      human_bytes(static_cast<double>(input_bytes)), human_bytes(bytes),
      quotient(static_cast<double>(input_bytes), bytes), bits_each(report.file_bytes, report.points),
      bits_each(report.file_bytes, report.cells), word, seconds);
  Table table(
      {"array", "domain", "type", "raw bytes", "coded bytes", "bits/element", "ratio", "bound", "max error"},
      3);
  add_row(table, report.connectivity);
  add_row(table, report.positions);
  for (const ArrayReport& array : report.arrays) {
    if (every_array || !is_single_value(array)) add_row(table, array);
  }
  if (!every_array) add_single_values(table, report.arrays);
  if (report.order_bytes > 0) {
    table.row({"(order)", "", "", "-", fmt::format("{}", report.order_bytes),
               bits_each(report.order_bytes, report.points), "-", "", ""});
  }
  table.row({"(headers)", "", "", "-", fmt::format("{}", report.other_bytes), "-", "-", "", ""});
  return text + table.str();
}

Json summary_json(const EncodeReport& report, const std::string& input, const std::string& output,
                  uint64_t input_bytes, double seconds) {
  Json arrays = Json::array();
  for (const ArrayReport& array : report.arrays) arrays.push_back(json_of(array));
  return {{"input", input},
          {"output", output},
          {"input_bytes", input_bytes},
          {"file_bytes", report.file_bytes},
          {"points", report.points},
          {"cells", report.cells},
          {"connectivity", json_of(report.connectivity)},
          {"positions", json_of(report.positions)},
          {"arrays", arrays},
          {"order_bytes", report.order_bytes},
          {"other_bytes", report.other_bytes},
          {"seconds", seconds}};
}

namespace {

/// "0..1", of vectors up to three of them, of others what holds all components; then how many are NaN.
std::string range_text(const ArrayInfo& array) {
  std::vector<std::pair<double, double>> ranges = array.ranges;
  if (ranges.size() > 3) {
    for (const auto& [low, high] : ranges)
      ranges[0] = {std::min(ranges[0].first, low), std::max(ranges[0].second, high)};
    ranges.resize(1);
  }
  std::vector<std::string> parts;
  for (const auto& [low, high] : ranges) {
    // Low is above high where a component has no number at all.
    if (low <= high) parts.push_back(low == high ? number(low) : number(low) + ".." + number(high));
  }
  if (array.nans > 0) parts.push_back(fmt::format("{} NaN", array.nans));
  return fmt::format("{}", fmt::join(parts, ", "));
}

void add_row(Table& table, const ArrayInfo& array, bool with_ranges) {
  std::vector<std::string> row = {array.name,
                                  maille::name_of(array.domain),
                                  type_text(array.type, array.components),
                                  maille::name_of(array.role),
                                  fmt::format("{}", array.count),
                                  fmt::format("{}", array.coded_bytes),
                                  bits_each(array.coded_bytes, array.count),
                                  bound_text(array.lossless, array.bound, array.asked, "range")};
  if (with_ranges) {
    row.push_back(number(array.maximum_error));
    row.push_back(range_text(array));
  }
  table.row(row);
}

/// "hexahedron 12, wedge 3".
std::string types_text(const FileInfo& info) {
  std::vector<std::string> parts;
  for (const auto& [type, cells] : info.types)
    parts.push_back(fmt::format("{} {}", maille::name_of(type), cells));
  return fmt::format("types:   {}\n", fmt::join(parts, ", "));
}

std::string chunks_text(const FileInfo& info) {
  Table table({"chunk", "id", "offset", "size"}, 1);
  for (const ChunkInfo& chunk : info.chunks) {
    table.row({chunk.type, fmt::format("{}", chunk.id), fmt::format("{}", chunk.offset),
               fmt::format("{}", chunk.size)});
  }
  return "chunks:\n" + table.str();
}

std::string tree_text(const FileInfo& info) {
  Table table({"level", "charts", "faces", "view error", "bound"}, 1);
  for (size_t level = info.faces_of_level.size(); level-- > 0;) {
    table.row({fmt::format("{}", level), fmt::format("{}", info.charts_of_level[level]),
               fmt::format("{}", info.faces_of_level[level]), number(info.view_error_of_level[level]),
               number(info.bound_of_level[level])});
  }
  return "levels of detail:\n" + table.str();
}

Json json_of_levels(const FileInfo& info) {
  Json levels = Json::array();
  for (size_t level = 0; level < info.faces_of_level.size(); ++level) {
    levels.push_back({{"charts", info.charts_of_level[level]},
                      {"faces", info.faces_of_level[level]},
                      {"view_error", info.view_error_of_level[level]},
                      {"bound", info.bound_of_level[level]}});
  }
  return levels;
}

}  // namespace

bool in_pieces(const FileInfo& info) {
  return std::any_of(info.chunks.begin(), info.chunks.end(),
                     [](const ChunkInfo& chunk) { return chunk.type == "PIEC"; });
}

namespace {

/// Those of a stream cannot be read alone, so they are not called pieces.
const char* word_for_parts(const FileInfo& info) {
  if (info.mode != Mode::stream) return "parts:";
  return in_pieces(info) ? "pieces:" : "batches:";
}

std::string steps_text(const FileInfo& info) {
  Table table({"step", "time", "coded bytes", "arrays"}, 0);
  for (size_t i = 0; i < info.steps.size(); ++i) {
    const StepInfo& step = info.steps[i];
    // 12 digits: solvers add up their steps, and 0.30000000000000004 is what a user calls 0.3. --json has
    // all.
    table.row({fmt::format("{}", i + 1), fmt::format("{:.12g}", step.time),
               fmt::format("{}", step.coded_bytes), fmt::format("{}", fmt::join(step.arrays, ", "))});
  }
  return table.str();
}

}  // namespace

std::string info_text(const FileInfo& info, const std::string& name, const std::optional<Sphere>& sphere,
                      bool tree, bool chunks) {
  const char* word = info.mode == Mode::stream ? "cell" : "face";
  std::string text = fmt::format(
      "{}: .maille format {}.{}, mode {}, effort {}, order {}\n"
      "size:    {} bytes ({}), {} bits/point, {} bits/{}\n"
      "points:  {}\n"
      "{}s:   {} ({})\n",
      name, info.format_major, info.format_minor, name_of(info.mode), info.effort, name_of(info.order),
      info.file_bytes, human_bytes(static_cast<double>(info.file_bytes)),
      bits_each(info.file_bytes, info.points), bits_each(info.file_bytes, info.cells), word, info.points,
      word, info.cells, counted(info.corners, "corner"));
  if (info.mode == Mode::stream || info.types.size() > 1) text += types_text(info);
  if (info.most_points_in_use > 0) {
    text += fmt::format("in use:  at most {} at once; decompressing to VTU takes about {} of memory\n",
                        counted(info.most_points_in_use, "point"),
                        human_bytes(static_cast<double>(info.decode_bytes)));
  }
  if (in_pieces(info) || info.parts > 1) text += fmt::format("{:<8} {}\n", word_for_parts(info), info.parts);
  if (!info.faces_of_level.empty()) {
    text += fmt::format("levels:  {}, the coarsest of {}\n", info.faces_of_level.size(),
                        counted(info.faces_of_level.back(), word));
  }
  if (sphere) {
    const Vector3& c = sphere->centre;
    text += fmt::format("lies in: {:.6g},{:.6g},{:.6g},{:.6g} (centre and radius, as for extract --sphere)\n",
                        c[0], c[1], c[2], sphere->radius);
  }
  for (const auto& [block, cells] : info.blocks)
    text += fmt::format("block:   {}: {}\n", block, counted(cells, word));
  for (const auto& [key, value] : info.metadata) text += metadata_line(key, value);
  if (!info.provenance.empty()) text += fmt::format("written by: {}\n", info.provenance);
  std::vector<std::string> head = {"array",    "domain",      "type",         "role",
                                   "elements", "coded bytes", "bits/element", "bound"};
  const bool with_ranges = !info.positions.ranges.empty();
  if (with_ranges) {
    head.push_back("max error");
    head.push_back("range");
  }
  Table table(head, 4, with_ranges);
  ArrayInfo cells = info.connectivity;  // a row for cells, as compress has it, instead of corners
  cells.domain = Domain::cell;
  cells.count = info.cells;
  add_row(table, cells, with_ranges);
  add_row(table, info.positions, with_ranges);
  for (const ArrayInfo& array : info.arrays) add_row(table, array, with_ranges);
  text += table.str();
  if (!info.steps.empty()) text += steps_text(info);
  return text + (tree ? tree_text(info) : "") + (chunks ? chunks_text(info) : "");
}

namespace {

Json json_of_types(const FileInfo& info) {
  Json types = Json::array();
  for (const auto& [type, cells] : info.types)
    types.push_back({{"type", maille::name_of(type)}, {"cells", cells}});
  return types;
}

}  // namespace

Json info_json(const FileInfo& info, const std::string& name, const std::optional<Sphere>& sphere) {
  Json around;  // null where it is not known
  if (sphere) around = {{"centre", sphere->centre.x}, {"radius", sphere->radius}};
  Json blocks = Json::array();
  for (const auto& [block, cells] : info.blocks) blocks.push_back({{"name", block}, {"cells", cells}});
  Json arrays = Json::array();
  for (const ArrayInfo& array : info.arrays) arrays.push_back(json_of(array));
  Json metadata = Json::array();
  for (const auto& [key, value] : info.metadata) metadata.push_back({{"key", key}, {"value", value}});
  Json steps = Json::array();
  for (const StepInfo& step : info.steps)
    steps.push_back({{"time", step.time}, {"coded_bytes", step.coded_bytes}, {"arrays", step.arrays}});
  Json chunks = Json::array();
  for (const ChunkInfo& chunk : info.chunks) {
    chunks.push_back(
        {{"type", chunk.type}, {"id", chunk.id}, {"offset", chunk.offset}, {"size", chunk.size}});
  }
  return {{"file", name},
          {"format", {{"major", info.format_major}, {"minor", info.format_minor}}},
          {"mode", name_of(info.mode)},
          {"effort", info.effort},
          {"order", name_of(info.order)},
          {"file_bytes", info.file_bytes},
          {"points", info.points},
          {"cells", info.cells},
          {"corners", info.corners},
          {"parts", info.parts},
          {"types", json_of_types(info)},
          {"most_points_in_use", info.most_points_in_use},
          {"decode_bytes", info.decode_bytes},
          {"levels", json_of_levels(info)},
          {"sphere", around},
          {"blocks", blocks},
          {"connectivity", json_of(info.connectivity)},
          {"positions", json_of(info.positions)},
          {"arrays", arrays},
          {"steps", steps},
          {"metadata", metadata},
          {"provenance", info.provenance},
          {"chunks", chunks},
          {"problems", info.problems}};
}

}  // namespace maille::tool
