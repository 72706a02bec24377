// extract of files of mode stream.
#include "extract_volume.h"

#include <fmt/format.h>

#include <cmath>

#include "part_output.h"
#include "result.h"
#include "spelling.h"
#include "summary.h"
#include "text.h"
#include "volume_cells.h"

namespace maille::tool {

namespace {

std::string trimmed(const std::string& text) {
  const size_t first = text.find_first_not_of(' '), last = text.find_last_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

/// "inf" is a limit, "nan" is none: no value would be wanted.
std::optional<double> limit_in(const std::string& text) {
  const std::optional<double> value = parse_number<double>(text);
  return value && !std::isnan(*value) ? value : std::nullopt;
}

struct QuotedName {
  std::string name;
  size_t end;  ///< the place behind the closing quote
};

/// The name in double quotes at the start of a text; two quotes in it stand for one.
std::optional<QuotedName> quoted_name(const std::string& text) {
  std::string name;
  for (size_t i = 1; i < text.size(); ++i) {
    const bool quote = text[i] == '"';
    if (quote && text.compare(i, 2, "\"\"") != 0) return QuotedName{name, i + 1};
    name += text[i];
    if (quote) ++i;
  }
  return std::nullopt;
}

/// "[0]" behind a name.
std::optional<uint32_t> component_in(const std::string& text) {
  if (text.size() < 3 || text.front() != '[' || text.back() != ']') return std::nullopt;
  return parse_number<uint32_t>(text.substr(1, text.size() - 2));
}

/// "velocity[0]", "p [Pa]" (no number, so it belongs to the name) or "\"v[0]\"[1]": the name, and which
/// component.
bool set_name(const std::string& text, ValueCondition& condition) {
  if (text.starts_with('"')) {
    const auto quoted = quoted_name(text);
    if (!quoted) return false;
    const std::string rest = trimmed(text.substr(quoted->end));
    condition.array = quoted->name;
    condition.component = component_in(rest);
    return rest.empty() || condition.component;
  }
  const size_t open = std::min(text.rfind('['), text.size());
  condition.component = component_in(text.substr(open));
  condition.array = condition.component ? trimmed(text.substr(0, open)) : text;
  return !condition.array.empty();
}

/// Where the operator is; behind a name in quotes, if there is one.
size_t place_of_operator(const std::string& text) {
  const auto quoted = text.starts_with('"') ? quoted_name(text) : std::nullopt;
  return text.find_first_of("<>=", quoted ? quoted->end : 0);
}

/// What stands behind the name: an operator and a number, or after "=" a range.
bool set_range(const std::string& text, ValueCondition& condition) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const bool or_equal = text.size() > 1 && text[1] == '=';
  const std::string rest = text.substr(or_equal ? 2 : 1);
  if (const size_t colon = rest.find(':'); text[0] == '=' && colon != std::string::npos) {
    const auto low = limit_in(rest.substr(0, colon)), high = limit_in(rest.substr(colon + 1));
    if (!low || !high) return false;
    condition.low = *low;
    condition.high = *high;
    return true;
  }
  const auto number = limit_in(rest);
  if (!number) return false;
  // Conditions include their ends, so a strict comparison takes the next double.
  if (text[0] == '>') condition.low = or_equal ? *number : std::nextafter(*number, infinity);
  if (text[0] == '<') condition.high = or_equal ? *number : std::nextafter(*number, -infinity);
  if (text[0] == '=') condition.low = condition.high = *number;
  return true;
}

Result<VolumeQuery> query_of(const ExtractOptions& options) {
  VolumeQuery query;
  query.region = TOOL_TRY(region_of(options));
  if (!options.plane.empty()) query.plane = TOOL_TRY(plane_of(options.plane));
  for (const std::string& text : options.where) query.conditions.push_back(TOOL_TRY(parse_condition(text)));
  if (!options.cells.empty()) {
    const size_t colon = options.cells.find(':');
    const auto first = parse_number<uint64_t>(options.cells.substr(0, colon));
    const auto end =
        parse_number<uint64_t>(colon == std::string::npos ? "" : options.cells.substr(colon + 1));
    if (!first || !end || *end < *first) {
      return failure(ErrorCode::usage,
                     fmt::format("--cells {}: two numbers, the first cell and the one behind the last, as in "
                                 "100:200",
                                 options.cells));
    }
    query.cells = {*first, *end};
  }
  return query;
}

void add_numbers(const std::string& name, Domain domain, const std::vector<uint32_t>& numbers, Mesh& mesh) {
  Array array = make_array(name, domain, Scalar::u32, 1);
  array.resize(numbers.size());
  std::copy(numbers.begin(), numbers.end(), array.values<uint32_t>().begin());
  // The mesh may have an array of this name; its values were asked for, and stay.
  if (mesh.find(name, domain) == nullptr) mesh.arrays.push_back(std::move(array));
}

Result<> report(const ExtractOptions& options, const Input& input, const VolumeFile& file,
                const ExtractedVolume& found, double seconds) {
  if (options.common.json) {
    Json json = {{"input", input_name(options.input)},
                 {"output", options.output},
                 {"pieces", found.pieces},
                 {"of_pieces", file.pieces()},
                 {"cells_read", found.cells_read},
                 {"damaged_pieces", found.problems.size()},
                 {"points", found.mesh.point_count()},
                 {"cells", found.mesh.cell_count()},
                 {"seconds", seconds}};
    add_fetched(input, json);
    return answer(dump(json));
  }
  if (options.common.quiet) return {};
  const std::string from = options.coarse
                               ? "from the index"
                               : fmt::format("of {} of {}", found.pieces, counted(file.pieces(), "piece"));
  say(fmt::format("{} -> {}: {}, {}, {}, {:.2f} s", input_name(options.input), output_name(options.output),
                  counted(found.mesh.point_count(), "point"), counted(found.mesh.cell_count(), "cell"), from,
                  seconds));
  say_fetched(input);
  return {};
}

Result<ExtractedVolume> extract_cells(const ExtractOptions& options, const Input& input,
                                      const VolumeFile& file) {
  const VolumeQuery query = TOOL_TRY(query_of(options));
  for (const ValueCondition& condition : query.conditions) {
    TOOL_CHECK(
        check_names(input_name(options.input), {condition.array}, names_of_arrays(file.description())));
  }
  TOOL_CHECK(allow(file, query, input));
  ExtractedVolume found = TOOL_TRY(file.extract(query));
  for (const std::string& problem : found.problems) complain(problem);
  if (found.mesh.cell_count() == 0) {
    const bool damaged = !found.problems.empty();
    return failure(damaged ? ErrorCode::corrupt : ErrorCode::usage,
                   fmt::format("{}: no cell{} lies there or has such values", input_name(options.input),
                               damaged ? " outside of the damage" : ""));
  }
  if (!options.numbers) return found;
  if (found.cell_numbers.empty()) {
    return failure(ErrorCode::usage,
                   fmt::format("{}: --numbers: the file does not keep the order of the input",
                               input_name(options.input)));
  }
  add_numbers("input_cell", Domain::cell, found.cell_numbers, found.mesh);
  add_numbers("input_point", Domain::point, found.point_numbers, found.mesh);
  return found;
}

/// The first option given that is for surfaces of mode random only.
const char* random_option(const ExtractOptions& options) {
  if (options.level) return "--level";
  if (options.error) return "--error";
  if (options.triangles) return "--triangles";
  if (!options.eye.empty()) return "--eye";
  if (!options.nearest.empty()) return "--nearest";
  if (!options.component.empty()) return "--component";
  if (options.whole_charts) return "--whole-charts";
  return options.chart_numbers ? "--chart-numbers" : nullptr;
}

}  // namespace

Result<Region> region_of(const ExtractOptions& options) {
  Region region;
  const auto point = [](const std::vector<double>& numbers, size_t first) {
    return Vector3{{numbers[first], numbers[first + 1], numbers[first + 2]}};
  };
  if (!options.box.empty()) {
    region.box = Box{point(options.box, 0), point(options.box, 3)};
    for (unsigned k = 0; k < 3; ++k) {
      if (region.box->low[k] <= region.box->high[k]) continue;
      return failure(ErrorCode::usage, "--box: the lowest corner comes first, then the highest");
    }
  }
  if (!options.sphere.empty() && !(options.sphere[3] >= 0))
    return failure(ErrorCode::usage, "--sphere: the last number is its radius, which must not be negative");
  if (!options.sphere.empty()) region.sphere = Sphere{point(options.sphere, 0), options.sphere[3]};
  return region;
}

Result<ValueCondition> parse_condition(const std::string& text) {
  ValueCondition condition;
  const std::string wanted = trimmed(text);
  const size_t at = place_of_operator(wanted);
  const bool differs = at != std::string::npos && at > 0 && wanted.compare(at - 1, 2, "!=") == 0;
  if (at != std::string::npos && !differs && set_name(trimmed(wanted.substr(0, at)), condition) &&
      set_range(wanted.substr(at), condition))
    return condition;
  return failure(
      ErrorCode::usage,
      fmt::format("--where '{}': an array, one of > >= < <= = and a number, as in 'T > 500', or a range, as "
                  "in 'T = 100:500'; NAME[0] is the first component; put a name that has < > = or [0] in it "
                  "in double quotes",
                  text));
}

Result<> check_no_volume_options(const ExtractOptions& options) {
  const char* found = !options.plane.empty()   ? "--plane"
                      : !options.where.empty() ? "--where"
                      : !options.cells.empty() ? "--cells"
                      : options.arrays         ? "--arrays"
                      : options.numbers        ? "--numbers"
                      : options.coarse         ? "--coarse"
                      : options.step != 0      ? "--step"
                                               : nullptr;
  if (found == nullptr) return {};
  return failure(ErrorCode::usage, fmt::format("{}: {} is for volumes, files of mode stream",
                                               input_name(options.input), found));
}

Result<int> extract_volume(const ExtractOptions& options, const Input& input, const std::string& format) {
  const Stopwatch whole;
  if (const char* found = random_option(options)) {
    return failure(ErrorCode::usage, fmt::format("{}: {} is for surfaces, files of mode random",
                                                 input_name(options.input), found));
  }
  const Threads threads(options.common.threads);
  DecodeOptions decoding;
  decoding.limits.mesh_bytes = options.common.memory;
  decoding.arrays = options.arrays;
  decoding.step = options.step;
  decoding.executor = threads.executor();
  const VolumeFile file = TOOL_TRY(VolumeFile::open(*input.source, decoding));
  if (options.arrays)
    TOOL_CHECK(check_names(input_name(options.input), *options.arrays, names_of_arrays(file.description())));
  ExtractedVolume found;
  if (options.coarse) {
    found.mesh = TOOL_TRY(file.coarse());
  } else {
    found = TOOL_TRY(extract_cells(options, input, file));
  }
  TOOL_CHECK(write_part(found.mesh, options.input, options, format, options.common));
  TOOL_CHECK(report(options, input, file, found, whole.seconds()));
  return found.problems.empty() ? 0 : static_cast<int>(ErrorCode::corrupt);
}

}  // namespace maille::tool
