#pragma once

#include <maille/error.h>
#include <cstdint>
#include <string>
#include <string_view>

namespace maille {

/// A piece of an OpenFOAM file, and where it stands.
struct FoamToken {
  enum class Kind : uint8_t {
    end,
    word,
    string,       ///< without its quotes
    number,       ///< `text` is what is written, `value` what it is
    punctuation,  ///< one of ( ) { } [ ] ; in `text`
    verbatim,     ///< between #{ and #}
  };
  Kind kind = Kind::end;
  std::string text;
  double value = 0;
  bool integer = false;  ///< a number without point and exponent
  uint32_t file = 0;     ///< in the list of the dictionary
  uint64_t line = 0;

  bool is(char c) const { return kind == Kind::punctuation && text[0] == c; }
};

/// Splits OpenFOAM's text into tokens: blanks and comments go. For dictionaries; files of lists have
/// FoamReader. Numbers are words that are numbers as a whole.
class FoamLexer {
 public:
  explicit FoamLexer(std::string_view text, uint32_t file = 0)
      : p_(text.data()), end_(p_ + text.size()), file_(file) {}

  /// The next token; `end` at the end. Error (malformed_input): what is open at the end, without a place.
  Result<FoamToken> next();
  /// The text between '{' and its '}', if that comes next; for expressions. Otherwise the next token.
  Result<FoamToken> braced();
  uint64_t line() const { return line_; }
  uint32_t file() const { return file_; }

 private:
  Result<> skip_blanks();
  Result<FoamToken> quoted();
  Result<FoamToken> verbatim();
  FoamToken word();
  FoamToken token(FoamToken::Kind kind, std::string text) const;
  void advance() {
    if (*p_ == '\n') ++line_;
    ++p_;
  }
  bool at(std::string_view text) const {
    return static_cast<size_t>(end_ - p_) >= text.size() && std::string_view(p_, text.size()) == text;
  }

  const char* p_;
  const char* end_;
  uint32_t file_;
  uint64_t line_ = 1;
};

}  // namespace maille
