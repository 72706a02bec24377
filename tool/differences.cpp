#include "differences.h"

#include <fmt/format.h>

#include "text.h"

namespace maille::tool {

std::string differences_text(const std::vector<ArrayDifference>& differences) {
  Table table({"array", "domain", "max error", "rms error", "unequal"}, 2);
  for (const ArrayDifference& array : differences) {
    table.row({array.name, maille::name_of(array.domain), number(array.maximum),
               number(array.root_mean_square), fmt::format("{}", array.unequal)});
  }
  return table.str();
}

Json differences_json(const std::vector<ArrayDifference>& differences) {
  Json arrays = Json::array();
  for (const ArrayDifference& array : differences) {
    arrays.push_back({{"name", array.name},
                      {"domain", maille::name_of(array.domain)},
                      {"maximum_error", array.maximum},
                      {"rms_error", array.root_mean_square},
                      {"unequal", array.unequal}});
  }
  return arrays;
}

}  // namespace maille::tool
