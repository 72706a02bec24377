#include <fmt/format.h>
#include <fmt/ranges.h>
#include <maille/slice.h>

#include "result.h"
#include "summary.h"
#include "text.h"
#include "verbs.h"
#include "volume_cells.h"

namespace maille::tool {

namespace {

std::string text_of(const ProbedValues& probed, const Vector3& place) {
  std::string text = fmt::format("{}, {}, {}: ", place[0], place[1], place[2]);
  if (!probed.inside) return text + "in no cell\n";
  text += "in a cell\n";
  for (const ProbedValues::Value& value : probed.values)
    text += fmt::format("  {} ({}): {}\n", value.name, maille::name_of(value.domain),
                        fmt::join(value.components, ", "));
  return text;
}

Json json_of(const ProbedValues& probed, const Vector3& place) {
  Json values = Json::array();
  for (const ProbedValues::Value& value : probed.values)
    values.push_back(
        {{"name", value.name}, {"domain", maille::name_of(value.domain)}, {"value", value.components}});
  return {{"at", place.x}, {"inside", probed.inside}, {"arrays", values}};
}

}  // namespace

Result<int> run(const ProbeOptions& options) {
  if (options.places.size() % 3 != 0)
    return failure(ErrorCode::usage, "--at: each place has three numbers, separated by commas");
  std::vector<Vector3> places;
  for (size_t i = 0; i + 3 <= options.places.size(); i += 3)
    places.push_back({{options.places[i], options.places[i + 1], options.places[i + 2]}});
  VolumeInput input = TOOL_TRY(VolumeInput::open(options));
  std::vector<ProbedValues> probed;
  for (const Vector3& place : places) {
    VolumeQuery query;
    // A box of no size: of a volume in pieces only those are read whose boxes hold the place.
    query.region.box = Box{place, place};
    const Mesh& cells = *TOOL_TRY(input.cells(query));
    probed.push_back(probe(cells, std::span(&place, 1)).front());
  }
  Json json = Json::array();
  std::string text;
  bool all = true;
  for (size_t i = 0; i < places.size(); ++i) {
    json.push_back(json_of(probed[i], places[i]));
    text += text_of(probed[i], places[i]);
    all = all && probed[i].inside;
  }
  TOOL_CHECK(answer(options.common.json ? dump(json) : text));
  // The exit code tells scripts whether all places lie in cells, as that of diff tells whether meshes differ.
  return all ? 0 : 1;
}

}  // namespace maille::tool
