#pragma once

#include <maille/source.h>
#include <memory>
#include <string>

#include "base/result.h"

namespace maille {

/// The other files that `file` names, or that belong to it by their names: the one door for what a file from
/// somebody else refers to. Only regular files in the same folder or below are opened; names that lead
/// elsewhere (absolute, by "..", an address, "-") are malformed_input, links that leave the folder, pipes and
/// devices cannot_read.
Result<std::unique_ptr<Source>> open_beside(const std::string& file, const std::string& named);
/// The path of such a file, which has been looked at in the same way, for readers that open it by themselves;
/// one that is not there is theirs to miss.
Result<std::string> path_beside(const std::string& file, const std::string& named);

}  // namespace maille
