#pragma once

#include "description/remains.h"
#include "surface/patch_streams.h"

namespace maille {

// Of a damaged file of mode `single`.

/// An array of the mesh as a whole, which stands in patch 0. Errors: corrupt, cannot_read.
Result<> read_mesh_array(const StreamSource& streams, const Description& description, Array& array);

/// Where the description of `mesh` has this array of it.
size_t place_of(const Description& description, const Array& array);
void drop_arrays(Mesh& mesh, const Description& description, const LostArrays& lost);
void tell_lost_arrays(const Description& description, const LostArrays& lost, Remains& remains);

}  // namespace maille
