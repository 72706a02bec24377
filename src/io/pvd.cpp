// Series in time. ParaView's list of files: <VTKFile type="Collection"><Collection><DataSet timestep=""
// file=""/>...
#include <maille/series.h>
#include <maille/source.h>

#include <algorithm>
#include <pugixml.hpp>
#include <string_view>

#include "base/result.h"
#include "io/exodus.h"

namespace maille {

namespace {

bool is_exodus(const std::string& path) {
  // By the name alone: a pipe can be read but once.
  constexpr std::string_view endings[] = {".e", ".exo", ".ex2", ".exii"};
  return std::any_of(std::begin(endings), std::end(endings),
                     [&](std::string_view ending) { return path.ends_with(ending); });
}

bool is_list(const std::string& path) {
  return path.ends_with(".pvd");
}

}  // namespace

bool may_be_series(const std::string& path) {
  return is_list(path) || is_exodus(path);
}

Result<ReadResult> read_series_entry(const SeriesEntry& entry, const ReadOptions& options) {
  const std::unique_ptr<Source> source = MAILLE_TRY(file_source(entry.path));
  return entry.step ? read_exodus_step(*source, options, *entry.step) : read_mesh(*source, options);
}

Result<std::vector<SeriesEntry>> read_series(const std::string& path) {
  const std::unique_ptr<Source> source = MAILLE_TRY(file_source(path));
  if (!is_list(path) && is_exodus(path)) {
    std::vector<SeriesEntry> steps;
    for (const double time : MAILLE_TRY(exodus_times(*source))) steps.push_back({path, time, steps.size()});
    return steps;
  }
  std::vector<std::byte> bytes(static_cast<size_t>(source->size()));
  MAILLE_CHECK(source->read_at(0, bytes));
  pugi::xml_document document;
  const auto parsed = document.load_buffer(bytes.data(), bytes.size());
  const pugi::xml_node list = document.child("VTKFile").child("Collection");
  if (!parsed || !list)
    return failure(ErrorCode::malformed_input, path + ": there should be a VTKFile with a Collection");
  const size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "" : path.substr(0, slash + 1);
  std::vector<SeriesEntry> series;
  for (const pugi::xml_node entry : list.children("DataSet")) {
    const std::string file = entry.attribute("file").as_string();
    const double time = entry.attribute("timestep").as_double();
    if (file.empty()) return failure(ErrorCode::malformed_input, path + ": a DataSet names no file");
    if (!series.empty() && series.back().time == time) {
      return failure(ErrorCode::unsupported,
                     path + ": several files at time " + std::to_string(time) + "; a step is one mesh");
    }
    series.push_back({file[0] == '/' ? file : folder + file, time, std::nullopt});
  }
  return series;
}

}  // namespace maille
