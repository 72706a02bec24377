#pragma once

#include <optional>
#include <string>
#include <vector>

#include "io/budget.h"
#include "io/cell_store.h"

// Cells as VTK's formats have them, one part of a mesh after the other.

namespace maille {

/// The faces of the polyhedra of one part, in the order of the cells, in either of VTK's two layouts.
/// append() and skip() are called for all cells in order, as the place in the stream follows from the cells
/// before.
class PartFaces {
 public:
  /// Until VTK 9.3: a stream of numbers of faces, numbers of points and points, and the end of each cell in
  /// it.
  static PartFaces stream(Array faces, Array ends);
  /// From VTK 9.4 on: faces by their ends in a list of points, cells by their ends in a list of faces.
  static PartFaces lists(Array points, Array face_ends, Array faces, Array cell_ends);

  /// Appends a cell's corners and face sizes; false when they lie outside of the arrays, or the budget is
  /// spent. Numbers of points are not looked at: the caller checks them.
  bool append(uint64_t cell, Budget& budget, std::vector<uint64_t>& corners, std::vector<uint32_t>& sizes);
  /// Passes over a cell that is no polyhedron.
  void skip(uint64_t cell);

 private:
  bool append_stream(uint64_t cell, std::vector<uint64_t>& corners, std::vector<uint32_t>& sizes);
  bool append_lists(uint64_t cell, Budget& budget, std::vector<uint64_t>& corners,
                    std::vector<uint32_t>& sizes);

  Array points_, face_ends_, faces_, cell_ends_;
  uint64_t at_ = 0;
  bool is_stream_ = false;
};

/// The cells of a part: arrays of integers of any type, as many `ends` (in the connectivity) as `types`,
/// which the caller has checked.
struct PartCells {
  Array connectivity, ends, types;
  std::optional<PartFaces> faces;  ///< where there are polyhedra
};

/// Appends the cells of a part of so many `points`, the first of which is number `base` of the mesh. Error:
/// malformed_input, for ends and points outside of what is there.
Result<> append_part_cells(PartCells part, uint64_t base, uint64_t points, const std::string& where,
                           Budget& budget, CellStore& cells);

}  // namespace maille
