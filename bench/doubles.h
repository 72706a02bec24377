#pragma once

#include <string>
#include <vector>

namespace maille::bench {

/// Positions in doubles, lossless: maille's bytes of them, connectivity not counted, against xz -9 of the raw
/// numbers in the order of the file. Prints a row per mesh and the geometric means. `variants`: also what
/// other programs might have made of the mesh, and of meshes whose positions are floats; else only files
/// whose positions are doubles count. False when a round trip failed.
bool measure_doubles(const std::vector<std::string>& paths, const std::vector<int>& efforts, bool variants);

}  // namespace maille::bench
