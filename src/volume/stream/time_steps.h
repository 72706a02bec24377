#pragma once

#include <maille/stream.h>

#include <memory>

#include "container/file_reader.h"
#include "volume/stream/stream_layout.h"

namespace maille {

/// Chunks of files of mode stream that this version reads.
inline constexpr std::string_view stream_chunk_types[] = {"DESC", "CELL", "POSI", "ARRY", "TAIL", "STEP",
                                                          "SVAL", "PIEC", "GIDS", "PIDX", "SIDX"};

/// How many steps of time stand behind the mesh: they are numbered from 1 without gaps.
uint64_t count_steps(const FileReader& file);

/// What VTK and Exodus call the time of all that a file holds becomes that of a step.
void set_time(double time, std::vector<Array>& mesh_arrays);
/// Whether a file with so many steps has this one. Error: usage.
Result<> check_step(uint64_t step, uint64_t steps, const std::string& name);

/// Steps behind the mesh, in order: their headers. Error: corrupt.
Result<std::vector<StepHeader>> read_steps(const FileReader& file, const std::vector<StreamArray>& arrays);

/// The same as list_steps() has them, of what is there of the file.
Result<std::vector<StreamStep>> steps_of(const FileReader& file, const StreamHeader& mesh);

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
