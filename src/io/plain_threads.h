#pragma once

#include <maille/executor.h>

namespace maille {

/// Threads of the standard library, which are started for each call and end with it: for systems where there
/// is no oneTBB.
class PlainThreads final : public Executor {
 public:
  /// 0: as many as the machine has.
  explicit PlainThreads(unsigned threads);
  /// The caller's thread is one of them. Work that calls this again is done in its own thread.
  void parallel_for(size_t count, const std::function<void(size_t)>& work) override;

 private:
  size_t threads_;
};

}  // namespace maille
