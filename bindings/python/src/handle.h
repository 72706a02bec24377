#pragma once

#include <mutex>
#include <utility>

#include "sources.h"

namespace maille::python {

/// A file of the library that several threads of Python may use, one after the other. It keeps alive what it
/// reads from. The library's own objects are for one thread at a time, and Python's lock is released while
/// they work.
template <class File>
class Handle {
 public:
  explicit Handle(py::object input) : kept_(std::move(input)) {}

  const Input& input() const { return kept_.cast<const Input&>(); }
  void set(File&& file) { file_.emplace(std::move(file)); }

  /// run() of work with the file. The lock is taken without that of the interpreter, which another thread may
  /// be waiting for.
  template <class Work>
  auto with(const py::object& progress, const Work& work) {
    return run(input(), progress, [&](const Progress&) {
      const std::lock_guard lock(mutex_);
      return work(*file_);
    });
  }
  /// Of what is known without reading.
  const File& file() const { return *file_; }

 private:
  py::object kept_;
  std::mutex mutex_;
  std::optional<File> file_;
};

}  // namespace maille::python
