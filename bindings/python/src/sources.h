#pragma once

#include <maille/source.h>
#include <pybind11/pybind11.h>

#include <memory>
#include <string>

#include "job.h"

namespace maille::python {

class FileObjectSource;

/// Where bytes come from: a path, an address, memory of Python, or an object with seek() and read().
class Input {
 public:
  static std::unique_ptr<Input> of_path(const std::string& path);
  static std::unique_ptr<Input> of_url(const std::string& url, uint64_t cache_bytes);
  static std::unique_ptr<Input> of_buffer(const py::buffer& buffer);
  static std::unique_ptr<Input> of_file(const py::object& file, std::string name);

  const Source& source() const { return *source_; }
  /// Raises what a file object raised meanwhile, if it did.
  void raise_pending() const;
  /// (requests, round trips, bytes) of an address, else None.
  py::object statistics() const;

 private:
  py::object kept_;
  std::unique_ptr<Source> source_;
  const FileObjectSource* file_ = nullptr;  ///< `source_`, where it is one
};

/// run() of work that reads an input.
template <class Work>
auto run(const Input& input, const py::object& progress, const Work& work) {
  std::optional<std::invoke_result_t<const Work&, const Progress&>> result;
  run_job(progress, [&](const Progress& told) { result.emplace(work(told)); });
  if (!*result) input.raise_pending();
  return take(std::move(*result));
}

void bind_sources(py::module_& module);

}  // namespace maille::python
