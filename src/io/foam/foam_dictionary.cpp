#include "io/foam/foam_dictionary.h"

#include <maille/source.h>
#include <algorithm>
#include <optional>

#include "base/result.h"
#include "io/beside.h"
#include "io/foam/foam_expression.h"
#include "io/gzip.h"
#include "io/reading.h"

namespace maille {

using Kind = FoamToken::Kind;

FoamDictionary::Entry* FoamDictionary::find(std::string_view keyword) {
  for (Entry& entry : entries_) {
    if (entry.keyword == keyword) return &entry;
  }
  return nullptr;
}

const FoamDictionary::Entry* FoamDictionary::find(std::string_view keyword) const {
  for (const Entry& entry : entries_) {
    if (entry.keyword == keyword) return &entry;
  }
  return nullptr;
}

FoamDictionary::Entry& FoamDictionary::put(const std::string& keyword, const FoamToken& at) {
  Entry* entry = find(keyword);
  if (entry == nullptr) entry = &entries_.emplace_back();
  *entry = {keyword, at, {}, nullptr};
  return *entry;
}

FoamDictionary FoamDictionary::copy() const {
  FoamDictionary made = *this;
  for (Entry& entry : made.entries_) {
    if (entry.dictionary != nullptr)
      entry.dictionary = std::make_shared<FoamDictionary>(entry.dictionary->copy());
  }
  return made;
}

size_t FoamDictionary::size() const {
  size_t sum = 0;
  for (const Entry& entry : entries_) {
    sum += 1 + entry.tokens.size() + (entry.dictionary != nullptr ? entry.dictionary->size() : 0);
  }
  return sum;
}

std::string FoamFile::place(const FoamToken& token) const {
  return files[token.file] + ": line " + std::to_string(token.line);
}
tl::unexpected<Error> FoamFile::bad(const FoamToken& token, const std::string& what) const {
  return failure(ErrorCode::malformed_input, place(token) + ": " + what);
}
tl::unexpected<Error> FoamFile::unsupported(const FoamToken& token, const std::string& what) const {
  return failure(ErrorCode::unsupported, place(token) + ": " + what);
}

namespace {

// Dictionaries that people write have thousands of tokens; variables of variables could make any number of
// them, doubling at each line. All three chosen, not swept.
constexpr size_t most_tokens = size_t{1} << 20;
constexpr unsigned deepest = 64;
/// Of a packed or plain file: a token has a byte and a blank at least, and some room for comments.
constexpr uint64_t most_bytes = uint64_t{16} << 20;

/// Reads a dictionary with what it includes, variables and expressions put in at once, so that what is read
/// is plain tokens. Every way to make much of little is bounded: tokens in all, depth of dictionaries, depth
/// of included files, bytes.
class Parser {
 public:
  Result<> open(std::string_view text, const std::string& name) {
    file_.files.push_back(name);
    levels_.push_back({FoamLexer(text, static_cast<uint32_t>(file_.files.size() - 1)), {}});
    return {};
  }

  /// Opens a file, and "name.gz" where there is no "name", as OpenFOAM does.
  Result<> open(const std::string& path) {
    auto opened = file_source(path);
    if (!opened) {
      if (auto packed = file_source(path + ".gz")) opened = std::move(packed);
    }
    return read(*MAILLE_TRY(std::move(opened)));
  }

  /// Opens a file that a dictionary names, which may be anything if the dictionary is somebody else's: so
  /// only files beside it are opened.
  Result<> open_included(const std::string& from, const std::string& name) {
    auto opened = open_beside(from, name);
    if (!opened && opened.error().code == ErrorCode::cannot_read) {
      if (auto packed = open_beside(from, name + ".gz")) opened = std::move(packed);
    }
    return read(*MAILLE_TRY(std::move(opened)));
  }

  Result<> read(const Source& source) {
    const std::string path = source.name();
    if (source.size() > most_bytes)
      return failure(ErrorCode::malformed_input,
                     path + ": larger than any dictionary, which may have 16 MiB");
    const InputBytes bytes = MAILLE_TRY(InputBytes::load(source));
    // Kept as long as its tokens are read, which are views of it.
    auto text = std::make_unique<std::string>(bytes.text());
    if (is_gzip(bytes.bytes())) {
      const std::vector<std::byte> unpacked = MAILLE_TRY(gunzip(bytes.bytes(), most_bytes, path));
      text->assign(reinterpret_cast<const char*>(unpacked.data()), unpacked.size());
    }
    MAILLE_CHECK(open(*text, path));
    levels_.back().text = std::move(text);
    return {};
  }

  Result<FoamFile> run() {
    scopes_.push_back(&file_.dictionary);
    MAILLE_CHECK(entries(true));
    return std::move(file_);
  }

 private:
  struct Level {
    FoamLexer lexer;
    std::unique_ptr<std::string> text;
  };

  // The next token of the file that is being read; at its end that of the one which includes it.
  Result<FoamToken> next(bool expression = false) {
    if (held_) {
      FoamToken token = std::move(*held_);
      held_.reset();
      return token;
    }
    for (;;) {
      FoamLexer& lexer = levels_.back().lexer;
      auto token = expression ? lexer.braced() : lexer.next();
      if (!token) {
        FoamToken here;
        here.file = lexer.file();
        here.line = lexer.line();
        return file_.bad(here, token.error().message);
      }
      if (token->kind != Kind::end || levels_.size() == 1) return token;
      levels_.pop_back();
    }
  }
  Result<> entries(bool top) {
    if (scopes_.size() > deepest)
      return failure(ErrorCode::malformed_input, "dictionaries nested too deeply");
    for (;;) {
      const FoamToken token = MAILLE_TRY(next());
      if (token.kind == Kind::end) {
        if (top) return {};
        return file_.bad(token, "the file ends within a dictionary; a '}' is missing");
      }
      if (token.is('}')) {
        if (!top) return {};
        return file_.bad(token, "a '}' without its '{'");
      }
      if (token.is(';')) continue;
      if (token.kind == Kind::word && token.text[0] == '#') {
        MAILLE_CHECK(directive(token));
      } else if (token.kind == Kind::word && token.text[0] == '$') {
        MAILLE_CHECK(merge(token));
      } else if (token.kind == Kind::word || token.kind == Kind::string) {
        MAILLE_CHECK(entry(token));
      } else {
        return file_.bad(token, "'" + token.text + "' where a keyword is expected");
      }
    }
  }

  // Copies the entries of another dictionary into this one. The copy is deep, so that later changes of one do
  // not show in the other; the sum of tokens bounds it.
  Result<> merge(const FoamToken& token) {
    const FoamDictionary::Entry* entry = find(token.text.substr(1));
    if (entry == nullptr || entry->dictionary == nullptr) {
      return file_.bad(token, "'" + token.text + "' is no dictionary known here");
    }
    tokens_ += entry->dictionary->size();
    if (tokens_ > most_tokens) return file_.bad(token, "the dictionary is too large");
    const FoamDictionary merged = entry->dictionary->copy();
    for (const auto& inner : merged.entries()) scopes_.back()->put(inner.keyword, inner.at) = inner;
    return {};
  }

  Result<> entry(const FoamToken& keyword) {
    FoamToken token = MAILLE_TRY(next());
    if (token.is('{')) {
      // What is said twice about a dictionary adds up, as OpenFOAM has it.
      const FoamDictionary::Entry* old = scopes_.back()->find(keyword.text);
      auto dictionary =
          old != nullptr && old->dictionary != nullptr ? old->dictionary : std::make_shared<FoamDictionary>();
      scopes_.back()->put(keyword.text, keyword).dictionary = dictionary;
      scopes_.push_back(dictionary.get());
      MAILLE_CHECK(entries(false));
      scopes_.pop_back();
      return {};
    }
    held_ = std::move(token);
    std::vector<FoamToken> tokens;
    MAILLE_CHECK(values(keyword, tokens));
    scopes_.back()->put(keyword.text, keyword).tokens = std::move(tokens);
    return {};
  }

  // Reads tokens to the ';' that is in no parentheses or braces.
  Result<> values(const FoamToken& keyword, std::vector<FoamToken>& tokens) {
    std::string open;
    for (;;) {
      FoamToken token = MAILLE_TRY(next());
      if (token.kind == Kind::end) {
        return file_.bad(keyword, "entry '" + keyword.text + "' does not end with ';'");
      }
      if (token.is(';') && open.empty()) return {};
      if (token.is('(') || token.is('{')) open.push_back(token.text[0]);
      if (token.is(')') || token.is('}')) {
        const char opening = token.is(')') ? '(' : '{';
        if (open.empty() || open.back() != opening) {
          return file_.bad(
              token, "entry '" + keyword.text + "': a '" + token.text + "' without its '" + opening + "'");
        }
        open.pop_back();
      }
      if (token.kind == Kind::word && token.text[0] == '#') {
        MAILLE_CHECK(value_directive(token, tokens));
      } else if (token.kind == Kind::word && token.text[0] == '$') {
        MAILLE_CHECK(expand(token, tokens));
      } else {
        tokens.push_back(std::move(token));
        if (++tokens_ > most_tokens) return file_.bad(keyword, "the dictionary is too large");
      }
    }
  }

  Result<> expand(const FoamToken& token, std::vector<FoamToken>& tokens) {
    const FoamDictionary::Entry* entry = find(token.text.substr(1));
    if (entry == nullptr || entry->dictionary != nullptr) {
      return file_.bad(token, "'" + token.text + "' is not known here");
    }
    tokens_ += entry->tokens.size();
    if (tokens_ > most_tokens) return file_.bad(token, "the dictionary is too large");
    tokens.insert(tokens.end(), entry->tokens.begin(), entry->tokens.end());
    return {};
  }

  /// Finds what a variable names: ":a" from the top, "..a" from the parent, "a.b" in dictionary a; else in
  /// this dictionary, then outwards.
  const FoamDictionary::Entry* find(std::string name) const {
    if (name.size() > 2 && name[0] == '{') name = name.substr(1, name.size() - 2);
    size_t scope = scopes_.size() - 1;
    bool outwards = true;
    size_t begin = 0;
    if (name[0] == ':') {
      scope = 0;
      begin = 1;
    } else if (name[0] == '.') {
      outwards = false;
      for (begin = 1; begin < name.size() && name[begin] == '.'; ++begin) {
        if (scope == 0) return nullptr;
        --scope;
      }
    }
    const std::string_view path = std::string_view(name).substr(begin);
    for (;; --scope) {
      if (const FoamDictionary::Entry* entry = within(*scopes_[scope], path)) return entry;
      if (!outwards || scope == 0) return nullptr;
    }
  }

  static const FoamDictionary::Entry* within(const FoamDictionary& dictionary, std::string_view path) {
    if (const FoamDictionary::Entry* entry = dictionary.find(path)) return entry;
    const size_t dot = path.find_first_of("./");
    if (dot == std::string_view::npos) return nullptr;
    const FoamDictionary::Entry* entry = dictionary.find(path.substr(0, dot));
    if (entry == nullptr || entry->dictionary == nullptr) return nullptr;
    return within(*entry->dictionary, path.substr(dot + 1));
  }

  Result<> directive(const FoamToken& token) {
    if (token.text == "#include" || token.text == "#includeIfPresent") return include(token);
    if (token.text == "#inputMode" || token.text == "#remove") {
      const FoamToken what = MAILLE_TRY(next());
      if (token.text == "#inputMode" && what.text == "merge") return {};
    }
    return file_.unsupported(token, "'" + token.text + "' is not supported");
  }

  Result<> include(const FoamToken& token) {
    const FoamToken name = MAILLE_TRY(next());
    if (name.kind != Kind::string && name.kind != Kind::word) {
      return file_.bad(name, "a file name is expected behind " + token.text);
    }
    if (name.text.find('$') != std::string::npos || name.text.find('<') != std::string::npos) {
      return file_.unsupported(name, "'" + name.text + "': names of included files must be plain");
    }
    // A file that includes itself ends here. Chosen, not swept.
    if (levels_.size() > 16) return file_.bad(token, "files include each other too deeply");
    const std::string from = file_.files[token.file];  // a copy: opening adds to the files
    const auto opened = open_included(from, name.text);
    const bool missing = !opened && opened.error().code == ErrorCode::cannot_read;
    if (opened || (missing && token.text == "#includeIfPresent")) return {};
    return failure(opened.error().code, file_.place(token) + ": " + opened.error().message);
  }

  Result<> value_directive(const FoamToken& token, std::vector<FoamToken>& tokens) {
    if (token.text == "#include" || token.text == "#includeIfPresent") return include(token);
    if (token.text != "#calc" && token.text != "#eval") {
      return file_.unsupported(
          token,
          "'" + token.text + "' is not supported" +
              (token.text == "#codeStream" ? ": it needs OpenFOAM and a compiler; write what it makes" : ""));
    }
    const FoamToken text = MAILLE_TRY(next(true));
    if (text.kind != Kind::string && text.kind != Kind::verbatim) {
      return file_.bad(text, "an expression is expected behind " + token.text);
    }
    const auto value = evaluate_foam_expression(
        text.text, [&](std::string_view name) { return variable(std::string(name)); });
    if (!value) return file_.bad(token, value.error().message);
    FoamToken number = token;
    number.kind = Kind::number;
    number.text = text.text;
    number.value = *value;
    tokens.push_back(std::move(number));
    return {};
  }

  Result<double> variable(const std::string& name) const {
    const FoamDictionary::Entry* entry = name.empty() ? nullptr : find(name);
    if (entry != nullptr && entry->tokens.size() == 1 && entry->tokens[0].kind == Kind::number) {
      return entry->tokens[0].value;
    }
    return failure(ErrorCode::malformed_input,
                   entry == nullptr ? "'$" + name + "' is not known here" : "'$" + name + "' is no number");
  }

  FoamFile file_;
  std::vector<Level> levels_;
  std::vector<FoamDictionary*> scopes_;
  std::optional<FoamToken> held_;
  size_t tokens_ = 0;
};

}  // namespace

Result<FoamFile> read_foam_file(const std::string& path) {
  Parser parser;
  MAILLE_CHECK(parser.open(path));
  return parser.run();
}

Result<FoamFile> read_foam_file(const Source& source) {
  Parser parser;
  MAILLE_CHECK(parser.read(source));
  return parser.run();
}

Result<FoamFile> parse_foam_text(std::string_view text, const std::string& name) {
  Parser parser;
  MAILLE_CHECK(parser.open(text, name));
  return parser.run();
}

FoamToken FoamCursor::take() {
  if (at_end()) return end_;
  last_ = tokens_[next_];
  return tokens_[next_++];
}

bool FoamCursor::take(char c) {
  if (!at(c)) return false;
  take();
  return true;
}

bool FoamCursor::take(std::string_view word) {
  if (!at_word(word)) return false;
  take();
  return true;
}

std::string FoamCursor::found() const {
  return at_end() ? "the entry's end" : "'" + peek().text + "'";
}

tl::unexpected<Error> FoamCursor::bad(const std::string& what) const {
  return file_.bad(at_end() ? last_ : peek(), "entry '" + entry_ + "': " + what);
}

tl::unexpected<Error> FoamCursor::unsupported(const std::string& what) const {
  return file_.unsupported(at_end() ? last_ : peek(), "entry '" + entry_ + "': " + what);
}

Result<> FoamCursor::expect(char c) {
  if (!take(c)) return bad(std::string("'") + c + "' expected, " + found() + " found");
  return {};
}

Result<> FoamCursor::open_list() {
  if (peek().kind == Kind::number && next_ + 1 < tokens_.size() && tokens_[next_ + 1].is('(')) take();
  return expect('(');
}

Result<double> FoamCursor::number() {
  if (peek().kind != Kind::number) return bad("a number expected, " + found() + " found");
  return take().value;
}

Result<uint64_t> FoamCursor::label(uint64_t limit, const std::string& what) {
  // Numbers are doubles in dictionaries; below 9e15 all whole ones are exact.
  const double value = peek().value;
  if (peek().kind != Kind::number || !(value >= 0) ||
      value != static_cast<double>(static_cast<int64_t>(value < 9e15 ? value : -1))) {
    return bad(what + " expected, " + found() + " found");
  }
  if (value >= static_cast<double>(limit)) {
    return bad(what + " " + peek().text + " is too large; " + std::to_string(limit) + " is the limit");
  }
  return static_cast<uint64_t>(take().value);
}

Result<std::string> FoamCursor::word() {
  if (peek().kind != Kind::word && peek().kind != Kind::string) {
    return bad("a word expected, " + found() + " found");
  }
  return take().text;
}

Result<FoamDictionary> FoamCursor::dictionary() {
  MAILLE_CHECK(expect('{'));
  return entries(0);
}

Result<FoamDictionary> FoamCursor::entries(unsigned depth) {
  if (depth > deepest) return bad("dictionaries nested too deeply");
  FoamDictionary dictionary;
  while (!take('}')) {
    if (take(';')) continue;
    const FoamToken at = peek();
    const std::string keyword = MAILLE_TRY(word());
    FoamDictionary::Entry& entry = dictionary.put(keyword, at);
    if (take('{')) {
      entry.dictionary = std::make_shared<FoamDictionary>(MAILLE_TRY(entries(depth + 1)));
      continue;
    }
    while (!at_end() && !this->at(';') && !this->at('}')) entry.tokens.push_back(take());
    if (at_end()) return bad("'" + keyword + "' does not end with ';'");
  }
  return dictionary;
}

}  // namespace maille
