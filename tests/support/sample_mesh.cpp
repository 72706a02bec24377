#include "support/sample_mesh.h"
#include "support/data.h"

namespace maille::testing {
namespace {

template <class T>
void set(Array& array, std::initializer_list<T> values) {
  array.resize(values.size() / array.components);
  std::copy(values.begin(), values.end(), array.values<T>().begin());
}

const std::initializer_list<uint32_t> corners = {0, 4,  1,  0,  3,  4,           // triangles
                                                 6, 7,  12, 15, 7,  10, 12, 15,  // tetrahedra
                                                 0, 1,  4,  3,  6,  7,  10, 9,  1,  2, 5,
                                                 4, 7,  8,  11, 10,                          // hexahedra
                                                 2, 13, 5,  8,  14, 11, 6,  7,  10, 9, 12};  // wedge, pyramid

Mesh without_cells() {
  Mesh mesh;
  mesh.points.type = Scalar::f64;
  set<double>(mesh.points, {0, 0,   0, 1, 0,   0,   2.5,  0,   0,   0,     1,   0, 1, 1,   0,   2.5,
                            1, 0,   0, 0, 1,   1,   0,    1,   2.5, 0,     1,   0, 1, 1,   1,   1,
                            1, 2.5, 1, 1, 0.5, 0.5, 2.25, 3.5, 0,   0.125, 3.5, 0, 1, 0.1, 0.2, 3});
  Array temperature = make_array("temperature", Domain::point, Scalar::f64, 1);
  Array velocity = make_array("velocity", Domain::point, Scalar::f64, 3);
  temperature.resize(16);
  velocity.resize(16);
  for (size_t i = 0; i < 16; ++i) temperature.values<double>()[i] = static_cast<double>(i) / 3.0;
  for (size_t i = 0; i < 48; ++i) velocity.values<double>()[i] = static_cast<double>(i) / 8.0;
  Array id = make_array("id", Domain::cell, Scalar::i32, 1);
  set<int32_t>(id, {1, 2, 7, 8, 3, 4, 5, 6});
  mesh.arrays = {temperature, velocity, id};
  return mesh;
}

}  // namespace

Mesh sample_mesh() {
  Mesh mesh = without_cells();
  CellBlock block;
  block.type = CellType::mixed;
  block.types = {5, 5, 10, 10, 12, 12, 13, 14};
  block.offsets = {0, 3, 6, 10, 14, 22, 30, 36, 41};
  block.connectivity = corners;
  mesh.blocks.push_back(block);
  return mesh;
}

Mesh sample_mesh_by_type() {
  Mesh mesh = without_cells();
  auto next = corners.begin();
  for (const auto& [type, size] : {std::pair(CellType::triangle, 6),
                                   {CellType::tetrahedron, 8},
                                   {CellType::hexahedron, 16},
                                   {CellType::wedge, 6},
                                   {CellType::pyramid, 5}}) {
    CellBlock block;
    block.type = type;
    block.connectivity.assign(next, next + size);
    next += size;
    mesh.blocks.push_back(block);
  }
  return mesh;
}

std::string sample_path(const std::string& name) {
  return tests_folder() + "/formats/" + name;
}

}  // namespace maille::testing
