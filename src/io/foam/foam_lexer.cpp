#include "io/foam/foam_lexer.h"

#include "base/result.h"
#include "io/numbers.h"

namespace maille {

namespace {

tl::unexpected<Error> bad(const char* what) {
  return failure(ErrorCode::malformed_input, what);
}

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f' || c == '\v';
}

bool ends_word(char c) {
  return is_blank(c) || c == '"' || c == ';' || c == '{' || c == '}' || c == '[' || c == ']' || c == '\'';
}

}  // namespace

FoamToken FoamLexer::token(FoamToken::Kind kind, std::string text) const {
  FoamToken token;
  token.kind = kind;
  token.text = std::move(text);
  token.file = file_;
  token.line = line_;
  return token;
}

Result<> FoamLexer::skip_blanks() {
  while (p_ != end_) {
    if (is_blank(*p_)) {
      advance();
    } else if (at("//")) {
      while (p_ != end_ && *p_ != '\n') ++p_;
    } else if (at("/*")) {
      while (p_ != end_ && !at("*/")) advance();
      if (p_ == end_) return bad("a comment is not closed by */");
      p_ += 2;
    } else {
      break;
    }
  }
  return {};
}

Result<FoamToken> FoamLexer::quoted() {
  FoamToken text = token(FoamToken::Kind::string, "");
  for (++p_; p_ != end_ && *p_ != '"'; advance()) {
    if (*p_ == '\\' && end_ - p_ > 1 && (p_[1] == '"' || p_[1] == '\\')) ++p_;
    text.text += *p_;
  }
  if (p_ == end_) return bad("a string is not closed by \"");
  ++p_;
  return text;
}

Result<FoamToken> FoamLexer::verbatim() {
  FoamToken text = token(FoamToken::Kind::verbatim, "");
  for (p_ += 2; p_ != end_ && !at("#}"); advance()) text.text += *p_;
  if (p_ == end_) return bad("code is not closed by #}");
  p_ += 2;
  return text;
}

Result<FoamToken> FoamLexer::braced() {
  MAILLE_CHECK(skip_blanks());
  if (p_ == end_ || *p_ != '{') return next();
  FoamToken text = token(FoamToken::Kind::string, "");
  unsigned depth = 0;
  do {
    if (p_ == end_) return bad("an expression is not closed by }");
    if (*p_ == '{') ++depth;
    if (*p_ == '}') --depth;
    text.text += *p_;
    advance();
  } while (depth > 0);
  text.text = text.text.substr(1, text.text.size() - 2);
  return text;
}

// A word may hold pairs of parentheses, such as div(phi,U); a lone ')' ends it.
FoamToken FoamLexer::word() {
  const char* const begin = p_;
  const char* closed = p_;  // behind the last place where no parenthesis is open
  unsigned depth = 0;
  for (; p_ != end_ && !ends_word(*p_); ++p_) {
    if (at("//") || at("/*")) break;
    if (*p_ == '(') {
      if (depth == 0) closed = p_;
      ++depth;
    } else if (*p_ == ')') {
      if (depth == 0) break;
      if (--depth == 0) closed = p_ + 1;
    }
  }
  // "hex(0 1": the parenthesis is no part of the word.
  if (depth > 0) p_ = closed;
  // ${name} has braces of its own.
  if (p_ == begin + 1 && *begin == '$' && p_ != end_ && *p_ == '{') {
    while (p_ != end_ && *p_ != '}' && *p_ != '\n') ++p_;
    if (p_ != end_ && *p_ == '}') ++p_;
  }
  FoamToken word = token(FoamToken::Kind::word, std::string(begin, p_));
  Number number;
  if (parse_number(begin, p_, number) == p_) {
    word.kind = FoamToken::Kind::number;
    word.value = number.value;
    word.integer = number.integer;
  }
  return word;
}

Result<FoamToken> FoamLexer::next() {
  MAILLE_CHECK(skip_blanks());
  if (p_ == end_) return token(FoamToken::Kind::end, "");
  const char c = *p_;
  if (c == '"') return quoted();
  if (at("#{")) return verbatim();
  if (c == '(' || c == ')' || c == '{' || c == '}' || c == '[' || c == ']' || c == ';' || c == '\'') {
    ++p_;
    return token(FoamToken::Kind::punctuation, std::string(1, c));
  }
  // A number ends where a list begins: 8(...).
  const char* q = p_;
  while (q != end_ && *q >= '0' && *q <= '9') ++q;
  if (q != p_ && q != end_ && *q == '(') {
    FoamToken count = token(FoamToken::Kind::number, std::string(p_, q));
    Number number;
    if (parse_number(p_, q, number) == q) count.value = number.value;
    count.integer = true;
    p_ = q;
    return count;
  }
  return word();
}

}  // namespace maille
