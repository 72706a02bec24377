#pragma once

#include <maille/encode.h>
#include <maille/file.h>

#include <span>
#include <vector>

#include "description/description.h"
#include "description/element_order.h"
#include "surface/parts/shared_points.h"
#include "surface/patch_streams.h"

namespace maille {

// What files of surfaces say of the mesh that is encoded: modes `single` and `random`.

/// Error: usage (a name no array has, an effort that is none), unsupported (polyhedra, too large).
Result<> check_options(const Mesh& mesh, const EncodeOptions& options);

/// How the numbers of positions, then of each array, become codes, in this order. The mesh must stay. Error:
/// those of choose_maps().
Result<std::vector<ArrayToCode>> map_arrays(const Mesh& mesh, const EncodeOptions& options);

/// `arrays` are those of map_arrays(): positions first. Parts and welding are added by who cuts or welds.
Description describe(const Mesh& mesh, std::span<const ArrayToCode> arrays, const EncodeOptions& options);

/// How the elements of the decoded mesh stood in `mesh`: patch after patch, in each block.
ElementOrder original_order(const Mesh& mesh, std::span<const PatchSources> patches,
                            const JoinedPoints& joined);

/// What a description says to users; without sizes of streams, and without the arrays, which array_info()
/// tells one by one.
FileInfo file_info(const Description& description);
ArrayInfo array_info(const Description& description, const ArrayDescription& array, uint64_t coded_bytes);

ArrayReport report_of(const Array& array, const ArrayMaps& maps, size_t coded_bytes);

}  // namespace maille
