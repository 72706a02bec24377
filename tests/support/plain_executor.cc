// In the place of src/io/posix/executor.cpp where tests run under ThreadSanitizer, which oneTBB is not compiled
// with: it would see threads, and nothing that orders what they do.
#include "support/three_threads.h"

namespace maille {

std::unique_ptr<Executor> thread_executor(unsigned) {
  return std::make_unique<testing::ThreeThreads>();
}

}  // namespace maille
