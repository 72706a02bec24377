#include <algorithm>
#include <array>
#include "io/cells.h"
#include "io/format.h"
#include "io/number_column.h"
#include "io/off/off.h"
#include "io/ply/ply.h"
#include "io/reading.h"
#include "io/text_scanner.h"

namespace maille {
namespace {

// Which arrays need doubles: found out by passes, as in OBJ.
using Wide = std::array<bool, off_array_count>;

/// What the header's keyword says vertices have.
struct OffHeader {
  bool texcoord = false;
  bool colour = false;
  bool normal = false;
  bool weight = false;
  bool binary = false;
  uint64_t vertices = 0;
  uint64_t faces = 0;
};

/// Takes the letters before "OFF", in any order; false when there are others.
bool parse_prefix(std::string_view prefix, OffHeader& header) {
  while (!prefix.empty()) {
    if (prefix.starts_with("ST")) {
      header.texcoord = true;
      // One letter here and one below, where the others have one.
      prefix.remove_prefix(1);
    } else if (prefix[0] == 'C') {
      header.colour = true;
    } else if (prefix[0] == 'N') {
      header.normal = true;
    } else if (prefix[0] == '4') {
      header.weight = true;
    } else {
      return false;
    }
    prefix.remove_prefix(1);
  }
  return true;
}

/// One pass over a text file; it ends early when an array turns out to need doubles.
class OffPass {
 public:
  OffPass(std::string_view text, Wide& wide, Watch& watch) : scanner_(text), wide_(wide), watch_(watch) {}

  /// False: another pass is needed.
  Result<bool> run() {
    scanner_.skip_byte_order_mark();
    MAILLE_CHECK(read_header());
    if (again_) return false;
    for (uint64_t vertex = 0; vertex < header_.vertices && !again_; ++vertex) {
      MAILLE_CHECK(read_vertex(vertex));
      if (watch_.due(scanner_.position())) MAILLE_CHECK(watch_.at(scanner_.position(), bytes()));
    }
    for (uint64_t face = 0; face < header_.faces && !again_; ++face) {
      MAILLE_CHECK(read_face(face));
      if (watch_.due(scanner_.position())) MAILLE_CHECK(watch_.at(scanner_.position(), bytes()));
    }
    if (again_) return false;
    skip_to_data();
    MAILLE_CHECK(comment_room_.check(watch_.name()));
    if (!scanner_.at_end())
      notes_.push_back("text behind the last face, from line " + std::to_string(scanner_.line()) +
                       " on, left out");
    return !again_;
  }

  ReadResult take();

 private:
  tl::unexpected<Error> bad(const std::string& what) const {
    return malformed_line(watch_.name(), scanner_.line(), what);
  }
  NumberColumn& column(OffArray array) { return columns_[static_cast<size_t>(array)]; }
  bool wide(OffArray array) const { return wide_[static_cast<size_t>(array)]; }

  // What is kept so far, which the limit is held against.
  uint64_t bytes() const {
    uint64_t size = faces_.bytes() + face_colours_.bytes();
    for (const NumberColumn& column : columns_) size += column.bytes().size();
    return size;
  }

  /// Skips white space and comments, keeping these.
  void skip_to_data() {
    for (scanner_.skip_white(); scanner_.peek() == '#'; scanner_.skip_white()) read_comment();
  }
  void read_comment() {
    scanner_.advance();
    std::string_view text = scanner_.rest_of_line();
    if (text.starts_with(" ")) text.remove_prefix(1);
    if (!take_hint(text) && comment_room_.take(text)) metadata_.emplace_back("comment", text);
  }
  bool take_hint(std::string_view text) {
    if (!text.starts_with("maille f64 ")) return false;
    const auto words = split_words(text);
    for (size_t i = 2; i < words.size(); ++i) {
      const auto at = std::find(std::begin(off_array_names), std::end(off_array_names), words[i]);
      if (at == std::end(off_array_names)) return false;
      bool& wide = wide_[static_cast<size_t>(at - std::begin(off_array_names))];
      again_ |= !wide;
      wide = true;
    }
    return true;
  }

  Result<> read_header() {
    skip_to_data();
    const std::string_view keyword = scanner_.look('#');
    if (keyword.ends_with("OFF")) {
      scanner_.word('#');
      std::string_view prefix = keyword.substr(0, keyword.size() - 3);
      const bool any_dimension = prefix.ends_with('n');
      if (any_dimension) prefix.remove_suffix(1);
      if (!parse_prefix(prefix, header_)) return bad("unknown keyword \"" + to_word(keyword) + "\"");
      scanner_.skip_blanks();
      if (scanner_.look('#') == "BINARY") {
        return failure(ErrorCode::unsupported,
                       watch_.name() + ": binary OFF is not supported; convert it to text");
      }
      skip_to_data();
      uint64_t dimension = 3;
      if (any_dimension && (!scanner_.integer(dimension, '#') || dimension != 3)) {
        return bad("nOFF with a dimension other than 3 is not supported");
      }
      // The keyword may be missing: then the file begins with the counts.
    } else if (keyword.empty() || keyword[0] < '0' || keyword[0] > '9') {
      return bad(found_at(scanner_) + " stands where the keyword OFF belongs");
    }
    return read_counts();
  }

  Result<> read_counts() {
    for (uint64_t* count : {&header_.vertices, &header_.faces}) {
      skip_to_data();
      if (!scanner_.integer(*count, '#')) {
        return bad(found_at(scanner_) + " stands where the number of " +
                   (count == &header_.vertices ? "vertices" : "faces") + " belongs");
      }
    }
    if (header_.vertices > max_points) return bad("more than 2^32 - 2 vertices");
    scanner_.skip_blanks();
    uint64_t edges = 0;  // often wrong, never needed
    if (!scanner_.at_line_end() && scanner_.peek() != '#' && !scanner_.integer(edges, '#')) {
      return bad(found_at(scanner_) + " stands where the number of edges belongs");
    }
    columns_ = {NumberColumn(3, wide(OffArray::position)), NumberColumn(1, wide(OffArray::weight)),
                NumberColumn(3, wide(OffArray::normal)),   NumberColumn(4, wide(OffArray::colour)),
                NumberColumn(2, wide(OffArray::texcoord)), NumberColumn(1, wide(OffArray::face_colour))};
    return {};
  }

  // Appends a tuple and moves on behind it.
  void append(OffArray array, const Number*& numbers) {
    if (!column(array).append(numbers)) {
      wide_[static_cast<size_t>(array)] = true;
      again_ = true;
    }
    numbers += column(array).components();
  }

  static bool is_byte(const Number& number) {
    return number.integer && number.value >= 0 && number.value <= 255;
  }

  Result<> read_vertex(uint64_t vertex) {
    skip_to_data();
    if (scanner_.at_end()) {
      return bad("the file ends at vertex " + std::to_string(vertex) + " of " +
                 std::to_string(header_.vertices));
    }
    // The most that a keyword can ask for is 13: four of the position, three of the normal, four of the
    // colour, two of the texture.
    std::array<Number, 16> numbers;
    size_t count = 0;
    for (; !scanner_.at_line_end() && scanner_.peek() != '#'; scanner_.skip_blanks()) {
      if (count == numbers.size() || !scanner_.number(numbers[count], '#')) {
        return bad("vertex " + std::to_string(vertex) + " has " + no_number_at(scanner_));
      }
      ++count;
    }
    const size_t needed =
        3 + (header_.weight ? 1u : 0u) + (header_.normal ? 3u : 0u) + (header_.texcoord ? 2u : 0u);
    // What is more than the keyword asks for is a colour, even without a "C".
    if (vertex == 0 && count >= needed) set_colour_components(count - needed);
    if (count != needed + colour_components_) {
      return bad("vertex " + std::to_string(vertex) + " has " + counted(count, "number") + " instead of " +
                 std::to_string(needed + colour_components_));
    }
    const Number* next = numbers.data();
    append(OffArray::position, next);
    if (header_.weight) append(OffArray::weight, next);
    if (header_.normal) append(OffArray::normal, next);
    if (colour_components_ != 0) {
      byte_colours_ = byte_colours_ && std::all_of(next, next + colour_components_, is_byte);
      append(OffArray::colour, next);
    }
    if (header_.texcoord) append(OffArray::texcoord, next);
    return {};
  }

  /// The first vertex tells how many numbers a colour has.
  void set_colour_components(size_t extra) {
    if (extra != 3 && extra != 4) return;
    if (!header_.colour) notes_.push_back("vertices have colours although the keyword does not say so");
    colour_components_ = extra;
    column(OffArray::colour) = NumberColumn(static_cast<uint32_t>(extra), wide(OffArray::colour));
  }

  Result<> read_face(uint64_t face) {
    skip_to_data();
    const auto bad_face = [&](const std::string& what) { return bad("face " + std::to_string(face) + what); };
    if (scanner_.at_end())
      return bad("the file ends at face " + std::to_string(face) + " of " + std::to_string(header_.faces));
    uint64_t degree = 0;
    if (!scanner_.integer(degree, '#'))
      return bad_face(" has " + found_at(scanner_) + " where its degree belongs");
    for (uint64_t i = 0; i < degree; ++i) {
      // The corners of a face may go on in the next line; its colour may not, since nothing says whether
      // there is one.
      scanner_.skip_white('#');
      int64_t node = 0;
      if (!scanner_.integer(node, '#')) {
        return bad_face(" has " + found_at(scanner_) + " where vertex " + std::to_string(i + 1) + " of " +
                        std::to_string(degree) + " belongs");
      }
      if (node < 0 || static_cast<uint64_t>(node) >= header_.vertices) {
        return bad_face(": vertex " + std::to_string(node) + " does not exist, there are " +
                        std::to_string(header_.vertices));
      }
      faces_.nodes.push_back(static_cast<uint32_t>(node));
    }
    faces_.end_cell();
    return read_face_colour(face);
  }

  Result<> read_face_colour(uint64_t face) {
    uint64_t count = 0;
    for (scanner_.skip_blanks(); !scanner_.at_line_end() && scanner_.peek() != '#'; scanner_.skip_blanks()) {
      Number number;
      if (count == 4 || !scanner_.number(number, '#')) {
        return bad("face " + std::to_string(face) + " has " + found_at(scanner_) + " behind its " +
                   (count == 4 ? "colour" : "vertices"));
      }
      byte_face_colours_ = byte_face_colours_ && is_byte(number);
      // 2e9 keeps the number within 32 bits.
      index_face_colours_ = index_face_colours_ && number.integer && std::fabs(number.value) < 2e9;
      const Number* next = &number;
      // Numbers are kept one behind the other, with the count of each face beside them; take_face_colours()
      // makes an array of them.
      append(OffArray::face_colour, next);
      ++count;
    }
    face_colours_.add(count);
    return {};
  }

  void take_face_colours(Mesh& mesh);

  TextScanner scanner_;
  Wide& wide_;
  Watch& watch_;
  bool again_ = false;
  OffHeader header_;
  size_t colour_components_ = 0;
  bool byte_colours_ = true;
  bool byte_face_colours_ = true;
  bool index_face_colours_ = true;
  std::array<NumberColumn, off_array_count> columns_;
  CellCollector faces_;
  Lengths face_colours_;
  std::vector<std::pair<std::string, std::string>> metadata_;
  CommentRoom comment_room_;
  std::vector<std::string> notes_;
};

/// An array of the same values in another type that holds them.
template <class To>
Array converted(const Array& from, Scalar type) {
  Array array = make_array(from.name, from.domain, type, from.components, from.role);
  array.resize(from.count());
  const std::span<To> to = array.values<To>();
  for (size_t i = 0; i < to.size(); ++i) {
    to[i] = from.type == Scalar::f32 ? static_cast<To>(from.values<float>()[i])
                                     : static_cast<To>(from.values<double>()[i]);
  }
  return array;
}

ReadResult OffPass::take() {
  ReadResult result;
  Mesh& mesh = result.mesh;
  mesh.metadata = std::move(metadata_);
  mesh.points = column(OffArray::position).take("position", Domain::point, Role::none);
  const auto add = [&](OffArray array, Role role) {
    if (column(array).count() != 0) {
      mesh.arrays.push_back(
          column(array).take(off_array_names[static_cast<size_t>(array)], Domain::point, role));
    }
  };
  add(OffArray::weight, Role::none);
  add(OffArray::normal, Role::normal);
  add(OffArray::colour, Role::colour);
  // The array added last is that of the colours.
  if (colour_components_ != 0 && byte_colours_ && header_.vertices != 0) {
    mesh.arrays.back() = converted<uint8_t>(mesh.arrays.back(), Scalar::u8);
  }
  add(OffArray::texcoord, Role::texture_coordinate);
  if (column(OffArray::face_colour).count() != 0) take_face_colours(mesh);
  if (faces_.count() != 0) mesh.blocks.push_back(faces_.take_faces());
  result.notes = std::move(notes_);
  return result;
}

/// Pads the colours of all faces to the same number of components.
void OffPass::take_face_colours(Mesh& mesh) {
  uint64_t longest = 0;
  for (uint64_t face = 0; face < faces_.count(); ++face)
    longest = std::max(longest, face_colours_.length(face));
  const NumberColumn& values = column(OffArray::face_colour);
  const bool index = longest == 1;
  Array colours = make_array(index ? "colour_index" : "colour", Domain::cell, values.type(),
                             static_cast<uint32_t>(longest), index ? Role::none : Role::colour);
  colours.resize(faces_.count());
  const size_t size = size_of(values.type());
  // Faces with fewer numbers than others are filled with zeros, and the counts tell which ones.
  Array counts = make_array(colours.name + ".count", Domain::cell, Scalar::u8, 1);
  for (uint64_t face = 0; face < faces_.count(); ++face) {
    const uint64_t length = face_colours_.length(face);
    counts.bytes.push_back(static_cast<std::byte>(length));
    if (length == 0) continue;
    std::memcpy(colours.bytes.data() + face * colours.tuple_size(),
                values.bytes().data() + face_colours_.begin(face) * size, length * size);
  }
  if (index && index_face_colours_) {
    colours = converted<int32_t>(colours, Scalar::i32);
  } else if (!index && byte_face_colours_) {
    colours = converted<uint8_t>(colours, Scalar::u8);
  }
  const bool uniform = face_colours_.uniform();
  mesh.arrays.push_back(std::move(colours));
  if (!uniform) mesh.arrays.push_back(std::move(counts));
}

bool recognise(Bytes first) {
  TextScanner scanner(std::string_view(reinterpret_cast<const char*>(first.data()), first.size()));
  scanner.skip_white('#');
  const std::string_view word = scanner.word('#');
  OffHeader header;
  if (!word.ends_with("OFF")) return false;
  std::string_view prefix = word.substr(0, word.size() - 3);
  if (prefix.ends_with('n')) prefix.remove_suffix(1);
  return parse_prefix(prefix, header);
}

}  // namespace

Result<ReadResult> read_off(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  Watch watch(source, input.bytes().size(), options);
  Wide wide{};
  for (;;) {  // at most once per array, since a pass that asks for another has found one that is wide
    OffPass pass(input.text(), wide, watch);
    if (!MAILLE_TRY(pass.run())) {
      watch.restart();
      continue;
    }
    ReadResult result = pass.take();
    MAILLE_CHECK(watch.at(input.bytes().size(), size_in_memory(result.mesh)));
    return result;
  }
}

const Format& off_format() {
  static const Format format{{"off", {".off", ".coff", ".noff", ".cnoff"}, "Object File Format, text", true},
                             recognise,
                             read_off,
                             write_off};
  return format;
}

}  // namespace maille
