#include "tolerance.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <span>

#include "result.h"

namespace maille::tool {

namespace {

// Names that mean the positions, as the bare value does.
bool means_positions(const std::string& name) {
  return name.empty() || name == "position" || name == "positions";
}

// A finer lattice than the mantissa of a double has no use.
constexpr double largest_bits = 52;

Result<double> parse_value(const std::string& option, const std::string& text, Tolerance::Kind kind) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    return failure(ErrorCode::usage, fmt::format("{}: '{}' is not a number", option, text));
  }
  if (kind == Tolerance::Kind::bits) {
    if (value < 1 || value > largest_bits || value != std::floor(value)) {
      return failure(ErrorCode::usage,
                     fmt::format("{}: {} is not a whole number from 1 to {}", option, text, largest_bits));
    }
  } else if (!(value > 0)) {
    return failure(ErrorCode::usage,
                   fmt::format("{}: the error allowed must be above 0; leave it out for lossless", option));
  }
  return value;
}

Result<> add(Tolerances& all, const std::string& option, const std::string& text, Tolerance::Kind kind) {
  // The last sign: array names may hold one.
  const size_t equals = text.rfind('=');
  const std::string name = equals == std::string::npos ? "" : text.substr(0, equals);
  const std::string value = equals == std::string::npos ? text : text.substr(equals + 1);
  const Tolerance tolerance{kind, TOOL_TRY(parse_value(option, value, kind))};
  const bool positions = means_positions(name);
  const bool fresh = positions ? !all.positions.has_value() : all.arrays.emplace(name, tolerance).second;
  if (!fresh) {
    return failure(ErrorCode::usage, fmt::format("{} {}: there is another tolerance for {}; give only one",
                                                 option, text, positions ? "positions" : "'" + name + "'"));
  }
  if (positions) all.positions = tolerance;
  return {};
}

}  // namespace

Result<Tolerances> parse_tolerances(const CompressOptions& options) {
  Tolerances all;
  for (const std::string& text : options.error) {
    TOOL_CHECK(add(all, "--error", text, Tolerance::Kind::absolute));
  }
  for (const std::string& text : options.relative_error) {
    TOOL_CHECK(add(all, "--rel-error", text, Tolerance::Kind::relative));
  }
  for (const std::string& text : options.bits) {
    TOOL_CHECK(add(all, "--bits", text, Tolerance::Kind::bits));
  }
  if (options.lossless && !all.lossless()) {
    return failure(ErrorCode::usage, "--lossless contradicts --error, --rel-error and --bits; give only one");
  }
  return all;
}

Result<> check_names(const Tolerances& tolerances, const Mesh& mesh, const std::string& input) {
  for (const auto& [name, tolerance] : tolerances.arrays) {
    const bool found = std::any_of(mesh.arrays.begin(), mesh.arrays.end(),
                                   [&name = name](const Array& array) { return array.name == name; });
    if (found) continue;
    std::vector<std::string> known = {"position"};
    for (const Array& array : mesh.arrays) known.push_back(array.name);
    return failure(ErrorCode::usage,
                   fmt::format("{}: has no array '{}'; it has: {}", input, name, fmt::join(known, ", ")));
  }
  return {};
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
  constexpr double much = 0.01;  // of the diagonal
  if (!tolerances.positions || tolerances.positions->kind != Tolerance::Kind::absolute) return {};
  const double diagonal = diagonal_of(mesh), error = tolerances.positions->value;
  if (!(diagonal > 0) || error < much * diagonal) return {};
  return fmt::format("an error of {} is {:.0f} % of the size of the mesh, whose box has a diagonal of {:.4g}",
                     error, 100 * error / diagonal, diagonal);
}

}  // namespace maille::tool
