#pragma once

#include <charconv>
#include <cstring>
#include <string>
#include <string_view>
#include "io/numbers.h"
#include "io/reading.h"

namespace maille {

/// Walks over a text, knowing the line it is on. Lines end with "\n", "\r\n" or "\r". Nothing here copies or
/// allocates; all reads stay inside the text, which must outlive the scanner. peek() and at_line_end() may be
/// called at the end; advance() and skip_return() may not.
class TextScanner {
 public:
  explicit TextScanner(std::string_view text, uint64_t first_line = 1)
      : begin_(text.data()), p_(text.data()), end_(text.data() + text.size()), line_(first_line) {}

  uint64_t line() const { return line_; }
  /// Bytes read so far.
  uint64_t position() const { return static_cast<uint64_t>(p_ - begin_); }
  bool at_end() const { return p_ == end_; }
  bool at_line_end() const { return p_ == end_ || *p_ == '\n' || *p_ == '\r'; }
  /// The next character, 0 at the end.
  char peek() const { return p_ == end_ ? '\0' : *p_; }
  void advance() { ++p_; }
  const char* here() const { return p_; }
  const char* end() const { return end_; }
  void jump(const char* p) { p_ = p; }

  /// Skips the mark with which some editors begin UTF-8.
  void skip_byte_order_mark() {
    if (std::string_view(p_, static_cast<size_t>(end_ - p_)).starts_with("\xef\xbb\xbf")) p_ += 3;
  }
  /// Skips blanks within the line.
  void skip_blanks() {
    while (p_ != end_ && (*p_ == ' ' || *p_ == '\t')) ++p_;
  }
  /// The same where a backslash at the end of a line continues it (OBJ).
  void skip_blanks_continued() {
    for (;;) {
      skip_blanks();
      if (p_ == end_ || *p_ != '\\') return;
      const char* next = p_ + 1;
      if (next != end_ && *next != '\n' && *next != '\r') return;
      p_ = next;
      skip_line_end();
    }
  }
  /// Moves behind the line's end when standing on it.
  void skip_line_end() {
    if (p_ == end_) return;
    if (*p_ == '\r' && p_ + 1 != end_ && p_[1] == '\n') ++p_;
    if (*p_ == '\n' || *p_ == '\r') {
      ++p_;
      ++line_;
    }
  }
  /// Moves behind a "\r" that ends a line by itself; call it only when standing on one.
  void skip_return() {
    ++p_;
    ++line_;
  }
  /// Skips blanks and line ends; where `comment` is set, also what stands behind it up to the end of the
  /// line.
  void skip_white(char comment = '\0') {
    for (;;) {
      skip_blanks();
      if (p_ == end_) return;
      if (*p_ == '\n' || *p_ == '\r') {
        skip_line_end();
      } else if (comment != '\0' && *p_ == comment) {
        rest_of_line();
      } else if (*p_ == '\f' || *p_ == '\v') {
        ++p_;
      } else {
        return;
      }
    }
  }
  /// What is left of the line, without the line's end; stands on the line's end afterwards.
  std::string_view rest_of_line() {
    const char* const from = p_;
    while (!at_line_end()) ++p_;
    return {from, static_cast<size_t>(p_ - from)};
  }
  void skip_line() {
    rest_of_line();
    skip_line_end();
  }
  /// The word at this place: up to the next white space or `stop`; empty at the end of a line.
  std::string_view word(char stop = ' ') {
    const char* const from = p_;
    while (p_ != end_ && !is_white(*p_) && *p_ != stop) ++p_;
    return {from, static_cast<size_t>(p_ - from)};
  }
  /// The word here without moving behind it, for messages: at most 40 characters, "" at the end of the line.
  std::string_view look(char stop = ' ') const {
    TextScanner copy = *this;
    return copy.word(stop).substr(0, 40);
  }
  /// Reads a number that ends at white space, the text's end, or the character `stop`. Does not move when
  /// there is none. So "1.5abc" is no number, where a prefix would be taken silently.
  bool number(Number& number, char stop = ' ') {
    const char* const behind = parse_number(p_, end_, number);
    if (behind == nullptr || (behind != end_ && !is_white(*behind) && *behind != stop)) return false;
    p_ = behind;
    return true;
  }
  /// A whole number that ends likewise. Does not move when there is none.
  template <class T>
  bool integer(T& value, char stop = ' ') {
    const char* from = p_;
    if (from != end_ && *from == '+') ++from;
    const auto [behind, error] = std::from_chars(from, end_, value);
    if (error != std::errc() || (behind != end_ && !is_white(*behind) && *behind != stop)) return false;
    p_ = behind;
    return true;
  }

  static bool is_white(char c) {
    return c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == '\f' || c == '\v';
  }

 private:
  const char* begin_;
  const char* p_;
  const char* end_;
  uint64_t line_;
};

/// What a message says was found at this place: "\"abc\"", "the end of the line", "the end of the file".
std::string found_at(const TextScanner& scanner);

/// The same with what is wrong, where a number should stand: "\"abc\" where a number belongs", "\"1e400\",
/// which is too large for a double".
std::string no_number_at(const TextScanner& scanner);

/// The text without blanks at either end.
std::string_view trim(std::string_view text);

}  // namespace maille
