#pragma once

#include <maille/error.h>

#include "options.h"

namespace maille::tool {

/// Reads the command line. Error: usage, one sentence that names the verb.
Result<Command> parse_command_line(int argc, const char* const* argv);

}  // namespace maille::tool
