#pragma once

#include <string>
#include <vector>

#include "options.h"

// What most people want, by what the file is for: compress --for PURPOSE.
namespace maille::tool {

/// Settings under one name. All of them are those of options that there are; what the user gives beside it
/// comes first.
struct Purpose {
  std::string name;
  std::string summary;  ///< for --help: what it is for, and the options that it stands for
  std::optional<Mode> mode = {};
  std::optional<int> effort = {};
  bool keep_order = false;
  std::string pieces = {};
  std::vector<std::string> bits = {};  ///< as of --bits
  std::string error = {};              ///< as of --error
  std::vector<std::string> dropped = {};
};
const std::vector<Purpose>& purposes();

/// What the command line itself said; the purpose leaves it alone.
struct Given {
  bool effort = false;
  bool order = false;
};
/// Fills in what was not given. `name` is that of a purpose.
void set_for(const std::string& name, const Given& given, CompressOptions& options);

}  // namespace maille::tool
