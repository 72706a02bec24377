#include <maille/executor.h>

namespace maille {
namespace {

/// This executor serves callers that pass none, as the core starts no threads of its own.
class SerialExecutor final : public Executor {
 public:
  void parallel_for(size_t count, const std::function<void(size_t)>& work) override {
    for (size_t i = 0; i < count; ++i) work(i);
  }
};

}  // namespace

Executor& serial_executor() {
  static SerialExecutor executor;
  return executor;
}

}  // namespace maille
