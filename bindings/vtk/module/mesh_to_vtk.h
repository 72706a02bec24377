#pragma once

#include <maille/mesh.h>

#include <vtkDataSet.h>
#include <vtkSmartPointer.h>

#include <span>
#include <string>
#include <utility>
#include <vector>

namespace maille_vtk {

/// Vertices, lines, faces and strips: what vtkPolyData holds.
bool fits_poly_data(maille::CellType type);
bool fits_poly_data(std::span<const std::pair<maille::CellType, uint64_t>> types);

/// A mesh as vtkPolyData (fits_poly_data() of all its types; cells come sorted by vertices, lines, faces and
/// strips) or as vtkUnstructuredGrid, with all its arrays but those on corners. Normals, texture coordinates,
/// tangents and colours are the active attributes.
vtkSmartPointer<vtkDataSet> to_vtk(const maille::Mesh& mesh, bool poly_data);

/// One block of a mesh as a mesh of its own, with the points that it has, in their order.
maille::Mesh block_of(const maille::Mesh& mesh, size_t block);

/// The type of VTK's array for such numbers.
int vtk_type_of(maille::Scalar type);

}  // namespace maille_vtk
