#pragma once

#include <maille/source.h>

#include <algorithm>
#include <string>
#include <vector>

#include "base/bytes.h"
#include "base/result.h"

namespace maille {

/// Reads a source front to back with a window of 64 KiB, for files that are not read whole. Jumps cost
/// nothing until something is read; headers that lie far apart cost one read each.
class SourceCursor {
 public:
  explicit SourceCursor(const Source& source) : source_(source), size_(source.size()) {}

  uint64_t position() const { return at_; }
  uint64_t left() const { return size_ - at_; }
  bool at_end() const { return at_ >= size_; }
  void jump(uint64_t to) { at_ = std::min(to, size_); }

  /// Error: malformed_input at the end of the file; cannot_read.
  template <class T>
  Result<T> take(bool swapped) {
    std::byte bytes[sizeof(T)];
    for (std::byte& byte : bytes) byte = MAILLE_TRY(next());
    if (swapped) std::reverse(bytes, bytes + sizeof(T));
    return load<T>(bytes);
  }
  /// Up to the end of the line, which is passed over, or of the file; no more than a name can have.
  Result<std::string> line() {
    std::string text;
    while (!at_end()) {
      const char c = static_cast<char>(MAILLE_TRY(next()));
      if (c == '\n') break;
      text.push_back(c);
      if (text.size() > most_line)
        return failure(ErrorCode::malformed_input,
                       source_.name() + ": byte " + std::to_string(at_) + ": a line of more than 64 KiB");
    }
    if (!text.empty() && text.back() == '\r') text.pop_back();
    return text;
  }

 private:
  // Chosen, not swept. A line of a header is no longer than a name in a .maille file may be.
  static constexpr size_t window_bytes = size_t{64} << 10;
  static constexpr size_t most_line = size_t{64} << 10;

  Result<std::byte> next() {
    if (at_ >= size_)
      return failure(ErrorCode::malformed_input, source_.name() + ": the file ends too early");
    if (at_ < begin_ || at_ >= begin_ + window_.size()) {
      begin_ = at_;
      window_.resize(static_cast<size_t>(std::min<uint64_t>(window_bytes, size_ - at_)));
      MAILLE_CHECK(source_.read_at(begin_, window_));
    }
    return window_[static_cast<size_t>(at_++ - begin_)];
  }

  const Source& source_;
  uint64_t size_, at_ = 0, begin_ = 0;
  std::vector<std::byte> window_;
};

}  // namespace maille
