#pragma once

#include <maille/mesh.h>

#include <cstdint>

namespace maille::testing {

/// What random_surface may produce. Everything nasty is on; switch off what a test cannot take.
struct RandomMeshOptions {
  uint32_t faces = 60;           ///< about as many at most; every tenth mesh is tiny whatever this says
  bool pathologies = true;       ///< non-manifold, flips, duplicates, degenerate faces, merged points, ...
  bool degenerate_faces = true;  ///< repeated points within a face, 1-gons, 2-gons, empty faces
  bool arrays = true;            ///< of every domain and scalar type
  bool special_values =
      true;  ///< NaN payloads, infinities, -0, denormals, extreme integers; also in positions
  bool any_position_type = true;  ///< f64 and integers too; otherwise f32
  bool several_blocks =
      true;  ///< triangle, quad, polygon and mixed blocks, with names; otherwise one polygon block
  bool other_cells = false;  ///< vertices, lines, tetrahedra, ... beside the faces
};

/// A mesh to break codecs with, valid (validate() holds), the same for a seed wherever the C library's sine
/// rounds the same. Seeds run through all base shapes and pathologies: a thousand of them see each often, and
/// many combinations.
Mesh random_surface(uint64_t seed, const RandomMeshOptions& options = {});

/// The same mesh as compare() sees it: points renamed, cells reordered within their blocks, faces rotated,
/// arrays following.
Mesh shuffled(const Mesh& mesh, uint64_t seed);
/// Each face turned over with a chance of `percent`, its corner arrays following. Not the same mesh.
Mesh flipped(const Mesh& mesh, uint64_t seed, unsigned percent = 50);

}  // namespace maille::testing
