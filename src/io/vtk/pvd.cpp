#include "io/vtk/pvd.h"

#include <cmath>
#include <pugixml.hpp>
#include <string_view>

#include "base/result.h"
#include "io/beside.h"
#include "io/numbers.h"
#include "io/reading.h"
#include "io/text_scanner.h"

namespace maille {
namespace {

/// The time of an entry; 0 where a list has no times.
Result<double> time_of(const pugi::xml_node& entry, const std::string& list) {
  const pugi::xml_attribute attribute = entry.attribute("timestep");
  if (!attribute) return 0.0;
  const std::string_view text = trim(attribute.value());
  const char* const end = text.data() + text.size();
  Number number;
  if (parse_number(text.data(), end, number) == end && std::isfinite(number.value)) return number.value;
  return failure(ErrorCode::malformed_input,
                 list + ": the timestep \"" + std::string(text) + "\" is no finite number");
}

}  // namespace

Result<std::vector<SeriesEntry>> read_pvd(const std::string& path, const Source& source) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  pugi::xml_document document;
  const auto parsed = document.load_buffer(input.bytes().data(), input.bytes().size());
  const pugi::xml_node list = document.child("VTKFile").child("Collection");
  if (!parsed || !list)
    return failure(ErrorCode::malformed_input, path + ": there should be a VTKFile with a Collection");
  std::vector<SeriesEntry> series;
  for (const pugi::xml_node entry : list.children("DataSet")) {
    // Files of a list are opened from its folder only, as is everything that a file refers to.
    const std::string file = MAILLE_TRY(path_beside(path, entry.attribute("file").value()));
    const double time = MAILLE_TRY(time_of(entry, path));
    if (!series.empty() && series.back().time == time) {
      return failure(ErrorCode::unsupported,
                     path + ": several files at time " + std::to_string(time) + "; a step is one mesh");
    }
    series.push_back({file, time, std::nullopt});
  }
  return series;
}

}  // namespace maille
