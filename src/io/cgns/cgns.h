#pragma once

#include <maille/io.h>

#include <vector>

namespace maille {

/// Reads the mesh with the solutions of one step, from 0 on. Errors: usage, too (there is no such step);
/// unsupported, where there is no library of HDF5 or for other elements; malformed_input; memory_bound.
Result<ReadResult> read_cgns_step(const Source& source, const ReadOptions& options, uint64_t step);
/// The times of all steps, in the file's order; none in a file without.
Result<std::vector<double>> cgns_times(const Source& source);

}  // namespace maille
