#pragma once

#include <maille/source.h>

#include <algorithm>
#include <cstring>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace maille {

/// A text of any size in blocks of whole lines, so that readers of lines never see a cut one. Memory is one
/// block, and 64 MiB where a file has such a line.
class LineBlocks {
 public:
  LineBlocks(const Source& source, uint64_t begin, uint64_t bytes_at_once = uint64_t{4} << 20)
      : source_(source), next_(begin), at_once_(bytes_at_once) {}

  bool at_end() const { return next_ >= source_.size(); }
  /// Where the next block begins.
  uint64_t position() const { return next_; }
  /// The next block; it lasts until the one after it. Longer where a line is: `most` bytes at most.
  Result<std::string_view> read() {
    // Each round doubles the block until a whole line is in it; it ends at most_line, as a line that is
    // longer is refused.
    for (uint64_t size = at_once_;; size *= 2) {
      block_.resize(std::min(size, source_.size() - next_));
      MAILLE_CHECK(source_.read_at(next_, block_));
      const std::string_view text(reinterpret_cast<const char*>(block_.data()), block_.size());
      const bool last = next_ + block_.size() == source_.size();
      const size_t whole = last ? text.size() : end_of_lines(text);
      if (whole == 0 && size < most_line) continue;
      if (whole == 0) return failure(ErrorCode::unsupported, source_.name() + ": a line of more than 64 MB");
      next_ += whole;
      return text.substr(0, whole);
    }
  }

 private:
  // Chosen, not swept (1a7b336): longer than a polygon of a million corners in OBJ. A text without line ends
  // costs this much memory before it is refused.
  static constexpr uint64_t most_line = uint64_t{64} << 20;

  /// The place behind the last line that the next one does not continue (with a backslash before its end, as
  /// OBJ has it); 0 if there is none. `end` falls in each round, so the loop ends.
  static size_t end_of_lines(std::string_view text) {
    for (size_t end = text.size(); end > 0;) {
      const size_t at = text.rfind('\n', end - 1);
      if (at == std::string_view::npos) return 0;
      const size_t before = at > 0 && text[at - 1] == '\r' ? at - 1 : at;
      if (before == 0 || text[before - 1] != '\\') return at + 1;
      end = at;
    }
    return 0;
  }

  const Source& source_;
  uint64_t next_;
  uint64_t at_once_;
  std::vector<std::byte> block_;
};

}  // namespace maille
