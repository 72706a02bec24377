#include "errors.h"

namespace maille::python {

void raise(const Error& error) {
  // Names of files that are no UTF-8 come through, as Python's own functions let them.
  const auto sentence = py::reinterpret_steal<py::object>(
      PyUnicode_DecodeUTF8(error.message.data(), static_cast<Py_ssize_t>(error.message.size()), "replace"));
  const py::object exception =
      py::module_::import("maille._errors").attr("exception_of")(static_cast<int>(error.code), sentence);
  PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(exception.ptr())), exception.ptr());
  throw py::error_already_set();
}

}  // namespace maille::python
