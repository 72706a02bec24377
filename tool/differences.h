#pragma once

#include <maille/compare.h>

#include <string>
#include <vector>

#include "summary.h"

namespace maille::tool {

/// Largest differences as a table and as JSON.
std::string differences_text(const std::vector<ArrayDifference>& differences);
Json differences_json(const std::vector<ArrayDifference>& differences);

}  // namespace maille::tool
