#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "io/cells.h"
#include "io/number_column.h"
#include "io/obj/obj.h"
#include "io/ply/ply.h"
#include "io/reading.h"
#include "io/text_scanner.h"

// Reading of an OBJ file: lines (here), then what they hold as a mesh (obj_mesh.cpp).
namespace maille {

/// A reference that is not there. It is no valid number of a point either: max_points is less.
inline constexpr uint32_t no_obj_number = 0xffffffff;

/// What an earlier pass over the file found out. Whether an array needs doubles, or has more components, may
/// only show at its last line; rather than converting what was read, the file is read again.
struct ObjKnowledge {
  std::array<bool, obj_array_count> wide{};
  std::array<bool, obj_array_count> on_corners{};
  bool byte_colours = false;
  uint32_t texcoord_components = 0;
  uint32_t colour_components = 0;
  /// Numbers of v, vt and vn in the whole file, once an index was found to be beyond them: the next pass
  /// stops at the line.
  std::optional<std::array<uint64_t, 3>> counts;
};

/// Faces, lines or points with what their corners refer to.
struct ObjCells {
  CellCollector cells;
  std::array<std::vector<uint32_t>, 2> refs;  // to vt and vn; empty as long as there is none
  struct LabelRun {
    uint64_t first_cell;
    uint32_t label;
  };
  std::array<std::vector<LabelRun>, obj_label_count> labels;

  // Bytes held so far, for the limit on memory.
  uint64_t bytes() const { return cells.bytes() + (refs[0].size() + refs[1].size()) * sizeof(uint32_t); }
};

/// The names one keyword has set, numbered in the order in which cells first used them.
struct ObjLabelTable {
  std::vector<std::string> names;
  std::map<std::string, uint32_t, std::less<>> numbers;
  std::string current;
  uint32_t number = no_obj_number;  // of `current`; none until a cell uses it

  /// The number of the current name; a name counts only once a cell uses it.
  uint32_t use() {
    if (number == no_obj_number) {
      const auto [at, added] = numbers.try_emplace(current, static_cast<uint32_t>(names.size()));
      if (added) names.push_back(current);
      number = at->second;
    }
    return number;
  }
};

/// One pass over the file. What it finds out about the file as a whole goes into ObjKnowledge, for the next
/// pass.
class ObjPass {
 public:
  enum class Outcome { done, again };

  ObjPass(std::string_view text, ObjKnowledge& known, Watch& watch)
      : scanner_(text), known_(known), watch_(watch) {
    const auto wide = [&](ObjArray array) { return known.wide[static_cast<size_t>(array)]; };
    columns_ = {NumberColumn(3, wide(ObjArray::position)),
                NumberColumn(std::max(known.texcoord_components, 1u), wide(ObjArray::texcoord)),
                NumberColumn(3, wide(ObjArray::normal)),
                NumberColumn(std::max(known.colour_components, 3u), wide(ObjArray::colour)),
                NumberColumn(1, wide(ObjArray::weight))};
  }

  Result<Outcome> run() {
    scanner_.skip_byte_order_mark();
    for (scanner_.skip_white(); !scanner_.at_end() && !again_; scanner_.skip_white()) {
      MAILLE_CHECK(read_line());
      if (watch_.due(scanner_.position())) MAILLE_CHECK(watch_.at(scanner_.position(), bytes()));
    }
    if (again_) return Outcome::again;
    MAILLE_CHECK(comment_room_.check(watch_.name()));
    // A reference may come before what it refers to. Whether one is beyond the end is only known here, and
    // the next pass finds its line.
    for (size_t i = 0; i < 3; ++i) {
      if (end_of_refs_[i] <= columns_[i].count()) continue;
      known_.counts = {columns_[0].count(), columns_[1].count(), columns_[2].count()};
      return Outcome::again;
    }
    if (is_no_obj()) {
      return failure(ErrorCode::malformed_input,
                     watch_.name() + ": no vertex, face or other OBJ statement found; is it another format?");
    }
    return Outcome::done;
  }

  Mesh take_mesh(std::vector<std::string>& notes);

 private:
  NumberColumn& column(ObjArray array) { return columns_[static_cast<size_t>(array)]; }

  uint64_t bytes() const {
    uint64_t size = 0;
    for (const NumberColumn& column : columns_) size += column.bytes().size();
    for (const ObjCells& cells : cells_) size += cells.bytes();
    return size;
  }

  /// Any text reads as lines to leave out, and a stray "g" or "s" begins a line in most of them: a file
  /// without vertices or cells is only taken for OBJ when all of its lines are known and one of them is a
  /// label or a library.
  bool is_no_obj() const {
    for (const NumberColumn& column : columns_) {
      if (column.count() != 0) return false;
    }
    for (const ObjCells& cells : cells_) {
      if (cells.cells.count() != 0) return false;
    }
    const bool labels = std::find(labels_used_.begin(), labels_used_.end(), true) != labels_used_.end();
    const bool library = std::any_of(metadata_.begin(), metadata_.end(),
                                     [](const auto& pair) { return pair.first == "mtllib"; });
    return unknown_lines_ != 0 || !(labels || library);
  }

  tl::unexpected<Error> bad(const std::string& what) const {
    return malformed_line(watch_.name(), scanner_.line(), what);
  }

  Result<> read_line() {
    if (scanner_.peek() == '#') return read_comment();
    const std::string_view keyword = scanner_.word();
    if (keyword == "v") return read_vertex();
    if (keyword == "f") return read_cell(0, "face");
    if (keyword == "vt") return read_texcoord();
    if (keyword == "vn") return read_normal();
    if (keyword == "l") return read_cell(1, "line");
    if (keyword == "p") return read_cell(2, "point");
    for (size_t i = 0; i < obj_label_count; ++i) {
      if (keyword == obj_label_keywords[i]) return read_label(i);
    }
    if (keyword == "mtllib") {
      keep("mtllib", trim(scanner_.rest_of_line()));
      return {};
    }
    if (keyword == "\\" || keyword.empty()) {
      scanner_.skip_line();
      return {};
    }
    return skip_unknown(keyword);
  }

  Result<> read_comment() {
    scanner_.advance();
    std::string_view text = scanner_.rest_of_line();
    if (text.starts_with(" ")) text.remove_prefix(1);
    if (!take_hint(text)) keep("comment", text);
    return {};
  }
  void keep(const char* key, std::string_view text) {
    if (comment_room_.take(text)) metadata_.emplace_back(key, text);
  }

  /// "maille f64 position" and the like; see obj.h.
  bool take_hint(std::string_view text) {
    const bool candidate = text.starts_with("maille ");
    if (!candidate) return false;
    const auto words = split_words(text);
    if (words.size() < 3) return false;
    for (size_t i = 2; i < words.size(); ++i) {
      const auto at = std::find(std::begin(obj_array_names), std::end(obj_array_names), words[i]);
      if (at == std::end(obj_array_names)) return false;
      const auto array = static_cast<size_t>(at - std::begin(obj_array_names));
      if (words[1] == "f64") {
        again_ |= !known_.wide[array];
        known_.wide[array] = true;
      } else if (words[1] == "corners") {
        known_.on_corners[array] = true;
      } else if (words[1] == "u8") {
        known_.byte_colours = true;
      } else {
        return false;
      }
    }
    return true;
  }

  /// Reads at most 8 numbers, up to the line's end or a comment.
  Result<size_t> read_numbers(const char* element, uint64_t number, std::array<Number, 8>& numbers) {
    for (size_t count = 0;; ++count) {
      scanner_.skip_blanks_continued();
      if (scanner_.at_line_end() || scanner_.peek() == '#') {
        scanner_.skip_line();
        return count;
      }
      if (count == numbers.size() || !scanner_.number(numbers[count], '\\')) {
        return bad(
            std::string(element) + " " + std::to_string(number) + " has " +
            (count == numbers.size() ? found_at(scanner_) + " behind 8 numbers" : no_number_at(scanner_)));
      }
    }
  }

  void append(ObjArray array, const Number* numbers) {
    if (column(array).append(numbers)) return;
    known_.wide[static_cast<size_t>(array)] = true;
    again_ = true;
  }

  /// More numbers per line than seen before: another pass, unless these are the first.
  void set_components(ObjArray array, uint32_t components) {
    if (column(array).count() != 0) again_ = true;
    column(array) = NumberColumn(components, known_.wide[static_cast<size_t>(array)]);
  }

  Result<> read_vertex() {
    const uint64_t vertex = column(ObjArray::position).count();
    std::array<Number, 8> numbers;
    const uint64_t line = scanner_.line();
    const size_t count = MAILLE_TRY(read_numbers("vertex", vertex + 1, numbers));
    append(ObjArray::position, numbers.data());
    if (count == 3) return {};
    if (count == 4) {
      column(ObjArray::weight).pad(vertex);
      append(ObjArray::weight, numbers.data() + 3);
      return {};
    }
    const auto colours = static_cast<uint32_t>(count) - 3;
    if (count == 6 || count == 7) {
      if (known_.colour_components < colours) {
        known_.colour_components = colours;
        set_components(ObjArray::colour, colours);
      }
      if (known_.colour_components > colours) numbers[6] = {1, 1, true, true};  // opaque
      // The columns no longer fit what follows; this pass goes on to the line's end only.
      if (again_) return {};
      column(ObjArray::colour).pad(vertex);
      append(ObjArray::colour, numbers.data() + 3);
      return {};
    }
    return malformed_line(watch_.name(), line,
                          "vertex " + std::to_string(vertex + 1) + " has " + counted(count, "number") +
                              "; there should be 3, 4, 6 or 7");
  }

  Result<> read_texcoord() {
    std::array<Number, 8> numbers;
    const uint64_t line = scanner_.line();
    const uint64_t at = column(ObjArray::texcoord).count() + 1;
    const size_t count = MAILLE_TRY(read_numbers("texture coordinate", at, numbers));
    if (count < 1 || count > 3) {
      return malformed_line(watch_.name(), line,
                            "texture coordinate " + std::to_string(at) + " has " + counted(count, "number") +
                                "; there should be 1 to 3");
    }
    if (known_.texcoord_components < count) {
      known_.texcoord_components = static_cast<uint32_t>(count);
      set_components(ObjArray::texcoord, known_.texcoord_components);
      if (again_) return {};
    }
    append(ObjArray::texcoord, numbers.data());
    return {};
  }

  Result<> read_normal() {
    std::array<Number, 8> numbers;
    const uint64_t line = scanner_.line();
    const uint64_t at = column(ObjArray::normal).count() + 1;
    const size_t count = MAILLE_TRY(read_numbers("normal", at, numbers));
    if (count != 3) {
      return malformed_line(
          watch_.name(), line,
          "normal " + std::to_string(at) + " has " + counted(count, "number") + " instead of 3");
    }
    append(ObjArray::normal, numbers.data());
    return {};
  }

  Result<> read_cell(size_t kind, const char* what) {
    ObjCells& target = cells_[kind];
    const uint64_t cell = target.cells.count();
    const size_t before = target.cells.nodes.size();
    for (;;) {
      scanner_.skip_blanks_continued();
      if (scanner_.at_line_end() || scanner_.peek() == '#') break;
      MAILLE_CHECK(read_corner(target, what));
    }
    if (target.cells.nodes.size() == before) {
      return bad(std::string(what) + " " + std::to_string(cell + 1) + " has no vertices");
    }
    scanner_.skip_line();
    target.cells.end_cell();
    for (size_t i = 0; i < obj_label_count; ++i) {
      if (!labels_used_[i]) continue;
      const uint32_t label = labels_[i].use();
      auto& runs = target.labels[i];
      if (runs.empty() || runs.back().label != label) runs.push_back({cell, label});
    }
    return {};
  }

  /// "17", "17/3", "17/3/5", "17//5".
  Result<> read_corner(ObjCells& target, const char* what) {
    target.cells.nodes.push_back(MAILLE_TRY(read_index(0, target, what)));
    for (size_t i = 1; i < 3; ++i) {
      if (scanner_.peek() != '/') break;
      scanner_.advance();
      const char next = scanner_.peek();
      if (next == '/' || scanner_.at_line_end() || next == ' ') continue;
      auto& refs = target.refs[i - 1];
      // Corners before this one had no reference; the list is filled up only now.
      refs.resize(target.cells.nodes.size() - 1, no_obj_number);
      refs.push_back(MAILLE_TRY(read_index(i, target, what)));
    }
    const char next = scanner_.peek();
    if (scanner_.at_line_end() || next == ' ' || next == '\t' || next == '\\') return {};
    return bad_corner(target, what, found_at(scanner_) + " stands behind an index");
  }

  tl::unexpected<Error> bad_corner(const ObjCells& target, const char* what,
                                   const std::string& problem) const {
    return bad(std::string(what) + " " + std::to_string(target.cells.count() + 1) + ": " + problem);
  }

  Result<uint32_t> read_index(size_t i, const ObjCells& target, const char* what) {
    static constexpr const char* names[] = {"vertex", "texture coordinate", "normal"};
    const char* p = scanner_.here();
    const bool negative = p != scanner_.end() && *p == '-';
    if (negative) ++p;
    const char* const first = p;
    uint64_t value = 0;
    // Stops at numbers beyond all that are allowed, before they could overflow.
    for (; p != scanner_.end() && *p >= '0' && *p <= '9' && value < no_obj_number; ++p) {
      value = value * 10 + static_cast<uint64_t>(*p - '0');
    }
    if (p == first) return bad_corner(target, what, found_at(scanner_) + " stands where an index belongs");
    const uint64_t count = columns_[i].count();
    const auto missing = [&](uint64_t there) {
      return bad_corner(target, what,
                        std::string(names[i]) + " " + (negative ? "-" : "") + std::to_string(value) +
                            " does not exist, there are " + std::to_string(there));
    };
    if (value == 0) return bad_corner(target, what, std::string(names[i]) + " 0; OBJ counts from 1");
    if (negative && value > count) return missing(count);
    // Negative numbers count back from the last one read so far.
    const uint64_t index = negative ? count - value : value - 1;
    if (known_.counts && index >= (*known_.counts)[i]) return missing((*known_.counts)[i]);
    if (index >= max_points) return missing(count);
    end_of_refs_[i] = std::max(end_of_refs_[i], index + 1);
    scanner_.jump(p);
    return static_cast<uint32_t>(index);
  }

  Result<> read_label(size_t kind) {
    labels_[kind].current = trim(scanner_.rest_of_line());
    labels_[kind].number = no_obj_number;
    if (!labels_used_[kind]) {
      labels_used_[kind] = true;
      // Cells read so far had no label of this kind: the empty one.
      for (ObjCells& cells : cells_) {
        if (cells.cells.count() != 0) cells.labels[kind].push_back({0, unnamed(kind)});
      }
    }
    return {};
  }
  // Makes the empty name the first of the table, number 0. It is called before any cell has used a name.
  uint32_t unnamed(size_t kind) {
    ObjLabelTable& table = labels_[kind];
    if (table.names.empty()) {
      table.names.emplace_back();
      table.numbers.emplace("", 0);
    }
    return 0;
  }

  Result<> skip_unknown(std::string_view keyword) {
    if (unknown_lines_++ == 0) {
      first_unknown_ = to_word(keyword.substr(0, 40));
      first_unknown_line_ = scanner_.line();
    }
    scanner_.skip_line();
    return {};
  }

  static void note_libraries(const Mesh& mesh, std::vector<std::string>& notes);
  void take_blocks(Mesh& mesh);
  void take_labels(Mesh& mesh);
  void take_references(Mesh& mesh, size_t kind, std::vector<std::string>& notes);
  Array gather(size_t kind, std::vector<std::string>& notes) const;
  void take_point_arrays(Mesh& mesh, std::vector<std::string>& notes);

  TextScanner scanner_;
  ObjKnowledge& known_;
  Watch& watch_;
  bool again_ = false;
  std::array<NumberColumn, obj_array_count> columns_;
  std::array<ObjCells, 3> cells_;  // faces, lines, points
  std::array<uint64_t, 3> end_of_refs_{};
  std::array<ObjLabelTable, obj_label_count> labels_;
  std::array<bool, obj_label_count> labels_used_{};
  std::vector<std::pair<std::string, std::string>> metadata_;
  CommentRoom comment_room_;
  uint64_t unknown_lines_ = 0;
  std::string first_unknown_;
  uint64_t first_unknown_line_ = 0;
};

}  // namespace maille
