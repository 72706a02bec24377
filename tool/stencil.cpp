#include <fmt/format.h>
#include <fmt/ranges.h>
#include <maille/predict.h>

#include <cmath>

#include "files.h"
#include "result.h"
#include "stencil_json.h"
#include "text.h"
#include "verbs.h"

namespace maille::tool {

namespace {

// A stencil has 64 samples at most; no sensible file of one is larger.
constexpr uint64_t largest_file = 1 << 20;

Result<int> list_families(const CommonOptions& common) {
  Table table({"stencil", "what is predicted, from what"}, 2);
  Json json = Json::array();
  for (const StencilFamily& family : stencil_families()) {
    table.row({family.usage, family.description});
    json.push_back({{"name", family.name}, {"usage", family.usage}, {"description", family.description}});
  }
  TOOL_CHECK(answer(common.json ? dump(json) : table.str()));
  return 0;
}

Result<NamedStencil> read_stencil(const std::string& path) {
  const Input input = TOOL_TRY(open_input(path));
  const uint64_t size = input.source->size();
  if (size > largest_file)
    return failure(ErrorCode::malformed_input, fmt::format("{}: is no stencil", input_name(path)));
  std::string text(size, '\0');
  TOOL_CHECK(input.source->read_at(0, std::as_writable_bytes(std::span(text))));
  Stencil stencil = TOOL_TRY(stencil_from_json(text, input_name(path)));
  return NamedStencil{std::move(stencil), {}};
}

Result<NamedStencil> find_stencil(const StencilOptions& options) {
  if (!options.name.empty() && !options.file.empty()) {
    return failure(ErrorCode::usage, "stencil: give a name or a file, not both");
  }
  return options.file.empty() ? named_stencil(options.name) : read_stencil(options.file);
}

/// What was asked for, on top of what is usual for the stencil.
PredictionRule rule_of(const StencilOptions& options, PredictionRule rule) {
  const bool taylor = options.covariance || options.order || options.noise || options.exact_order;
  if (options.rule == "spectral") rule.kind = PredictionRule::Kind::spectral;
  if (options.rule == "taylor" || (options.rule.empty() && taylor)) rule.kind = PredictionRule::Kind::taylor;
  rule.covariance = options.covariance.value_or(rule.covariance);
  rule.noise = options.noise.value_or(rule.noise);
  // With noise, derivatives of high order are not worth following.
  rule.order = options.order.value_or(rule.noise > 0 ? 2 : rule.order);
  rule.exact_order = options.exact_order.value_or(rule.exact_order);
  return rule;
}

/// " = 5/12" where a weight is a simple fraction.
std::string fraction(double weight) {
  // Weights of the usual stencils are fractions of small numbers, and 5/12 says more than 0.4166666667.
  for (int denominator = 1; denominator <= 128; ++denominator) {
    const double numerator = std::round(weight * denominator);
    if (std::fabs(weight * denominator - numerator) > 1e-9) continue;
    return denominator == 1 ? "" : fmt::format("{:.0f}/{}", numerator, denominator);
  }
  return "";
}

std::string coordinates(const std::vector<double>& position) {
  std::vector<std::string> parts;
  for (const double x : position) parts.push_back(fmt::format("{:.4f}", std::fabs(x) < 1e-12 ? 0 : x));
  return fmt::format("{}", fmt::join(parts, " "));
}

std::string rule_text(const PredictionRule& rule) {
  if (rule.kind == PredictionRule::Kind::spectral) return "by its spectrum";
  const char* const covariances[] = {"independent", "rotation", "gaussian"};
  std::string text =
      fmt::format("by Taylor expansion (covariance: {}", covariances[static_cast<int>(rule.covariance)]);
  if (rule.order < largest_taylor_order) text += fmt::format("; order: {}", rule.order);
  if (rule.noise > 0) text += fmt::format("; noise: {}", number(rule.noise));
  return text + ")";
}

std::string prediction_text(const Stencil& stencil, const PredictionRule& rule,
                            const Prediction& prediction) {
  Table table({"sample", "position", "weight", ""}, 1);
  for (size_t i = 0; i < stencil.known.size(); ++i) {
    const Stencil::Sample& sample = stencil.known[i];
    const double weight = prediction.weights[i];
    table.row({sample.label.empty() ? fmt::format("{}", i) : sample.label, coordinates(sample.position),
               fmt::format("{:.10f}", std::fabs(weight) < 5e-11 ? 0 : weight), fraction(weight)});
  }
  const std::string exact = prediction.exactness < 0
                                ? "no polynomials"
                                : fmt::format("polynomials up to degree {}", prediction.exactness);
  return fmt::format("{}, at {}, {}\n{}exact for {}; noise gain {}\n",
                     stencil.name.empty() ? "stencil" : stencil.name, coordinates(stencil.target),
                     rule_text(rule), table.str(), exact, number(prediction.noise_gain));
}

}  // namespace

Result<int> run(const StencilOptions& options) {
  if (options.name.empty() && options.file.empty()) return list_families(options.common);
  const NamedStencil named = TOOL_TRY(find_stencil(options));
  const PredictionRule rule = rule_of(options, named.rule);
  const auto predicted = predict(named.stencil, rule);
  if (!predicted && !options.file.empty()) {
    return failure(predicted.error().code, input_name(options.file) + ": " + predicted.error().message);
  }
  const Prediction prediction = TOOL_TRY(predicted);
  if (options.common.json) {
    TOOL_CHECK(answer(dump(prediction_json(named.stencil, rule, prediction))));
  } else {
    TOOL_CHECK(answer(prediction_text(named.stencil, rule, prediction)));
  }
  return 0;
}

}  // namespace maille::tool
