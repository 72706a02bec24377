#include "values.h"

#include <pybind11/stl.h>

namespace maille::python {

py::dtype dtype_of(Scalar type) {
  static constexpr const char* names[scalar_count] = {"i1", "u1", "i2", "u2", "i4",
                                                      "u4", "i8", "u8", "f4", "f8"};
  return py::dtype(names[static_cast<size_t>(type)]);
}

std::optional<Scalar> scalar_of(const py::array& array) {
  for (unsigned i = 0; i < scalar_count; ++i) {
    const auto type = static_cast<Scalar>(i);
    if (array.dtype().is(dtype_of(type)) || array.dtype().equal(dtype_of(type))) return type;
  }
  return std::nullopt;
}

py::array view_of(std::shared_ptr<const void> owner, const void* data, const py::dtype& type,
                  std::vector<py::ssize_t> shape) {
  using Owner = std::shared_ptr<const void>;
  const py::capsule base(new Owner(std::move(owner)), [](void* kept) { delete static_cast<Owner*>(kept); });
  py::array view(type, std::move(shape), {}, data, base);
  // Meshes are shared by all views of them, and the library relies on their having been validated.
  view.attr("setflags")(py::arg("write") = false);
  return view;
}

std::vector<py::ssize_t> shape_of(uint64_t tuples, uint32_t components) {
  std::vector<py::ssize_t> shape = {static_cast<py::ssize_t>(tuples)};
  if (components != 1) shape.push_back(static_cast<py::ssize_t>(components));
  return shape;
}

std::span<const std::byte> bytes_of(const py::array& array) {
  constexpr int wanted =
      static_cast<int>(py::array::c_style) | static_cast<int>(py::detail::npy_api::NPY_ARRAY_ALIGNED_);
  if ((array.flags() & wanted) != wanted)
    throw py::value_error("the array is not contiguous, or not aligned");
  return {static_cast<const std::byte*>(array.data()), static_cast<size_t>(array.nbytes())};
}

py::tuple described(const Array& array, const py::array& values) {
  return py::make_tuple(array.name, name_of(array.domain), name_of(array.role), array.labels, values);
}

}  // namespace maille::python
