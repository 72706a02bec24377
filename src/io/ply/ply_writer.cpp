#include "io/ply/ply_writer.h"

#include <algorithm>
#include <map>
#include <set>
#include "base/bytes.h"
#include "io/buffered_writer.h"
#include "io/cells.h"
#include "io/notes.h"
#include "io/ply/ply.h"
#include "io/ply/ply_rows.h"
#include "io/reading.h"

namespace maille {
namespace {

/// PLY has no integers of 64 bits: they are written as two of 32, with a hint that says so.
bool is_half(Scalar type) {
  return type == Scalar::i64 || type == Scalar::u64;
}
Scalar stored_type(Scalar type) {
  return is_half(type) ? Scalar::u32 : type;
}

/// A name as a property can have it: no blanks, nothing beyond ASCII. The array's own name is kept by a hint.
std::string property_name(const std::string& name) {
  std::string result;
  for (const char c : name) result += c > ' ' && c < 127 ? c : '_';
  return result.empty() ? "array" : result;
}

/// Ends: the name grows in each round, and finitely many are used.
std::string unique(std::string name, std::set<std::string>& used) {
  while (!used.insert(name).second) name += "_";
  return name;
}

/// Builds header and fields from a mesh. The aim is twofold: programs that know nothing of us find the usual
/// properties, and our reader makes the very same mesh of the file. So properties get usual names where roles
/// or metadata of an earlier PLY file say so, and what plan_ply_columns() would not make of them by itself is
/// told by hints.
class PlyPlan {
 public:
  PlyPlan(const Mesh& mesh, std::vector<std::string>& notes) : mesh_(mesh), notes_(notes) {}

  Result<> build() {
    MAILLE_CHECK(count_cells());
    read_metadata();
    plan_vertices();
    // Arrays on cells need an element even if there are no cells, so that they come back.
    if (face_count || (!line_count && has_cell_arrays())) plan_faces();
    if (line_count) plan_edges();
    plan_mesh_arrays();
    order_elements();
    add_comments();
    for (const PlyOutElement& element : elements) MAILLE_CHECK(check_properties(element.element));
    return {};
  }

  PlyHeader header;
  std::vector<PlyOutElement> elements;
  uint64_t face_count = 0;
  uint64_t line_count = 0;

 private:
  struct ListType {
    Scalar count = Scalar::u8;
    Scalar value = Scalar::f32;
  };

  Result<> count_cells() {
    uint64_t others = 0;
    for_each_cell(mesh_, [&](CellType type, uint64_t, uint64_t, std::span<const uint32_t> nodes) {
      longest_face_ = is_face(type) ? std::max<uint64_t>(longest_face_, nodes.size()) : longest_face_;
      ++(is_face(type) ? face_count : type == CellType::line ? line_count : others);
    });
    if (others != 0 && face_count + line_count == 0) {
      return failure(ErrorCode::usage, "PLY holds faces and edges, but this mesh has only other cells (" +
                                           std::string(name_of(mesh_.blocks.front().type)) + ", ...)");
    }
    if (others != 0) notes_.push_back(counted(others, "cell") + " that are neither faces nor edges left out");
    note_block_names(mesh_, notes_);
    return {};
  }

  /// What is written can be read again: the reader's bound on properties holds here, too.
  static Result<> check_properties(const PlyElement& element) {
    if (element.properties.size() <= most_ply_properties) return {};
    return failure(ErrorCode::usage,
                   "a " + element.name + " would have " + std::to_string(element.properties.size()) +
                       " properties in PLY, of which no more than 4096 are read; leave some "
                       "arrays out (the command: --arrays)");
  }

  bool has_cell_arrays() const {
    return std::any_of(mesh_.arrays.begin(), mesh_.arrays.end(), [](const Array& array) {
      return array.domain == Domain::cell || array.domain == Domain::corner;
    });
  }

  // What the reader remembered of a PLY file. Metadata can come from anybody, so each entry is used only if
  // it fits.
  void read_metadata() {
    for (const auto& [key, text] : mesh_.metadata) {
      const auto words = split_words(text);
      const auto word = [&](size_t i) { return i < words.size() ? std::string(words[i]) : std::string(); };
      if (key == "ply.list" && words.size() == 4) {
        const auto count = ply_type_named(words[2]);
        const auto value = ply_type_named(words[3]);
        if (count && value && !is_float(*count)) lists_[{word(0), from_word(words[1])}] = {*count, *value};
      } else if (key == "ply.only") {
        only_[from_word(word(1))] = word(0);
      } else if (key == "ply.texcoord" && words.size() == 3) {
        texcoords_[word(0)] = {property_name(word(1)), property_name(word(2))};
      } else if (key == "ply.indices" && words.size() == 3) {
        indices_ = {word(0), word(1), word(2)};
      } else if (key == "ply.element" && words.size() == 2) {
        uint64_t count = 0;
        if (TextScanner(words[1]).integer(count)) foreign_.emplace_back(word(0), count);
      } else if (key == "ply.order") {
        for (const auto name : words) order_.emplace_back(name);
      }
    }
  }

  PlyOutElement& start(const std::string& name, uint64_t count) {
    PlyOutElement element;
    element.element.name = unique(property_name(name), element_names_);
    element.element.count = count;
    return elements.emplace_back(std::move(element));
  }

  void plan_vertices() {
    PlyOutElement& out = start("vertex", mesh_.point_count());
    const bool halves = is_half(mesh_.points.type);
    if (halves) make_rounded_points();
    const Array& points = halves ? rounded_points_ : mesh_.points;
    for (const char* name : {"x", "y", "z"}) add_property(out, name, points.type, false, Scalar::u8);
    out.fields.push_back({PlyField::Kind::fixed, &points, points.type, 3, Scalar::u8, nullptr});
    // Of 64-bit integers: doubles for other readers, and the exact values for ours.
    if (halves) add_named(out, mesh_.points, numbered_names("position", 3), "");
    add_arrays(out, Domain::point);
    add_hints(out, "", {"x", "y", "z"});
  }

  void make_rounded_points() {
    rounded_points_ = make_array("position", Domain::point, Scalar::f64, 3);
    rounded_points_.resize(mesh_.point_count());
    const std::span<double> to = rounded_points_.values<double>();
    for (size_t i = 0; i < to.size(); ++i) {
      to[i] = mesh_.points.type == Scalar::i64 ? static_cast<double>(mesh_.points.values<int64_t>()[i])
                                               : static_cast<double>(mesh_.points.values<uint64_t>()[i]);
    }
  }

  void plan_faces() {
    PlyOutElement& out = start("face", face_count);
    out.rows = PlyOutElement::Rows::faces;
    PlyField field{PlyField::Kind::nodes, nullptr, index_type(), 1, list_count_type(longest_face_), nullptr};
    std::string name = "vertex_indices";
    if (indices_.size() == 3) {
      const auto count = ply_type_named(indices_[0]);
      const auto type = ply_type_named(indices_[1]);
      // Types of an earlier file are kept only if they hold what there is now.
      if (count && holds(*count, longest_face_)) field.count_type = *count;
      if (type && !is_float(*type) && holds(*type, std::max<uint64_t>(mesh_.point_count(), 1) - 1))
        field.type = *type;
      name = property_name(indices_[2]);
    }
    add_property(out, name, field.type, true, field.count_type);
    // No array may take a name by which readers look for the corners of faces.
    out.used.insert({"vertex_indices", "vertex_index"});
    out.fields.push_back(field);
    for (const Array& array : mesh_.arrays) {
      if (array.domain == Domain::corner) add_corner_array(out, array);
      if (array.domain == Domain::cell && belongs(array, out)) add_array(out, array, "");
    }
    add_hints(out, "", {name});
  }

  void plan_edges() {
    PlyOutElement& out = start("edge", line_count);
    out.rows = PlyOutElement::Rows::edges;
    add_property(out, "vertex1", index_type(), false, Scalar::u8);
    add_property(out, "vertex2", index_type(), false, Scalar::u8);
    out.fields.push_back({PlyField::Kind::ends, nullptr, index_type(), 2, Scalar::u8, nullptr});
    add_arrays(out, Domain::cell);
    add_hints(out, "", {"vertex1", "vertex2"});
  }

  static bool holds(Scalar type, uint64_t value) {
    return with_type(type, [&](auto zero) {
      using T = decltype(zero);
      if constexpr (std::is_integral_v<T>)
        return value <= static_cast<uint64_t>(std::numeric_limits<T>::max());
      return false;
    });
  }
  // int as all programs write it, unless there are 2^31 points or more.
  Scalar index_type() const { return holds(Scalar::i32, mesh_.point_count()) ? Scalar::i32 : Scalar::u32; }
  static Scalar list_count_type(uint64_t longest) {
    return holds(Scalar::u8, longest) ? Scalar::u8 : Scalar::u32;
  }

  static void add_property(PlyOutElement& out, const std::string& name, Scalar type, bool list,
                           Scalar count_type) {
    out.used.insert(name);
    out.element.properties.push_back({name, type, list, count_type});
  }

  /// Whether this array is written with this element. Arrays on cells go with both faces and edges, unless
  /// "ply.only" says where they came from.
  bool belongs(const Array& array, const PlyOutElement& out) const {
    if (array.domain != Domain::cell) return true;
    const auto only = only_.find(array.name);
    return face_count == 0 || line_count == 0 || only == only_.end() || only->second == out.element.name;
  }

  const ListType* list_type(const std::string& element, const std::string& array) const {
    const auto at = lists_.find({element, array});
    return at == lists_.end() ? nullptr : &at->second;
  }

  void add_arrays(PlyOutElement& out, Domain domain) {
    for (const Array& array : mesh_.arrays) {
      if (array.domain == domain && belongs(array, out)) add_array(out, array, "");
    }
  }

  void add_array(PlyOutElement& out, const Array& array, const std::string& prefix) {
    if (used_.count(&array) != 0 && array.domain == Domain::mesh) return;
    const bool counts = array.name.ends_with(".count");
    const std::string list_name = counts ? array.name.substr(0, array.name.size() - 6) : array.name;
    if (const ListType* type = list_type(out.element.name, list_name)) {
      if (counts && add_ragged(out, array, list_name, *type, prefix)) return;
      if (!counts && mesh_.find(array.name + ".count", array.domain) != nullptr &&
          ragged_.count(array.name) != 0)
        return;
      if (!counts && array.type == type->value && holds(type->count, array.components)) {
        const std::string name = unique(property_name(array.name.substr(prefix.size())), out.used);
        add_property(out, name, array.type, true, type->count);
        out.fields.push_back(
            {PlyField::Kind::fixed_list, &array, array.type, array.components, type->count, nullptr});
        used_.insert(&array);
        return;
      }
    }
    add_named(out, array, preferred_names(out, array, prefix), prefix);
  }

  /// Writes a list of varying length from "name.count" and "name", when these fit together; false when they
  /// do not, and both are written as arrays of their own then.
  bool add_ragged(PlyOutElement& out, const Array& counts, const std::string& name, const ListType& type,
                  const std::string& prefix) {
    if (counts.type != type.count || counts.components != 1) return false;
    if (counts.domain == Domain::mesh && counts.count() != out.element.count) return false;
    uint64_t total = 0;
    uint64_t longest = 0;
    for (uint64_t i = 0; i < counts.count(); ++i) {
      const uint64_t count = ply_count_at(counts, i);
      longest = std::max(longest, count);
      // Keeps the sum from overflowing; no array is that long.
      if (count > (uint64_t{1} << 40)) return false;
      total += count;
    }
    const Array* padded = counts.domain == Domain::mesh ? nullptr : mesh_.find(name, counts.domain);
    const Array* running = mesh_.find(name, Domain::mesh);
    PlyField field{PlyField::Kind::padded_list, nullptr, type.value, 1, type.count, &counts};
    if (padded != nullptr && padded->type == type.value && padded->components >= longest) {
      field.array = padded;
    } else if (running != nullptr && running->type == type.value && running->components == 1 &&
               running->count() == total && out.element.count == counts.count()) {
      field.kind = PlyField::Kind::running_list;
      field.array = running;
    } else if (longest != 0) {
      return false;
    }
    if (field.array != nullptr) used_.insert(field.array);
    used_.insert(&counts);
    ragged_.insert(name);
    add_property(out, unique(property_name(name.substr(prefix.size())), out.used), type.value, true,
                 type.count);
    out.fields.push_back(field);
    return true;
  }

  std::vector<std::string> preferred_names(const PlyOutElement& out, const Array& array,
                                           const std::string& prefix) const {
    const std::string name = array.name.substr(prefix.size());
    const auto is = [&](const char* usual, Role role) { return array.role == role || name == usual; };
    if (array.components == 3 && is("normal", Role::normal)) return {"nx", "ny", "nz"};
    if (array.components == 3 && is("colour", Role::colour)) return {"red", "green", "blue"};
    if (array.components == 4 && is("colour", Role::colour)) return {"red", "green", "blue", "alpha"};
    if (array.components == 2 && is("texcoord", Role::texture_coordinate)) {
      const auto names = texcoords_.find(out.element.name);
      return names == texcoords_.end() ? std::vector<std::string>{"s", "t"} : names->second;
    }
    return numbered_names(property_name(name), array.components);
  }

  static std::vector<std::string> numbered_names(const std::string& name, uint32_t components) {
    if (components == 1) return {name};
    std::vector<std::string> names;
    for (uint32_t i = 0; i < components; ++i) names.push_back(name + "_" + std::to_string(i));
    return names;
  }

  /// Adds one property for each component; 64-bit integers take two, the low half first.
  void add_named(PlyOutElement& out, const Array& array, std::vector<std::string> names,
                 const std::string& prefix) {
    // A second array of normals cannot have "nx" again: it gets its own name and numbers.
    if (std::any_of(names.begin(), names.end(),
                    [&](const auto& name) { return out.used.count(name) != 0; })) {
      names = numbered_names(property_name(array.name.substr(prefix.size())), array.components);
    }
    if (is_half(array.type)) {
      std::vector<std::string> halves;
      for (const std::string& name : names) halves.insert(halves.end(), {name + "_lo", name + "_hi"});
      names = std::move(halves);
    }
    const Scalar type = stored_type(array.type);
    PlyHint hint{out.element.name, array.name, array.type, array.components, array.role, {}};
    for (const std::string& name : names) {
      hint.properties.push_back(unique(name, out.used));
      out.element.properties.push_back({hint.properties.back(), type, false, Scalar::u8});
    }
    out.fields.push_back(
        {PlyField::Kind::fixed, &array, type, static_cast<uint32_t>(names.size()), Scalar::u8, nullptr});
    used_.insert(&array);
    out.hints.push_back(std::move(hint));
  }

  void add_corner_array(PlyOutElement& out, const Array& array) {
    const uint32_t numbers = array.components * (is_half(array.type) ? 2 : 1);
    const uint64_t longest = longest_face_ * numbers;
    Scalar count_type = list_count_type(longest);
    if (const ListType* type = list_type("corner", array.name); type && holds(type->count, longest)) {
      count_type = type->count;
    }
    const Scalar type = stored_type(array.type);
    const bool usual = array.role == Role::texture_coordinate && array.components == 2 &&
                       is_float(array.type) && out.used.count("texcoord") == 0;
    const std::string name = usual ? "texcoord" : unique(property_name(array.name), out.used);
    add_property(out, name, type, true, count_type);
    out.fields.push_back({PlyField::Kind::corners, &array, type, numbers, count_type, nullptr});
    used_.insert(&array);
    if (!usual || array.name != "texcoord") {
      corner_hints_.push_back({"corner", array.name, array.type, array.components, array.role, {name}});
    }
  }

  /// Keeps those of the hints that are needed for the reader to make the same arrays: it plans columns as the
  /// reader would and adds hints for arrays that differ. A hint changes what is left for other rules, hence
  /// the rounds; each adds a hint or ends, so there are at most as many rounds as hints.
  void add_hints(PlyOutElement& out, const std::string& prefix, const std::vector<std::string_view>& taken) {
    const std::vector<PlyHint> wanted = std::move(out.hints);
    std::vector<bool> is_added(wanted.size());
    out.hints.clear();
    for (size_t round = 0; round <= wanted.size(); ++round) {
      const auto columns = plan_ply_columns(out.element, out.hints, taken);
      const auto column_at = columns_by_first_property(columns, out.element);
      bool added = false;
      for (size_t i = 0; i < wanted.size(); ++i) {
        if (is_added[i] || is_made(wanted[i], column_at, out.element, prefix)) continue;
        out.hints.push_back(wanted[i]);
        is_added[i] = added = true;
      }
      if (!added) return;
    }
  }

  /// Names are unique in an element, and a property is of one column at most, so that thousands of arrays are
  /// found without looking through all columns for each.
  using ColumnsByProperty = std::map<std::string_view, const PlyColumn*>;
  static ColumnsByProperty columns_by_first_property(const std::vector<PlyColumn>& columns,
                                                     const PlyElement& element) {
    ColumnsByProperty found;
    for (const PlyColumn& column : columns)
      if (!column.properties.empty()) found.emplace(element.properties[column.properties[0]].name, &column);
    return found;
  }
  static bool is_made(const PlyHint& hint, const ColumnsByProperty& column_at, const PlyElement& element,
                      const std::string& prefix) {
    const auto found = hint.properties.empty() ? column_at.end() : column_at.find(hint.properties[0]);
    if (found == column_at.end()) return false;
    const PlyColumn& column = *found->second;
    const auto is_named = [&](size_t property, const std::string& name) {
      return element.properties[property].name == name;
    };
    return (column.hinted ? "" : prefix) + column.name == hint.name && column.type == hint.type &&
           column.components == hint.components && column.role == hint.role &&
           std::equal(column.properties.begin(), column.properties.end(), hint.properties.begin(),
                      hint.properties.end(), is_named);
  }

  // Elements of an earlier file come back with their arrays; each other array on the mesh becomes an element
  // of its own.
  void plan_mesh_arrays() {
    for (const auto& [name, count] : foreign_) {
      const std::string prefix = name + ".";
      PlyOutElement& out = start(name, count);
      for (const Array& array : mesh_.arrays) {
        if (array.domain != Domain::mesh || !array.name.starts_with(prefix) || used_.count(&array) != 0)
          continue;
        if (array.count() == count) add_array(out, array, prefix);
      }
      add_hints(out, prefix, {});
    }
    for (const Array& array : mesh_.arrays) {
      if (array.domain != Domain::mesh || used_.count(&array) != 0) continue;
      PlyOutElement& out = start(property_name(array.name), array.count());
      add_named(out, array, numbered_names("value", array.components), "");
    }
  }

  void order_elements() {
    const auto place = [&](const PlyOutElement& out) {
      return std::find(order_.begin(), order_.end(), out.element.name) - order_.begin();
    };
    std::stable_sort(elements.begin(), elements.end(),
                     [&](const PlyOutElement& a, const PlyOutElement& b) { return place(a) < place(b); });
  }

  void add_comments() {
    for (const auto& [key, text] : mesh_.metadata) {
      if (key.starts_with("ply.")) continue;
      // A comment is one line, so a text of several lines is written as words (to_word()).
      const bool one_line = text.find_first_of("\r\n") == std::string::npos;
      if (one_line && (key == "comment" || key == "obj_info")) {
        header.comments.emplace_back(key, text);
      } else {
        header.comments.emplace_back("comment", format_ply_metadata(key, text));
      }
    }
    for (const PlyOutElement& out : elements) {
      for (const PlyHint& hint : out.hints) header.comments.emplace_back("comment", format_ply_hint(hint));
      header.elements.push_back(out.element);
    }
    for (const PlyHint& hint : corner_hints_) header.comments.emplace_back("comment", format_ply_hint(hint));
    for (const Array& array : mesh_.arrays) {
      for (const std::string& label : array.labels) {
        header.comments.emplace_back("comment", format_ply_label({array.domain, array.name, label}));
      }
    }
  }

  const Mesh& mesh_;
  std::vector<std::string>& notes_;
  uint64_t longest_face_ = 0;
  Array rounded_points_;
  std::map<std::pair<std::string, std::string>, ListType> lists_;
  std::map<std::string, std::string> only_;
  std::map<std::string, std::vector<std::string>> texcoords_;
  std::vector<std::string> indices_;
  std::vector<std::pair<std::string, uint64_t>> foreign_;
  std::vector<std::string> order_;
  std::vector<PlyHint> corner_hints_;
  std::set<std::string> element_names_;
  std::set<std::string> ragged_;
  std::set<const Array*> used_;
};

void write_element(const Mesh& mesh, PlyOutElement& element, PlyRowWriter& rows) {
  const bool faces = element.rows == PlyOutElement::Rows::faces;
  if (element.element.properties.empty()) return;
  if (element.rows == PlyOutElement::Rows::numbered) {
    for (uint64_t row = 0; row < element.element.count; ++row) rows.write(element, row, 0, {});
    return;
  }
  for_each_cell(mesh, [&](CellType type, uint64_t cell, uint64_t corner, std::span<const uint32_t> nodes) {
    if (faces ? is_face(type) : type == CellType::line) rows.write(element, cell, corner, nodes);
  });
}

}  // namespace

Result<std::vector<std::string>> write_ply(const Mesh& mesh, Sink& sink, const WriteOptions& options) {
  std::vector<std::string> notes;
  PlyPlan plan(mesh, notes);
  MAILLE_CHECK(plan.build());
  plan.header.encoding = options.ascii        ? PlyEncoding::ascii
                         : options.big_endian ? PlyEncoding::big_endian
                                              : PlyEncoding::little_endian;
  if (options.ascii) note_nan_payloads(mesh, notes);
  BufferedWriter out(sink);
  out.put(format_ply_header(plan.header));
  PlyRowWriter rows(out, plan.header.encoding);
  for (PlyOutElement& element : plan.elements) write_element(mesh, element, rows);
  MAILLE_CHECK(out.finish());
  return notes;
}

}  // namespace maille
