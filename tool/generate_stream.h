#pragma once

#include <maille/encode.h>
#include <maille/generate.h>
#include <maille/stream.h>

#include "files.h"
#include "options.h"

namespace maille::tool {

/// Writes a generated mesh as it comes: one block, and an array of labels that tells zones and patches.
Result<StreamReport> generate_stream(const BlockDescription& description, const GenerateOptions& options,
                                     Sink& sink, ProgressDisplay& progress);

/// The same in pieces, by way of temporary files.
Result<EncodeReport> generate_pieces(const BlockDescription& description, const GenerateOptions& options,
                                     Sink& sink, ProgressDisplay& progress);

}  // namespace maille::tool
