#pragma once

#include <maille/error.h>

#include <functional>
#include <string>

#include "options.h"

namespace maille::tool {

/// Steps of time that were appended to a mesh.
struct AppendedSteps {
  uint64_t count = 0;
  uint64_t input_bytes = 0;  ///< of all files of the series
  uint64_t coded_bytes = 0;  ///< of the steps
  uint64_t file_bytes = 0;   ///< of all
  bool left_out = false;     ///< something of their inputs, as notes said
};

/// A mesh of which later steps follow.
struct Series {
  std::string name;  ///< for the report
  std::function<Result<AppendedSteps>(const std::string& file)> append;
};

/// compress of one mesh, also where the input has several steps of time. With a series its steps are appended
/// before the file appears under its name. The value: bytes of all files of the input, as of the other two.
Result<uint64_t> compress_one(const CompressOptions& options, const Series* series = nullptr);

}  // namespace maille::tool
