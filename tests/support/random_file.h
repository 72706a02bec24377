#pragma once

#include <maille/encode.h>
#include <maille/mesh.h>

#include <cstddef>
#include <string>
#include <vector>

namespace maille::testing {

/// A file of mode `random` with charts so small that small meshes have many, and levels.
struct RandomFile {
  std::string error;  ///< empty: it could be written
  bool unsupported = false;
  std::vector<std::byte> bytes;
};

RandomFile random_file(const Mesh& mesh, const EncodeOptions& options, uint32_t chart_faces = 12);

/// What is wrong with the mesh decoded; empty: it is the same. Solids, which this mode does not take, are
/// well.
std::string round_trip(const Mesh& mesh, const EncodeOptions& options);

}  // namespace maille::testing
