#include <maille/executor.h>
#include <tbb/blocked_range.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace maille {
namespace {

/// The Executor of programs with threads: the core knows the interface only, as it has no threads of its own.
/// An arena of its own bounds the threads of this executor whatever else of the program uses TBB.
class ThreadExecutor final : public Executor {
 public:
  /// TBB has no more threads than cores, and prints a warning where more are asked for. 2^16 keeps the
  /// conversion to int from overflowing. 0 asks for all cores.
  explicit ThreadExecutor(unsigned threads)
      : arena_(threads == 0 ? tbb::task_arena::automatic
                            : std::min(static_cast<int>(std::min(threads, 1u << 16)),
                                       tbb::info::default_concurrency())) {}

  void parallel_for(size_t count, const std::function<void(size_t)>& work) override {
    arena_.execute([&] { tbb::parallel_for(size_t{0}, count, work); });
  }

 private:
  tbb::task_arena arena_;
};

}  // namespace

std::unique_ptr<Executor> thread_executor(unsigned threads) {
  return std::make_unique<ThreadExecutor>(threads);
}

}  // namespace maille
