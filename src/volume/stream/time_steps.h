#pragma once

#include <maille/stream.h>

#include "container/file_reader.h"
#include "volume/stream/stream_layout.h"

namespace maille {

/// Chunks of files of mode stream that this version reads.
inline constexpr std::string_view stream_chunk_types[] = {"DESC", "CELL", "POSI", "ARRY", "TAIL",
                                                          "STEP", "SVAL", "PIEC", "GIDS", "PIDX"};

uint64_t count_steps(const FileReader& file);

/// Steps behind the mesh, in order: their headers. Error: corrupt.
Result<std::vector<StepHeader>> read_steps(const FileReader& file, const std::vector<StreamArray>& arrays);

}  // namespace maille
