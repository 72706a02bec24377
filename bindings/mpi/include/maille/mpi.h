#pragma once

#include <maille/ranks.h>

#include <mpi.h>

#include <memory>
#include <string>

// maille for programs that run with MPI. docs/mpi.md shows it in use.

namespace maille::mpi {

/// The ranks of a communicator, which must outlive it. Messages of any size: in rounds below 2 GiB.
std::unique_ptr<Ranks> ranks(MPI_Comm communicator);

/// A file that all ranks write together: under a temporary name beside it, synced, then renamed by the first
/// rank, so that a run that fails leaves none. Collective. Error: write_failed, before anything is coded,
/// where that can be known.
Result<std::unique_ptr<RanksFile>> file(MPI_Comm communicator, const std::string& path);

/// maille::encode() for the ranks of a communicator. Collective: all give their parts, and get the same
/// report or the same error.
Result<EncodeReport> encode(MPI_Comm communicator, const RankPart& part, const std::string& path,
                            const EncodeOptions& options = {}, const RanksOptions& how = {});

/// A file that is there and goes on: until all of a step is there it reads as it was, also after a crash, and
/// the next step overwrites the remains. Collective. Error: write_failed, also if somebody else appends to
/// it.
Result<std::unique_ptr<RanksFile>> file_to_append(MPI_Comm communicator, const std::string& path);

/// maille::append_step() for the ranks of a communicator: a step of time as one collective write. Collective.
Result<StepReport> append_step(MPI_Comm communicator, const std::string& path, double time,
                               const RankPart& part, const EncodeOptions& options = {},
                               const RanksOptions& how = {});

/// Removes the temporary file of a run that is going on, if this rank has one: for signal handlers.
void remove_unfinished_file() noexcept;

}  // namespace maille::mpi
