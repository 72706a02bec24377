#pragma once

#include <maille/source.h>
#include <string>
#include <vector>

#include "base/system.h"

namespace maille {

/// Bytes of the regular file that is open; 0 for what is none, and for files below /proc, which claim no
/// bytes.
Result<uint64_t> plain_size(int file, const std::string& path);
/// Such a file as a source; `size`: plain_size().
std::unique_ptr<Source> plain_source(Descriptor file, uint64_t size, const std::string& path);
/// All that a pipe or a device gives.
Result<std::vector<std::byte>> read_to_end(int file, const std::string& name);

/// Opens a regular file in `folder` or below. Links are followed as long as they do not leave the folder,
/// pipes and devices are not waited for. Error: cannot_read.
Result<Descriptor> open_beneath(const std::string& folder, const std::string& name);

}  // namespace maille
