#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace maille {

/// What a server says before the content (RFC 9110), as far as ranges need it: what the content is a part of,
/// and by what a change of the file in between can be noticed (etag, last_modified, total).
struct HttpAnswer {
  /// "bytes 0-99/1000"; first > last: "bytes */1000", a range that is not there.
  struct ContentRange {
    uint64_t first = 0, last = 0;
    std::optional<uint64_t> total;
  };

  int status = 0;
  std::optional<ContentRange> range;
  std::optional<uint64_t> length;
  std::string etag, last_modified, encoding, type;

  /// A line of the head; the status line of the next answer (behind a redirection) begins anew.
  void take(std::string_view line);
};

/// Nothing where it is not as it should be.
std::optional<HttpAnswer::ContentRange> parse_content_range(std::string_view text);

}  // namespace maille
