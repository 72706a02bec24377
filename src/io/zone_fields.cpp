#include "io/zone_fields.h"

#include <maille/with_type.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <type_traits>

#include "base/result.h"

namespace maille {
namespace {

using Parts = std::vector<std::pair<std::vector<ElementRun>, Array>>;

/// None: the parts do not fit each other.
std::optional<Scalar> common_type(const Parts& parts) {
  Scalar type = parts[0].second.type;
  for (const auto& [runs, part] : parts) {
    if (part.components != parts[0].second.components) return std::nullopt;
    if (part.type == type) continue;
    if (!is_float(type) || !is_float(part.type)) return std::nullopt;
    type = Scalar::f64;
  }
  return type;
}

void fill(const Parts& parts, Array& array) {
  with_type(array.type, [&](auto to) {
    using To = decltype(to);
    const std::span<To> values = array.values<To>();
    if constexpr (std::is_floating_point_v<To>)
      std::fill(values.begin(), values.end(), std::numeric_limits<To>::quiet_NaN());
    for (const auto& part : parts) {
      with_type(part.second.type, [&](auto from) {
        auto value = part.second.values<decltype(from)>().begin();
        for (const ElementRun& run : part.first) {
          for (uint64_t i = 0; i < run.count * array.components; ++i)
            values[run.first * array.components + i] = static_cast<To>(*value++);
        }
      });
    }
  });
}

}  // namespace

void ZoneFields::add(std::vector<ElementRun> runs, Array values) {
  const auto [known, is_new] = numbers_.try_emplace({values.domain, values.name}, fields_.size());
  if (is_new) fields_.push_back({values.name, values.domain, {}});
  fields_[known->second].parts.emplace_back(std::move(runs), std::move(values));
}

Result<> ZoneFields::finish(uint64_t cells, Budget& budget, Mesh& mesh, std::vector<std::string>& notes) {
  for (Field& field : fields_) {
    const std::optional<Scalar> type = common_type(field.parts);
    if (!type) {
      notes.push_back("array \"" + field.name + "\" left out: it is not of one type in all zones");
      continue;
    }
    Array array = make_array(field.name, field.domain, *type, field.parts[0].second.components);
    const uint64_t count = field.domain == Domain::point ? mesh.point_count() : cells;
    MAILLE_CHECK(budget.take(count, array.tuple_size()));
    array.resize(count);
    fill(field.parts, array);
    field.parts.clear();
    mesh.arrays.push_back(std::move(array));
  }
  return {};
}

}  // namespace maille
