#pragma once

#include <maille/io.h>

#include <vector>

namespace maille {

/// The mesh of the last step, or of a file without steps.
Result<ReadResult> read_xdmf(const Source& source, const ReadOptions& options);
/// Reads the mesh of one step, from 0 on. Errors: usage, too (there is no such step); unsupported, for other
/// grids and where there is no library of HDF5; malformed_input; memory_bound; those of files beside it.
Result<ReadResult> read_xdmf_step(const Source& source, const ReadOptions& options, uint64_t step);
/// The times of all steps, in the file's order; none in a file without.
Result<std::vector<double>> xdmf_times(const Source& source);

}  // namespace maille
