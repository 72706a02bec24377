#pragma once

#include <maille/error.h>
#include <maille/mesh.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "description/element_order.h"
#include "surface/patch_streams.h"

namespace maille {

// Twins are points at one place, bit for bit: two faces of a mesh that meet there have a point each, as where
// an array has a seam and the format knows only arrays of points. In a welded mesh they are one point, and a
// number on each corner says which of the twins it is. docs/format.md, 13.7.

struct WeldedMesh {
  /// Arrays of points that differ between twins are on corners here, but hold the tuples of the points that
  /// were there before.
  Mesh mesh;
  std::vector<bool> by_twin;          ///< by array: is it such an array?
  std::vector<uint32_t> corner_twin;  ///< by corner: the point it had before
  std::vector<uint32_t> kept;         ///< by point: the first of its twins, in rising order
};

/// Nothing where less than a point in 64 has a twin before it, or points are corners of no cell: these have
/// no corner that could say what their values are. With loss, points that the decoder has at one place are
/// twins. Whether welding pays is for the caller to try: 35 GLBs take 0.22 to 1.00 of the bytes (14 bits;
/// 16c4d15).
std::optional<WeldedMesh> weld(const Mesh& mesh, const ArrayToCode& positions);

/// How the positions of a mesh become codes when it is welded: no point may come back elsewhere for it.
ArrayMaps welded_maps(const WeldedMesh& welded, ArrayMaps positions);

/// Which points the corners of a welded mesh get when twins are split again: by point of the welded mesh,
/// twins by their numbers.
struct SplitPoints {
  std::vector<uint32_t> of_corner;
  std::vector<uint32_t> welded;  ///< by point: the one it is split from
};
/// `points`: of the welded mesh; `corners`: its connectivity; `twins`: the number on each corner. Points come
/// welded point by welded point; one of no cell stays one.
SplitPoints split_points(uint32_t points, std::span<const uint32_t> corners, std::span<const uint32_t> twins);

/// For points that are split again: by point, the one of the mesh before it was welded. `order`: that of the
/// welded mesh; `twins`: by corner of the mesh, the numbers that the decoder has.
std::vector<uint32_t> original_points(const WeldedMesh& welded, const ElementOrder& order,
                                      std::span<const uint32_t> twins);

/// Inverse of weld(), up to the order of points. `by_twin` tells which arrays of `mesh`, on corners, go back
/// to points: each point gets the tuple of its last corner, as all its corners have the same. Error: corrupt,
/// if there are not `points` of them then.
Result<Mesh> split_twins(Mesh mesh, std::span<const uint32_t> twins, const std::vector<bool>& by_twin,
                         uint64_t points);

}  // namespace maille
