#pragma once

#include <maille/error.h>

#include <string>

namespace maille {

/// MAILLE_SMALL_DECODER leaves modes and codings out of one of the two decoders for the web. What it says of
/// these: no error for people, web/src/session.js takes the other decoder then.
inline tl::unexpected<Error> left_out() {
  return failure(static_cast<ErrorCode>(1002),
                 "this decoder leaves out how the file is coded; the full one has it");
}

}  // namespace maille
