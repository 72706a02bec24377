#pragma once

#include <maille/decode.h>
#include <maille/mesh.h>

#include <optional>
#include <string>
#include <vector>

namespace maille::testing {

/// What came of asking for something of a file.
struct Answer {
  std::string asked;
  std::optional<Error> error;
  std::optional<Mesh> mesh;  ///< where it is one
  bool may_be_part = false;  ///< what is left of a damaged file, or what a query found
};

/// Everything that can be asked of a .maille file, one after another: decode(), salvage(), inspect(),
/// verify_checksums(), steps, portions of a stream, pieces, charts and searches.
std::vector<Answer> ask_everything(Bytes file, const Limits& limits);

/// What is wrong with an answer, whatever the file was: an error of an odd kind, or a mesh that is not valid.
/// Empty: nothing.
std::string fault_of(const Answer& answer);

}  // namespace maille::testing
