#include "io/plain_threads.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace maille {
namespace {

/// This thread does work of a Round, so all threads there should be are there already.
thread_local bool is_in_round = false;

/// One call of parallel_for(): whoever takes part does pieces until none are left.
class Round {
 public:
  Round(size_t count, const std::function<void(size_t)>& work) : count_(count), work_(work) {}

  void take_part() noexcept {
    const bool before = std::exchange(is_in_round, true);
    for (size_t piece = next_++; piece < count_; piece = next_++) {
      try {
        work_(piece);
      } catch (...) {
        stop();
      }
    }
    is_in_round = before;
  }
  /// Once everybody is done. What work throws, such as std::bad_alloc, goes on in the caller's thread.
  void finish() const {
    if (thrown_) std::rethrow_exception(thrown_);
  }

 private:
  void stop() {
    const std::lock_guard lock(mutex_);
    if (!thrown_) thrown_ = std::current_exception();
    next_ = count_;
  }

  const size_t count_;
  const std::function<void(size_t)>& work_;
  std::atomic<size_t> next_ = 0;
  std::mutex mutex_;
  std::exception_ptr thrown_;
};

/// As many threads beside this one, or fewer where the system has no more. They end before the destructor
/// does.
class Helpers {
 public:
  Helpers(size_t count, Round& round) {
    threads_.reserve(count);
    try {
      while (threads_.size() < count) threads_.emplace_back([&round] { round.take_part(); });
    } catch (const std::system_error&) {
    }
  }
  Helpers(const Helpers&) = delete;
  Helpers& operator=(const Helpers&) = delete;
  ~Helpers() {
    for (std::thread& thread : threads_) thread.join();
  }

 private:
  std::vector<std::thread> threads_;
};

}  // namespace

// More threads than processors gain nothing, and thousands would cost their stacks.
PlainThreads::PlainThreads(unsigned threads) {
  const unsigned processors = std::max(std::thread::hardware_concurrency(), 1u);
  threads_ = threads == 0 ? processors : std::min(threads, processors);
}

void PlainThreads::parallel_for(size_t count, const std::function<void(size_t)>& work) {
  Round round(count, work);
  {
    const size_t threads = is_in_round ? 1 : std::min(threads_, count);
    const Helpers helpers(threads > 1 ? threads - 1 : 0, round);
    round.take_part();
  }
  round.finish();
}

}  // namespace maille
