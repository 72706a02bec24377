#pragma once

#include <maille/series.h>

namespace maille {

/// The files of ParaView's list, <VTKFile type="Collection"><Collection><DataSet timestep="" file=""/>...
/// Errors: those of read_series().
Result<std::vector<SeriesEntry>> read_pvd(const std::string& path, const Source& source);

}  // namespace maille
