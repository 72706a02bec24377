#pragma once

#include <maille/compare.h>
#include <maille/file.h>
#include <maille/mesh.h>

#include <cstdint>
#include <string>
#include <vector>

#include "options.h"
#include "summary.h"
#include "text.h"

// What verify says of a file and of the mesh that it was made from.
namespace maille::tool {

/// One array held against the original.
struct ArrayVerdict {
  ArrayInfo info;
  ArrayDifference difference;
  bool good = true;  ///< within the bound, or bit for bit
};

/// The answer of verify.
struct Verdict {
  std::vector<std::string> damage;
  uint64_t points = 0;
  uint64_t cells = 0;
  uint64_t steps = 0;  ///< of time that were compared
  const char* word = "face";
  bool compared = false;
  bool same = true;
  std::vector<std::string> differences;
  std::vector<ArrayVerdict> arrays;

  int exit_code() const {
    return static_cast<int>(!damage.empty() ? ErrorCode::corrupt : same ? ErrorCode{} : ErrorCode::differs);
  }
};

void differs(Verdict& verdict, std::vector<std::string> differences);

/// Holds what a file decodes to against its original: everything lossless must be the same, values with loss
/// within their bounds.
Result<> hold_against(const Mesh& original, const Mesh& decoded, const FileInfo& info,
                      const CommonOptions& common, Verdict& verdict);

std::string table_of(const std::vector<ArrayVerdict>& arrays);
Json json_of(const std::vector<ArrayVerdict>& arrays);

}  // namespace maille::tool
