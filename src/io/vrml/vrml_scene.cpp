#include "io/vrml/vrml_scene.h"

#include <algorithm>
#include <set>

#include "base/bytes.h"
#include "io/budget.h"
#include "io/reading.h"
#include "io/text_scanner.h"

namespace maille {
namespace {

/// Deeper than any real scene, and shallow enough that the recursion does not run out of stack. The number
/// was chosen, not swept.
constexpr int max_depth = 200;

/// A tolerant parser: it knows how nodes nest and the fields of the few nodes that matter, and steps over all
/// else word by word, so that prototypes, scripts and unknown nodes do no harm.
class Parser {
 public:
  Parser(std::string_view text, const std::string& file, const ReadOptions& options)
      : text_(text), in_(text), file_(&file), options_(&options) {}

  Result<VrmlScene> parse();

 private:
  /// What a name stands for, as far as it matters.
  struct Definition {
    std::shared_ptr<const VrmlValues> values;
    bool geometry = false;
  };
  // A node or bracket that is not closed yet; brackets without a node have no type.
  struct Open {
    std::string type, name;
    uint64_t line = 0;
  };

  Result<> check_header();
  void skip_white();
  std::string_view id();
  Result<> skip_string(std::string* content = nullptr);

  Result<> walk(char close);
  Result<> node_after_def();
  Result<> node(const std::string& type, const std::string& name);
  Result<> known_field(const std::string& type, const std::string& field, bool& known);
  Result<> use();
  Result<> values_node(VrmlKind kind, const std::string& field, const std::string& name);
  Result<> geometry_node(VrmlGeometry::Type type);
  Result<> geometry_field(VrmlGeometry& geometry, const std::string& field, bool& known);
  Result<> values_field(VrmlGeometry& geometry, VrmlKind kind);
  Result<> numbers(VrmlValues& values, bool& fits);
  Result<> end_of_list(bool list);
  Result<> integers(std::vector<int32_t>& values);
  bool boolean();
  void transform_field(const std::string& field);
  std::string nearest_name() const;
  std::string transforms_around() const;
  Result<> check_progress();
  tl::unexpected<Error> malformed(const std::string& what) const {
    return malformed_line(*file_, in_.line(), what);
  }

  std::string_view text_;
  TextScanner in_;
  const std::string* file_;
  const ReadOptions* options_;
  VrmlScene scene_;
  std::map<std::string, Definition> definitions_;
  std::vector<Open> open_;
  std::vector<std::string> transforms_;  ///< of the Transform nodes around
  std::string last_word_;                ///< of a statement that goes on
  std::array<bool, vrml_kinds> wide_ = {};
  bool must_restart_ = false;  ///< with wider numbers
  std::shared_ptr<const VrmlValues> last_values_;
  VrmlGeometry* geometry_ = nullptr;  ///< the one that is open
  uint64_t next_report_ = 0;
};

// Commas are white space in VRML.
void Parser::skip_white() {
  for (;;) {
    in_.skip_white('#');
    if (in_.peek() != ',' || in_.at_end()) return;
    in_.advance();
  }
}

// A word up to white space or a mark; empty where a mark stands.
std::string_view Parser::id() {
  const char* const from = in_.here();
  const char* p = from;
  constexpr std::string_view marks = ",{}[]\"#";
  while (p != in_.end() && !TextScanner::is_white(*p) && marks.find(*p) == std::string_view::npos) ++p;
  in_.jump(p);
  return {from, static_cast<size_t>(p - from)};
}

/// Stands on the opening quote.
Result<> Parser::skip_string(std::string* content) {
  const uint64_t line = in_.line();
  in_.advance();
  while (!in_.at_end() && in_.peek() != '"') {
    if (in_.at_line_end()) {
      in_.skip_line_end();
      continue;
    }
    // The character behind a backslash is taken as it is, so an escaped quote does not end the string.
    if (in_.peek() == '\\') in_.advance();
    if (in_.at_end() || in_.at_line_end()) continue;
    if (content) *content += in_.peek();
    in_.advance();
  }
  if (in_.at_end()) return malformed_line(*file_, line, "a string begins here, but has no end");
  in_.advance();
  return {};
}

Result<> Parser::check_header() {
  if (text_.starts_with("\xef\xbb\xbf")) in_.jump(in_.here() + 3);
  // A copy of the scanner reads the line: it is a comment to the parser, which skips it.
  const std::string_view header = TextScanner(in_).rest_of_line();
  if (header.starts_with("#VRML V2.0")) return {};
  if (header.starts_with("#VRML V1.0") || header.starts_with("#X3D")) {
    const std::string version = header.starts_with("#X3D") ? "X3D" : "VRML 1.0";
    return failure(
        ErrorCode::unsupported,
        *file_ + ": it is " + version + ", only VRML97 (\"#VRML V2.0 utf8\") can be read; convert it first");
  }
  return malformed("the first line must be \"#VRML V2.0 utf8\"");
}

// Reports each 4 MiB of text: reports cost little, but this is called for every number.
Result<> Parser::check_progress() {
  if (in_.position() < next_report_) return {};
  next_report_ = in_.position() + (uint64_t{4} << 20);
  return report_progress(
      options_->progress, "reading",
      static_cast<double>(in_.position()) / static_cast<double>(std::max<size_t>(text_.size(), 1)));
}

/// Walks over everything up to the closing bracket, or to the end of the file.
Result<> Parser::walk(char close) {
  const uint64_t line = in_.line();
  if (open_.size() > max_depth) return malformed("nodes nested more than 200 levels deep");
  for (;;) {
    skip_white();
    if (in_.at_end()) {
      if (close == '\0' && last_word_.empty()) return {};
      return malformed(close == '\0'
                           ? "the file ends inside a statement"
                           : "the file ends inside brackets that open in line " + std::to_string(line));
    }
    const char c = in_.peek();
    if (c == '}' || c == ']') {
      if (c != close) return malformed(std::string("a \"") + c + "\" that closes nothing");
      in_.advance();
      last_word_.clear();
      return {};
    }
    if (c == '{' || c == '[') {
      in_.advance();
      open_.push_back({});
      MAILLE_CHECK(walk(c == '{' ? '}' : ']'));
      open_.pop_back();
    } else if (c == '"') {
      MAILLE_CHECK(skip_string());
      last_word_.clear();
    } else {
      const std::string word(id());
      if (word == "DEF") {
        MAILLE_CHECK(node_after_def());
      } else if (word == "USE") {
        MAILLE_CHECK(use());
      } else {
        bool known = false;
        if (!open_.empty()) MAILLE_CHECK(known_field(open_.back().type, word, known));
        if (known) continue;
        skip_white();
        if (in_.peek() == '{' && !in_.at_end()) {
          MAILLE_CHECK(node(word, ""));
        } else {
          last_word_ = last_word_ == "TO" ? "" : word;  // a ROUTE ends so
        }
      }
    }
  }
}

Result<> Parser::node_after_def() {
  skip_white();
  const std::string name(id());
  skip_white();
  const std::string type(id());
  skip_white();
  if (name.empty() || type.empty() || in_.at_end() || in_.peek() != '{') {
    return malformed("DEF must be followed by a name and a node");
  }
  return node(type, name);
}

// USE outside the fields of a geometry repeats what is already in the scene.
Result<> Parser::use() {
  skip_white();
  const std::string name(id());
  const auto found = definitions_.find(name);
  if (found == definitions_.end())
    return malformed("USE of \"" + name.substr(0, 40) + "\", which no DEF before names");
  scene_.reused += found->second.geometry;
  last_word_.clear();
  return {};
}

Result<> Parser::node(const std::string& type, const std::string& name) {
  MAILLE_CHECK(check_progress());
  static const std::map<std::string, VrmlGeometry::Type> geometries = {
      {"IndexedFaceSet", VrmlGeometry::Type::faces},
      {"IndexedLineSet", VrmlGeometry::Type::lines},
      {"PointSet", VrmlGeometry::Type::points}};
  static const std::map<std::string, std::pair<VrmlKind, const char*>> lists = {
      {"Coordinate", {VrmlKind::coordinate, "point"}},
      {"Normal", {VrmlKind::normal, "vector"}},
      {"Color", {VrmlKind::colour, "color"}},
      {"TextureCoordinate", {VrmlKind::texture_coordinate, "point"}}};
  static const std::set<std::string> others = {"Box",  "Cone",      "Cylinder", "Sphere",
                                               "Text", "Extrusion", "Inline",   "ElevationGrid"};
  open_.push_back({type, name, in_.line()});
  in_.advance();  // the opening bracket
  if (const auto geometry = geometries.find(type); geometry != geometries.end()) {
    MAILLE_CHECK(geometry_node(geometry->second));
    if (!name.empty()) definitions_[name] = {nullptr, true};
  } else if (const auto list = lists.find(type); list != lists.end()) {
    MAILLE_CHECK(values_node(list->second.first, list->second.second, name));
  } else {
    scene_.left_out[type] += others.count(type);
    scene_.materials = scene_.materials || type == "Material";
    const size_t before = scene_.geometries.size();
    const bool transform = type == "Transform";
    if (transform) transforms_.emplace_back();
    MAILLE_CHECK(walk('}'));
    if (transform) transforms_.pop_back();
    // A name for a group counts as geometry when some was found inside it.
    if (!name.empty()) definitions_[name] = {nullptr, scene_.geometries.size() > before};
  }
  open_.pop_back();
  last_word_.clear();
  return {};
}

/// Reads fields of other nodes that are worth keeping. `known` turns true where the field was read; other
/// fields are stepped over by walk().
Result<> Parser::known_field(const std::string& type, const std::string& field, bool& known) {
  if (geometry_ != nullptr && (type == "IndexedFaceSet" || type == "IndexedLineSet" || type == "PointSet")) {
    return geometry_field(*geometry_, field, known);
  }
  if (type == "Transform" && (field == "translation" || field == "rotation" || field == "scale" ||
                              field == "scaleOrientation" || field == "center")) {
    known = true;
    transform_field(field);
  } else if (type == "ImageTexture" && field == "url") {
    known = true;
    skip_white();
    const bool list = in_.peek() == '[';
    if (list) in_.advance();
    skip_white();
    while (!in_.at_end() && in_.peek() == '"') {
      std::string url;
      MAILLE_CHECK(skip_string(&url));
      scene_.textures.push_back(std::move(url));
      skip_white();
      if (!list) return {};
    }
    if (list && in_.peek() != ']') return malformed("a list of strings does not end in \"]\"");
    if (list) in_.advance();
  }
  return {};
}

// The field is kept as text, with its numbers as they stand.
void Parser::transform_field(const std::string& field) {
  std::string text = field;
  for (;;) {
    skip_white();
    Number number;
    const char* const behind = parse_number(in_.here(), in_.end(), number);
    if (!behind) break;
    text += " " + std::string(in_.here(), behind);
    in_.jump(behind);
  }
  if (text == field || transforms_.empty()) return;  // IS: a parameter of a prototype
  scene_.transforms = true;
  transforms_.back() += (transforms_.back().empty() ? "" : " ") + text;
}

std::string Parser::transforms_around() const {
  std::string text;
  for (const std::string& transform : transforms_) {
    if (!transform.empty()) text += (text.empty() ? "" : " / ") + transform;
  }
  return text;
}

// The name of the innermost node around that has one, which may be the geometry itself, its Shape or a
// Transform.
std::string Parser::nearest_name() const {
  for (size_t i = open_.size(); i-- > 0;) {
    if (!open_[i].name.empty()) return open_[i].name;
  }
  return "";
}

/// Stands behind the opening bracket; `field` is the one with the numbers.
Result<> Parser::values_node(VrmlKind kind, const std::string& field, const std::string& name) {
  auto values = std::make_shared<VrmlValues>();
  const auto k = static_cast<size_t>(kind);
  values->kind = kind;
  values->type = wide_[k] ? Scalar::f64 : Scalar::f32;
  for (;;) {
    skip_white();
    if (in_.at_end()) {
      return malformed("the file ends inside brackets that open in line " +
                       std::to_string(open_.back().line));
    }
    if (in_.peek() == '}') break;
    const std::string word(id());
    if (word != field) {
      return malformed("found " + (word.empty() ? found_at(in_) : "\"" + word.substr(0, 40) + "\"") +
                       " where \"" + field + "\" should stand");
    }
    bool fits = true;
    MAILLE_CHECK(numbers(*values, fits));
    // The error only unwinds the recursion; parse() sees that the text is to be read again.
    if (!fits) {
      wide_[k] = must_restart_ = true;
      return failure(ErrorCode::cancelled, "");
    }
  }
  in_.advance();
  if (values->numbers() % components_of(kind) != 0) {
    return malformed(std::to_string(values->numbers()) + " numbers are no whole number of tuples of " +
                     std::to_string(components_of(kind)));
  }
  // Names have no scope here: those in a prototype are visible behind it, which does no harm.
  if (!name.empty()) definitions_[name] = {values, false};
  last_values_ = std::move(values);
  return {};
}

/// One number or a list; nothing behind IS. `fits` turns false where a number needs more than f32.
Result<> Parser::numbers(VrmlValues& values, bool& fits) {
  skip_white();
  const bool list = in_.peek() == '[' && !in_.at_end();
  if (list) in_.advance();
  const size_t size = size_of(values.type);
  for (;;) {
    skip_white();
    Number number;
    const char* const behind = parse_number(in_.here(), in_.end(), number);
    if (!behind) break;
    in_.jump(behind);
    const size_t at = values.bytes.size();
    values.bytes.resize(at + size);
    if (values.type == Scalar::f64) {
      store(values.bytes.data() + at, number.value);
    } else {
      fits = fits && number.fits_single;
      store(values.bytes.data() + at, number.single);
    }
    MAILLE_CHECK(check_progress());
  }
  return end_of_list(list);
}

Result<> Parser::integers(std::vector<int32_t>& values) {
  skip_white();
  const bool list = in_.peek() == '[' && !in_.at_end();
  if (list) in_.advance();
  for (;;) {
    skip_white();
    int32_t value = 0;
    const auto [behind, error] = std::from_chars(in_.here(), in_.end(), value);
    if (error == std::errc::result_out_of_range) return malformed("an index is out of range");
    if (error != std::errc()) break;
    in_.jump(behind);
    values.push_back(value);
    MAILLE_CHECK(check_progress());
  }
  return end_of_list(list);
}

Result<> Parser::end_of_list(bool list) {
  if (!list) {
    // "IS" stands where a prototype's parameter gives the value.
    const TextScanner before = in_;
    if (id() == "IS") {
      skip_white();
      id();
    } else {
      in_ = before;
    }
    return {};
  }
  if (in_.at_end() || in_.peek() != ']') {
    return malformed("found " + found_at(in_) +
                     " in a list of numbers, where a number or \"]\" should stand");
  }
  in_.advance();
  return {};
}

bool Parser::boolean() {
  skip_white();
  return id() != "FALSE";
}

/// Reads the node of a field: written here, named before, or NULL. A node of another type is read for its
/// names, but its values do not count.
Result<> Parser::values_field(VrmlGeometry& geometry, VrmlKind kind) {
  static constexpr const char* types[vrml_kinds] = {"Coordinate", "Normal", "Color", "TextureCoordinate"};
  std::shared_ptr<const VrmlValues>& into = geometry.values[static_cast<size_t>(kind)];
  skip_white();
  std::string word(id()), name;
  skip_white();
  if (word == "USE") {
    const std::string used(id());
    const auto found = definitions_.find(used);
    if (found == definitions_.end() || !found->second.values || found->second.values->kind != kind) {
      return malformed("USE of \"" + used.substr(0, 40) + "\", which no DEF before gives to a " +
                       types[static_cast<size_t>(kind)]);
    }
    into = found->second.values;
    return {};
  }
  if (word == "NULL") return {};
  if (word == "IS") {
    id();
    return {};
  }
  if (word == "DEF") {
    name = id();
    skip_white();
    word = id();
    skip_white();
  }
  if (in_.at_end() || in_.peek() != '{')
    return malformed("found " + found_at(in_) + " where a node should stand");
  last_values_.reset();
  MAILLE_CHECK(node(word, name));
  if (word == types[static_cast<size_t>(kind)]) into = last_values_;
  return {};
}

Result<> Parser::geometry_field(VrmlGeometry& geometry, const std::string& field, bool& known) {
  static const std::map<std::string, VrmlKind> values = {{"coord", VrmlKind::coordinate},
                                                         {"normal", VrmlKind::normal},
                                                         {"color", VrmlKind::colour},
                                                         {"texCoord", VrmlKind::texture_coordinate}};
  static const std::map<std::string, VrmlKind> indices = {{"coordIndex", VrmlKind::coordinate},
                                                          {"normalIndex", VrmlKind::normal},
                                                          {"colorIndex", VrmlKind::colour},
                                                          {"texCoordIndex", VrmlKind::texture_coordinate}};
  known = true;
  if (const auto value = values.find(field); value != values.end())
    return values_field(geometry, value->second);
  if (const auto index = indices.find(field); index != indices.end()) {
    return integers(geometry.indices[static_cast<size_t>(index->second)]);
  }
  if (field == "colorPerVertex") {
    geometry.per_vertex[static_cast<size_t>(VrmlKind::colour)] = boolean();
  } else if (field == "normalPerVertex") {
    geometry.per_vertex[static_cast<size_t>(VrmlKind::normal)] = boolean();
  } else if (field == "ccw") {
    scene_.clockwise += !boolean();
  } else {
    known = false;
  }
  return {};
}

/// Stands behind the opening bracket.
Result<> Parser::geometry_node(VrmlGeometry::Type type) {
  VrmlGeometry geometry;
  geometry.type = type;
  geometry.line = open_.back().line;
  geometry.name = nearest_name();
  geometry.transform = transforms_around();
  // A hostile file may nest geometries; the outer one goes on behind the inner.
  VrmlGeometry* const outer = std::exchange(geometry_, &geometry);
  MAILLE_CHECK(walk('}'));
  geometry_ = outer;
  scene_.geometries.push_back(std::move(geometry));
  return {};
}

Result<VrmlScene> Parser::parse() {
  MAILLE_CHECK(check_header());
  for (;;) {
    auto status = walk('\0');
    if (status) return std::move(scene_);
    if (!must_restart_) return tl::unexpected(std::move(status).error());
    // Some number needs a double: all of its kind are read again as doubles. At most once per kind.
    const std::array<bool, vrml_kinds> wide = wide_;
    *this = Parser(text_, *file_, *options_);
    wide_ = wide;
    MAILLE_CHECK(check_header());
  }
}

}  // namespace

Result<VrmlScene> parse_vrml(std::string_view text, const std::string& file, const ReadOptions& options) {
  return Parser(text, file, options).parse();
}

}  // namespace maille
