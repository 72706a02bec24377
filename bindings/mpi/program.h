#pragma once

#include <maille/ranks.h>

#include <string>

// What the files of the program maille-mpi have in common.

namespace maille {

/// The error of the first rank that has one, in all.
Result<> agree(Ranks& ranks, const Result<>& mine);

/// Each rank decodes its share of the pieces and writes it: OUT_0.vtu, OUT_1.vtu ... beside OUT.pvtu, with
/// the numbers that points and cells have in the whole mesh. `step`: 0 for the mesh, or a step of time behind
/// it. Errors: usage, for a file in any order; those of reading and writing, the same in all ranks.
Result<> decompress_shares(const std::string& input, const std::string& output, uint64_t step, Ranks& ranks);

}  // namespace maille
