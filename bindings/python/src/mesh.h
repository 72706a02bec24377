#pragma once

#include <maille/mesh.h>
#include <pybind11/pybind11.h>

#include <memory>

#include "errors.h"

namespace maille::python {

/// A mesh that does not change any more: views of its arrays keep it alive.
struct SharedMesh {
  std::shared_ptr<const Mesh> mesh;
};

inline SharedMesh shared(Mesh&& mesh) {
  return {std::make_shared<const Mesh>(std::move(mesh))};
}

void bind_mesh(py::module_& module);

}  // namespace maille::python
