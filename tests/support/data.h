#pragma once

#include <string>
#include <vector>

namespace maille::testing {

/// The folder tests/ of the source tree. Only data.cpp is told where it and the meshes are, so that what a
/// compiler's cache has of the other files serves every clone.
std::string tests_folder();

/// Folder with the shared meshes, unpacked; empty when they are not on this machine.
std::string data_folder();

/// Files of one folder of the shared meshes ("tri", "poly", ...), sorted; empty when they are not there.
std::vector<std::string> data_files(const std::string& folder);

}  // namespace maille::testing
