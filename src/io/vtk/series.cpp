// Series in time: files that hold their steps themselves, cases of OpenFOAM, and ParaView's list of files.
#include <maille/path.h>
#include <maille/series.h>
#include <maille/source.h>

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "base/result.h"
#include "io/cgns/cgns.h"
#include "io/ensight/ensight.h"
#include "io/exodus/exodus.h"
#include "io/foam/foam_processors.h"
#include "io/vtk/pvd.h"
#include "io/vtk/vtkhdf.h"
#include "io/xdmf/xdmf.h"

namespace maille {

namespace {

bool is_exodus(const std::string& path) {
  // By the name alone: a pipe can be read but once.
  constexpr std::string_view endings[] = {".e", ".exo", ".ex2", ".exii"};
  return std::any_of(std::begin(endings), std::end(endings),
                     [&](std::string_view ending) { return path.ends_with(ending); });
}

bool is_vtkhdf(const std::string& path) {
  return path.ends_with(".vtkhdf") || path.ends_with(".hdf");
}

bool is_cgns(const std::string& path) {
  return path.ends_with(".cgns");
}

bool is_xdmf(const std::string& path) {
  return path.ends_with(".xdmf") || path.ends_with(".xmf");
}

bool is_ensight(const std::string& path) {
  std::error_code error;
  // A folder of that name is a case of OpenFOAM.
  if (std::filesystem::is_directory(to_path(path), error)) return false;
  return path.ends_with(".case") || path.ends_with(".encas");
}

/// A file that holds its steps itself.
bool has_own_steps(const std::string& path) {
  return is_exodus(path) || is_vtkhdf(path) || is_cgns(path) || is_xdmf(path) || is_ensight(path);
}

bool is_list(const std::string& path) {
  return path.ends_with(".pvd");
}

Result<std::vector<SeriesEntry>> steps_of_file(const std::string& path, const Source& source) {
  std::vector<SeriesEntry> steps;
  const auto times = is_exodus(path)    ? exodus_times(source)
                     : is_ensight(path) ? ensight_times(source)
                     : is_cgns(path)    ? cgns_times(source)
                     : is_xdmf(path)    ? xdmf_times(source)
                                        : vtkhdf_times(source);
  for (const double time : MAILLE_TRY(times)) steps.push_back({path, time, steps.size(), !is_exodus(path)});
  return steps;
}

/// The times of a case of OpenFOAM; none where the path says which one is meant.
std::vector<SeriesEntry> times_of_case(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(to_path(path), error) && !path.ends_with(".foam")) return {};
  const std::string folder = foam_case_folder(path);
  std::vector<SeriesEntry> times;
  for (const FoamTime& time : foam_times_of(path))
    times.push_back({time.divided ? folder : folder + "/" + time.name, time.value, times.size()});
  return times;
}

/// Whether a path is a case and not a folder of one time. Steps whose meshes lie in folders of processors are
/// named by the case and their number.
bool is_case(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_directory(to_path(path), error) && !foam_case_of(path).time;
}

}  // namespace

bool may_be_series(const std::string& path) {
  return is_list(path) || has_own_steps(path) || !times_of_case(path).empty();
}

Result<ReadResult> read_series_entry(const SeriesEntry& entry, const ReadOptions& options) {
  if (entry.step && is_case(entry.path)) return read_foam_step(entry.path, options, *entry.step);
  if (!has_own_steps(entry.path) || !entry.step) return read_mesh(entry.path, options);
  const std::unique_ptr<Source> source = MAILLE_TRY(file_source(entry.path));
  if (is_ensight(entry.path)) return read_ensight_step(*source, options, *entry.step);
  if (is_xdmf(entry.path)) return read_xdmf_step(*source, options, *entry.step);
  if (is_cgns(entry.path)) return read_cgns_step(*source, options, *entry.step);
  return is_exodus(entry.path) ? read_exodus_step(*source, options, *entry.step)
                               : read_vtkhdf_step(*source, options, *entry.step);
}

Result<std::vector<SeriesEntry>> read_series(const std::string& path) {
  if (!is_list(path) && !has_own_steps(path)) return times_of_case(path);
  const std::unique_ptr<Source> source = MAILLE_TRY(file_source(path));
  return is_list(path) ? read_pvd(path, *source) : steps_of_file(path, *source);
}

}  // namespace maille
