#pragma once

#include <maille/error.h>

#include <string>
#include <vector>

namespace maille {

/// Decodes the charts of level 0 of all files, one file after the other in each of some rounds, and prints a
/// row for each: the best round of each. So that two files, or two builds of this program one after the
/// other, meet the same machine.
Result<> compare_decoding(const std::vector<std::string>& files);

/// Prints a row for each mesh and coding: charts of the mesh, with 14 bits and lossless, at efforts 1, 2 and
/// 5, beside meshoptimizer + zstd -19 for its triangles with 14 bits, in the same rounds.
Result<> compare_with_peers(const std::vector<std::string>& meshes);

}  // namespace maille
