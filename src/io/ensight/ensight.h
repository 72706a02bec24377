#pragma once

#include <maille/io.h>

#include <vector>

namespace maille {

/// The mesh of one step, from 0 on. Error: usage, too (there is no such step).
Result<ReadResult> read_ensight_step(const Source& source, const ReadOptions& options, uint64_t step);
/// Of all steps; none in a case without time.
Result<std::vector<double>> ensight_times(const Source& source);

}  // namespace maille
