#pragma once

#include <maille/http.h>

#include <string>

#include "support/random.h"

namespace maille::testing {

inline constexpr size_t content_bytes = 300'000;
inline const std::string strong_etag = "ETag: \"one\"\r\n";

inline std::string test_content(uint64_t seed = 1) {
  Random random(seed);
  std::string content(content_bytes, ' ');
  for (char& c : content) c = static_cast<char>(random.next());
  return content;
}

/// Patience for a test: no pauses to speak of.
inline HttpOptions impatient() {
  HttpOptions options;
  options.pause_seconds = 0.001;
  options.stall_seconds = 30;
  return options;
}

}  // namespace maille::testing
