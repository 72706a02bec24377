#pragma once

#include <maille/error.h>

#include <string>

namespace maille {

/// MAILLE_SMALL_DECODER and MAILLE_CHART_DECODER leave modes and codings out of decoders for the web. What
/// these say of that is no error for people: web/src/session.js sees the code, and takes another decoder
/// then. The codes lie above all of ErrorCode.
inline tl::unexpected<Error> left_out(int code = 1002) {
  return failure(static_cast<ErrorCode>(code),
                 "this decoder leaves out how the file is coded; the full one has it");
}
/// What the decoder of charts leaves out, but not the small one.
inline tl::unexpected<Error> left_out_of_charts() {
  return left_out(1003);
}

// Not inline: files that are compiled for the decoder of charts have a value of their own.
#ifdef MAILLE_CHART_DECODER
constexpr bool charts_alone = true;
#else
constexpr bool charts_alone = false;
#endif

}  // namespace maille
