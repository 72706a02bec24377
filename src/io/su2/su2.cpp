// SU2: lines "KEY= value", each followed by the lines it announces. Elements have VTK's types; boundaries are
// markers with a name. What has no place in a mesh (boxes of free-form deformation, periodicity) is kept as
// text.
#include <algorithm>

#include "io/buffered_writer.h"
#include "io/cell_store.h"
#include "io/format.h"
#include "io/notes.h"
#include "io/token_reader.h"

namespace maille {
namespace {

// What SU2 knows beyond a mesh, as metadata and as an array.
constexpr char dimension_key[] = "su2.dimension";
constexpr char other_key[] = "su2.other";
constexpr char zone_name[] = "su2:zone";

// Keys that are read into the mesh. All others are kept as text with the lines that follow them.
constexpr std::string_view known_keys[] = {"NZONE", "IZONE", "NDIME",      "NELEM",
                                           "NPOIN", "NMARK", "MARKER_TAG", "MARKER_ELEMS"};

/// Of partitioned meshes of old versions: it has points of other partitions where others have elements.
constexpr const char* halo_marker = "SEND_RECEIVE";

bool is_known(std::string_view key) {
  return std::find(std::begin(known_keys), std::end(known_keys), key) != std::end(known_keys);
}

// Lines, triangles, quads, tetrahedra, hexahedra, wedges and pyramids by VTK's numbers, and vertices.
bool is_su2_type(int64_t type) {
  return type == 1 || type == 3 || type == 5 || type == 9 || type == 10 || (type >= 12 && type <= 14);
}

class Su2Reader {
 public:
  Su2Reader(const Source& source, std::string_view text, const ReadOptions& options)
      : in_(text, source.name(), '%'),
        budget_(source.name(), text.size(), options.limits),
        pace_(budget_, options.progress, text.size()) {}

  Result<ReadResult> read();

 private:
  std::string lines_to_next_key();
  tl::unexpected<Error> refuse_order(int64_t type) const;
  Result<> read_line(const std::string& key, std::string_view value);
  Result<uint64_t> count(std::string_view value, const std::string& key) const;
  Result<> read_elements(uint64_t count, const std::string& name);
  Result<> read_points(uint64_t count);
  Result<> check_points();

  TokenReader in_;
  Budget budget_;
  ReadingPace pace_;
  bool known_ = false;  ///< a key of SU2 was there
  uint64_t dimension_ = 3, zones_ = 1, zone_ = 1;
  // The first point of the current zone, and the first node whose number was not checked yet.
  uint64_t first_point_ = 0, first_node_ = 0;
  RealColumn positions_;
  uint64_t points_ = 0;
  CellStore cells_;
  BlockShapes shapes_;
  std::string marker_, other_;
  std::vector<std::pair<uint64_t, uint64_t>> zone_cells_;  ///< zone and the cells up to its end
  std::vector<std::string> notes_;
};

Result<uint64_t> Su2Reader::count(std::string_view value, const std::string& key) const {
  TextScanner scanner(value);
  uint64_t number = 0;
  scanner.skip_blanks();
  if (!scanner.integer(number)) return in_.malformed(key + "= should be followed by a number");
  return number;
}

/// The order of their nodes stands in no specification: SU2's page of the format ends with linear elements.
tl::unexpected<Error> Su2Reader::refuse_order(int64_t type) const {
  return failure(ErrorCode::unsupported, in_.name() + ": elements of type " + std::to_string(type) +
                                             " are of higher order (" + std::to_string(type / 100 + 1) +
                                             "), which cannot be read; linear elements of SU2 can, and those "
                                             "of second order from .msh, .cgns and .vtu");
}

Result<> Su2Reader::read_elements(uint64_t count, const std::string& name) {
  for (uint64_t i = 0; i < count; ++i) {
    // 9 numbers: the eight nodes of the largest element, and its type.
    MAILLE_CHECK(pace_.step(i, count, 9 * sizeof(uint32_t), in_.scanner.position()));
    int64_t type = 0, node = 0;
    if (!in_.integer(type)) return in_.expected("the type of an element");
    if (type > 100 && is_su2_type(type % 100)) return refuse_order(type);
    if (!is_su2_type(type)) return in_.malformed("SU2 has no element type " + std::to_string(type));
    const unsigned nodes = nodes_of(static_cast<CellType>(type));
    // Blanks only: an element ends with its line.
    for (unsigned k = 0; k < nodes; ++k) {
      in_.scanner.skip_blanks();
      if (!in_.scanner.integer(node)) return in_.expected("a point of an element");
      // Points of a zone are numbered from 0 on; joined, they follow those of the zones before.
      if (node < 0 || static_cast<uint64_t>(node) > max_points - first_point_)
        return in_.malformed("there is no point " + std::to_string(node));
      cells_.nodes.push_back(static_cast<uint32_t>(first_point_ + static_cast<uint64_t>(node)));
    }
    // Behind the points an element may have its number.
    in_.scanner.rest_of_line();
    cells_.end_cells(1, static_cast<CellType>(type), nodes);
    shapes_.add(1, static_cast<CellType>(type), name);
  }
  return {};
}

Result<> Su2Reader::read_points(uint64_t count) {
  if (count > max_points - points_) return in_.malformed("there are 2^32 points or more");
  for (uint64_t i = 0; i < count; ++i) {
    MAILLE_CHECK(pace_.step(i, count, 3 * sizeof(double), in_.scanner.position()));
    for (uint64_t k = 0; k < dimension_; ++k) {
      Number number;
      in_.skip_white();
      if (!in_.number(number)) return in_.expected("a coordinate of point " + std::to_string(i));
      positions_.add(number);
    }
    if (dimension_ == 2) positions_.add(Number{});
    // Behind the coordinates a point may have its number, which is its place anyway.
    in_.scanner.rest_of_line();
  }
  points_ += count;
  return {};
}

/// Elements may stand before their points, so their numbers are checked when a zone ends.
Result<> Su2Reader::check_points() {
  for (; first_node_ < cells_.nodes.size(); ++first_node_) {
    if (cells_.nodes[first_node_] < points_) continue;
    return failure(ErrorCode::malformed_input, in_.name() + ": an element uses point " +
                                                   std::to_string(cells_.nodes[first_node_] - first_point_) +
                                                   ", but there are " +
                                                   std::to_string(points_ - first_point_) + " points");
  }
  zone_cells_.emplace_back(zone_, cells_.count());
  first_point_ = points_;
  return {};
}

Result<> Su2Reader::read_line(const std::string& key, std::string_view value) {
  if (key == "NZONE") {
    zones_ = MAILLE_TRY(count(value, key));
  } else if (key == "IZONE") {
    // The first IZONE stands before any points and ends no zone.
    if (points_ > first_point_) MAILLE_CHECK(check_points());
    zone_ = MAILLE_TRY(count(value, key));
  } else if (key == "NDIME") {
    dimension_ = MAILLE_TRY(count(value, key));
    if (dimension_ != 2 && dimension_ != 3) return in_.malformed("NDIME should be 2 or 3");
  } else if (key == "NELEM") {
    const uint64_t elements = MAILLE_TRY(count(value, key));
    return read_elements(elements, "");
  } else if (key == "NPOIN") {
    if (points_ != first_point_) return in_.malformed("NPOIN stands there twice in one zone");
    const uint64_t points = MAILLE_TRY(count(value, key));
    return read_points(points);
  } else if (key == "MARKER_TAG") {
    marker_ = from_word(trim(value));
  } else if (key == "MARKER_ELEMS") {
    const uint64_t elements = MAILLE_TRY(count(value, key));
    if (marker_ != halo_marker) return read_elements(elements, marker_);
  } else if (key == "SEND_TO" && marker_ == halo_marker) {
    lines_to_next_key();
    notes_.push_back("marker SEND_RECEIVE left out: which points halves of a partition share");
  } else if (key != "NMARK") {
    other_ += key + "=" + std::string(value) + "\n" + lines_to_next_key();
  }
  return {};
}

std::string Su2Reader::lines_to_next_key() {
  std::string lines;
  for (in_.skip_white(); !in_.scanner.at_end(); in_.skip_white()) {
    // The next key is for the caller, so the scanner goes back to before it.
    const TextScanner before = in_.scanner;
    const std::string_view line = in_.scanner.rest_of_line();
    if (line.find('=') != std::string_view::npos) {
      in_.scanner = before;
      break;
    }
    lines += std::string(line) + "\n";
  }
  return lines;
}

Result<ReadResult> Su2Reader::read() {
  in_.scanner.skip_byte_order_mark();
  for (in_.skip_white(); !in_.scanner.at_end(); in_.skip_white()) {
    const std::string_view line = in_.scanner.rest_of_line();
    const size_t equals = line.find('=');
    if (equals == std::string_view::npos)
      return in_.malformed("there should be \"KEY= value\", but found \"" + std::string(line.substr(0, 40)) +
                           "\"");
    const std::string key(trim(line.substr(0, equals)));
    known_ = known_ || is_known(key);
    MAILLE_CHECK(read_line(key, line.substr(equals + 1)));
  }
  // Any text of lines with "=" would otherwise read as an empty mesh.
  if (!known_) return in_.malformed("there is none of the keys of SU2, such as NDIME=");
  MAILLE_CHECK(check_points());
  ReadResult result;
  Mesh& mesh = result.mesh;
  mesh.points = positions_.take("position", Domain::point, 3);
  if (zones_ > 1) {
    Array zones = make_array(zone_name, Domain::cell, Scalar::i32, 1);
    for (const auto& [zone, end] : zone_cells_) {
      const uint64_t from = zones.count();
      zones.resize(end);
      std::fill(zones.values<int32_t>().begin() + static_cast<ptrdiff_t>(from), zones.values<int32_t>().end(),
                static_cast<int32_t>(zone));
    }
    mesh.arrays.push_back(std::move(zones));
    notes_.push_back("the points of " + std::to_string(zones_) + " zones were joined; the cell array \"" +
                     std::string(zone_name) + "\" tells them apart");
  }
  mesh.blocks = shapes_.take(cells_);
  if (dimension_ == 2) mesh.metadata.emplace_back(dimension_key, "2");
  if (!other_.empty()) mesh.metadata.emplace_back(other_key, other_);
  result.notes = std::move(notes_);
  return result;
}

Result<ReadResult> read_su2(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  return Su2Reader(source, input.text(), options).read();
}

class Su2Writer {
 public:
  Su2Writer(const Mesh& mesh, Sink& sink) : mesh_(mesh), out_(sink) {}

  Result<std::vector<std::string>> write();

 private:
  void choose_dimension();
  void put_cells(const CellBlock& block, int dimension);
  void put_points();
  void put_markers();
  void put_other(std::string_view text);
  uint64_t count_cells(const CellBlock& block, int dimension) const;

  const Mesh& mesh_;
  BufferedWriter out_;
  int dimension_ = 3;
  uint64_t written_ = 0;
  std::vector<std::string> notes_;
};

/// The type of a cell as SU2 knows it. A polygon of three or four corners is a triangle or quad; mixed stands
/// for none.
CellType su2_type(const CellBlock& block, uint64_t i) {
  const CellType type = block.type_of(i);
  if (type == CellType::polygon && block.cell(i).size() == 3) return CellType::triangle;
  if (type == CellType::polygon && block.cell(i).size() == 4) return CellType::quad;
  return is_su2_type(static_cast<int64_t>(type)) ? type : CellType::mixed;
}

// Counts the cells of the full dimension, or all the others that SU2 has; put_cells() writes the same ones.
uint64_t Su2Writer::count_cells(const CellBlock& block, int dimension) const {
  uint64_t count = 0;
  for (uint64_t i = 0; i < block.size(); ++i) {
    const CellType type = su2_type(block, i);
    if (type != CellType::mixed && (dimension_of(type) == dimension_) == (dimension == dimension_)) ++count;
  }
  return count;
}

/// Two when the mesh has no volumes and all its heights are zero, otherwise three. The dimension of the file
/// it came from is not asked: the mesh may have changed since.
void Su2Writer::choose_dimension() {
  bool volumes = false, heights = false;
  for (const CellBlock& block : mesh_.blocks) {
    for (uint64_t i = 0; i < block.size() && !volumes; ++i) volumes = dimension_of(block.type_of(i)) == 3;
  }
  with_type(mesh_.points.type, [&](auto zero) {
    const auto values = mesh_.points.values<decltype(zero)>();
    for (size_t i = 2; i < values.size(); i += 3) heights = heights || values[i] != decltype(zero){};
  });
  dimension_ = volumes || heights ? 3 : 2;
}

/// Cells of the full dimension, or all the others.
void Su2Writer::put_cells(const CellBlock& block, int dimension) {
  for (uint64_t i = 0; i < block.size(); ++i) {
    const CellType type = su2_type(block, i);
    if (type == CellType::mixed || (dimension_of(type) == dimension_) != (dimension == dimension_)) continue;
    out_.put_number(static_cast<int>(type));
    for (const uint32_t node : block.cell(i)) {
      out_.put(' ');
      out_.put_number(node);
    }
    out_.put('\n');
    ++written_;
  }
}

void Su2Writer::put_points() {
  out_.put("NPOIN= " + std::to_string(mesh_.point_count()) + "\n");
  const size_t size = mesh_.points.tuple_size();
  for (uint64_t i = 0; i < mesh_.point_count(); ++i) {
    put_scalars(out_, mesh_.points.bytes.data() + i * size, mesh_.points.type,
                static_cast<uint32_t>(dimension_));
    out_.put('\n');
  }
}

/// Blocks of the same name that follow each other are one marker.
void Su2Writer::put_markers() {
  struct Marker {
    std::string name;
    std::vector<const CellBlock*> blocks;
    uint64_t cells = 0;
  };
  std::vector<Marker> markers;
  for (const CellBlock& block : mesh_.blocks) {
    const uint64_t cells = count_cells(block, 0);
    if (cells == 0) continue;
    const std::string name = block.name.empty() ? "boundary" : to_word(block.name);
    if (markers.empty() || markers.back().name != name) markers.push_back({name, {}, 0});
    markers.back().blocks.push_back(&block);
    markers.back().cells += cells;
  }
  out_.put("NMARK= " + std::to_string(markers.size()) + "\n");
  for (const Marker& marker : markers) {
    out_.put("MARKER_TAG= " + marker.name + "\nMARKER_ELEMS= " + std::to_string(marker.cells) + "\n");
    for (const CellBlock* block : marker.blocks) put_cells(*block, 0);
  }
}

/// Writes sections that were kept as text, without those that the mesh has itself. The text may come from
/// elsewhere, and a key of SU2 in it would add a second mesh.
void Su2Writer::put_other(std::string_view text) {
  bool put = false;
  for (TextScanner scanner(text); !scanner.at_end(); scanner.skip_line_end()) {
    const std::string_view line = trim(scanner.rest_of_line());
    if (const size_t equals = line.find('='); equals != std::string_view::npos) {
      const std::string_view key = trim(line.substr(0, equals));
      put = !is_known(key);
    }
    if (put) out_.put(std::string(line) + "\n");
  }
}

Result<std::vector<std::string>> Su2Writer::write() {
  choose_dimension();
  uint64_t elements = 0, named = 0;
  for (const CellBlock& block : mesh_.blocks) {
    elements += count_cells(block, dimension_);
    if (!block.name.empty() && count_cells(block, dimension_) != 0) ++named;
  }
  out_.put("NDIME= " + std::to_string(dimension_) + "\nNELEM= " + std::to_string(elements) + "\n");
  for (const CellBlock& block : mesh_.blocks) put_cells(block, dimension_);
  put_points();
  put_markers();
  for (const auto& [key, value] : mesh_.metadata) {
    if (key == other_key) put_other(value);
    note_metadata(key, value, notes_);
  }
  if (written_ != mesh_.cell_count()) {
    notes_.push_back(counted(mesh_.cell_count() - written_, "cell") + " left out: SU2 has linear cells only");
  }
  if (named != 0)
    notes_.push_back("the names of " + counted(named, "block") +
                     " of elements left out: SU2 names boundaries only");
  for (const Array& array : mesh_.arrays) note_array(array, notes_);
  note_nan_payloads(mesh_, notes_);
  MAILLE_CHECK(out_.finish());
  return std::move(notes_);
}

Result<std::vector<std::string>> write_su2(const Mesh& mesh, Sink& sink, const WriteOptions&) {
  return Su2Writer(mesh, sink).write();
}

// The keys need not stand in the first line: comments may come before them.
bool recognise_su2(Bytes first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()), first_bytes.size());
  return text.find("NDIME=") != std::string_view::npos || text.find("NZONE=") != std::string_view::npos;
}

}  // namespace

const Format& su2_format() {
  static const Format format{{"su2", {".su2"}, "SU2, text", true}, recognise_su2, read_su2, write_su2};
  return format;
}

}  // namespace maille
