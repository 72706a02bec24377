// ParaView's list of files in time: <VTKFile type="Collection"><Collection><DataSet timestep="" file=""/>...
#include <maille/series.h>
#include <maille/source.h>

#include <pugixml.hpp>

#include "base/result.h"

namespace maille {

Result<std::vector<SeriesEntry>> read_series(const std::string& path) {
  const std::unique_ptr<Source> source = MAILLE_TRY(file_source(path));
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
    series.push_back({file[0] == '/' ? file : folder + file, time});
  }
  return series;
}

}  // namespace maille
