// maille._core: the library for the package of Python files beside it, which is what users see: it checks
// what they give, and describes it.
#include <maille/version.h>
#include <pybind11/pybind11.h>

#include "codec.h"
#include "mesh.h"
#include "sources.h"

PYBIND11_MODULE(_core, module) {
  module.attr("version") = maille::library_version();
  maille::python::bind_mesh(module);
  maille::python::bind_sources(module);
  maille::python::bind_codec(module);
  maille::python::bind_surface(module);
  maille::python::bind_volume(module);
  maille::python::bind_stream(module);
}
