#pragma once

#include <maille/io.h>

#include <vector>

namespace maille {

/// The mesh of one step, from 0 on. Error: usage, too (there is no such step).
Result<ReadResult> read_vtkhdf_step(const Source& source, const ReadOptions& options, uint64_t step);
/// Of all steps; none in a file without.
Result<std::vector<double>> vtkhdf_times(const Source& source);

}  // namespace maille
