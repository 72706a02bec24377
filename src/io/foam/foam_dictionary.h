#pragma once

#include <maille/error.h>
#include <maille/source.h>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/foam/foam_lexer.h"

namespace maille {

/// OpenFOAM's dictionaries: `keyword value ...;` and `keyword { ... }`. Values are tokens, with variables,
/// included files and expressions already put in. Entries keep the order of the file; a keyword is there
/// once.
class FoamDictionary {
 public:
  struct Entry {
    std::string keyword;
    FoamToken at;                                ///< the keyword
    std::vector<FoamToken> tokens;               ///< without the ';'
    std::shared_ptr<FoamDictionary> dictionary;  ///< or this
  };

  /// The entry of this name, of which the last one in the file counts; nullptr if there is none. By linear
  /// search: dictionaries are short.
  const Entry* find(std::string_view keyword) const;
  Entry* find(std::string_view keyword);
  /// A new entry behind the others, or the old one of this name, emptied.
  Entry& put(const std::string& keyword, const FoamToken& at);
  const std::vector<Entry>& entries() const { return entries_; }
  /// A copy whose inner dictionaries are its own.
  FoamDictionary copy() const;
  /// Entries and tokens, those of inner dictionaries as well.
  size_t size() const;

 private:
  std::vector<Entry> entries_;
};

/// A dictionary file and what it includes; messages name the file and line of a token.
struct FoamFile {
  FoamDictionary dictionary;
  std::vector<std::string> files;  ///< by FoamToken::file

  /// "file: line 12"
  std::string place(const FoamToken& token) const;
  /// malformed_input: "file: line 12: what".
  tl::unexpected<Error> bad(const FoamToken& token, const std::string& what) const;
  tl::unexpected<Error> unsupported(const FoamToken& token, const std::string& what) const;
};

/// Reads a dictionary and the files it includes. Errors: cannot_read, malformed_input, unsupported
/// (#codeStream and other directives that need OpenFOAM itself).
Result<FoamFile> read_foam_file(const std::string& path);
Result<FoamFile> read_foam_file(const Source& source);
/// The same from a text; `name` is what messages call it, included files are looked for beside it.
Result<FoamFile> parse_foam_text(std::string_view text, const std::string& name);

/// Walks over the tokens of an entry. Errors (malformed_input) name the file, the line and the entry. peek()
/// at the end is a token of kind `end`, so no caller needs to ask first.
class FoamCursor {
 public:
  FoamCursor(const FoamFile& file, const FoamDictionary::Entry& entry)
      : file_(file), tokens_(entry.tokens), entry_(entry.keyword), last_(entry.at) {}

  bool at_end() const { return next_ == tokens_.size(); }
  const FoamToken& peek() const { return at_end() ? end_ : tokens_[next_]; }
  bool at(char c) const { return peek().is(c); }
  bool at_word(std::string_view word) const {
    return peek().kind == FoamToken::Kind::word && peek().text == word;
  }
  FoamToken take();
  bool take(char c);
  bool take(std::string_view word);

  Result<> expect(char c);
  /// A list's '(', behind the number of its elements if that is given.
  Result<> open_list();
  Result<double> number();
  // A whole number below `limit`; `what` names it in messages.
  Result<uint64_t> label(uint64_t limit, const std::string& what);
  Result<std::string> word();
  /// { entries } within a list, without variables or directives.
  Result<FoamDictionary> dictionary();

  tl::unexpected<Error> bad(const std::string& what) const;
  tl::unexpected<Error> unsupported(const std::string& what) const;
  /// Remembered, to say where something began.
  const FoamToken& last() const { return last_; }

 private:
  std::string found() const;
  Result<FoamDictionary> entries(unsigned depth);

  const FoamFile& file_;
  std::span<const FoamToken> tokens_;
  std::string entry_;
  FoamToken last_;
  FoamToken end_;
  size_t next_ = 0;
};

}  // namespace maille
