#include "stencil_json.h"

#include <fmt/format.h>

#include "result.h"

namespace maille::tool {

namespace {

Result<std::vector<double>> position_from(const Json& json, const std::string& what) {
  std::vector<double> position;
  const bool list = json.is_array();
  if (list) {
    for (const Json& number : json) {
      if (number.is_number()) position.push_back(number.get<double>());
    }
  }
  if (!list || position.size() != json.size()) {
    return failure(ErrorCode::malformed_input, fmt::format("{} is no list of numbers", what));
  }
  return position;
}

/// A position, or an object with a label and a position.
Result<Stencil::Sample> sample_from(const Json& json, const std::string& what) {
  Stencil::Sample sample;
  if (json.is_object() && json.contains("label") && json["label"].is_string())
    sample.label = json["label"].get<std::string>();
  const Json position = json.is_object() ? json.value("position", Json()) : json;
  sample.position = TOOL_TRY(position_from(position, what));
  return sample;
}

Result<std::vector<Stencil::Sample>> samples_from(const Json& json, const std::string& kind) {
  std::vector<Stencil::Sample> samples;
  if (!json.is_array()) return failure(ErrorCode::malformed_input, fmt::format("\"{}\" is no list", kind));
  for (size_t i = 0; i < json.size(); ++i) {
    samples.push_back(TOOL_TRY(sample_from(json[i], fmt::format("\"{}\", sample {}", kind, i))));
  }
  return samples;
}

Result<std::vector<std::pair<uint32_t, uint32_t>>> edges_from(const Json& json) {
  std::vector<std::pair<uint32_t, uint32_t>> edges;
  const auto is_index = [](const Json& number) {
    return number.is_number_unsigned() && number.get<uint64_t>() < 1000;
  };
  for (const Json& edge : json) {
    if (!edge.is_array() || edge.size() != 2 || !is_index(edge[0]) || !is_index(edge[1])) {
      return failure(ErrorCode::malformed_input, "\"edges\" is no list of pairs of numbers of samples");
    }
    edges.emplace_back(edge[0].get<uint32_t>(), edge[1].get<uint32_t>());
  }
  return edges;
}

Result<Stencil> stencil_from(const Json& json) {
  if (!json.is_object()) return failure(ErrorCode::malformed_input, "is no JSON object");
  Stencil stencil;
  if (json.contains("name") && json["name"].is_string()) stencil.name = json["name"].get<std::string>();
  stencil.target = TOOL_TRY(position_from(json.value("target", Json()), "\"target\""));
  stencil.dimension = static_cast<unsigned>(stencil.target.size());
  stencil.known = TOOL_TRY(samples_from(json.value("known", Json()), "known"));
  stencil.hidden = TOOL_TRY(samples_from(json.value("hidden", Json::array()), "hidden"));
  stencil.edges = TOOL_TRY(edges_from(json.value("edges", Json::array())));
  return stencil;
}

const char* name_of(Covariance covariance) {
  if (covariance == Covariance::independent) return "independent";
  return covariance == Covariance::rotation ? "rotation" : "gaussian";
}

Json rule_json(const PredictionRule& rule) {
  if (rule.kind == PredictionRule::Kind::spectral) return {{"kind", "spectral"}};
  Json json = {{"kind", "taylor"}, {"covariance", name_of(rule.covariance)}, {"order", rule.order}};
  if (rule.noise > 0) {
    json["noise"] = rule.noise;
    json["exact"] = rule.exact_order;
  }
  return json;
}

}  // namespace

Result<Stencil> stencil_from_json(const std::string& text, const std::string& name) {
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return failure(ErrorCode::malformed_input, name + ": is no JSON");
  Result<Stencil> stencil = stencil_from(json);
  if (!stencil) return failure(stencil.error().code, name + ": " + stencil.error().message);
  return stencil;
}

Json prediction_json(const Stencil& stencil, const PredictionRule& rule, const Prediction& prediction) {
  Json json = {{"name", stencil.name}, {"rule", rule_json(rule)}, {"target", stencil.target}};
  json["known"] = Json::array();
  for (size_t i = 0; i < stencil.known.size(); ++i) {
    const Stencil::Sample& sample = stencil.known[i];
    json["known"].push_back(
        {{"label", sample.label}, {"position", sample.position}, {"weight", prediction.weights[i]}});
  }
  json["hidden"] = Json::array();
  for (const Stencil::Sample& sample : stencil.hidden) {
    json["hidden"].push_back({{"label", sample.label}, {"position", sample.position}});
  }
  json["edges"] = Json::array();
  for (const auto& [a, b] : stencil.edges) json["edges"].push_back(Json::array({a, b}));
  json["exactness"] = prediction.exactness;
  json["noise_gain"] = prediction.noise_gain;
  return json;
}

}  // namespace maille::tool
