// Verbs of the program `maille-full`, which is this command with other codecs and the server linked to it:
// loaded in every process these would take 6 MB, as much as a stream with a small front does.
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "program_folder.h"
#include "result.h"
#include "verbs.h"

namespace maille::tool {

namespace {

/// The arguments of this process, as they were given.
std::vector<std::string> arguments() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> all;
  for (std::string each; std::getline(file, each, '\0');) all.push_back(each);
  return all;
}

/// Becomes the other program: it is beside this one, or where it is installed.
Result<int> in_full_program() {
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

}  // namespace

Result<int> run(const BenchOptions&) {
  return in_full_program();
}
Result<int> run(const ServeOptions&) {
  return in_full_program();
}
Result<int> run(const ViewOptions&) {
  return in_full_program();
}

}  // namespace maille::tool
