#pragma once

#include <pybind11/pybind11.h>

namespace maille::python {

void bind_codec(pybind11::module_& module);
void bind_surface(pybind11::module_& module);
void bind_volume(pybind11::module_& module);
void bind_stream(pybind11::module_& module);

}  // namespace maille::python
