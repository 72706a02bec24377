#include <maille/executor.h>

namespace maille {
namespace {

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
