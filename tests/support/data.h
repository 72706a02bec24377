#pragma once

#include <string>
#include <vector>

namespace maille::testing {

/// Folder with the shared meshes, unpacked; empty when they are not on this machine.
std::string data_folder();

/// Files of one folder of the shared meshes ("tri", "poly", ...), sorted; empty when they are not there.
std::vector<std::string> data_files(const std::string& folder);

}  // namespace maille::testing
