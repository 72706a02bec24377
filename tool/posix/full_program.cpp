#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "program_folder.h"
#include "system.h"

namespace maille::tool {

namespace {

/// The arguments of this process, as they were given.
std::vector<std::string> arguments() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> all;
  for (std::string each; std::getline(file, each, '\0');) all.push_back(each);
  return all;
}

}  // namespace

// It is beside this one, or where it is installed.
Result<int> become_full_program() {
  const std::string here = program_folder();
  std::vector<std::string> given = arguments();
  std::vector<char*> argv;
  for (std::string& each : given) argv.push_back(each.data());
  argv.push_back(nullptr);
  for (const std::string& folder : {here, here + "/" MAILLE_FULL_FOLDER})
    ::execv((folder + "/maille-full").c_str(), argv.data());
  return failure(ErrorCode::unsupported,
                 "this verb needs the program maille-full, which cannot be started "
                 "beside " +
                     here + "/maille: " + std::strerror(errno));
}

}  // namespace maille::tool
