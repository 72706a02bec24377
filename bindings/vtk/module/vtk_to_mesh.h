#pragma once

#include <maille/error.h>
#include <maille/mesh.h>

#include <vtkDataSet.h>

#include <string>
#include <vector>

namespace maille_vtk {

struct FromVtk {
  maille::Mesh mesh;
  /// What a mesh of maille does not hold, one sentence each.
  std::vector<std::string> notes;
};

/// Any vtkDataSet: points, cells, arrays of numbers; blocks, labels and metadata where field data have them
/// as to_vtk() writes them. Error: unsupported, for more points than a mesh in memory has.
maille::Result<FromVtk> from_vtk(vtkDataSet& data);

}  // namespace maille_vtk
