#include "io/hdf5/child_process.h"

namespace maille {

// Only the library of HDF5 works in a process of its own, and for Windows there is none
// (io/hdf5/missing.cpp).
Result<std::unique_ptr<ChildProcess>> ChildProcess::start(const std::function<Answer()>&, uint64_t,
                                                          uint64_t) {
  return failure(ErrorCode::unsupported, "this maille starts no process that reads a file");
}

ChildProcess::~ChildProcess() = default;

std::optional<std::vector<std::byte>> ChildProcess::ask(Bytes) {
  return std::nullopt;
}

}  // namespace maille
