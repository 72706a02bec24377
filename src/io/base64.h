#pragma once

#include <maille/source.h>

#include <string>
#include <string_view>

namespace maille {

/// RFC 4648 base64 with padding, without line breaks.
std::string to_base64(Bytes bytes);

/// Reads base64 text front to back. White space is skipped; padding ends a group, not the text, so that texts
/// encoded in parts and joined (VTK writes headers so) read as their joined bytes.
class Base64Reader {
 public:
  explicit Base64Reader(std::string_view text) : text_(text) {}
  /// Fills `out`; false when the text ends before, or holds a foreign character.
  bool read(std::span<std::byte> out);
  /// The most bytes that can still follow: a bound for what may be reserved before anything is decoded. Each
  /// four characters of the text give at most three, and 3 covers an unfinished group.
  uint64_t most_left() const { return pending_size_ + (text_.size() - at_) / 4 * 3 + 3; }
  /// Place in the text, for messages.
  size_t position() const { return at_; }
  /// Only white space is left.
  bool at_end();

 private:
  bool next_group();

  std::string_view text_;
  size_t at_ = 0;
  std::byte pending_[3] = {};
  unsigned pending_at_ = 0;
  unsigned pending_size_ = 0;
};

}  // namespace maille
