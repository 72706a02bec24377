#pragma once

#include <maille/mesh.h>

#include <string>

#include "files.h"
#include "options.h"
#include "summary.h"

// What extract and slice share: they write a part of a mesh, in any format but .maille.
namespace maille::tool {

/// The format to write. Errors: usage, as of output_format(), and for .maille.
Result<std::string> part_format(const OutputOptions& options, const char* verb);

/// Writes a part of the mesh that `input` names, whole or not at all, and says what the format cannot hold.
Result<> write_part(const Mesh& part, const std::string& input, const OutputOptions& options,
                    const std::string& format, const CommonOptions& common);

/// How much of an address was fetched, and of how large a file; nothing of other inputs.
void add_fetched(const Input& input, Json& json);
void say_fetched(const Input& input);

}  // namespace maille::tool
