#include <algorithm>
#include "base/bytes.h"
#include "io/format.h"
#include "io/number_column.h"
#include "io/stl/stl.h"
#include "io/text_scanner.h"
#include "io/tuple_index.h"

namespace maille {
namespace {

bool is_all_zero(const std::vector<std::byte>& bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](std::byte b) { return b == std::byte{0}; });
}

// Are these, bit for bit, the normals that the writer would compute? Then they need not be kept.
template <class T>
bool normals_are_computed(const Mesh& mesh, const std::vector<std::byte>& normals) {
  const std::span<const T> points = mesh.points.values<T>();
  const Buffer<uint32_t>& nodes = mesh.blocks.front().connectivity;
  for (size_t facet = 0; facet * 3 < nodes.size(); ++facet) {
    std::array<std::array<T, 3>, 3> corners;
    for (size_t i = 0; i < 3; ++i) {
      const size_t at = size_t{nodes[facet * 3 + i]} * 3;
      corners[i] = {points[at], points[at + 1], points[at + 2]};
    }
    const std::array<T, 3> normal = facet_normal<T>(corners);
    if (std::memcmp(normal.data(), normals.data() + facet * sizeof normal, sizeof normal) != 0) return false;
  }
  return true;
}

/// Makes a mesh of welded corners and says what was done with the normals, one for each facet. Zero normals
/// are looked at first: facets without area have computed normals that are zero as well.
void finish(ReadResult& result, TupleIndex& points, std::vector<uint32_t> nodes, Scalar type,
            std::vector<std::byte> normals) {
  Mesh& mesh = result.mesh;
  mesh.points = make_array("position", Domain::point, type, 3);
  mesh.points.bytes = points.take_tuples();
  result.notes.insert(result.notes.begin(), "welded " + counted(nodes.size(), "corner") + " into " +
                                                counted(mesh.point_count(), "point") +
                                                " (equal bit for bit)");
  if (nodes.empty()) return;
  CellBlock block;
  block.type = CellType::triangle;
  block.connectivity = std::move(nodes);
  mesh.blocks.push_back(std::move(block));
  if (is_all_zero(normals)) {
    mesh.metadata.emplace_back("stl.normals", "zero");
    result.notes.push_back("all facet normals are zero");
  } else if (type == Scalar::f32 ? normals_are_computed<float>(mesh, normals)
                                 : normals_are_computed<double>(mesh, normals)) {
    result.notes.push_back("facet normals follow from the positions; left out");
  } else {
    Array array = make_array("normal", Domain::cell, type, 3, Role::normal);
    array.bytes = std::move(normals);
    mesh.arrays.push_back(std::move(array));
    result.notes.push_back("facet normals are not exactly those of the positions; kept as an array on cells");
  }
}

Result<ReadResult> read_binary(Bytes bytes, Watch& watch) {
  // The caller has checked that the header is there.
  const uint64_t count = load<uint32_t>(bytes.data() + 80);
  const uint64_t there = (bytes.size() - stl_header_size) / stl_facet_size;
  if (there < count) {
    return malformed_byte(
        watch.name(), bytes.size(),
        "the file ends inside facet " + std::to_string(there) + " of " + std::to_string(count));
  }
  ReadResult result;
  // A closed surface of triangles has about half as many points as facets.
  TupleIndex points(12, count / 2 + 8);
  // `count` was held against the bytes that are there, 50 for each facet.
  std::vector<uint32_t> nodes(count * 3);
  std::vector<std::byte> normals(count * 12);
  std::vector<std::byte> attributes(count * 2);
  const std::byte* from = bytes.data() + stl_header_size;
  for (uint64_t facet = 0; facet < count; ++facet, from += stl_facet_size) {
    std::memcpy(normals.data() + facet * 12, from, 12);
    for (size_t i = 0; i < 3; ++i) nodes[facet * 3 + i] = points.number_of(from + 12 + i * 12);
    std::memcpy(attributes.data() + facet * 2, from + 48, 2);
    const uint64_t at = stl_header_size + facet * stl_facet_size;
    // 26 bytes a facet: three node numbers, the normal and the attribute, all allocated above.
    if (watch.due(at)) MAILLE_CHECK(watch.at(at, count * 26 + points.tuples().size()));
  }
  if (there * stl_facet_size + stl_header_size < bytes.size() || there > count) {
    result.notes.push_back(counted(bytes.size() - stl_header_size - count * stl_facet_size, "byte") +
                           " behind the last facet left out");
  }
  // The header ends at its last byte that is not zero; it may hold any bytes, so it is kept as a word.
  std::string_view header(reinterpret_cast<const char*>(bytes.data()), 80);
  while (!header.empty() && header.back() == '\0') header.remove_suffix(1);
  if (!header.empty()) result.mesh.metadata.emplace_back("stl.header", to_word(header));
  finish(result, points, std::move(nodes), Scalar::f32, std::move(normals));
  if (!is_all_zero(attributes)) {
    Array array = make_array("attribute", Domain::cell, Scalar::u16, 1);
    array.bytes = std::move(attributes);
    result.mesh.arrays.push_back(std::move(array));
  }
  return result;
}

/// One pass over a text file, in floats or in doubles for all positions.
class StlPass {
 public:
  StlPass(std::string_view text, bool wide, Watch& watch)
      : scanner_(text),
        watch_(watch),
        normals_(3, wide),
        corner_(3, wide),
        points_(corner_.tuple_size(), 1024) {}

  /// False: the numbers need doubles, read again.
  Result<bool> run() {
    for (;;) {
      scanner_.skip_white();
      if (scanner_.at_end()) return true;
      if (!accept("solid")) return bad("\"solid\"");
      scanner_.skip_blanks();
      solids_.emplace_back(trim(scanner_.rest_of_line()));
      for (scanner_.skip_white(); !accept("endsolid"); scanner_.skip_white()) {
        if (!MAILLE_TRY(read_facet())) return false;
        if (watch_.due(scanner_.position())) {
          MAILLE_CHECK(watch_.at(scanner_.position(),
                                 nodes_.size() * 4 + normals_.bytes().size() + points_.tuples().size()));
        }
      }
      scanner_.rest_of_line();  // the name once more
    }
  }

  ReadResult take() {
    ReadResult result;
    const Scalar type = normals_.type();
    const uint64_t facets = nodes_.size() / 3;
    finish(result, points_, std::move(nodes_), type, normals_.bytes());
    // One solid is the mesh, and its name metadata; of several each facet remembers its own.
    if (solids_.size() == 1) {
      if (!solids_[0].empty()) result.mesh.metadata.emplace_back("stl.solid", solids_[0]);
    } else if (facets != 0) {
      Array array = make_array("solid", Domain::cell, Scalar::u32, 1, Role::label);
      array.resize(facets);
      std::copy(solid_of_facet_.begin(), solid_of_facet_.end(), array.values<uint32_t>().begin());
      array.labels = std::move(solids_);
      result.mesh.arrays.push_back(std::move(array));
    }
    return result;
  }

 private:
  tl::unexpected<Error> bad(const std::string& expected) const {
    return malformed_line(watch_.name(), scanner_.line(),
                          "facet " + std::to_string(solid_of_facet_.size()) + ": " + found_at(scanner_) +
                              " stands where " + expected + " belongs");
  }

  /// Moves behind this keyword, in any case of letters; stays where it is when another word stands there.
  bool accept(std::string_view keyword) {
    const char* const from = scanner_.here();
    const std::string_view word = scanner_.word();
    const bool equal = std::equal(
        word.begin(), word.end(), keyword.begin(), keyword.end(),
        [](char a, char b) { return (a >= 'A' && a <= 'Z' ? static_cast<char>(a - 'A' + 'a') : a) == b; });
    if (!equal) scanner_.jump(from);
    return equal;
  }
  Result<> expect(std::string_view keyword) {
    scanner_.skip_white();
    if (!accept(keyword)) return bad("\"" + std::string(keyword) + "\"");
    return {};
  }

  /// Appends three numbers; false when they need doubles.
  Result<bool> read_numbers(NumberColumn& column) {
    Number numbers[3];
    for (Number& number : numbers) {
      scanner_.skip_white();
      if (!scanner_.number(number)) return bad("a number");
    }
    return column.append(numbers);
  }

  Result<bool> read_facet() {
    MAILLE_CHECK(expect("facet"));
    MAILLE_CHECK(expect("normal"));
    // A normal of more digits than a float is no reason for double positions: their last digits come from
    // computing.
    const bool normal_fits = MAILLE_TRY(read_numbers(normals_));
    static_cast<void>(normal_fits);
    MAILLE_CHECK(expect("outer"));
    MAILLE_CHECK(expect("loop"));
    for (size_t i = 0; i < 3; ++i) {
      MAILLE_CHECK(expect("vertex"));
      corner_.clear();
      if (!MAILLE_TRY(read_numbers(corner_))) return false;
      if (points_.count() == max_points) {
        return failure(ErrorCode::unsupported, watch_.name() + ": more than 2^32 - 2 points");
      }
      nodes_.push_back(points_.number_of(corner_.bytes().data()));
    }
    MAILLE_CHECK(expect("endloop"));
    MAILLE_CHECK(expect("endfacet"));
    solid_of_facet_.push_back(static_cast<uint32_t>(solids_.size() - 1));
    return true;
  }

  TextScanner scanner_;
  Watch& watch_;
  NumberColumn normals_;
  NumberColumn corner_;
  TupleIndex points_;
  std::vector<uint32_t> nodes_;
  std::vector<uint32_t> solid_of_facet_;
  std::vector<std::string> solids_;
};

Result<ReadResult> read_text(std::string_view text, Watch& watch) {
  for (const bool wide : {false, true}) {
    StlPass pass(text, wide, watch);
    if (MAILLE_TRY(pass.run())) return pass.take();
    watch.restart();
  }
  return failure(ErrorCode::malformed_input,
                 watch.name() + ": not readable as numbers");  // a double always fits
}

bool begins_solid(std::string_view text) {
  TextScanner scanner(text);
  scanner.skip_white();
  const std::string_view word = scanner.word();
  return word == "solid" || word == "SOLID" || word == "Solid";
}

bool recognise(Bytes first) {
  return begins_solid(std::string_view(reinterpret_cast<const char*>(first.data()), first.size()));
}

}  // namespace

Result<ReadResult> read_stl(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  const Bytes bytes = input.bytes();
  Watch watch(source, bytes.size(), options);
  // Many binary files begin with "solid" too, so the size decides first: the count in the header has to give
  // the size of the file exactly. Otherwise a file that begins like text is text, and another is binary with
  // bytes missing or too many.
  const bool sized =
      bytes.size() >= stl_header_size &&
      bytes.size() - stl_header_size == load<uint32_t>(bytes.data() + 80) * uint64_t{stl_facet_size};
  if (!sized && (bytes.size() < stl_header_size || begins_solid(input.text()))) {
    if (!begins_solid(input.text())) {
      return malformed_byte(source.name(), bytes.size(),
                            "too short for a binary STL (84 bytes), and text would begin with \"solid\"");
    }
    ReadResult result = MAILLE_TRY(read_text(input.text(), watch));
    MAILLE_CHECK(watch.at(bytes.size(), size_in_memory(result.mesh)));
    return result;
  }
  ReadResult result = MAILLE_TRY(read_binary(bytes, watch));
  MAILLE_CHECK(watch.at(bytes.size(), size_in_memory(result.mesh)));
  return result;
}

const Format& stl_format() {
  static const Format format{
      {"stl", {".stl"}, "STL, triangles, binary or text", true}, recognise, read_stl, write_stl};
  return format;
}

}  // namespace maille
