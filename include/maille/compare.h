#pragma once

#include <maille/mesh.h>
#include <string>
#include <vector>

namespace maille {

struct CompareOptions {
  /// Points and cells must be in the same order, cells must start at the same corner. Otherwise a mesh equals
  /// another when some renaming of points, order of cells, rotation of faces and turn of solids (tetrahedra,
  /// pyramids, wedges, hexahedra; never mirrored) makes them equal.
  bool same_order = false;
  /// Largest difference allowed per component of positions; 0 means the same bits. With it, points are
  /// matched by order only (same_order must be set); differences_by_order() tells how large they are.
  double tolerance = 0;
  bool compare_arrays = true;
  bool compare_metadata = false;
};

struct Comparison {
  bool equal = false;
  /// What differs, one sentence each, the most telling first; at most a dozen. Empty when equal.
  std::vector<std::string> differences;
};

/// Compares two meshes: points and all point arrays bit for bit, cells with their arrays and corner arrays,
/// and mesh arrays. Borders of blocks do not matter, but names and types of blocks do, cell by cell. The
/// answer is exact, also with duplicate points and faces: "equal" is shown by a renaming that was checked,
/// "different" by a property that no renaming changes or by trying all renamings. Meshes too symmetric for
/// that are reported as not decided, and not as equal.
Comparison compare(const Mesh& a, const Mesh& b, const CompareOptions& options = {});

/// How far the values of an array are from those of another.
struct ArrayDifference {
  std::string name;
  Domain domain = Domain::point;
  double maximum = 0;           ///< largest |a - b| over finite components
  double maximum_norm = 0;      ///< largest length of b - a, all components of a tuple together
  double maximum_relative = 0;  ///< largest |a - b| / |a|; infinity where a is 0 and b is not
  double root_mean_square = 0;
  uint64_t unequal = 0;  ///< tuples whose bits differ
};
/// Array by array, the positions first, between two meshes with the same number of elements, matched by their
/// order. Error: differs, for an array that only one of them has, or with another number of tuples or
/// components.
[[nodiscard]] Result<std::vector<ArrayDifference>> differences_by_order(const Mesh& a, const Mesh& b);

}  // namespace maille
