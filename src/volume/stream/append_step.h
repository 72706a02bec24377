#pragma once

#include <maille/stream.h>

#include <memory>

#include "container/file_reader.h"
#include "volume/stream/stream_layout.h"

namespace maille {

/// A step of time that is to be appended to a file: what is known of that file.
struct StepTarget {
  std::unique_ptr<FileReader> file;
  StreamHeader mesh;
  StreamTail tail;
};
/// Error: usage, where the file takes no steps, or not these arrays at this time.
Result<StepTarget> open_for_step(const Source& source, const StepHeader& step);
/// Whether a step of so many points and cells can be one of the mesh. Error: usage, with both counts.
Result<> check_counts(const Source& source, const StepTarget& target, uint64_t points, uint64_t cells);
/// What changes of the metadata. Error: corrupt.
Result<> set_metadata(const FileReader& file, const StreamHeader& mesh, const StepOptions& options,
                      StepHeader& step);

/// The bytes of one more step behind a stream that keeps its order, for which `values` are by number of its
/// points and cells. Errors: as append_step().
Result<std::vector<std::byte>> step_behind(const Source& stream, StepHeader step, StepSource& values,
                                           const StepOptions& options, StepReport& report);

}  // namespace maille
