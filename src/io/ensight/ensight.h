#pragma once

#include <maille/io.h>

#include <vector>

namespace maille {

/// Reads the mesh of one step of the union of all time sets, from 0 on. Errors: usage, too (there is no such
/// step); unsupported, for other formats of EnSight than Gold; malformed_input; memory_bound.
Result<ReadResult> read_ensight_step(const Source& source, const ReadOptions& options, uint64_t step);
/// The times of all steps, ascending; none in a case without time.
Result<std::vector<double>> ensight_times(const Source& source);

}  // namespace maille
