#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace maille {

/// Who runs independent pieces of work. The library starts no threads of its own; results never depend on it.
/// It must outlive the calls and objects that it was given to.
class Executor {
 public:
  virtual ~Executor() = default;
  /// Calls work(0) ... work(count - 1), in any order, possibly at once, and returns when all are done.
  virtual void parallel_for(size_t count, const std::function<void(size_t)>& work) = 0;
};

/// Runs everything in the calling thread. Used where no executor is given.
Executor& serial_executor();
/// At most `threads` threads, of oneTBB (on Windows, of the standard library); 0: as many as the machine has.
/// (Not in the core library.)
std::unique_ptr<Executor> thread_executor(unsigned threads);

/// How far a long job has come.
struct ProgressReport {
  const char* stage;  ///< "reading", "connectivity", "positions", ...
  double fraction;    ///< of this stage, 0 to 1
};
/// Told now and then; returns false to cancel the job, which then ends with the error `cancelled`. Called on
/// the thread that called the library, never on those of the executor.
using Progress = std::function<bool(const ProgressReport&)>;

}  // namespace maille
