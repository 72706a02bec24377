#pragma once

#include <maille/stream.h>

#include "container/file_reader.h"
#include "volume/stream/stream_layout.h"

namespace maille {

// Steps of time of files in pieces. The values of a step in a piece are a step behind the piece's own stream,
// as files that are not in pieces have it; steps begin anew with each `steps_of_group`, so that one is read
// with no more than those of its group. docs/format.md, "Volumes in pieces".

inline constexpr uint64_t steps_of_group = 16;
inline uint64_t first_of_group(uint64_t step) {
  return (step - 1) / steps_of_group * steps_of_group + 1;
}

/// Appends a step, whose values are those of the mesh in the order of the input. The file is open, and keeps
/// the order. Errors: as append_step().
Result<StepReport> append_to_pieces(const std::string& path, const Source& source, const FileReader& file,
                                    StepHeader step, StepSource& values, const StepOptions& options);

}  // namespace maille
