#pragma once

#include <maille/error.h>

#include "options.h"

namespace maille::tool {

/// compress of one mesh, also where the input has several steps of time.
Result<int> compress_one(const CompressOptions& options);

}  // namespace maille::tool
