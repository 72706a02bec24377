#pragma once

#include <maille/stream.h>

#include "container/file_reader.h"
#include "volume/stream/stream_layout.h"

namespace maille {

/// Chunks of files of mode stream that this version reads.
inline constexpr std::string_view stream_chunk_types[] = {"DESC", "CELL", "POSI", "ARRY",
                                                          "TAIL", "STEP", "SVAL"};

/// The values of one step in a file, apart from the mesh.
class StepValues {
 public:
  /// Step `number` of the file, counted from 1. `source` must outlive it. Errors: usage (there is no such
  /// step), corrupt, cannot_read, unsupported.
  static Result<StepValues> open(const Source& source, uint64_t number);

  const StepHeader& header() const { return header_; }
  /// Coded tuples of an array in a batch.
  Result<std::vector<std::byte>> read(uint32_t batch, size_t array) const;

 private:
  StepValues(FileReader file, uint32_t number, StepHeader header)
      : file_(std::move(file)), number_(number), header_(std::move(header)) {}
  FileReader file_;
  uint32_t number_;
  StepHeader header_;
};

/// Steps behind the mesh, in order: their headers. Error: corrupt.
Result<std::vector<StepHeader>> read_steps(const FileReader& file, const std::vector<StreamArray>& arrays);

}  // namespace maille
