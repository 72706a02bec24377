#include "tolerance.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <span>

#include "result.h"
#include "spelling.h"
#include "text.h"

namespace maille::tool {

namespace {

// Names that mean the positions, as the bare value does.
bool means_positions(const std::string& name) {
  return name.empty() || name == "position" || name == "positions";
}

// A finer lattice than the mantissa of a double has no use.
constexpr double largest_bits = 52;

constexpr LengthUnit units[] = {{"um", 1e-6}, {"mm", 1e-3},   {"cm", 1e-2},
                                {"m", 1},     {"in", 0.0254}, {"ft", 0.3048}};

/// The unit at the end of "0.1mm", which is taken off there.
const LengthUnit* take_unit(std::string& text) {
  const size_t last = text.find_last_not_of("abcdefghijklmnopqrstuvwxyz");
  if (last == std::string::npos) return nullptr;
  for (const LengthUnit& unit : units) {
    if (text.compare(last + 1, std::string::npos, unit.name) != 0) continue;
    text.resize(last + 1);
    return &unit;
  }
  return nullptr;
}

/// Why a text is not a number, as far as that is plain.
std::string hint_at_number(const std::string& text) {
  std::string with_point = text;
  std::replace(with_point.begin(), with_point.end(), ',', '.');
  if (with_point != text && parse_number<double>(with_point)) return fmt::format("; write {}", with_point);
  if (text.ends_with('%')) return "; only --error, --rel-error and --pw-rel-error take percentages";
  if (text.find('=') == std::string::npos && text.find_first_of("0123456789") == std::string::npos)
    return "; write a number, or NAME= and a number for an array";
  // "0.1mm"
  const size_t unit = std::min(text.find_first_not_of("0123456789."), text.size());
  const std::string digits = text.substr(0, unit);
  const bool letters = std::all_of(text.begin() + static_cast<std::ptrdiff_t>(unit), text.end(),
                                   [](unsigned char c) { return std::isalpha(c) != 0; });
  if (letters && parse_number<double>(digits))
    return fmt::format("; units are um, mm, cm, m, in and ft, for --error and --norm-error of positions");
  return "";
}

Result<double> parse_value(const std::string& option, const std::string& text, Tolerance::Kind kind) {
  const std::optional<double> number = parse_number<double>(text);
  if (!number || !std::isfinite(*number)) {
    return failure(ErrorCode::usage,
                   fmt::format("{}: '{}' is not a number{}", option, text, hint_at_number(text)));
  }
  const double value = *number;
  if (kind == Tolerance::Kind::bits) {
    if (value < 1 || value > largest_bits || value != std::floor(value)) {
      return failure(ErrorCode::usage,
                     fmt::format("{}: {} is not a whole number from 1 to {}", option, text, largest_bits));
    }
  } else if (!(value > 0)) {
    const char* meant = kind == Tolerance::Kind::psnr ? "ratio" : "error allowed";
    return failure(ErrorCode::usage,
                   fmt::format("{}: the {} must be above 0; leave it out for lossless", option, meant));
  } else if (kind == Tolerance::Kind::pointwise && value >= 1) {
    return failure(ErrorCode::usage,
                   fmt::format("{}: {} is not below 1, so all would become 0", option, text));
  }
  return value;
}

/// "0.01", or a percentage: of the size of the mesh or the range of an array, which makes of --error what
/// --rel-error is.
Result<Tolerance> parse_tolerance(const std::string& option, const std::string& text, Tolerance::Kind kind) {
  using Kind = Tolerance::Kind;
  const bool takes_percent = kind == Kind::absolute || kind == Kind::relative || kind == Kind::pointwise;
  if (!takes_percent || !text.ends_with('%'))
    return Tolerance{kind, TOOL_TRY(parse_value(option, text, kind))};
  const Kind meant = kind == Kind::absolute ? Kind::relative : kind;
  const double percent = TOOL_TRY(parse_value(option, text.substr(0, text.size() - 1), Kind::relative));
  if (meant == Kind::pointwise && percent >= 100)
    return failure(ErrorCode::usage,
                   fmt::format("{}: {} is not below 100 %, so all would become 0", option, text));
  return Tolerance{meant, percent / 100};
}

Result<> add(Tolerances& all, const std::string& option, const std::string& text, Tolerance::Kind kind) {
  const std::string name = bound_name(text);
  const size_t equals = text.rfind('=');
  std::string value = equals == std::string::npos ? text : text.substr(equals + 1);
  const bool positions = means_positions(name);
  const bool is_length = kind == Tolerance::Kind::absolute || kind == Tolerance::Kind::norm;
  const LengthUnit* const unit = positions && is_length ? take_unit(value) : nullptr;
  const Tolerance tolerance = TOOL_TRY(parse_tolerance(option, value, kind));
  const bool fresh = positions ? !all.positions.has_value() : all.arrays.emplace(name, tolerance).second;
  if (!fresh) {
    return failure(ErrorCode::usage, fmt::format("{} {}: there is another tolerance for {}; give only one",
                                                 option, text, positions ? "positions" : "'" + name + "'"));
  }
  if (positions) {
    all.positions = tolerance;
    all.unit = unit;
  }
  return {};
}

}  // namespace

const std::array<BoundOption, 6> bound_options = {{
    {Tolerance::Kind::absolute, "--error", "-e,--error", "X|NAME=X",
     "Largest error allowed in each coordinate of the positions, in file units, or in each "
     "component of the array NAME; X% means --rel-error; 0.1mm (um, mm, cm, m, in, ft) is a length "
     "where the file has a unit, as glTF and 3MF do; repeatable"},
    {Tolerance::Kind::relative, "--rel-error", "--rel-error", "X|NAME=X",
     "The same as a fraction of the diagonal of the bounding box (positions) or of the range "
     "of values (NAME: of the component with the widest range); repeatable"},
    {Tolerance::Kind::pointwise, "--pw-rel-error", "--pw-rel-error", "X|NAME=X",
     "The same as a fraction (below 1) of each value, so that zeros and signs are kept; only "
     "for mode stream; repeatable"},
    {Tolerance::Kind::norm, "--norm-error", "--norm-error", "X|NAME=X",
     "Largest length of the error vector of each position, or of each tuple of the array "
     "NAME; repeatable"},
    {Tolerance::Kind::psnr, "--psnr", "--psnr", "DB|NAME=DB",
     "Least peak signal-to-noise ratio, in decibels: 20 log10 of the range divided by the "
     "root of the mean squared error; repeatable"},
    {Tolerance::Kind::bits, "--bits", "--bits", "N|NAME=N",
     "Round to a lattice of 2^N values over the longest side of the bounding box (positions) "
     "or over the range of values (NAME); repeatable"},
}};

Result<Tolerances> parse_tolerances(const CompressOptions& options) {
  Tolerances all;
  for (const BoundOption& option : bound_options) {
    const auto texts = options.bounds.find(option.kind);
    if (texts == options.bounds.end()) continue;
    for (const std::string& text : texts->second) TOOL_CHECK(add(all, option.name, text, option.kind));
  }
  if (options.lossless && !all.lossless()) {
    return failure(ErrorCode::usage, "--lossless contradicts every bound of an error; give only one");
  }
  return all;
}

namespace {

/// What a word means in other programs, formats and spellings; Role::none for names of a mesh's own.
Role role_called(const std::string& name) {
  const std::string word = lower_case(name);
  static const std::map<std::string, Role> roles = {
      {"normal", Role::normal},
      {"normals", Role::normal},
      {"color", Role::colour},
      {"colors", Role::colour},
      {"colour", Role::colour},
      {"colours", Role::colour},
      {"rgb", Role::colour},
      {"rgba", Role::colour},
      {"color_0", Role::colour},
      {"texcoord", Role::texture_coordinate},
      {"texcoords", Role::texture_coordinate},
      {"texcoord_0", Role::texture_coordinate},
      {"texture_coordinate", Role::texture_coordinate},
      {"texture_coordinates", Role::texture_coordinate},
      {"uv", Role::texture_coordinate},
      {"uvs", Role::texture_coordinate},
      {"tangent", Role::tangent},
      {"tangents", Role::tangent},
  };
  const auto found = roles.find(word);
  return found == roles.end() ? Role::none : found->second;
}

}  // namespace

std::string bound_name(const std::string& text) {
  // The last sign: array names may hold one.
  const size_t equals = text.rfind('=');
  return equals == std::string::npos ? "" : text.substr(0, equals);
}

bool means_same_array(const std::string& a, const std::string& b) {
  if (a == b || (means_positions(a) && means_positions(b))) return true;
  return role_called(a) != Role::none && role_called(a) == role_called(b);
}

Result<std::vector<std::string>> arrays_called(const std::string& name, const std::vector<Array>& arrays,
                                               const std::string& input) {
  const auto has_name = [&](const Array& array) { return array.name == name; };
  if (std::any_of(arrays.begin(), arrays.end(), has_name)) return std::vector<std::string>{name};
  std::vector<std::string> names, known = {"position"};
  const Role role = role_called(name);
  for (const Array& array : arrays) {
    known.push_back(array.name);
    if (role != Role::none && array.role == role) names.push_back(array.name);
  }
  if (role != Role::none) return names;
  return no_array(input, name, known);
}

namespace {

/// In units of the file.
Result<std::optional<Tolerance>> positions_of(const Tolerances& asked, const std::string& input,
                                              std::optional<double> metres) {
  if (asked.unit == nullptr || !asked.positions) return asked.positions;
  if (!metres) {
    return failure(ErrorCode::usage,
                   fmt::format("{}: does not say what its lengths count in (glTF and 3MF do), so {}{} has no "
                               "meaning; give the number without the unit, as the file counts",
                               input, asked.positions->value, asked.unit->name));
  }
  Tolerance found = *asked.positions;
  if (asked.unit->metres != *metres) found.value *= asked.unit->metres / *metres;
  return found;
}

}  // namespace

Result<Tolerances> tolerances_of(const Tolerances& asked, const std::vector<Array>& arrays,
                                 const std::string& input, bool quiet, std::optional<double> metres) {
  Tolerances found;
  found.positions = TOOL_TRY(positions_of(asked, input, metres));
  std::vector<std::string> notes;
  for (const auto& [name, tolerance] : asked.arrays) {
    const std::vector<std::string> names = TOOL_TRY(arrays_called(name, arrays, input));
    if (names.empty()) notes.push_back(fmt::format("it has no array '{}'; that bound is not used", name));
    // A bound by the array's own name comes first.
    for (const std::string& own : names) {
      if (own == name || asked.arrays.count(own) == 0) found.arrays[own] = tolerance;
    }
  }
  say_notes(input, notes, quiet);
  return found;
}

std::optional<double> metres_of_unit(const Mesh& mesh, const std::string& format) {
  static const std::map<std::string, double> names = {{"micron", 1e-6},     {"millimeter", 1e-3},
                                                      {"centimeter", 1e-2}, {"inch", 0.0254},
                                                      {"foot", 0.3048},     {"meter", 1}};
  bool is_3mf = format == "3mf", is_gltf = format == "glb" || format == "gltf" || format == "b3dm";
  for (const auto& [key, value] : mesh.metadata) {
    if (key == "3mf.unit") {
      const auto unit = names.find(value);
      return unit == names.end() ? std::nullopt : std::optional<double>(unit->second);
    }
    is_3mf |= key.starts_with("3mf.");
    is_gltf |= key.starts_with("gltf.");
  }
  // A 3MF file that says nothing counts in millimetres; glTF has metres only.
  if (is_3mf) return 1e-3;
  return is_gltf ? std::optional<double>(1) : std::nullopt;
}

namespace {

/// Of the box around all finite positions; 0 where there are none, or where they are no floats.
template <class T>
double diagonal_of(std::span<const T> coordinates) {
  double squares = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (size_t i = axis; i < coordinates.size(); i += 3) {
      const auto value = static_cast<double>(coordinates[i]);
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    if (low < high) squares += (high - low) * (high - low);
  }
  return std::sqrt(squares);
}

double diagonal_of(const Mesh& mesh) {
  if (mesh.points.components != 3) return 0;
  if (mesh.points.type == Scalar::f32) return diagonal_of(mesh.points.values<float>());
  return mesh.points.type == Scalar::f64 ? diagonal_of(mesh.points.values<double>()) : 0;
}

}  // namespace

std::optional<std::string> note_of_size(const Tolerances& tolerances, const Mesh& mesh) {
  // Chosen, not swept: an error of a hundredth is plain to see.
  constexpr double much = 0.01;  // of the diagonal
  using Kind = Tolerance::Kind;
  if (!tolerances.positions) return {};
  const auto [kind, value] = *tolerances.positions;
  const double diagonal = diagonal_of(mesh), error = kind == Kind::relative ? value * diagonal : value;
  // Whoever gives a fraction below 1 knows what it is of the mesh.
  if ((kind != Kind::absolute && kind != Kind::relative) || (kind == Kind::relative && value < 1)) return {};
  if (!(diagonal > 0) || error < much * diagonal) return {};
  if (error >= diagonal) {
    return fmt::format(
        "an error of {:g} is no less than the size of the mesh, whose box has a diagonal of {:.4g}", error,
        diagonal);
  }
  return fmt::format(
      "an error of {:g} is {:.0f} % of the size of the mesh, whose box has a diagonal of {:.4g}", error,
      100 * error / diagonal, diagonal);
}

namespace {

/// The component with the widest range: its finite values.
std::vector<double> widest_component(const Array& array) {
  std::vector<double> widest;
  double range = -1;
  for (size_t k = 0; k < array.components; ++k) {
    std::vector<double> values;
    for (size_t i = k; i < array.count() * array.components; i += array.components) {
      const double value = array.type == Scalar::f32 ? static_cast<double>(array.values<float>()[i])
                                                     : array.values<double>()[i];
      if (std::isfinite(value)) values.push_back(value);
    }
    if (values.empty()) continue;
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    if (*high - *low > range) {
      range = *high - *low;
      widest = std::move(values);
    }
  }
  return widest;
}

}  // namespace

std::vector<std::string> notes_of_ranges(const Tolerances& tolerances, const Mesh& mesh) {
  std::vector<std::string> notes;
  for (const Array& array : mesh.arrays) {
    const auto found = tolerances.arrays.find(array.name);
    if (found == tolerances.arrays.end() || found->second.kind != Tolerance::Kind::relative) continue;
    if (array.type != Scalar::f32 && array.type != Scalar::f64) continue;
    std::vector<double> values = widest_component(array);
    // At most half a percent of the values, and at most eight: these may have been set by hand. Chosen, not
    // swept.
    const size_t few = std::min<size_t>(values.size() / 200, 8);  // at either end
    if (few == 0) continue;
    const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
    const double range = *greatest - *least;
    const auto ranked = [&](size_t rank) {
      std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(rank), values.end());
      return values[rank];
    };
    const double inner = ranked(values.size() - 1 - few) - ranked(few);
    // Below half of the range, all other values lose at least one of the bits that were meant to be kept.
    if (inner >= range / 2) continue;
    notes.push_back(
        fmt::format("the bound of '{}' is a part of its range, {:.4g}, but all values except {} lie within "
                    "{:.4g}; --error "
                    "gives a bound that does not depend on these few",
                    array.name, range, 2 * few, inner));
  }
  return notes;
}

}  // namespace maille::tool
