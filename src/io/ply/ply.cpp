#include "io/ply/ply.h"

#include <algorithm>
#include <set>
#include "base/result.h"
#include "io/reading.h"

namespace maille {
namespace {

// A header beyond this is an attack or damage, not a mesh. Chosen, not swept: readers look elements up one by
// one.
constexpr size_t max_elements = 256;

struct TypeName {
  std::string_view name;
  Scalar type;
};
constexpr TypeName type_names[] = {
    {"char", Scalar::i8},   {"int8", Scalar::i8},     {"uchar", Scalar::u8},   {"uint8", Scalar::u8},
    {"short", Scalar::i16}, {"int16", Scalar::i16},   {"ushort", Scalar::u16}, {"uint16", Scalar::u16},
    {"int", Scalar::i32},   {"int32", Scalar::i32},   {"uint", Scalar::u32},   {"uint32", Scalar::u32},
    {"float", Scalar::f32}, {"float32", Scalar::f32}, {"double", Scalar::f64}, {"float64", Scalar::f64},
};

/// Reads the header line by line. The grammar is that of Greg Turk's "The PLY Polygon File Format", with what
/// files really have beside it: names of types with their widths, "obj_info", comments without their keyword,
/// and any of three line ends. Property lists may be long, but not endless: counts of elements, properties
/// and bytes of comments are bounded, and each name is unique in its list, so that find() has one answer.
class HeaderParser {
 public:
  HeaderParser(TextScanner& scanner, const std::string& file) : scanner_(scanner), file_(file) {}

  Result<PlyHeader> parse() {
    if (scanner_.word() != "ply") return bad("a PLY file begins with the line \"ply\"");
    // Where lines end with "\r" alone, a "\n" behind the last one is data already.
    lone_return_ =
        scanner_.peek() == '\r' && scanner_.here() + 1 != scanner_.end() && scanner_.here()[1] != '\n';
    MAILLE_CHECK(end_line());
    bool done = false;
    bool has_format = false;
    CommentRoom comment_room;
    while (!done) {
      scanner_.skip_blanks();
      const std::string keyword(scanner_.word());
      const bool is_comment = keyword == "comment" || keyword == "obj_info";
      // Only one blank separates a comment from its keyword: blanks behind it belong to the text.
      if (is_comment && !scanner_.at_line_end()) scanner_.advance();
      if (!is_comment) scanner_.skip_blanks();
      if (keyword == "format") {
        MAILLE_CHECK(parse_format());
        has_format = true;
      } else if (is_comment) {
        const std::string_view text = scanner_.rest_of_line();
        // Parsing goes on without the text, so that the message below comes once and at the end.
        if (comment_room.take(text)) header_.comments.emplace_back(keyword, text);
      } else if (keyword == "element") {
        MAILLE_CHECK(parse_element());
      } else if (keyword == "property") {
        MAILLE_CHECK(parse_property());
      } else if (keyword == "end_header") {
        done = true;
      } else if (!keyword.empty() && has_format && header_.elements.empty() && !scanner_.at_end()) {
        // Some programs leave out "comment". From the first element on, such a line could be a property.
        const std::string text = keyword + " " + std::string(scanner_.rest_of_line());
        if (comment_room.take(text)) header_.comments.emplace_back("comment", text);
      } else if (!keyword.empty() || scanner_.at_end()) {
        return bad(scanner_.at_end()
                       ? "the file ends before \"end_header\""
                       : "unknown keyword \"" + to_word(keyword.substr(0, 40)) + "\" in the header");
      }
      // A file without elements may end with "end_header", without a line end.
      if (!done || !scanner_.at_end()) MAILLE_CHECK(end_line());
    }
    if (!has_format) return bad("the header has no line \"format\"");
    MAILLE_CHECK(comment_room.check(file_));
    return std::move(header_);
  }

 private:
  tl::unexpected<Error> bad(const std::string& what) const {
    return malformed_line(file_, scanner_.line(), what);
  }

  Result<> end_line() {
    scanner_.skip_blanks();
    if (scanner_.at_end()) return bad("the file ends before \"end_header\"");
    if (!scanner_.at_line_end()) return bad("unexpected " + found_at(scanner_) + " in the header");
    if (lone_return_) {
      scanner_.skip_return();
    } else {
      scanner_.skip_line_end();
    }
    return {};
  }

  Result<> parse_format() {
    const std::string_view name = scanner_.word();
    if (name == "ascii") {
      header_.encoding = PlyEncoding::ascii;
    } else if (name == "binary_little_endian") {
      header_.encoding = PlyEncoding::little_endian;
    } else if (name == "binary_big_endian") {
      header_.encoding = PlyEncoding::big_endian;
    } else {
      return bad("unknown format \"" + to_word(name.substr(0, 40)) +
                 "\"; known are ascii, binary_little_endian and binary_big_endian");
    }
    scanner_.skip_blanks();
    const std::string_view version = scanner_.word();
    // No other version was ever published.
    if (version != "1.0") return bad("PLY version \"" + to_word(version.substr(0, 40)) + "\" instead of 1.0");
    return {};
  }

  Result<> parse_element() {
    PlyElement element;
    element.name = scanner_.word();
    scanner_.skip_blanks();
    if (!scanner_.integer(element.count)) {
      return bad("element \"" + to_word(element.name.substr(0, 40)) + "\" has " + found_at(scanner_) +
                 " where its count belongs");
    }
    // Rows are found by the element's name, so a second one of the same name could not be told apart.
    if (!element_names_.insert(element.name).second) {
      return bad("a second element \"" + to_word(element.name.substr(0, 40)) + "\"");
    }
    if (header_.elements.size() == max_elements) return bad("more than 256 elements");
    property_names_.clear();
    header_.elements.push_back(std::move(element));
    return {};
  }

  Result<Scalar> parse_type() {
    scanner_.skip_blanks();
    const std::string_view word = scanner_.word();
    if (const auto type = ply_type_named(word)) return *type;
    return bad("unknown type \"" + to_word(word.substr(0, 40)) + "\"");
  }

  Result<> parse_property() {
    if (header_.elements.empty()) return bad("a property before the first element");
    PlyProperty property;
    if (scanner_.look() == "list") {
      scanner_.word();
      property.list = true;
      property.count_type = MAILLE_TRY(parse_type());
      if (is_float(property.count_type)) return bad("the length of a list must be an integer");
    }
    property.type = MAILLE_TRY(parse_type());
    scanner_.skip_blanks();
    property.name = scanner_.word();
    if (property.name.empty()) return bad("a property without a name");
    if (!property_names_.insert(property.name).second) {
      return bad("a second property \"" + to_word(property.name.substr(0, 40)) + "\" in element \"" +
                 to_word(header_.elements.back().name.substr(0, 40)) + "\"");
    }
    auto& properties = header_.elements.back().properties;
    if (properties.size() == most_ply_properties) return bad("more than 4096 properties in one element");
    properties.push_back(std::move(property));
    return {};
  }

  TextScanner& scanner_;
  const std::string& file_;
  PlyHeader header_;
  bool lone_return_ = false;
  std::set<std::string> element_names_;
  std::set<std::string> property_names_;
};

/// Properties that make one array. The first group of a name whose properties are all there, of one type and
/// unused, wins, so colours with alpha stand before those without.
struct Group {
  std::string_view array;
  Role role;
  std::string_view properties[4];
};
constexpr Group groups[] = {
    {"normal", Role::normal, {"nx", "ny", "nz", ""}},
    {"colour", Role::colour, {"red", "green", "blue", "alpha"}},
    {"colour", Role::colour, {"red", "green", "blue", ""}},
    {"texcoord", Role::texture_coordinate, {"s", "t", "", ""}},
    {"texcoord", Role::texture_coordinate, {"u", "v", "", ""}},
    {"texcoord", Role::texture_coordinate, {"texture_u", "texture_v", "", ""}},
};

/// Makes columns while keeping track of which properties and array names are used up: hints first, then
/// groups, then each property that is left by itself. Two arrays never get one name, and no property is in
/// two arrays.
class Planner {
 public:
  Planner(const PlyElement& element, const std::vector<std::string_view>& taken)
      : element_(element), used_(element.properties.size()) {
    for (size_t i = 0; i < used_.size(); ++i) {
      used_[i] = std::find(taken.begin(), taken.end(), element.properties[i].name) != taken.end();
    }
  }

  // A hint that does not fit its element (a header that somebody edited) is ignored, and its properties are
  // arrays of their own: nothing is lost but the description.
  void add_hint(const PlyHint& hint) {
    const bool halves = hint.type == Scalar::i64 || hint.type == Scalar::u64;
    const Scalar stored = halves ? Scalar::u32 : hint.type;
    PlyColumn column{hint.name, hint.type, hint.components, hint.role, false, {}, true};
    if (hint.properties.size() != size_t{hint.components} * (halves ? 2 : 1)) return;
    if (!collect(hint.properties, stored, column.properties)) return;
    add(std::move(column));
  }

  void add_group(const Group& group) {
    const size_t first = element_.find(group.properties[0]).value_or(used_.size());
    if (first == used_.size()) return;
    std::vector<std::string> names;
    for (const std::string_view name : group.properties) {
      if (!name.empty()) names.emplace_back(name);
    }
    PlyColumn column{std::string(group.array),
                     element_.properties[first].type,
                     static_cast<uint32_t>(names.size()),
                     group.role,
                     false,
                     {},
                     false};
    // A property that already has the group's name keeps it.
    if (element_.find(group.array) || !collect(names, column.type, column.properties)) return;
    add(std::move(column));
  }

  void add_rest() {
    for (size_t i = 0; i < used_.size(); ++i) {
      const PlyProperty& property = element_.properties[i];
      if (used_[i]) continue;
      PlyColumn column{property.name, property.type, 1, Role::none, property.list, {i}, false};
      // Ends: each round makes the name longer, and there are fewer than 4096 + 256 names.
      while (!names_.insert(column.name).second) column.name += "_";
      columns_.push_back(std::move(column));
    }
  }

  std::vector<PlyColumn> take() {
    // Arrays come in the order in which their first properties stand in the file, whatever rule made them.
    std::stable_sort(columns_.begin(), columns_.end(), [](const PlyColumn& a, const PlyColumn& b) {
      return a.properties.front() < b.properties.front();
    });
    return std::move(columns_);
  }

 private:
  bool collect(const std::vector<std::string>& names, Scalar type, std::vector<size_t>& properties) const {
    for (const std::string& name : names) {
      const auto at = element_.find(name);
      if (!at || used_[*at] || element_.properties[*at].list || element_.properties[*at].type != type)
        return false;
      if (std::find(properties.begin(), properties.end(), *at) != properties.end()) return false;
      properties.push_back(*at);
    }
    return !properties.empty();
  }

  void add(PlyColumn column) {
    if (!names_.insert(column.name).second) return;
    for (const size_t property : column.properties) used_[property] = true;
    columns_.push_back(std::move(column));
  }

  const PlyElement& element_;
  std::vector<bool> used_;
  std::set<std::string> names_;
  std::vector<PlyColumn> columns_;
};

template <class Enum>
std::optional<Enum> enum_named(std::string_view name, unsigned count) {
  for (unsigned i = 0; i < count; ++i) {
    if (name_of(static_cast<Enum>(i)) == name) return static_cast<Enum>(i);
  }
  return {};
}

// Comments of our own begin with the program's name, so that no comment of somebody else's is taken for one.
constexpr std::string_view hint_prefix = "maille array ";
constexpr std::string_view label_prefix = "maille label ";
constexpr std::string_view metadata_prefix = "maille metadata ";

}  // namespace

std::vector<std::string_view> split_words(std::string_view text) {
  std::vector<std::string_view> words;
  TextScanner scanner(text);
  for (scanner.skip_white(); !scanner.at_end(); scanner.skip_white()) words.push_back(scanner.word());
  return words;
}

std::optional<Scalar> ply_type_named(std::string_view name) {
  for (const TypeName& entry : type_names) {
    if (entry.name == name) return entry.type;
  }
  return {};
}

std::optional<size_t> PlyElement::find(std::string_view property) const {
  for (size_t i = 0; i < properties.size(); ++i) {
    if (properties[i].name == property) return i;
  }
  return {};
}

Result<PlyHeader> parse_ply_header(TextScanner& scanner, const std::string& file) {
  return HeaderParser(scanner, file).parse();
}

const char* ply_name_of(Scalar type) {
  for (const TypeName& entry : type_names) {
    if (entry.type == type) return entry.name.data();
  }
  return nullptr;
}

std::string format_ply_header(const PlyHeader& header) {
  static constexpr const char* encodings[] = {"ascii", "binary_little_endian", "binary_big_endian"};
  std::string text = std::string("ply\nformat ") + encodings[static_cast<size_t>(header.encoding)] + " 1.0\n";
  for (const auto& [keyword, line] : header.comments)
    text += keyword + (line.empty() ? "" : " ") + line + "\n";
  for (const PlyElement& element : header.elements) {
    text += "element " + element.name + " " + std::to_string(element.count) + "\n";
    for (const PlyProperty& property : element.properties) {
      text += "property ";
      if (property.list) text += std::string("list ") + ply_name_of(property.count_type) + " ";
      text += std::string(ply_name_of(property.type)) + " " + property.name + "\n";
    }
  }
  return text + "end_header\n";
}

std::optional<PlyHint> parse_ply_hint(std::string_view comment) {
  if (!comment.starts_with(hint_prefix)) return {};
  const auto words = split_words(comment.substr(hint_prefix.size()));
  if (words.size() < 6) return {};
  const auto type = enum_named<Scalar>(words[2], scalar_count);
  const auto role = enum_named<Role>(words[4], role_count);
  PlyHint hint;
  TextScanner number(words[3]);
  if (!type || !role || !number.integer(hint.components) || hint.components == 0) return {};
  hint.element = words[0];
  hint.name = from_word(words[1]);
  hint.type = *type;
  hint.role = *role;
  hint.properties.assign(words.begin() + 5, words.end());
  return hint;
}

std::string format_ply_hint(const PlyHint& hint) {
  std::string text = std::string(hint_prefix) + hint.element + " " + to_word(hint.name) + " " +
                     name_of(hint.type) + " " + std::to_string(hint.components) + " " + name_of(hint.role);
  for (const std::string& property : hint.properties) text += " " + property;
  return text;
}

std::optional<PlyLabel> parse_ply_label(std::string_view comment) {
  if (!comment.starts_with(label_prefix)) return {};
  const auto words = split_words(comment.substr(label_prefix.size()));
  if (words.size() != 3) return {};
  const auto domain = enum_named<Domain>(words[0], domain_count);
  if (!domain) return {};
  return PlyLabel{*domain, from_word(words[1]), from_word(words[2])};
}

std::string format_ply_label(const PlyLabel& label) {
  return std::string(label_prefix) + name_of(label.domain) + " " + to_word(label.array) + " " +
         to_word(label.text);
}

std::optional<std::pair<std::string, std::string>> parse_ply_metadata(std::string_view comment) {
  if (!comment.starts_with(metadata_prefix)) return {};
  const auto words = split_words(comment.substr(metadata_prefix.size()));
  if (words.size() != 2) return {};
  return std::pair(from_word(words[0]), from_word(words[1]));
}

std::string format_ply_metadata(const std::string& key, const std::string& text) {
  return std::string(metadata_prefix) + to_word(key) + " " + to_word(text);
}

std::vector<PlyColumn> plan_ply_columns(const PlyElement& element, const std::vector<PlyHint>& hints,
                                        const std::vector<std::string_view>& taken) {
  Planner planner(element, taken);
  for (const PlyHint& hint : hints) {
    if (hint.element == element.name) planner.add_hint(hint);
  }
  for (const Group& group : groups) planner.add_group(group);
  planner.add_rest();
  return planner.take();
}

std::optional<size_t> find_vertex_indices(const PlyElement& element) {
  for (const std::string_view name : {"vertex_indices", "vertex_index"}) {
    const auto at = element.find(name);
    if (at && element.properties[*at].list && !is_float(element.properties[*at].type)) return at;
  }
  return {};
}

}  // namespace maille
