#include "job.h"

#include <unistd.h>

#include <chrono>
#include <exception>

namespace maille::python {

namespace {

/// Guarded by the interpreter's lock.
struct Threads {
  unsigned wanted = 0;
  pid_t process = 0;  ///< that has `executor`
  // Never destroyed: oneTBB's threads must not be joined while the interpreter ends.
  Executor* executor = nullptr;
};
Threads& threads() {
  static Threads all;
  return all;
}

}  // namespace

Executor* executor() {
  Threads& all = threads();
  if (all.wanted == 1) return nullptr;
  if (all.executor == nullptr) {
    all.executor = thread_executor(all.wanted).release();
    all.process = ::getpid();
  }
  // After fork() the child has the executor but none of its threads, so waiting for them would never end.
  return all.process == ::getpid() ? all.executor : nullptr;
}

void set_threads(unsigned count) {
  Threads& all = threads();
  all.wanted = count;
  // One that was in use may still be. A process that was forked keeps what it has: nothing.
  if (all.process == ::getpid()) all.executor = nullptr;
}

namespace {

/// Lets signals and the progress function speak, now and then, in the middle of work.
class Watch {
 public:
  explicit Watch(const py::object& progress) : progress_(progress) {}

  /// Without the interpreter's lock, in the thread that called. False: the work is to end.
  bool tell(const ProgressReport& report) {
    // Ctrl-C is answered, and progress shown, this often.
    constexpr auto interval = std::chrono::milliseconds(50);
    stage_ = report.stage;
    const auto now = std::chrono::steady_clock::now();
    if (raised_) return false;
    // Taking the interpreter's lock costs far more than this test, and another thread of Python may hold it
    // for long.
    if (now - last_ < interval || !somebody_listens_ || finalizing()) return true;
    last_ = now;
    const py::gil_scoped_acquire acquired;
    try {
      return look_around(report);
    } catch (...) {
      raised_ = std::current_exception();
      return false;
    }
  }

  /// With the lock, when the work is over: what was raised, or the last report, however short the work was.
  void end() {
    if (raised_) std::rethrow_exception(raised_);
    look_around({stage_, 1});
  }

 private:
  bool look_around(const ProgressReport& report) {
    // Python's signal handlers run only when somebody asks for them; without this Ctrl-C would wait for the
    // library.
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (progress_.is_none()) return true;
    const py::object answer = progress_(report.stage, report.fraction);
    return answer.is_none() || answer.cast<bool>();
  }

  /// A thread that asks for the lock while the interpreter ends is taken down, and C++ with it.
  static bool finalizing() {
#if PY_VERSION_HEX >= 0x030D0000
    return Py_IsFinalizing() != 0;
#else
    return _Py_IsFinalizing() != 0;
#endif
  }
  /// Signals come to the main thread only.
  static bool in_main_thread() {
    const py::object main = py::module_::import("threading").attr("main_thread")();
    return main.attr("ident").cast<unsigned long>() == PyThread_get_thread_ident();
  }

  const py::object& progress_;
  const bool somebody_listens_ = !progress_.is_none() || in_main_thread();
  const char* stage_ = "done";
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  std::exception_ptr raised_;
};

}  // namespace

void run_job(const py::object& progress, const std::function<void(const Progress&)>& work) {
  Watch watch(progress);
  {
    // The library tells progress in the thread that called it (maille/executor.h).
    const py::gil_scoped_release released;
    work([&watch](const ProgressReport& report) { return watch.tell(report); });
  }
  watch.end();
}

}  // namespace maille::python
