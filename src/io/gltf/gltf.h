#pragma once

#include <maille/io.h>

namespace maille {

// glTF 2.0. Positions stay as stored: transforms of nodes are not applied but kept as metadata, from which
// the writer restores them. One block per primitive, named by its mesh ("mesh", or "mesh/0", "mesh/1" where a
// mesh has several); materials are the cell array "material". Metadata, all JSON:
//   gltf.asset        the asset object
//   gltf.nodes        the nodes, gltf.scene the roots, gltf.meshes the blocks of each mesh; absent when every
//                     mesh is used once and not moved
//   gltf.normalized   names of arrays whose integers stand for fractions of 1
//   gltf.only         name of array -> blocks that have it; it is zero in the others
Result<ReadResult> read_gltf(const Source& source, const ReadOptions& options);
/// Text where the options name the format "gltf" or ask for text, otherwise binary.
Result<std::vector<std::string>> write_gltf(const Mesh& mesh, Sink& sink, const WriteOptions& options);

}  // namespace maille
