#pragma once

#include <maille/geometry.h>
#include <maille/mesh.h>

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace maille {

/// What a plane cuts out of the solids of a mesh, as polygons: one for each cell that it passes, or several
/// where bent faces let it pass twice. Their corners lie on edges of cells; cells that share an edge share
/// the corner. Of curved solids edges are straight between corners.
///
/// Point arrays: interpolated along the edge; integers are those of the nearer end, and so are numbers that
/// are not finite at one of them. Cell arrays: those of the cell. Other arrays are left out. A plane that
/// just touches a cell does not pass it.
Mesh slice(const Mesh& mesh, const Region::Plane& plane);

/// The values of the arrays of a mesh at a place.
struct ProbedValues {
  bool inside = false;  ///< of a solid; nothing else is known otherwise
  uint64_t cell = 0;    ///< through all blocks
  struct Value {
    std::string name;
    Domain domain = Domain::point;
    std::vector<double> components;
  };
  std::vector<Value> values;
};

/// By place, what the mesh has there: of cell arrays the value of the first cell that has the place, of point
/// arrays interpolated. For that a cell is cut into tetrahedra between its middle, the middles of its faces
/// and their edges, with mean values in middles: exact for linear fields, and the same from both sides of a
/// face.
std::vector<ProbedValues> probe(const Mesh& mesh, std::span<const Vector3> places);

}  // namespace maille
