#pragma once

#include <maille/io.h>

#include <vector>

namespace maille {

/// Reads the mesh with the variables of one step, from 0 on. Errors: usage, too (there is no such step);
/// unsupported, for elements of other kinds; malformed_input; memory_bound.
Result<ReadResult> read_exodus_step(const Source& source, const ReadOptions& options, uint64_t step);
/// The times of all steps, in the file's order; none where there are none.
Result<std::vector<double>> exodus_times(const Source& source);

}  // namespace maille
