#pragma once

#include <filesystem>
#include <vector>

#include "faults/mutations.h"

namespace maille::testing {

/// Golden files, and small random meshes at all levels.
std::vector<Seed> maille_seeds();

std::vector<std::byte> content(const std::filesystem::path& path);

}  // namespace maille::testing
