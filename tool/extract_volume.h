#pragma once

#include <maille/volume_file.h>

#include "files.h"
#include "options.h"

namespace maille::tool {

/// What a condition of --where says: "T > 500", "T <= 3", "T = 2", "T = 1:5", "velocity[0] < 0", or with a
/// name in double quotes. Error: usage.
Result<ValueCondition> parse_condition(const std::string& text);

/// The box and the sphere that were asked for, for both modes. Error: usage, for a box whose corners are not
/// in order.
Result<Region> region_of(const ExtractOptions& options);

/// Takes a part of a file of mode stream. Errors: usage, for options of other modes.
Result<int> extract_volume(const ExtractOptions& options, const Input& input, const std::string& format);
/// Error: usage, where an option is for volumes only.
Result<> check_no_volume_options(const ExtractOptions& options);

}  // namespace maille::tool
