#pragma once

#include <maille/error.h>
#include <maille/io.h>
#include <optional>
#include <string>
#include <vector>

namespace maille {

/// One file of a series in time, or one step of a file that has several.
struct SeriesEntry {
  std::string path;
  double time = 0;
  std::optional<uint64_t> step = {};  ///< in the file, from 0 on
};
/// Whether the name is that of a file that lists a series (.pvd), or may hold one (Exodus).
bool may_be_series(const std::string& path);
/// The files that a .pvd of ParaView lists, in its order, with their times, which are finite; or the steps of
/// an Exodus file. The files are in the list's folder or below: one that names others is refused.
/// Error: cannot_read; malformed_input; unsupported, when one time has several files.
Result<std::vector<SeriesEntry>> read_series(const std::string& path);
/// read_mesh() of the file, with the variables of the step.
Result<ReadResult> read_series_entry(const SeriesEntry& entry, const ReadOptions& options = {});

}  // namespace maille
