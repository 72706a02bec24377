// OBJ files of points and faces, written row by row as binary PLY into temporary files, without the mesh in
// memory: what scanners write. Files that hold more (groups, materials, references of corners) end as
// `unsupported` and are read whole. The result has to be the same as that of reading the file whole.
#include <array>
#include <optional>

#include "base/pace.h"
#include "io/converted_surface.h"
#include "io/obj/obj.h"
#include "io/reading.h"
#include "io/text_scanner.h"

namespace maille {
namespace {

// Comments are kept in memory and go into the header of the PLY file; a source of PLY reads no header above 1
// MiB.
constexpr size_t most_comments = size_t{512} << 10;

/// What a first pass finds out.
struct ObjShape {
  uint64_t points = 0, texcoords = 0, normals = 0, faces = 0;
  size_t position_numbers = 0;  ///< on every line: 3, or 6 and 7 with colours
  size_t texcoord_numbers = 0;
  std::array<bool, 4> wide{};  ///< positions, texture coordinates, normals, colours
  unsigned references = 0;     ///< of corners: 1 with texture coordinates, 2 with normals
  std::vector<std::pair<std::string, std::string>> comments;
};

// Two passes: the first finds out counts and types, which a binary file needs in front, the second writes.
class ObjConverter {
 public:
  ObjConverter(const Source& source, const PartsOptions& options) : source_(source), options_(options) {}

  Result<ConvertedSurface> run() {
    MAILLE_CHECK(pass("looking through the file"));
    MAILLE_CHECK(check_shape());
    surface_.emplace(MAILLE_TRY(ConvertedSurface::create(options_.folder)));
    // Normals and texture coordinates stand behind the positions, mostly, but a row of PLY holds all three:
    // they are written into files of their own and joined at the end.
    if (shape_.texcoords > 0) texcoords_.emplace(MAILLE_TRY(ScratchFile::create(options_.folder)));
    if (shape_.normals > 0) normals_.emplace(MAILLE_TRY(ScratchFile::create(options_.folder)));
    const bool beside = texcoords_ || normals_;
    if (beside) positions_.emplace(MAILLE_TRY(ScratchFile::create(options_.folder)));
    points_ = 0;
    MAILLE_CHECK(pass("reading"));
    if (beside) MAILLE_CHECK(join_points());
    write_header();
    return *std::move(surface_);
  }

 private:
  bool first_pass() const { return !surface_; }
  tl::unexpected<Error> bad(const TextScanner& scanner, const std::string& what) const {
    return malformed_line(source_.name(), scanner.line(), what);
  }
  tl::unexpected<Error> unknown(const TextScanner& scanner, const std::string& what) const {
    return not_in_parts(source_, "line " + std::to_string(scanner.line()) + ": " + what);
  }

  Result<> pass(const char* stage) {
    LineBlocks lines(source_, 0);
    uint64_t line = 1;
    // Blocks end at line ends, so each is scanned on its own; only the number of the line goes on.
    for (bool begin = true; !lines.at_end(); begin = false) {
      if (options_.progress && !options_.progress({stage, static_cast<double>(lines.position()) /
                                                              static_cast<double>(source_.size())}))
        return cancelled();
      TextScanner scanner(MAILLE_TRY(lines.read()), line);
      if (begin) scanner.skip_byte_order_mark();
      for (scanner.skip_white(); !scanner.at_end(); scanner.skip_white()) MAILLE_CHECK(read_line(scanner));
      line = scanner.line();
    }
    return {};
  }

  Result<> read_line(TextScanner& scanner) {
    if (scanner.peek() == '#') return read_comment(scanner);
    const std::string_view word = scanner.word();
    if (word == "v") return read_position(scanner);
    if (word == "f") return read_face(scanner);
    if (word == "vn") return read_tuple(scanner, 3, 2, shape_.normals, normals_);
    if (word == "vt") return read_tuple(scanner, 0, 1, shape_.texcoords, texcoords_);
    if (word == "mtllib") {
      const std::string_view name = trim(scanner.rest_of_line());
      if (first_pass()) keep_comment("comment", format_ply_metadata("mtllib", std::string(name)));
      return {};
    }
    return unknown(scanner, "\"" + std::string(word.substr(0, 20)) + "\" (groups, materials, lines, points)");
  }

  Result<> read_comment(TextScanner& scanner) {
    scanner.advance();
    std::string_view text = scanner.rest_of_line();
    if (text.starts_with(" ")) text.remove_prefix(1);
    // Hints change the types of arrays, which only the reader of whole files knows.
    if (text.starts_with("maille ")) return unknown(scanner, "a hint of maille");
    if (first_pass()) keep_comment("comment", text);
    return comment_bytes_ > most_comments ? unknown(scanner, "so many comments") : Result<>();
  }
  void keep_comment(const char* key, std::string_view text) {
    // 16 bytes stand for the keyword and the line's end around the text.
    comment_bytes_ += text.size() + 16;
    shape_.comments.emplace_back(key, text);
  }

  /// Up to the end of the line. Error: malformed_input.
  Result<size_t> read_numbers(TextScanner& scanner, std::array<Number, 8>& numbers) {
    for (size_t count = 0;; ++count) {
      scanner.skip_blanks_continued();
      if (scanner.at_line_end() || scanner.peek() == '#') {
        scanner.rest_of_line();
        return count;
      }
      if (count == numbers.size() || !scanner.number(numbers[count], '\\'))
        return bad(scanner, no_number_at(scanner));
    }
  }
  void widen(size_t array, std::span<const Number> numbers) {
    for (const Number& number : numbers) shape_.wide[array] = shape_.wide[array] || !number.fits_single;
  }
  void put(size_t array, std::span<const Number> numbers) {
    for (const Number& number : numbers) {
      if (shape_.wide[array]) {
        put_number(row_, number.value);
      } else {
        put_number(row_, number.single);
      }
    }
  }

  Result<> read_position(TextScanner& scanner) {
    std::array<Number, 8> numbers;
    const size_t count = MAILLE_TRY(read_numbers(scanner, numbers));
    if (count != 3 && count != 6 && count != 7)
      return unknown(scanner, "a point of other than 3, 6 or 7 numbers");
    const auto all = std::span(numbers);
    ++points_;
    if (first_pass()) {
      if (shape_.position_numbers != 0 && shape_.position_numbers != count)
        return unknown(scanner, "points that have colours beside others");
      shape_.position_numbers = count;
      shape_.points = points_;
      widen(0, all.first(3));
      widen(3, all.subspan(3, count - 3));
      return {};
    }
    row_.clear();
    put(0, all.first(3));
    put(3, all.subspan(3, count - 3));
    return (positions_ ? *positions_ : surface_->points).append(row_);
  }

  /// `expected`: numbers, 0 for one to three.
  Result<> read_tuple(TextScanner& scanner, size_t expected, size_t array, uint64_t& tuples,
                      std::optional<ScratchFile>& file) {
    std::array<Number, 8> numbers;
    const size_t count = MAILLE_TRY(read_numbers(scanner, numbers));
    if (count == 0 || count > 3 || (expected != 0 && count != expected))
      return unknown(scanner, "so many numbers");
    const auto all = std::span(numbers).first(count);
    if (first_pass()) {
      if (array == 1 && shape_.texcoord_numbers != 0 && shape_.texcoord_numbers != count)
        return unknown(scanner, "texture coordinates of different numbers");
      if (array == 1) shape_.texcoord_numbers = count;
      ++tuples;
      widen(array, all);
      return {};
    }
    row_.clear();
    put(array, all);
    return file->append(row_);
  }

  Result<> read_face(TextScanner& scanner) {
    corners_.clear();
    for (scanner.skip_blanks_continued(); !scanner.at_line_end() && scanner.peek() != '#';
         scanner.skip_blanks_continued()) {
      MAILLE_CHECK(read_corner(scanner));
    }
    scanner.rest_of_line();
    if (corners_.empty()) return bad(scanner, "a face without vertices");
    // A row holds the number of corners as one byte.
    if (corners_.size() > 255) return unknown(scanner, "a face of more than 255 corners");
    if (first_pass()) {
      ++shape_.faces;
      return {};
    }
    row_.clear();
    put_number(row_, static_cast<uint8_t>(corners_.size()));
    for (const uint64_t corner : corners_) {
      if (corner >= shape_.points) {
        return bad(scanner, "vertex " + std::to_string(corner + 1) + " does not exist, there are " +
                                std::to_string(shape_.points));
      }
      put_number(row_, static_cast<uint32_t>(corner));
    }
    return surface_->faces.append(row_);
  }

  /// "17", "17/17", "17/17/17", "17//17": all three must be the same.
  Result<> read_corner(TextScanner& scanner) {
    const uint64_t corner = MAILLE_TRY(read_index(scanner, points_));
    corners_.push_back(corner);
    unsigned references = 0;
    for (unsigned kind = 1; kind < 3 && scanner.peek() == '/'; ++kind) {
      scanner.advance();
      const char next = scanner.peek();
      if (next == '/' || next == ' ' || scanner.at_line_end()) continue;
      // Counted backwards they depend on how many there were so far, which the check for equal numbers does
      // not know.
      if (next == '-') return unknown(scanner, "texture coordinates or normals counted backwards");
      if (MAILLE_TRY(read_index(scanner, 0)) != corner)
        return unknown(scanner, "texture coordinates or normals of corners, not of points,");
      references |= kind;
    }
    // The first corner of the file says what all must have.
    if (first_pass() && shape_.faces == 0 && corners_.size() == 1) shape_.references = references;
    if (references != shape_.references)
      return unknown(scanner, "corners with texture coordinates or normals beside others");
    const char next = scanner.peek();
    if (scanner.at_line_end() || next == ' ' || next == '\t' || next == '\\') return {};
    return bad(scanner, found_at(scanner) + " stands behind an index");
  }
  // `behind`: how many there are so far, for negative numbers.
  Result<uint64_t> read_index(TextScanner& scanner, uint64_t behind) {
    const bool negative = scanner.peek() == '-';
    if (negative) scanner.advance();
    uint64_t value = 0;
    const char* const first = scanner.here();
    const char* p = first;
    for (; p != scanner.end() && *p >= '0' && *p <= '9' && value < max_points; ++p)
      value = value * 10 + static_cast<uint64_t>(*p - '0');
    if (p == first || value == 0 || value > max_points || (negative && value > behind))
      return bad(scanner, found_at(scanner) + " stands where the number of a vertex belongs");
    scanner.jump(p);
    return negative ? behind - value : value - 1;
  }

  Result<> check_shape() const {
    const auto fits = [&](uint64_t tuples, unsigned kind) {
      const bool used = (shape_.references & kind) != 0;
      return used == (tuples > 0) && (!used || tuples == shape_.points);
    };
    if (!fits(shape_.texcoords, 1) || !fits(shape_.normals, 2))
      return not_in_parts(source_, "another number of texture coordinates or normals than points");
    if (shape_.points > max_points) return not_in_parts(source_, "more than 2^32 points");
    return {};
  }

  /// Appends positions, then what the reader of whole files has behind them. Colours are beside positions
  /// already, as they stand on the same line.
  Result<> join_points() {
    Pace pace(options_.progress, "joining points", shape_.points);
    std::array<ScratchFile*, 3> files{&*positions_, texcoords_ ? &*texcoords_ : nullptr,
                                      normals_ ? &*normals_ : nullptr};
    const auto size = [&](size_t array, size_t numbers) { return numbers * (shape_.wide[array] ? 8 : 4); };
    const std::array<size_t, 3> sizes{size(0, 3) + size(3, shape_.position_numbers - 3),
                                      size(1, shape_.texcoord_numbers), size(2, 3)};
    // Points that are in memory at once; the number was chosen, not swept.
    constexpr uint64_t at_once = 1 << 16;
    std::array<std::vector<std::byte>, 3> tuples;
    for (uint64_t first = 0; first < shape_.points; first += at_once) {
      const uint64_t count = std::min(at_once, shape_.points - first);
      for (size_t f = 0; f < 3; ++f) {
        if (files[f] == nullptr) continue;
        tuples[f].resize(count * sizes[f]);
        MAILLE_CHECK(files[f]->read_at(first * sizes[f], tuples[f]));
      }
      for (uint64_t i = 0; i < count; ++i) {
        for (size_t f = 0; f < 3; ++f) {
          if (files[f] == nullptr) continue;
          MAILLE_CHECK(surface_->points.append(Bytes(tuples[f]).subspan(i * sizes[f], sizes[f])));
        }
        if (!pace.step()) return cancelled();
      }
    }
    return {};
  }

  void write_header() {
    PlyHeader& header = surface_->header;
    header.encoding = PlyEncoding::little_endian;
    header.comments = std::move(shape_.comments);
    PlyElement vertex{"vertex", shape_.points, {}};
    const auto add = [&](size_t array, size_t numbers, std::initializer_list<const char*> names) {
      for (const char* name : names) {
        if (numbers-- == 0) return;
        vertex.properties.push_back(
            {name, shape_.wide[array] ? Scalar::f64 : Scalar::f32, false, Scalar::u8});
      }
    };
    add(0, 3, {"x", "y", "z"});
    // A file without points has no numbers on them either.
    add(3, shape_.position_numbers < 3 ? 0 : shape_.position_numbers - 3, {"red", "green", "blue", "alpha"});
    // The hint tells the reader of PLY which properties form one array, and its name.
    const auto hint = [&](ObjArray array, size_t numbers, std::initializer_list<const char*> names) {
      const auto a = static_cast<size_t>(array);
      PlyHint made{"vertex",
                   obj_array_names[a],
                   shape_.wide[a] ? Scalar::f64 : Scalar::f32,
                   static_cast<uint32_t>(numbers),
                   obj_array_roles[a],
                   {}};
      for (const char* name : names) {
        if (made.properties.size() < numbers) made.properties.emplace_back(name);
      }
      header.comments.emplace_back("comment", format_ply_hint(made));
      add(a, numbers, names);
    };
    if (texcoords_) hint(ObjArray::texcoord, shape_.texcoord_numbers, {"s", "t", "u"});
    if (normals_) hint(ObjArray::normal, 3, {"nx", "ny", "nz"});
    // Indices are signed where that is enough, and unsigned for more points.
    const bool signed_fits = shape_.points < uint64_t{1} << 31;
    header.elements.push_back(std::move(vertex));
    if (shape_.faces == 0) return;
    PlyElement face{"face", shape_.faces, {}};
    face.properties.push_back({"vertex_indices", signed_fits ? Scalar::i32 : Scalar::u32, true, Scalar::u8});
    header.elements.push_back(std::move(face));
  }

  const Source& source_;
  const PartsOptions& options_;
  ObjShape shape_;
  uint64_t points_ = 0;  ///< so far, in this pass
  size_t comment_bytes_ = 0;
  std::vector<uint64_t> corners_;
  std::vector<std::byte> row_;
  std::optional<ConvertedSurface> surface_;  ///< none in the first pass
  std::optional<ScratchFile> positions_, texcoords_, normals_;
};

}  // namespace

Result<ConvertedSurface> convert_obj(const Source& source, const PartsOptions& options) {
  return ObjConverter(source, options).run();
}

}  // namespace maille
