// Binary PLY files read in parts: points without lists, then faces.
#include <maille/mesh_source.h>

#include <algorithm>
#include <limits>

#include "base/bytes.h"
#include "io/mesh_sources.h"
#include "io/ply/ply_table.h"

namespace maille {
namespace {

// Chosen, not swept; read_mesh(), which takes over then, has no such bound.
constexpr uint64_t most_header = uint64_t{1} << 20;
// How much is read at once to pass over faces. The front of a face, up to the length of its list, always
// fits: a property takes eight bytes of it at most, and more than that of the header.
constexpr uint64_t bytes_at_once = most_header;
/// Where every so many faces begin is known, if they have different numbers of corners. Chosen, not swept:
/// eight bytes for 4096 faces, and at most that many faces are passed over to find one.
constexpr uint64_t faces_per_entry = 4096;

uint64_t bytes_of_row(const PlyElement& element) {
  uint64_t bytes = 0;
  for (const PlyProperty& property : element.properties) bytes += size_of(property.type);
  return bytes;
}

bool has_lists(const PlyElement& element) {
  return std::any_of(element.properties.begin(), element.properties.end(),
                     [](const PlyProperty& property) { return property.list; });
}

// Of any whole type of PLY, in the file's byte order. Shifting up and down again extends the sign.
int64_t whole_number(const std::byte* from, Scalar type, bool big_endian) {
  std::byte bytes[8] = {};
  const size_t size = size_of(type);
  std::copy_n(from, size, bytes);
  if (big_endian) std::reverse(bytes, bytes + size);
  const auto bits = load<uint64_t>(bytes);
  const unsigned unused = 64 - 8 * static_cast<unsigned>(size);
  const bool is_signed = type == Scalar::i8 || type == Scalar::i16 || type == Scalar::i32;
  return is_signed ? static_cast<int64_t>(bits << unused) >> unused : static_cast<int64_t>(bits);
}

/// A binary PLY file of points, then faces, of any size, read in parts without a temporary file: points and,
/// where all faces have as many corners, faces are found by multiplication, other faces by an index that one
/// pass makes. The rows read last are kept, as callers ask for positions and then for each array of the same
/// rows.
class PlySource final : public MeshSource {
 public:
  explicit PlySource(const Source& source) : source_(source) {}

  Result<> open(const Limits& limits) {
    MAILLE_CHECK(read_header());
    MAILLE_CHECK(check_elements());
    MAILLE_CHECK(describe(limits));
    return find_faces();
  }

  const MeshDescription& description() const override { return description_; }
  Result<> read_points(uint64_t first, uint64_t count, std::span<std::byte> out) override {
    const Mesh& rows = *MAILLE_TRY(point_rows(first, count));
    return copy(rows.points, out);
  }
  Result<> read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) override {
    const std::string& name = description_.arrays[array].name;
    const bool on_points = description_.arrays[array].domain == Domain::point;
    const Mesh& rows = *MAILLE_TRY(on_points ? point_rows(first, count) : face_rows(first, count));
    size_t place = array;
    // `array` counts all arrays of the description, while rows of faces hold those of faces only.
    if (!on_points) {
      for (size_t i = 0; i < array; ++i) place -= description_.arrays[i].domain == Domain::point;
    }
    if (place >= rows.arrays.size() || rows.arrays[place].name != name) return bad("an array is not there");
    return copy(rows.arrays[place], out);
  }
  Result<> read_cells(uint64_t first, uint64_t count, CellPiece& out) override;

 private:
  tl::unexpected<Error> bad(const std::string& what) const {
    return failure(ErrorCode::malformed_input, source_.name() + ": " + what);
  }
  tl::unexpected<Error> not_in_parts(const std::string& what) const {
    return failure(ErrorCode::unsupported, source_.name() + ": " + what + " cannot be read in parts");
  }
  bool big_endian() const { return header_.encoding == PlyEncoding::big_endian; }
  const PlyElement& vertex() const { return header_.elements[0]; }
  const PlyElement& face() const { return header_.elements[1]; }
  bool has_faces() const { return header_.elements.size() > 1; }
  static Result<> copy(const Array& from, std::span<std::byte> out) {
    if (from.bytes.size() != out.size())
      return failure(ErrorCode::usage, "room for another number of tuples");
    std::copy(from.bytes.begin(), from.bytes.end(), out.begin());
    return {};
  }

  Result<> read_header();
  Result<> check_elements() const;
  Result<> describe(const Limits& limits);
  /// A place among the faces that moves on from one to the next, with bytes of the file around it.
  struct Walk {
    uint64_t at = 0, end = 0;  ///< no face reaches beyond the end
    std::vector<std::byte> buffer = {};
    uint64_t buffer_at = 0;
  };
  Result<> find_faces();
  Result<uint64_t> pass_face(Walk& walk, uint64_t number) const;
  Result<uint64_t> bytes_of_face(Bytes bytes, uint64_t face, uint64_t at, uint64_t& degree) const;
  Result<const Mesh*> point_rows(uint64_t first, uint64_t count);
  Result<const Mesh*> face_rows(uint64_t first, uint64_t count);
  Result<uint64_t> place_of_face(uint64_t number);
  Result<std::vector<std::byte>> bytes_of_faces(uint64_t first, uint64_t count, uint64_t& at);

  struct Rows {
    uint64_t first = 0, count = 0;
    Mesh mesh;
  };

  const Source& source_;
  PlyHeader header_;
  std::vector<PlyHint> hints_;
  MeshDescription description_;
  uint64_t points_at_ = 0, faces_at_ = 0, faces_end_ = 0;
  uint64_t face_bytes_ = 0;        ///< 0: they differ
  std::vector<uint64_t> entries_;  ///< where faces begin then
  size_t indices_ = 0;             ///< the property
  Rows points_, faces_;            ///< those read last
};

Result<> PlySource::read_header() {
  std::vector<std::byte> front(std::min(source_.size(), most_header));
  MAILLE_CHECK(source_.read_at(0, front));
  const std::string_view text(reinterpret_cast<const char*>(front.data()), front.size());
  if (front.size() < source_.size() && text.find("end_header") == std::string_view::npos)
    return not_in_parts("a header of more than 1 MiB");
  TextScanner scanner(text);
  scanner.skip_byte_order_mark();
  header_ = MAILLE_TRY(parse_ply_header(scanner, source_.name()));
  points_at_ = scanner.position();
  for (const auto& [keyword, text] : header_.comments) {
    if (auto hint = parse_ply_hint(text); hint && keyword == "comment") hints_.push_back(std::move(*hint));
  }
  return {};
}

Result<> PlySource::check_elements() const {
  if (header_.encoding == PlyEncoding::ascii) return not_in_parts("text");
  const auto& elements = header_.elements;
  if (elements.empty() || elements[0].name != "vertex" || elements.size() > 2 ||
      (elements.size() == 2 && (elements[1].name != "face" || !find_vertex_indices(elements[1])))) {
    return not_in_parts("other elements than points, then faces");
  }
  if (has_lists(vertex())) return not_in_parts("lists of points");
  const auto lists = [](const PlyElement& element) {
    return std::count_if(element.properties.begin(), element.properties.end(),
                         [](const PlyProperty& property) { return property.list; });
  };
  if (has_faces() && lists(face()) != 1) return not_in_parts("several lists of faces");
  if (has_faces() && is_float(face().properties[*find_vertex_indices(face())].type))
    return bad("numbers of points are floats");
  return {};
}

/// Describes the mesh as the reader of whole files would: it reads the header with counts of 0, so that
/// names, types and metadata of both ways are the same by construction.
Result<> PlySource::describe(const Limits& limits) {
  PlyHeader none = header_;
  for (PlyElement& element : none.elements) element.count = 0;
  const std::string text = format_ply_header(none);
  const auto bytes = memory_source(std::as_bytes(std::span(text.data(), text.size())), source_.name());
  ReadResult read = MAILLE_TRY(read_mesh(*bytes, {.format = "ply", .limits = limits, .progress = {}}));
  description_.points = vertex().count;
  description_.cells = has_faces() ? face().count : 0;
  description_.point_type = read.mesh.points.type;
  description_.arrays = std::move(read.mesh.arrays);
  description_.metadata = std::move(read.mesh.metadata);
  if (description_.points > max_points) {
    return failure(ErrorCode::unsupported, source_.name() + ": " + std::to_string(description_.points) +
                                               " vertices are more than the 2^32 - 2 a mesh can have");
  }
  // At least three, as the reader has found x, y and z, so the division is safe.
  const uint64_t row = bytes_of_row(vertex());
  if ((source_.size() - points_at_) / row < description_.points)
    return bad("the file ends inside its " + std::to_string(description_.points) + " vertices");
  faces_at_ = faces_end_ = points_at_ + row * description_.points;
  return {};
}

/// Bytes of the face at the begin of `bytes`, which need not hold its list; 0 if they end before its length.
/// No overflow: a list has fewer than 2^32 numbers of at most eight bytes, and only one list is allowed.
Result<uint64_t> PlySource::bytes_of_face(Bytes bytes, uint64_t number, uint64_t at, uint64_t& degree) const {
  uint64_t offset = 0;
  for (size_t i = 0; i < face().properties.size(); ++i) {
    const PlyProperty& property = face().properties[i];
    if (!property.list) {
      offset += size_of(property.type);
      continue;
    }
    const size_t size = size_of(property.count_type);
    if (offset + size > bytes.size()) return uint64_t{0};
    const int64_t count = whole_number(bytes.data() + offset, property.count_type, big_endian());
    if (count < 0 || count > std::numeric_limits<uint32_t>::max())
      return bad("byte " + std::to_string(at + offset) + ": face " + std::to_string(number) + " has " +
                 std::to_string(count) + " corners");
    degree = static_cast<uint64_t>(count);
    offset += size + degree * size_of(property.type);
  }
  return offset;
}

/// Moves behind the face and gives its number of corners. The list is not read, however long it is.
Result<uint64_t> PlySource::pass_face(Walk& walk, uint64_t number) const {
  uint64_t degree = 0;
  const size_t used = static_cast<size_t>(std::min<uint64_t>(walk.at - walk.buffer_at, walk.buffer.size()));
  uint64_t size = MAILLE_TRY(bytes_of_face(Bytes(walk.buffer).subspan(used), number, walk.at, degree));
  if (size == 0) {
    walk.buffer.resize(static_cast<size_t>(std::min(bytes_at_once, walk.end - walk.at)));
    walk.buffer_at = walk.at;
    MAILLE_CHECK(source_.read_at(walk.at, walk.buffer));
    size = MAILLE_TRY(bytes_of_face(walk.buffer, number, walk.at, degree));
  }
  if (size == 0 || size > walk.end - walk.at) {
    return bad("the file ends inside face " + std::to_string(number) + " of " +
               std::to_string(description_.cells));
  }
  walk.at += size;
  return degree;
}

/// One pass over all faces: how many corners they have, and where they are.
Result<> PlySource::find_faces() {
  if (description_.cells == 0) return {};
  indices_ = *find_vertex_indices(face());
  Walk walk{faces_at_, source_.size()};
  uint64_t first_degree = 0;
  bool same = true;
  for (uint64_t i = 0; i < description_.cells; ++i) {
    if (i % faces_per_entry == 0) entries_.push_back(walk.at);
    const uint64_t degree = MAILLE_TRY(pass_face(walk, i));
    if (i == 0) {
      first_degree = degree;
      face_bytes_ = walk.at - faces_at_;
    }
    same = same && degree == first_degree;
    description_.corners += degree;
  }
  faces_end_ = walk.at;
  if (same) entries_ = {};
  if (!same) face_bytes_ = 0;
  const CellType type = same && first_degree == 3   ? CellType::triangle
                        : same && first_degree == 4 ? CellType::quad
                                                    : CellType::polygon;
  description_.blocks.push_back({"", type, description_.cells});
  return {};
}

Result<const Mesh*> PlySource::point_rows(uint64_t first, uint64_t count) {
  if (points_.first == first && points_.count == count && count != 0) return &points_.mesh;
  if (first > description_.points || count > description_.points - first)
    return failure(ErrorCode::usage, source_.name() + " has not so many points");
  PlyHeader some = header_;
  some.elements[0].count = count;
  if (has_faces()) some.elements[1].count = 0;
  const std::string text = format_ply_header(some);
  const uint64_t row = bytes_of_row(vertex());
  std::vector<std::byte> bytes(text.size() + count * row);
  std::copy_n(reinterpret_cast<const std::byte*>(text.data()), text.size(), bytes.begin());
  MAILLE_CHECK(source_.read_at(points_at_ + first * row, std::span(bytes).subspan(text.size())));
  const auto rows = memory_source(Bytes(bytes), source_.name());
  points_ = {first, count, {}};
  points_.mesh = MAILLE_TRY(read_mesh(*rows, {.format = "ply", .limits = {}, .progress = {}})).mesh;
  return &points_.mesh;
}

Result<uint64_t> PlySource::place_of_face(uint64_t number) {
  if (face_bytes_ != 0) return faces_at_ + number * face_bytes_;
  if (number == description_.cells) return faces_end_;
  const uint64_t entry = number / faces_per_entry;
  const uint64_t end = entry + 1 < entries_.size() ? entries_[entry + 1] : faces_end_;
  Walk walk{entries_[entry], end};
  for (uint64_t i = entry * faces_per_entry; i < number; ++i) MAILLE_CHECK(pass_face(walk, i));
  return walk.at;
}

Result<std::vector<std::byte>> PlySource::bytes_of_faces(uint64_t first, uint64_t count, uint64_t& at) {
  if (first > description_.cells || count > description_.cells - first)
    return failure(ErrorCode::usage, source_.name() + " has not so many faces");
  at = MAILLE_TRY(place_of_face(first));
  std::vector<std::byte> bytes(MAILLE_TRY(place_of_face(first + count)) - at);
  MAILLE_CHECK(source_.read_at(at, bytes));
  return bytes;
}

Result<const Mesh*> PlySource::face_rows(uint64_t first, uint64_t count) {
  if (faces_.first == first && faces_.count == count && count != 0) return &faces_.mesh;
  uint64_t at = 0;
  const std::vector<std::byte> bytes = MAILLE_TRY(bytes_of_faces(first, count, at));
  PlyElement element = face();
  element.count = count;
  PlyTable table(element, plan_ply_columns(element, hints_, {element.properties[indices_].name}),
                 std::nullopt, description_.points);
  const auto rows = memory_source(Bytes(bytes), source_.name());
  const ReadOptions options;
  Watch watch(*rows, bytes.size(), options);
  // The whole rows were found by find_faces(), so the table reads exactly these bytes.
  uint64_t next = 0;
  MAILLE_CHECK(table.read_binary(bytes, next, big_endian(), watch, 0));
  faces_ = {first, count, {}};
  for (PlyValues& values : table.values) {
    Array& array = faces_.mesh.arrays.emplace_back();
    array.name = values.column.name;
    array.bytes = std::move(values.bytes);
  }
  return &faces_.mesh;
}

Result<> PlySource::read_cells(uint64_t first, uint64_t count, CellPiece& out) {
  uint64_t begin = 0;
  const std::vector<std::byte> bytes = MAILLE_TRY(bytes_of_faces(first, count, begin));
  uint64_t before = 0;
  // What stands before the list in each row has a fixed size, as the list is the only one.
  for (size_t i = 0; i < indices_; ++i) before += size_of(face().properties[i].type);
  const PlyProperty& list = face().properties[indices_];
  const size_t size = size_of(list.type);
  out.types.clear();
  out.offsets.assign(1, 0);
  out.connectivity.clear();
  uint64_t at = 0;
  for (uint64_t i = 0; i < count; ++i) {
    uint64_t degree = 0;
    const uint64_t row = MAILLE_TRY(bytes_of_face(Bytes(bytes).subspan(at), first + i, begin + at, degree));
    const std::byte* from = bytes.data() + at + before + size_of(list.count_type);
    for (uint64_t k = 0; k < degree; ++k, from += size) {
      const int64_t node = whole_number(from, list.type, big_endian());
      if (node < 0 || static_cast<uint64_t>(node) >= description_.points) {
        const auto byte = begin + static_cast<uint64_t>(from - bytes.data());
        return bad("byte " + std::to_string(byte) + ": face " + std::to_string(first + i) + ": vertex " +
                   std::to_string(node) + " does not exist, there are " +
                   std::to_string(description_.points));
      }
      out.connectivity.push_back(static_cast<uint64_t>(node));
    }
    out.offsets.push_back(out.connectivity.size());
    const CellType type = degree == 3 ? CellType::triangle : degree == 4 ? CellType::quad : CellType::polygon;
    out.types.push_back(static_cast<uint8_t>(type));
    at += row;
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<MeshSource>> open_ply_source(const Source& source, const Limits& limits) {
  auto opened = std::make_unique<PlySource>(source);
  MAILLE_CHECK(opened->open(limits));
  return std::unique_ptr<MeshSource>(std::move(opened));
}

}  // namespace maille
