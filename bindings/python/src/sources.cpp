#include "sources.h"

#include <maille/http.h>

#include <algorithm>
#include <mutex>
#include <string_view>

namespace maille::python {

/// Reads by seek() and read() of a Python object. An exception that these raise cannot pass through the
/// library, which knows Results only, so it is kept until the call is over and then raised unchanged.
class FileObjectSource final : public Source {
 public:
  FileObjectSource(py::object file, std::string name) : file_(std::move(file)), name_(std::move(name)) {
    constexpr int from_end = 2;
    file_.attr("seek")(0, from_end);
    size_ = file_.attr("tell")().cast<uint64_t>();
  }

  uint64_t size() const override { return size_; }
  std::string name() const override { return name_; }

  /// From any thread: the interpreter's lock is not enough, as read() may give it away behind seek().
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    const std::lock_guard lock(mutex_);
    const py::gil_scoped_acquire acquired;
    try {
      file_.attr("seek")(offset);
      for (size_t done = 0; done < out.size();) {
        // A raw file may return fewer bytes than it was asked for.
        const py::object part = file_.attr("read")(out.size() - done);
        if (!py::isinstance<py::bytes>(part))
          return failure(ErrorCode::cannot_read, name_ + ": its read() gives no bytes; open it in mode 'rb'");
        const std::string_view bytes = py::reinterpret_borrow<py::bytes>(part);
        if (bytes.empty() || bytes.size() > out.size() - done)
          return failure(ErrorCode::cannot_read, name_ + ": ends before byte " +
                                                     std::to_string(offset + out.size()) +
                                                     "; was it changed while it was read?");
        std::copy_n(reinterpret_cast<const std::byte*>(bytes.data()), bytes.size(), out.data() + done);
        done += bytes.size();
      }
    } catch (py::error_already_set& error) {
      pending_ = std::make_shared<py::error_already_set>(error);
    }
    if (pending_) return failure(ErrorCode::cannot_read, name_ + ": an exception was raised");
    return {};
  }

  /// With the interpreter's lock.
  void raise_pending() const {
    if (!pending_) return;
    const auto error = std::move(pending_);
    pending_ = nullptr;
    error->restore();
    throw py::error_already_set();
  }

 private:
  py::object file_;
  std::string name_;
  uint64_t size_ = 0;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<py::error_already_set> pending_;
};

std::unique_ptr<Input> Input::of_path(const std::string& path) {
  auto input = std::make_unique<Input>();
  const py::gil_scoped_release released;
  // Not a map of the file: where somebody cuts it off meanwhile, that is an error, not the end of the
  // process.
  auto source = unmapped_source(path);
  const py::gil_scoped_acquire acquired;
  input->source_ = take(std::move(source));
  return input;
}

std::unique_ptr<Input> Input::of_url(const std::string& url, uint64_t cache_bytes) {
  auto input = std::make_unique<Input>();
  HttpOptions options;
  options.cache_bytes = cache_bytes;
  input->source_ = run(py::none(), [&](const Progress&) { return http_source(url, options); });
  return input;
}

std::unique_ptr<Input> Input::of_buffer(const py::buffer& buffer) {
  // Kept, so that nobody resizes a bytearray, or closes a memory map, meanwhile.
  auto view = std::make_unique<py::buffer_info>(buffer.request());
  const bool in_one = PyBuffer_IsContiguous(view->view(), 'C') != 0;
  if (!in_one) throw py::value_error("the bytes of the buffer are not contiguous; copy it with bytes()");
  auto input = std::make_unique<Input>();
  const auto size = static_cast<size_t>(view->size * view->itemsize);
  input->source_ = memory_source(Bytes(static_cast<const std::byte*>(view->ptr), size));
  input->kept_ = py::capsule(view.release(), [](void* kept) { delete static_cast<py::buffer_info*>(kept); });
  return input;
}

std::unique_ptr<Input> Input::of_file(const py::object& file, std::string name) {
  auto input = std::make_unique<Input>();
  auto source = std::make_unique<FileObjectSource>(file, std::move(name));
  input->file_ = source.get();
  input->source_ = std::move(source);
  return input;
}

void Input::raise_pending() const {
  if (file_ != nullptr) file_->raise_pending();
}

py::object Input::statistics() const {
  const auto* http = dynamic_cast<const HttpSource*>(source_.get());
  if (http == nullptr) return py::none();
  const HttpStatistics all = http->statistics();
  return py::make_tuple(all.requests, all.round_trips, all.bytes);
}

void bind_sources(py::module_& module) {
  py::class_<Input>(module, "Input")
      .def_static("of_path", &Input::of_path, py::arg("path"))
      .def_static("of_url", &Input::of_url, py::arg("url"), py::arg("cache_bytes"))
      .def_static("of_buffer", &Input::of_buffer, py::arg("buffer"))
      .def_static("of_file", &Input::of_file, py::arg("file"), py::arg("name"))
      .def_property_readonly("size", [](const Input& self) { return self.source().size(); })
      .def_property_readonly("name", [](const Input& self) { return self.source().name(); })
      .def("statistics", &Input::statistics);
}

}  // namespace maille::python
