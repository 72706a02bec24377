#include "io/plain_threads.h"

namespace maille {

// Debian has no oneTBB for mingw-w64.
std::unique_ptr<Executor> thread_executor(unsigned threads) {
  return std::make_unique<PlainThreads>(threads);
}

}  // namespace maille
