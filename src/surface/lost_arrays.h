#pragma once

#include <maille/decode.h>

#include <span>
#include <string>
#include <vector>

#include "container/stream_source.h"
#include "description/description.h"
#include "description/remains.h"

namespace maille {

// Of a damaged file of mode `single`: which arrays are lost, and how the others are decoded without them.

/// Names of the arrays wanted of a patch that cannot be read: their streams are damaged or missing, or the
/// twins that they are coded by.
std::vector<std::string> lost_arrays(const StreamSource& streams, const Description& description,
                                     uint32_t patch, const DecodeOptions& options);
/// Twins are needed, and cannot be read.
bool lost_twins(const StreamSource& streams, const Description& description);
/// `options`, wanting no arrays of these names.
DecodeOptions without_arrays(const DecodeOptions& options, const Description& description,
                             std::span<const std::string> names);
/// An array of the mesh as a whole, which stands in patch 0. Errors: corrupt, cannot_read.
Result<> read_mesh_array(const StreamSource& streams, const Description& description, Array& array);

void drop_arrays(Mesh& mesh, std::span<const std::string> names);
/// Each once.
void tell_lost_arrays(std::vector<std::string> names, Remains& remains);

}  // namespace maille
