#pragma once

#include <maille/volume_file.h>

#include "files.h"
#include "options.h"
#include "progress.h"

namespace maille::tool {

/// The cells of an input that a query is for, with the arrays wanted: of a file of mode stream no more is
/// read than has to be, other inputs are read whole. Error: corrupt, where a piece is damaged.
struct VolumeRequest {
  std::string input, input_format;
  uint64_t fetch_limit = default_fetch_limit;
  std::optional<std::vector<std::string>> arrays;
  uint64_t step = 0;
};
Result<Mesh> read_cells(const VolumeRequest& request, const VolumeQuery& query, const CommonOptions& common);

/// What may be fetched grows by what the query reads.
Result<> allow(const VolumeFile& file, const VolumeQuery& query, const Input& input);

/// A plane by a point on it and its normal. Error: usage, for a normal of no length.
Result<Region::Plane> plane_of(const std::vector<double>& numbers);

}  // namespace maille::tool
