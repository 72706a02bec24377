#pragma once

#include <maille/mesh.h>
#include <pybind11/numpy.h>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "errors.h"

// Numbers between numpy and the library.
namespace maille::python {

py::dtype dtype_of(Scalar type);
/// The Scalar of an array's dtype; nothing for types that a mesh cannot have, such as booleans or complex
/// numbers.
std::optional<Scalar> scalar_of(const py::array& array);

/// An array that shows memory of `owner`, which lives as long as the array does. Nobody can write to it.
py::array view_of(std::shared_ptr<const void> owner, const void* data, const py::dtype& type,
                  std::vector<py::ssize_t> shape);

/// A view of a vector that is moved to the heap for it.
template <class T>
py::array view_of(std::vector<T>&& values) {
  const auto kept = std::make_shared<const std::vector<T>>(std::move(values));
  return view_of(kept, kept->data(), py::dtype::of<T>(), {static_cast<py::ssize_t>(kept->size())});
}

/// (n,) or, of several components, (n, components).
std::vector<py::ssize_t> shape_of(uint64_t tuples, uint32_t components);

/// What numpy has, which must be contiguous and of native byte order (the Python side sees to that).
std::span<const std::byte> bytes_of(const py::array& array);

/// Name, domain, role, labels, values: how the Python side has arrays.
py::tuple described(const Array& array, const py::array& values);

}  // namespace maille::python
