#pragma once

#include <maille/error.h>
#include <maille/mesh.h>
#include <string>

namespace maille::bench {

/// A million hexahedra: five blocks of an O-grid in a twisted pipe with an S-bend, graded towards the wall,
/// block after block.
Result<Mesh> generate_pipe();

/// All numbers of 64-bit floats as 32-bit ones, which is what the aims of the project speak of.
Mesh as_f32(Mesh mesh);

/// Cells of three dimensions; all, if there are none.
uint64_t solid_cells(const Mesh& mesh);

}  // namespace maille::bench
