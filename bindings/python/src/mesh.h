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

/// Validates a mesh again: it may borrow arrays of numpy that somebody has written to since it was made, and
/// the library would read outside of its memory if an index were too large.
const Mesh& looked_at(const SharedMesh& self);

void bind_mesh(py::module_& module);

}  // namespace maille::python
