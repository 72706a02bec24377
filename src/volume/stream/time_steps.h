#pragma once

#include <maille/stream.h>

#include "container/file_reader.h"
#include "volume/stream/stream_layout.h"

namespace maille {

/// Chunks of files of mode stream that this version reads.
inline constexpr std::string_view stream_chunk_types[] = {"DESC", "CELL", "POSI", "ARRY", "TAIL", "STEP",
                                                          "SVAL", "PIEC", "GIDS", "PIDX", "SIDX"};

/// The description of the mesh, found by the index. Errors, which name the file: corrupt, memory_bound.
Result<StreamHeader> header_of(const FileReader& file, const Limits& limits);
/// The end of the file, in the same way. `most_memory`: what it may take, in bytes.
Result<StreamTail> tail_of(const FileReader& file, uint64_t most_memory);

/// How many steps of time stand behind the mesh: they are numbered from 1 without gaps.
uint64_t count_steps(const FileReader& file);

/// What VTK and Exodus call the time of all that a file holds becomes that of a step.
void set_time(double time, std::vector<Array>& mesh_arrays);
/// Whether a file with so many steps has this one. Error: usage.
Result<> check_step(uint64_t step, uint64_t steps, const std::string& name);

/// Steps behind the mesh, in order: their headers, which are held against the limits together. Errors:
/// corrupt, memory_bound.
Result<std::vector<StepHeader>> read_steps(const FileReader& file, const std::vector<StreamArray>& arrays,
                                           const Limits& limits);

/// The same as list_steps() has them, of what is there of the file.
Result<std::vector<StreamStep>> steps_of(const FileReader& file, const StreamHeader& mesh,
                                         const Limits& limits);

}  // namespace maille
