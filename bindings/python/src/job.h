#pragma once

#include <maille/executor.h>

#include <functional>
#include <optional>
#include <type_traits>

#include "errors.h"

namespace maille::python {

/// Who decodes and encodes for Python: as many threads as the machine has, or as set_threads() says; the
/// calling thread alone (nullptr) in a child of a process that had started threads, as fork() does not copy
/// them.
Executor* executor();
/// 0: as many as the machine has; 1: none besides the caller.
void set_threads(unsigned threads);

/// Runs work that may take its time without the lock of the interpreter. `progress` is None or a function of
/// a stage and a fraction; it is called here, in the thread that called, some times a second, and may return
/// False to end the work. Ctrl-C ends it, too. What is raised meanwhile comes through.
void run_job(const py::object& progress, const std::function<void(const Progress&)>& work);

/// The same for work that gives a Result: its value, or an exception.
template <class Work>
auto run(const py::object& progress, const Work& work) {
  std::optional<std::invoke_result_t<const Work&, const Progress&>> result;
  run_job(progress, [&](const Progress& told) { result.emplace(work(told)); });
  return take(std::move(*result));
}

}  // namespace maille::python
