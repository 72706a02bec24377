#pragma once

#include <maille/io.h>

#include <vector>

namespace maille {

/// The mesh with the variables of one step, from 0 on. Error: usage, too (there is no such step).
Result<ReadResult> read_exodus_step(const Source& source, const ReadOptions& options, uint64_t step);
/// Of all steps.
Result<std::vector<double>> exodus_times(const Source& source);

}  // namespace maille
