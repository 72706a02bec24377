#pragma once

#include <maille/stream.h>

#include "container/file_reader.h"
#include "container/file_writer.h"
#include "volume/pieces/piece_layout.h"
#include "volume/stream/step_chain.h"
#include "volume/stream/stream_layout.h"

namespace maille {

// Steps of time of files in pieces. The values of a step in a piece are a step behind the piece's own stream,
// as files that are not in pieces have it; steps begin anew with each group of key_steps, so that one is read
// with no more than those of its group. docs/format.md, 16.14.

inline uint64_t first_of_group(uint64_t step) {
  return (step - 1) / key_steps * key_steps + 1;
}

/// What a step has of a piece.
struct StepOfPiece {
  std::vector<std::byte> stream;  ///< with the steps before, of the group
  std::vector<Array> arrays;      ///< by the numbers of the piece
};
struct CodedStepOfPiece {
  std::vector<std::byte> bytes;  ///< SVAL
  StepReport report;
  std::vector<PieceField> fields;
};
/// Empty arrays of a step, with room for the values of a piece.
std::vector<Array> arrays_of_piece(const std::vector<StreamArray>& described, const PieceNumbers& numbers);
/// Codes the step behind the piece's own stream, as a file of its own would have it. By one thread. Errors:
/// as append_step().
Result<CodedStepOfPiece> code_step_of_piece(const StepOfPiece& piece, StepHeader step,
                                            const StepOptions& options);
inline StreamKey key_of_step(uint64_t step, uint32_t piece) {
  return {"SVAL", static_cast<uint32_t>(step), piece};
}
/// Writes what stands behind the values of all pieces: what the index says of them, then the step, which
/// makes it count.
Result<> write_step_end(FileWriter& writer, uint64_t number,
                        const std::vector<std::vector<PieceField>>& fields, const StepHeader& step);

/// Appends a step, whose values are those of the mesh in the order of the input. The file is open, and keeps
/// the order. Errors: as append_step().
Result<StepReport> append_to_pieces(const std::string& path, const Source& source, const FileReader& file,
                                    StepHeader step, StepSource& values, const StepOptions& options);

}  // namespace maille
