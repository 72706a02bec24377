#pragma once

#include <maille/generate.h>

#include <optional>
#include <string>

#include "generate_counts.h"
#include "options.h"

namespace maille::tool {

struct GeneratedParts {
  GeneratedCounts counts;
  uint64_t output_bytes = 0;
};
/// Writes the mesh of generate_mesh() in another format as it comes: it is generated once to count and once
/// to write. Nothing where it has to be written whole.
Result<std::optional<GeneratedParts>> generate_in_parts(const BlockDescription& description,
                                                        const GenerateOptions& options,
                                                        const std::string& format);

}  // namespace maille::tool
