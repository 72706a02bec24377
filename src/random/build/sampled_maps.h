#pragma once

#include <maille/encode.h>
#include <maille/mesh_source.h>

#include <vector>

#include "surface/patch_streams.h"

namespace maille {

/// How the numbers of positions (first) and of each array become codes: chosen by a sample, then held against
/// every number of the mesh; what does not fit joins the sample. The same bounds hold as for a mesh in
/// memory, but lossless maps may be less tight. Errors: those of choose_maps(), of the source.
Result<std::vector<ArrayMaps>> sample_maps(MeshSource& mesh, const EncodeOptions& options);

/// A piece of an array with these maps: which of its numbers the lattice cannot hold is found anew.
ArrayToCode piece_to_code(const Array& piece, const ArrayMaps& maps);

/// An array of the mesh, or its positions, without tuples.
inline constexpr size_t positions_of_source = ~size_t{0};
Array empty_array_of(const MeshDescription& mesh, size_t array);
/// Tuples of it.
Result<> read_tuples_of(MeshSource& mesh, size_t array, uint64_t first, uint64_t count,
                        std::span<std::byte> out);

}  // namespace maille
