#pragma once

#include <maille/source.h>
#include <sys/types.h>

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "base/result.h"

namespace maille {

/// A copy of this process that answers questions: for libraries that a damaged file makes crash, hang or ask
/// for all memory. Where the child dies, its questions have no answer, and that is all. Starting one takes 1
/// ms (75581a5).
class ChildProcess {
 public:
  using Answer = std::function<std::vector<std::byte>(Bytes question)>;
  /// `make` is called in the child, which has all memory as it is now but none of the other threads. `bytes`
  /// more memory, and as many `seconds` of processor time in all, are what it gets. Error: cannot_read.
  static Result<std::unique_ptr<ChildProcess>> start(const std::function<Answer()>& make, uint64_t bytes,
                                                     uint64_t seconds);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Asks and waits for the answer; none: the child is gone. Not for several threads at once.
  std::optional<std::vector<std::byte>> ask(Bytes question);

 private:
  ChildProcess(pid_t id, int socket) : id_(id), socket_(socket) {}

  pid_t id_;
  int socket_;
  bool alive_ = true;
};

}  // namespace maille
