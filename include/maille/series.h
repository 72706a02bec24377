#pragma once

#include <maille/error.h>
#include <string>
#include <vector>

namespace maille {

/// One file of a series in time.
struct SeriesEntry {
  std::string path;
  double time = 0;
};
/// The files that a .pvd of ParaView lists, in its order, with their times. Error: cannot_read;
/// malformed_input; unsupported, when one time has several files.
Result<std::vector<SeriesEntry>> read_series(const std::string& path);

}  // namespace maille
