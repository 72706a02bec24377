// Meshes: their arrays as views, from arrays of numpy, and what is done to them whole.
#include "mesh.h"

#include <maille/compare.h>
#include <maille/encode.h>
#include <maille/slice.h>
#include <pybind11/stl.h>

#include <algorithm>

#include "job.h"
#include "surface_triangles.h"
#include "values.h"

namespace maille::python {

namespace {

/// Keeps an object of Python; whoever lets go of it last may be a thread without the interpreter's lock.
std::shared_ptr<const void> owner_of(const py::object& object) {
  return {object.inc_ref().ptr(), [](const PyObject* kept) {
            const py::gil_scoped_acquire acquired;
            Py_DECREF(const_cast<PyObject*>(kept));
          }};
}

/// Numbers of numpy where they lie: the array lives as long as the mesh, or a copy of it, does.
template <class T>
void borrow(const py::object& from, Buffer<T>& to) {
  if (from.is_none()) return;
  const auto array = from.cast<py::array>();
  const auto bytes = bytes_of(array);
  to = Buffer<T>::borrow({reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)},
                         owner_of(array));
}

Domain domain_called(const std::string& name) {
  for (unsigned i = 0; i < domain_count; ++i) {
    if (name == name_of(static_cast<Domain>(i))) return static_cast<Domain>(i);
  }
  throw py::value_error("an array is on points, corners, cells or the mesh, not on '" + name + "'");
}

Role role_called(const std::string& name) {
  std::string known;
  for (unsigned i = 0; i < role_count; ++i) {
    const char* each = name_of(static_cast<Role>(i));
    if (name == each) return static_cast<Role>(i);
    known += (i == 0 ? "" : ", ") + std::string(each);
  }
  throw py::value_error("there is no role '" + name + "'; there are: " + known);
}

/// Values (n,) or (n, components), with the rest of what describes an array.
Array array_from(const std::string& name, Domain domain, const py::array& values) {
  const auto type = scalar_of(values);
  if (!type) throw py::type_error("'" + name + "': there are no arrays of this type");
  Array array =
      make_array(name, domain, *type, values.ndim() == 1 ? 1 : static_cast<uint32_t>(values.shape(1)));
  borrow(values, array.bytes);
  return array;
}

Array array_from(const py::tuple& given) {
  Array array = array_from(given[0].cast<std::string>(), domain_called(given[1].cast<std::string>()),
                           given[4].cast<py::array>());
  array.role = role_called(given[2].cast<std::string>());
  array.labels = given[3].cast<std::vector<std::string>>();
  return array;
}

CellBlock block_from(const py::tuple& given) {
  CellBlock block;
  block.name = given[0].cast<std::string>();
  block.type = static_cast<CellType>(given[1].cast<int>());
  borrow(given[2], block.types);
  borrow(given[3], block.offsets);
  borrow(given[4], block.connectivity);
  borrow(given[5], block.face_sizes);
  borrow(given[6], block.cell_faces);
  return block;
}

SharedMesh mesh_from(const py::array& points, const py::list& blocks, const py::list& arrays,
                     std::vector<std::pair<std::string, std::string>> metadata) {
  Mesh mesh;
  mesh.points = array_from("position", Domain::point, points);
  for (const py::handle& block : blocks) mesh.blocks.push_back(block_from(block.cast<py::tuple>()));
  for (const py::handle& array : arrays) mesh.arrays.push_back(array_from(array.cast<py::tuple>()));
  mesh.metadata = std::move(metadata);
  // Arrays of numpy are as hostile as files: numbers of points that do not exist would be read as memory.
  take(validate(mesh));
  return shared(std::move(mesh));
}

template <class Values>
py::object values_of(const SharedMesh& self, const Values& values, unsigned columns = 0) {
  using T = std::remove_const_t<std::remove_pointer_t<decltype(values.data())>>;
  const auto rows = static_cast<py::ssize_t>(values.size() / std::max(columns, 1U));
  std::vector<py::ssize_t> shape = {rows};
  if (columns != 0) shape.push_back(static_cast<py::ssize_t>(columns));
  return view_of(self.mesh, values.data(), py::dtype::of<T>(), std::move(shape));
}

template <class Values>
py::object values_or_none(const SharedMesh& self, const Values& values) {
  return values.empty() ? py::object(py::none()) : values_of(self, values);
}

/// A block as block_from() takes it. Blocks of one kind have connectivity of shape (cells, nodes).
py::tuple tuple_of(const SharedMesh& self, const CellBlock& block) {
  return py::make_tuple(block.name, static_cast<int>(block.type), values_or_none(self, block.types),
                        values_or_none(self, block.offsets),
                        values_of(self, block.connectivity, nodes_of(block.type)),
                        values_or_none(self, block.face_sizes), values_or_none(self, block.cell_faces));
}

py::array values_of(const SharedMesh& self, const Array& array) {
  return view_of(self.mesh, array.bytes.data(), dtype_of(array.type),
                 shape_of(array.count(), array.components));
}

py::list blocks_of(const SharedMesh& self) {
  py::list blocks;
  for (const CellBlock& block : self.mesh->blocks) blocks.append(tuple_of(self, block));
  return blocks;
}

py::list arrays_of(const SharedMesh& self) {
  py::list arrays;
  for (const Array& array : self.mesh->arrays) arrays.append(described(array, values_of(self, array)));
  return arrays;
}

std::vector<std::string> differences(const SharedMesh& a, const SharedMesh& b, bool same_order) {
  const CompareOptions options{.same_order = same_order};
  const Mesh &first = looked_at(a), &second = looked_at(b);
  const Comparison found =
      run(py::none(), [&](const Progress&) { return Result<Comparison>(compare(first, second, options)); });
  if (!found.equal && found.differences.empty()) return {"the meshes differ"};
  return found.differences;
}

py::tuple surface_of(const SharedMesh& self) {
  const Mesh& mesh = looked_at(self);
  SurfaceTriangles found =
      run(py::none(), [&](const Progress&) { return Result<SurfaceTriangles>(surface_triangles(mesh)); });
  const auto kept = std::make_shared<const std::vector<uint32_t>>(std::move(found.corners));
  return py::make_tuple(view_of(kept, kept->data(), py::dtype::of<uint32_t>(), shape_of(kept->size() / 3, 3)),
                        view_of(std::move(found.cells)));
}

SharedMesh slice_of(const SharedMesh& self, const std::array<double, 3>& normal, double offset) {
  const Mesh& mesh = looked_at(self);
  return shared(run(py::none(), [&](const Progress&) {
    return Result<Mesh>(slice(mesh, {Vector3{normal}, offset}));
  }));
}

py::list probed(const SharedMesh& self, const py::array_t<double, py::array::c_style>& places) {
  const Mesh& mesh = looked_at(self);
  std::vector<Vector3> at(static_cast<size_t>(places.shape(0)));
  for (size_t i = 0; i < at.size(); ++i) {
    for (unsigned k = 0; k < 3; ++k) at[i][k] = places.at(static_cast<py::ssize_t>(i), k);
  }
  const auto found =
      run(py::none(), [&](const Progress&) { return Result<std::vector<ProbedValues>>(probe(mesh, at)); });
  py::list answers;
  for (const ProbedValues& each : found) {
    py::list values;
    for (const auto& value : each.values)
      values.append(py::make_tuple(value.name, name_of(value.domain), value.components));
    answers.append(py::make_tuple(each.inside, each.cell, values));
  }
  return answers;
}

}  // namespace

const Mesh& looked_at(const SharedMesh& self) {
  take(validate(*self.mesh));
  return *self.mesh;
}

void bind_mesh(py::module_& module) {
  py::class_<SharedMesh>(module, "Mesh")
      .def(py::init(&mesh_from), py::arg("points"), py::arg("blocks"), py::arg("arrays"), py::arg("metadata"))
      .def_property_readonly("points",
                             [](const SharedMesh& self) { return values_of(self, self.mesh->points); })
      .def_property_readonly("blocks", &blocks_of)
      .def_property_readonly("arrays", &arrays_of)
      .def_property_readonly("metadata", [](const SharedMesh& self) { return self.mesh->metadata; })
      .def_property_readonly("point_count", [](const SharedMesh& self) { return self.mesh->point_count(); })
      .def_property_readonly("cell_count", [](const SharedMesh& self) { return self.mesh->cell_count(); })
      .def_property_readonly("usual_mode",
                             [](const SharedMesh& self) { return static_cast<int>(usual_mode(*self.mesh)); })
      .def("differences", &differences, py::arg("other"), py::arg("same_order"))
      .def("surface", &surface_of)
      .def("slice", &slice_of, py::arg("normal"), py::arg("offset"))
      .def("probe", &probed, py::arg("places"));

  module.def("cell_types", [] {
    py::list types;
    for (int number = 1; number < 256; ++number) {
      const auto type = static_cast<CellType>(number);
      const std::string name = name_of(type);
      if (name != "unknown") types.append(py::make_tuple(name, number, nodes_of(type), dimension_of(type)));
    }
    return types;
  });
}

}  // namespace maille::python
