#pragma once

#include <maille/executor.h>

#include <atomic>
#include <thread>

namespace maille::testing {

#ifdef __EMSCRIPTEN__
/// There are no threads: the last first, so that an order in time would show.
class ThreeThreads final : public Executor {
 public:
  void parallel_for(size_t count, const std::function<void(size_t)>& work) override {
    while (count > 0) work(--count);
  }
};
#else
/// Three, however few cores there are: oneTBB would start fewer. ThreadSanitizer sees all that they do.
class ThreeThreads final : public Executor {
 public:
  void parallel_for(size_t count, const std::function<void(size_t)>& work) override {
    std::atomic<size_t> next = 0;
    const auto run = [&] {
      for (size_t i = next++; i < count; i = next++) work(i);
    };
    if (count < 2) return run();
    std::thread second(run), third(run);
    run();
    second.join();
    third.join();
  }
};
#endif

}  // namespace maille::testing
