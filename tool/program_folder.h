#pragma once

#include <string>

namespace maille::tool {

/// The folder of the program that runs; empty where the system does not tell.
std::string program_folder();

}  // namespace maille::tool
