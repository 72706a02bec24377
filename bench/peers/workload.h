#pragma once

#include <maille/error.h>
#include <maille/mesh.h>
#include <cstdint>
#include <string>
#include <vector>

namespace maille::bench {

/// Faces over points, in the one form that every codec's output can be turned into. Integers of a lattice are
/// held exactly: they stay below 2^24.
struct Surface {
  std::vector<float> xyz;
  std::vector<uint32_t> degrees;  ///< one per face; empty: all are triangles
  std::vector<uint32_t> corners;

  size_t vertices() const { return xyz.size() / 3; }
  size_t faces() const { return degrees.empty() ? corners.size() / 3 : degrees.size(); }
};

/// One mesh at one precision: what every codec gets.
struct Workload {
  std::string folder;  ///< "tri", "poly", ...: what means are taken over
  std::string mesh;
  int bits = 0;  ///< lattice over the longest side; 0: float32 positions as they are
  Surface surface;
  std::vector<uint32_t> triangles;  ///< the faces cut into fans, for codecs that know only triangles
  Mesh mesh_for_maille;             ///< the same faces and positions: i32 on a lattice, else f32
};

/// Largest precision that Surface holds exactly.
inline constexpr int max_bits = 24;

/// The faces of a mesh; positions become float32, all else is left out. Error: unsupported without faces.
Result<Surface> surface_of(const Mesh& mesh);
/// The same of a file.
Result<Surface> load(const std::string& path);

/// Turns every second face around.
Surface flip_every_second(Surface surface);

/// Rounds the positions to a lattice with 2^bits - 1 steps over the longest side (bits 0: keeps them).
Workload make_workload(const Surface& surface, int bits);

}  // namespace maille::bench
