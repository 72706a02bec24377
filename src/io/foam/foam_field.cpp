#include "io/foam/foam_field.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <utility>

#include "io/reading.h"
#include "io/text_scanner.h"

namespace maille {
namespace {

// A type of values: how it is called in the class of a field ("volVectorField"), how in "List<vector>", and
// its numbers.
struct TypeName {
  std::string_view in_class, in_list;
  uint32_t components;
};
constexpr TypeName type_names[] = {{"Scalar", "scalar", 1},
                                   {"Vector", "vector", 3},
                                   {"SphericalTensor", "sphericalTensor", 1},
                                   {"SymmTensor", "symmTensor", 6},
                                   {"Tensor", "tensor", 9}};

/// The most dictionaries in dictionaries; real fields have two or three.
constexpr size_t most_depth = 64;

bool is_blank(char c) {
  return TextScanner::is_white(c);
}

/// Where keywords end. Patterns of patches' names may have parentheses in them, so these do not end one.
bool ends_keyword(char c) {
  return is_blank(c) || c == ';' || c == '{' || c == '}' || c == '"';
}
bool ends_word(char c) {
  return ends_keyword(c) || c == '(' || c == ')' || c == '[' || c == ']';
}

/// How many digits a number is written with, leading zeros not counted; 17 tell any double.
int significant_digits(std::string_view number) {
  int digits = 0;
  for (const char c : number) {
    if (c == 'e' || c == 'E') break;
    if (c >= '1' && c <= '9') ++digits;
    if (c == '0' && digits > 0) ++digits;
  }
  return std::min(digits, 17);
}

/// Walks over the entries of a field's text once and notes where values stand; everything else stays text,
/// which goes back into the field word for word.
class FieldScanner {
 public:
  FieldScanner(std::string_view text, const std::string& name) : text_(text) {
    field_.name = name;
    field_.text = text;
  }
  Result<FoamField> scan();

 private:
  char here() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  bool at(std::string_view what) const { return text_.substr(at_, what.size()) == what; }
  Result<> skip();
  Result<> skip_to(std::string_view end, size_t from, const char* what);
  Result<> keyword(std::string& key);
  std::string_view word();
  Result<> take_entry(const std::string& key, size_t key_begin);
  Result<> take_tokens(const std::string& key);
  Result<> take_token(const std::string& key, std::string_view& last);
  Result<> take_uniform(const std::string& key);
  Result<> take_list(const std::string& key, std::string_view type, bool nonuniform);
  Result<> take_list_values(FoamValues& values);
  Result<> take_mark(FoamValues& values);
  void take_header(const std::string& key, size_t begin, size_t end);
  void note_directive(std::string_view what) {
    if (field_.directive.empty()) field_.directive = std::string(what.substr(0, 40));
  }
  /// Fills in whose the values are; false: of no place that an array has.
  bool place(FoamValues& values, const std::string& key) const;

  FoamField field_;
  std::string_view text_;
  size_t at_ = 0;
  std::vector<std::string> path_;  ///< of dictionaries
};

Result<> FieldScanner::skip_to(std::string_view end, size_t from, const char* what) {
  const size_t found = text_.find(end, from);
  if (found == std::string_view::npos)
    return field_.bad(at_, std::string(what) + " is not closed by " + std::string(end));
  at_ = found + end.size();
  return {};
}

/// Skips blanks and comments.
Result<> FieldScanner::skip() {
  for (;;) {
    while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
    if (at("//")) {
      at_ = std::min(text_.find('\n', at_), text_.size());
    } else if (at("/*")) {
      MAILLE_CHECK(skip_to("*/", at_ + 2, "a comment"));
    } else {
      return {};
    }
  }
}

Result<> FieldScanner::keyword(std::string& key) {
  const size_t from = at_;
  if (here() == '"') MAILLE_CHECK(skip_to("\"", at_ + 1, "a string"));
  const bool quoted = at_ > from;
  while (!quoted && at_ < text_.size() && !ends_keyword(text_[at_])) ++at_;
  key = text_.substr(from, at_ - from);
  return {};
}

std::string_view FieldScanner::word() {
  const size_t from = at_;
  while (at_ < text_.size() && !ends_word(text_[at_])) ++at_;
  return text_.substr(from, at_ - from);
}

void FieldScanner::take_header(const std::string& key, size_t begin, size_t end) {
  while (end > begin && is_blank(text_[end - 1])) --end;
  std::string_view value = text_.substr(begin, end - begin);
  const bool quoted = value.size() >= 2 && value.front() == '"' && value.back() == '"';
  if (quoted) value = value.substr(1, value.size() - 2);
  if (key == "class") field_.type = value;
  if (key == "object") field_.object = value;
  if (key == "format") {
    field_.binary = value == "binary";
    field_.format_begin = begin;
    field_.format_end = end;
  }
  if (key == "location") {
    field_.location = value;
    field_.location_begin = begin + (quoted ? 1 : 0);
    field_.location_end = end - (quoted ? 1 : 0);
  }
  if (key == "arch") {
    field_.wide_labels = value.find("label=64") != std::string_view::npos;
    field_.single = value.find("scalar=32") != std::string_view::npos;
  }
}

bool FieldScanner::place(FoamValues& values, const std::string& key) const {
  if (path_.empty() && (key == "internalField" || (key == "value" && field_.type.ends_with("::Internal"))))
    return true;
  values.entry = key;
  if (path_.size() != 2 || path_[0] != "boundaryField") return false;
  values.patch = path_[1];
  return true;
}

/// Takes a uniform value; the word "uniform" is behind us.
Result<> FieldScanner::take_uniform(const std::string& key) {
  FoamValues values;
  values.uniform = true;
  values.count = 1;
  values.begin = at_ - std::string_view("uniform").size();
  MAILLE_CHECK(skip());
  values.values = at_;
  if (here() == '(') {
    MAILLE_CHECK(skip_to(")", at_, "a value"));
  } else {
    word();
  }
  values.end = at_;
  if (place(values, key)) field_.values.push_back(std::move(values));
  return {};
}

/// Passes over the values of a list. Binary numbers are passed over by their size, as they may hold any byte;
/// text is searched for the closing parenthesis.
Result<> FieldScanner::take_list_values(FoamValues& values) {
  const uint32_t components = foam_components(values.type);
  const bool of_labels = values.type == "label", of_flags = values.type == "bool";
  if (values.repeated) return skip_to("}", at_, "a list");
  if (!field_.binary) {
    // Values in parentheses of their own.
    for (size_t depth = 1; depth > 0;) {
      const size_t next = text_.find_first_of("()", at_);
      if (next == std::string_view::npos) return field_.bad(values.begin, "a list is not closed by )");
      depth = text_[next] == '(' ? depth + 1 : depth - 1;
      at_ = next + 1;
    }
    return {};
  }
  if (components == 0) {
    return failure(ErrorCode::unsupported,
                   field_.bad(values.begin, "").value().message + "a binary list of " +
                       (values.type.empty() ? "unknown values" : values.type) + " cannot be read");
  }
  const uint64_t label = field_.wide_labels ? 8 : 4;
  const uint64_t size = of_flags ? 1 : of_labels ? label : components * size_of(field_.scalar());
  if (values.count > (text_.size() - at_) / size)
    return field_.bad(values.begin,
                      "a list of " + std::to_string(values.count) + " values, but the file ends before");
  at_ += static_cast<size_t>(values.count * size);
  if (here() != ')') return field_.bad(values.begin, "a list is longer or shorter than it says");
  ++at_;
  return {};
}

Result<> FieldScanner::take_mark(FoamValues& values) {
  values.marked = true;
  ++at_;
  values.values = at_;
  while (at_ < text_.size() && !ends_word(text_[at_])) ++at_;
  return {};
}

/// Takes a list, behind "List<type>" or "nonuniform".
Result<> FieldScanner::take_list(const std::string& key, std::string_view type, bool nonuniform) {
  FoamValues values;
  values.type = type;
  values.begin = at_;
  MAILLE_CHECK(skip());
  if (here() == foam_list_mark) {
    MAILLE_CHECK(take_mark(values));
  } else {
    const auto [behind, error] =
        std::from_chars(text_.data() + at_, text_.data() + text_.size(), values.count);
    if (error != std::errc()) {
      // A list without its length, or a type that is a word of something else.
      at_ = values.begin;
      return {};
    }
    at_ = static_cast<size_t>(behind - text_.data());
    MAILLE_CHECK(skip());
    values.repeated = here() == '{';
    // Nothing follows the length of an empty list in binary files.
    values.end = at_;
    if (here() != '(' && here() != '{') {
      if (values.count == 0 && nonuniform && place(values, key))
        field_.empty_lists.push_back(std::move(values));
      return {};
    }
    values.values = ++at_;
    MAILLE_CHECK(take_list_values(values));
  }
  values.end = at_;
  const bool has_place = place(values, key);
  if (values.marked && !nonuniform) return field_.bad(values.begin, "a mark where no list belongs");
  if (!has_place) values.patch.clear();
  const bool empty = values.count == 0 && !values.marked;
  if (nonuniform && !empty) field_.values.push_back(std::move(values));
  if (nonuniform && empty && has_place) field_.empty_lists.push_back(std::move(values));
  return {};
}

/// Takes one piece of an entry's value. `last`: the word before it, which tells "nonuniform List<...>" from
/// other lists.
Result<> FieldScanner::take_token(const std::string& key, std::string_view& last) {
  if (here() == '"') {
    last = {};
    return skip_to("\"", at_ + 1, "a string");
  }
  if (at("#{")) {
    note_directive("#{ code #}");
    last = {};
    return skip_to("#}", at_ + 2, "code");
  }
  const std::string_view found = word();
  // A sign by itself; passing over it is what makes the loop end.
  if (found.empty()) {
    ++at_;
    last = {};
    return {};
  }
  if (found[0] == '#') note_directive(found);
  const bool list = found.starts_with("List<") && found.ends_with(">");
  const std::string_view before = std::exchange(last, found);
  if (list) return take_list(key, found.substr(5, found.size() - 6), before == "nonuniform");
  if (found == "uniform") return take_uniform(key);
  if (found != "nonuniform") return {};
  // Without a type: an empty list.
  const size_t from = at_;
  MAILLE_CHECK(skip());
  if (here() >= '0' && here() <= '9') return take_list(key, "", true);
  at_ = from;
  return {};
}

/// Takes what stands behind a keyword, to its ';'.
Result<> FieldScanner::take_tokens(const std::string& key) {
  const bool of_header = path_.size() == 1 && path_[0] == "FoamFile";
  const size_t begin = at_;
  size_t depth = 0;
  std::string_view last;
  for (;;) {
    MAILLE_CHECK(skip());
    if (at_ >= text_.size()) return field_.bad(begin, "the file ends within the entry " + key.substr(0, 40));
    const char c = here();
    if (depth == 0 && (c == ';' || c == '}')) break;
    if (c == '(' || c == '{' || c == '[') ++depth;
    if ((c == ')' || c == '}' || c == ']') && depth > 0) --depth;
    MAILLE_CHECK(take_token(key, last));
  }
  if (of_header) take_header(key, begin, at_);
  if (here() == ';') ++at_;
  return {};
}

Result<> FieldScanner::take_entry(const std::string& key, size_t key_begin) {
  MAILLE_CHECK(skip());
  if (here() != '{') return take_tokens(key);
  if (path_.size() == most_depth) return field_.bad(at_, "too many dictionaries in dictionaries");
  ++at_;
  path_.push_back(key);
  if (path_.size() == 2 && path_[0] == "boundaryField") field_.patches.push_back({key, key_begin, 0});
  return {};
}

Result<FoamField> FieldScanner::scan() {
  std::string key;
  for (;;) {
    MAILLE_CHECK(skip());
    if (at_ >= text_.size()) break;
    if (here() == '}') {
      if (path_.empty()) return field_.bad(at_, "a } without its {");
      const bool of_header = path_.size() == 1 && path_[0] == "FoamFile";
      ++at_;
      if (path_.size() == 2 && path_[0] == "boundaryField" && !field_.patches.empty())
        field_.patches.back().end = at_;
      path_.pop_back();
      // A class that is no field: nothing is known of what is behind the header.
      if (of_header && !foam_field_kind(field_.type)) return std::move(field_);
      continue;
    }
    if (here() == ';' || here() == '{') {
      ++at_;
      if (text_[at_ - 1] == '{') path_.emplace_back();
      if (path_.size() > most_depth) return field_.bad(at_, "too many dictionaries in dictionaries");
      continue;
    }
    const size_t key_begin = at_;
    MAILLE_CHECK(keyword(key));
    if (key.starts_with("#include")) {
      at_ = std::min(text_.find('\n', at_), text_.size());
      continue;
    }
    if (key.starts_with("#")) note_directive(key);
    if (key.starts_with("code")) note_directive(key);
    MAILLE_CHECK(take_entry(key, key_begin));
  }
  if (!path_.empty()) return field_.bad(text_.size(), "the file ends within " + path_.back().substr(0, 40));
  return std::move(field_);
}

}  // namespace

// Lines are counted only for a message.
tl::unexpected<Error> FoamField::bad(size_t at, const std::string& what) const {
  const auto lines =
      std::count(text.begin(), text.begin() + static_cast<ptrdiff_t>(std::min(at, text.size())), '\n');
  return malformed_line(name, static_cast<uint64_t>(lines) + 1, what);
}

namespace {

struct KnownClass {
  FoamFieldKind::Place place;
  const TypeName* type;
};

std::optional<KnownClass> known_class(std::string_view type) {
  if (type.ends_with("::Internal")) type.remove_suffix(std::string_view("::Internal").size());
  constexpr std::pair<std::string_view, FoamFieldKind::Place> places[] = {
      {"vol", FoamFieldKind::Place::cells},
      {"surface", FoamFieldKind::Place::faces},
      {"point", FoamFieldKind::Place::points}};
  for (const auto& [prefix, place] : places) {
    for (const TypeName& name : type_names) {
      if (type == std::string(prefix) + std::string(name.in_class) + "Field") return KnownClass{place, &name};
    }
  }
  return {};
}

}  // namespace

std::optional<FoamFieldKind> foam_field_kind(std::string_view type) {
  const auto known = known_class(type);
  return known ? std::optional(FoamFieldKind{known->place, known->type->components}) : std::nullopt;
}

std::string_view foam_list_type(std::string_view type) {
  const auto known = known_class(type);
  return known ? known->type->in_list : std::string_view();
}

uint32_t foam_components(std::string_view type) {
  if (type == "label" || type == "bool") return 1;
  for (const TypeName& name : type_names) {
    if (name.in_list == type) return name.components;
  }
  return 0;
}

Result<FoamField> scan_foam_field(std::string_view text, const std::string& name) {
  return FieldScanner(text, name).scan();
}

FoamValueReader::FoamValueReader(const FoamField& field, const FoamValues& values)
    : field_(field), values_(values), components_(foam_components(values.type)), at_(values.values) {
  const auto kind = foam_field_kind(field.type);
  if (components_ == 0 && kind) components_ = kind->components;
}

void FoamValueReader::store(std::byte* out, uint32_t component, double value) const {
  if (field_.single) {
    const auto single = static_cast<float>(value);
    std::memcpy(out + component * sizeof single, &single, sizeof single);
  } else {
    std::memcpy(out + component * sizeof value, &value, sizeof value);
  }
}

Result<> FoamValueReader::read_text(std::byte* out) {
  const char* const end = field_.text.data() + values_.end;
  const char* at = field_.text.data() + at_;
  const auto skip = [&] {
    while (at != end && is_blank(*at)) ++at;
  };
  skip();
  const bool inner = components_ > 1 || (at != end && *at == '(');
  const auto bad = [&](const char* what) {
    return field_.bad(static_cast<size_t>(at - field_.text.data()), what);
  };
  if (inner && (at == end || *at++ != '(')) return bad("there should be \"(\" before the numbers of a value");
  for (uint32_t i = 0; i < components_; ++i) {
    skip();
    Number number;
    const char* const behind = parse_number(at, end, number);
    if (behind == nullptr) return bad("there should be a number");
    digits_ = std::max(digits_, significant_digits({at, behind}));
    store(out, i, number.value);
    at = behind;
  }
  skip();
  if (inner && (at == end || *at++ != ')')) return bad("there should be \")\" behind the numbers of a value");
  at_ = static_cast<size_t>(at - field_.text.data());
  return {};
}

Result<> FoamValueReader::next(std::byte* out) {
  const size_t size = components_ * size_of(field_.scalar());
  // One value for all is read once.
  if (values_.uniform || values_.repeated) {
    if (repeated_.empty()) {
      repeated_.resize(size);
      MAILLE_CHECK(read_text(repeated_.data()));
    }
    std::copy(repeated_.begin(), repeated_.end(), out);
    return {};
  }
  if (number_++ == values_.count)
    return field_.bad(values_.begin, "a list is shorter than another file says");
  if (!field_.binary) return read_text(out);
  std::memcpy(out, field_.text.data() + at_, size);
  at_ += size;
  return {};
}

Result<> FoamValueReader::end() {
  if (values_.uniform || values_.repeated || field_.binary) return {};
  const std::string_view rest = field_.text.substr(at_, values_.end - at_);
  if (trim(rest) != ")") return field_.bad(at_, "a list is longer or shorter than it says");
  return {};
}

}  // namespace maille
