// MEDIT .mesh, the text format of INRIA's meshers, and its binary form .meshb: sections that begin with a
// keyword and a count. Every element ends in a number, its reference.
#include <algorithm>
#include <map>

#include "io/buffered_writer.h"
#include "io/cell_store.h"
#include "io/cells.h"
#include "io/format.h"
#include "io/notes.h"
#include "io/token_reader.h"

namespace maille {
namespace {

constexpr char reference_name[] = "medit:ref";

/// Keywords and their codes in binary files.
struct CellKind {
  const char* name;
  int32_t code;
  CellType type;
};
constexpr CellKind cell_kinds[] = {{"Edges", 5, CellType::line},
                                   {"Triangles", 6, CellType::triangle},
                                   {"Quadrilaterals", 7, CellType::quad},
                                   {"Tetrahedra", 8, CellType::tetrahedron},
                                   {"Prisms", 9, CellType::wedge},
                                   {"Hexahedra", 10, CellType::hexahedron},
                                   {"Pyramids", 49, CellType::pyramid},
                                   {"Pentahedra", 0, CellType::wedge},
                                   {"EdgesP2", 0, CellType::quadratic_edge},
                                   {"TrianglesP2", 0, CellType::quadratic_triangle},
                                   {"TetrahedraP2", 0, CellType::quadratic_tetrahedron}};

/// Lists of numbers of elements that are special: they become arrays of 0 and 1.
struct FlagKind {
  const char* name;
  int32_t code;
  CellType type;  ///< vertex: of points
  const char* array;
};
constexpr FlagKind flag_kinds[] = {
    {"Corners", 13, CellType::vertex, "medit:corner"},
    {"RequiredVertices", 15, CellType::vertex, "medit:required"},
    {"Ridges", 14, CellType::line, "medit:ridge"},
    {"RequiredEdges", 16, CellType::line, "medit:required"},
    {"RequiredTriangles", 17, CellType::triangle, "medit:required"},
    {"RequiredQuadrilaterals", 18, CellType::quad, "medit:required"},
};
constexpr int32_t code_dimension = 3, code_vertices = 4, code_end = 54;

void swap_wedge(uint32_t* nodes) {
  std::swap(nodes[1], nodes[2]);
  std::swap(nodes[4], nodes[5]);
}

const CellKind* kind_of(CellType type) {
  for (const CellKind& kind : cell_kinds) {
    if (kind.type == type) return &kind;
  }
  return nullptr;
}

/// What both forms have in common; derived classes find sections and read numbers.
class MeditReader {
 public:
  MeditReader(const Source& source, uint64_t size, const ReadOptions& options)
      : name_(source.name()),
        budget_(source.name(), size, options.limits),
        pace_(budget_, options.progress, size) {}
  virtual ~MeditReader() = default;

  Result<ReadResult> read();

 protected:
  /// The next section's name; empty at the end.
  virtual Result<std::string> next_section() = 0;
  virtual Result<uint64_t> count() = 0;
  virtual bool integer(int64_t& value) = 0;
  virtual bool real(RealColumn& out) = 0;
  virtual Result<> skip_section() = 0;
  virtual tl::unexpected<Error> expected(const std::string& what) = 0;
  virtual uint64_t position() const = 0;

  std::string name_;
  Budget budget_;
  ReadingPace pace_;
  int64_t dimension_ = 3;
  std::vector<std::string> notes_;

 private:
  Result<> read_section(const std::string& section);
  Result<> read_vertices();
  Result<> read_cells(const CellKind& kind);
  Result<> read_flags(const FlagKind& kind);
  void add_flags(Mesh& mesh);

  RealColumn positions_;
  uint64_t points_ = 0;
  std::vector<int32_t> point_references_, cell_references_;
  CellStore cells_;
  BlockShapes shapes_;
  struct Flags {
    const FlagKind* kind;
    std::vector<uint64_t> elements;
  };
  std::vector<Flags> flags_;
};

Result<> MeditReader::read_vertices() {
  points_ = MAILLE_TRY(count());
  if (positions_.size() != 0) return expected("one section Vertices only");
  if (points_ > max_points) return expected("fewer than 2^32 points");
  for (uint64_t i = 0; i < points_; ++i) {
    MAILLE_CHECK(pace_.step(i, points_, 3 * sizeof(double) + sizeof(int32_t), position()));
    for (int64_t k = 0; k < dimension_; ++k) {
      if (!real(positions_)) return expected("a coordinate of vertex " + std::to_string(i + 1));
    }
    if (dimension_ == 2) positions_.add(Number{});
    int64_t reference = 0;
    if (!integer(reference)) return expected("the reference of vertex " + std::to_string(i + 1));
    point_references_.push_back(static_cast<int32_t>(reference));
  }
  return {};
}

Result<> MeditReader::read_cells(const CellKind& kind) {
  const uint64_t count = MAILLE_TRY(this->count());
  const unsigned nodes = nodes_of(kind.type);
  const std::string element = std::string(kind.name) + ", element ";
  for (uint64_t i = 0; i < count; ++i) {
    MAILLE_CHECK(pace_.step(i, count, (nodes + 1) * sizeof(uint32_t), position()));
    int64_t value = 0;
    for (unsigned k = 0; k < nodes; ++k) {
      if (!integer(value)) return expected("a vertex (" + element + std::to_string(i + 1) + ")");
      if (value < 1 || value > static_cast<int64_t>(points_)) {
        return failure(ErrorCode::malformed_input, name_ + ": " + element + std::to_string(i + 1) +
                                                       " uses vertex " + std::to_string(value) +
                                                       ", but the vertices before it are 1 to " +
                                                       std::to_string(points_));
      }
      cells_.nodes.push_back(static_cast<uint32_t>(value - 1));
    }
    // As in Gmsh, the triangle 0 1 2 of a prism is seen from inside; in VTK from outside.
    if (kind.type == CellType::wedge) swap_wedge(cells_.nodes.data() + cells_.nodes.size() - nodes);
    if (!integer(value)) return expected("a reference (" + element + std::to_string(i + 1) + ")");
    cell_references_.push_back(static_cast<int32_t>(value));
    cells_.end_cells(1, kind.type, nodes);
  }
  shapes_.add(count, kind.type, "");
  return {};
}

Result<> MeditReader::read_flags(const FlagKind& kind) {
  const uint64_t count = MAILLE_TRY(this->count());
  Flags flags{&kind, {}};
  for (uint64_t i = 0; i < count; ++i) {
    MAILLE_CHECK(pace_.step(i, count, sizeof(uint64_t), position()));
    int64_t value = 0;
    if (!integer(value)) return expected("a number of an element (" + std::string(kind.name) + ")");
    flags.elements.push_back(static_cast<uint64_t>(value - 1));
  }
  flags_.push_back(std::move(flags));
  return {};
}

Result<> MeditReader::read_section(const std::string& section) {
  if (section == "Dimension") {
    if (!integer(dimension_) || (dimension_ != 2 && dimension_ != 3))
      return expected("the dimension, 2 or 3");
    return {};
  }
  if (section == "Vertices") return read_vertices();
  for (const CellKind& kind : cell_kinds) {
    if (section == kind.name) return read_cells(kind);
  }
  for (const FlagKind& kind : flag_kinds) {
    if (section == kind.name) return read_flags(kind);
  }
  notes_.push_back("section " + section.substr(0, 40) + " left out");
  return skip_section();
}

void MeditReader::add_flags(Mesh& mesh) {
  std::vector<uint64_t> cells_of_type[256];
  for (uint64_t i = 0; !flags_.empty() && i < cells_.count(); ++i) {
    cells_of_type[static_cast<uint8_t>(cells_.type(i))].push_back(i);
  }
  for (const Flags& flags : flags_) {
    const bool of_points = flags.kind->type == CellType::vertex;
    const Domain domain = of_points ? Domain::point : Domain::cell;
    const auto is_it = [&](const Array& array) {
      return array.domain == domain && array.name == flags.kind->array;
    };
    auto found = std::find_if(mesh.arrays.begin(), mesh.arrays.end(), is_it);
    if (found == mesh.arrays.end()) {
      mesh.arrays.push_back(make_array(flags.kind->array, domain, Scalar::u8, 1));
      mesh.arrays.back().resize(of_points ? points_ : cells_.count());
      found = mesh.arrays.end() - 1;
    }
    const auto& cells = cells_of_type[static_cast<uint8_t>(flags.kind->type)];
    uint64_t missing = 0;
    for (const uint64_t element : flags.elements) {
      if (element >= (of_points ? points_ : cells.size())) {
        ++missing;
      } else {
        found->bytes[of_points ? element : cells[element]] = std::byte{1};
      }
    }
    if (missing != 0)
      notes_.push_back(std::string(flags.kind->name) + " names " + counted(missing, "element") +
                       " that are not there");
  }
}

void add_references(Mesh& mesh, Domain domain, const std::vector<int32_t>& values) {
  if (std::all_of(values.begin(), values.end(), [](int32_t value) { return value == 0; })) return;
  Array array = make_array(reference_name, domain, Scalar::i32, 1);
  array.resize(values.size());
  std::copy(values.begin(), values.end(), array.values<int32_t>().begin());
  mesh.arrays.push_back(std::move(array));
}

Result<ReadResult> MeditReader::read() {
  for (;;) {
    const std::string section = MAILLE_TRY(next_section());
    if (section.empty() || section == "End") break;
    MAILLE_CHECK(read_section(section));
  }
  ReadResult result;
  Mesh& mesh = result.mesh;
  mesh.points = positions_.take("position", Domain::point, 3);
  add_references(mesh, Domain::point, point_references_);
  add_references(mesh, Domain::cell, cell_references_);
  add_flags(mesh);
  mesh.blocks = shapes_.take(cells_);
  if (dimension_ == 2) mesh.metadata.emplace_back("medit.dimension", "2");
  result.notes = std::move(notes_);
  return result;
}

class MeditTextReader final : public MeditReader {
 public:
  MeditTextReader(const Source& source, std::string_view text, const ReadOptions& options)
      : MeditReader(source, text.size(), options), in_(text, source.name(), '#') {
    in_.scanner.skip_byte_order_mark();
  }

 protected:
  Result<std::string> next_section() override {
    if (in_.at_end()) return std::string();
    const std::string word(in_.word());
    if (word.starts_with("MeshVersion")) {
      int64_t version = 0;
      if (!in_.integer(version)) return in_.expected("the version of the format");
      return next_section();
    }
    if (!std::isalpha(static_cast<unsigned char>(word[0]))) {
      return in_.malformed("there should be the name of a section, but found \"" + word.substr(0, 40) + "\"");
    }
    return word;
  }
  Result<uint64_t> count() override { return in_.count("elements"); }
  bool integer(int64_t& value) override { return in_.integer(value); }
  bool real(RealColumn& out) override {
    Number number;
    if (!in_.number(number)) return false;
    out.add(number);
    return true;
  }
  Result<> skip_section() override {
    while (!in_.at_end() && !std::isalpha(static_cast<unsigned char>(in_.scanner.peek()))) in_.scanner.word();
    return {};
  }
  tl::unexpected<Error> expected(const std::string& what) override { return in_.expected(what); }
  uint64_t position() const override { return in_.scanner.position(); }

 private:
  TokenReader in_;
};

class MeditBinaryReader final : public MeditReader {
 public:
  MeditBinaryReader(const Source& source, Bytes bytes, const ReadOptions& options)
      : MeditReader(source, bytes.size(), options), bytes_(bytes) {}

  Result<> begin() {
    const uint32_t cookie = bytes_.size() < 8 ? 0 : load<uint32_t>(bytes_.data());
    if (cookie != 1 && cookie != 0x01000000) return malformed("it does not begin like a .meshb file");
    swapped_ = cookie != 1;
    at_ = 4;
    int64_t version = 0;
    integer(version);
    version_ = static_cast<int>(version);
    if (version < 1 || version > 4) return malformed("its version is not 1 to 4");
    return {};
  }

 protected:
  Result<std::string> next_section() override {
    if (next_ != 0) {
      if (next_ <= at_before_ || next_ > bytes_.size())
        return malformed("a section does not end behind its beginning");
      at_ = next_;
    }
    if (at_ == bytes_.size()) return std::string();
    at_before_ = at_;
    int32_t code = 0;
    if (!get(code)) return malformed("the file ends inside a section");
    if (code == code_end) return std::string("End");
    int64_t next = 0;
    if (!size(next, version_ >= 3) || next < 0) return malformed("the file ends inside a section");
    next_ = static_cast<uint64_t>(next);
    // The dimension has 32 bits in all versions.
    narrow_ = code == code_dimension;
    if (narrow_) return std::string("Dimension");
    if (code == code_vertices) return std::string("Vertices");
    for (const CellKind& kind : cell_kinds) {
      if (code == kind.code) return std::string(kind.name);
    }
    for (const FlagKind& kind : flag_kinds) {
      if (code == kind.code) return std::string(kind.name);
    }
    return "with code " + std::to_string(code);
  }
  Result<uint64_t> count() override {
    int64_t value = 0;
    if (!size(value, version_ >= 4) || value < 0) return expected("a number of elements");
    return static_cast<uint64_t>(value);
  }
  bool integer(int64_t& value) override { return size(value, version_ >= 4 && !narrow_); }
  bool real(RealColumn& out) override {
    if (version_ == 1) {
      float value = 0;
      if (!get(value)) return false;
      out.add(Number{static_cast<double>(value), value, true, false});
      return true;
    }
    double value = 0;
    if (!get(value)) return false;
    out.add(value);
    return true;
  }
  Result<> skip_section() override {
    if (next_ == 0) at_ = bytes_.size();
    return {};
  }
  tl::unexpected<Error> expected(const std::string& what) override {
    return malformed("there should be " + what);
  }
  uint64_t position() const override { return at_; }

 private:
  tl::unexpected<Error> malformed(const std::string& what) const { return malformed_byte(name_, at_, what); }
  template <class T>
  bool get(T& value) {
    if (bytes_.size() - at_ < sizeof value) return false;
    std::byte copy[sizeof value];
    std::copy_n(bytes_.data() + at_, sizeof value, copy);
    if (swapped_) std::reverse(copy, copy + sizeof value);
    value = load<T>(copy);
    at_ += sizeof value;
    return true;
  }
  bool size(int64_t& value, bool wide) {
    if (wide) return get(value);
    int32_t narrow = 0;
    if (!get(narrow)) return false;
    value = narrow;
    return true;
  }

  Bytes bytes_;
  uint64_t at_ = 0, at_before_ = 0, next_ = 0;
  int version_ = 1;
  bool swapped_ = false, narrow_ = false;
};

bool is_meshb(Bytes bytes) {
  if (bytes.size() < 8) return false;
  const auto cookie = load<uint32_t>(bytes.data()), version = load<uint32_t>(bytes.data() + 4);
  return (cookie == 1 && version >= 1 && version <= 4) ||
         (cookie == 0x01000000 && (version & 0xffffff) == 0 && version >> 24 <= 4 && version != 0);
}

Result<ReadResult> read_medit(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  if (!is_meshb(input.bytes())) return MeditTextReader(source, input.text(), options).read();
  MeditBinaryReader reader(source, input.bytes(), options);
  MAILLE_CHECK(reader.begin());
  return reader.read();
}

class MeditWriter {
 public:
  MeditWriter(const Mesh& mesh, Sink& sink, bool binary) : mesh_(mesh), out_(sink), binary_(binary) {}

  Result<std::vector<std::string>> write();

 private:
  struct Cell {
    std::span<const uint32_t> nodes;
    uint64_t number;
  };
  void collect();
  void choose_references();
  void note_arrays();
  std::vector<int32_t> references_of(const Array& array) const;
  bool flagged(const char* name, Domain domain, uint64_t element) const;
  void begin(const char* name, int32_t code, uint64_t count, uint64_t bytes_each);
  void put_int(int64_t value, char behind);
  void put_vertices();
  void put_flags(const FlagKind& kind);

  const Mesh& mesh_;
  BufferedWriter out_;
  bool binary_;
  uint64_t position_ = 0;
  std::vector<CellType> order_;
  std::map<CellType, std::vector<Cell>> cells_;
  std::vector<int32_t> point_references_, cell_references_;
  std::vector<std::string> notes_;
};

void MeditWriter::collect() {
  uint64_t number = 0, dropped = 0;
  bool reordered = false;
  for (const CellBlock& block : mesh_.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i, ++number) {
      const CellType type = block.type_of(i);
      const auto nodes = block.cell(i);
      const CellType written = type != CellType::polygon ? type
                               : nodes.size() == 3       ? CellType::triangle
                               : nodes.size() == 4       ? CellType::quad
                                                         : type;
      const CellKind* kind = kind_of(written);
      if (kind == nullptr || (binary_ && kind->code == 0)) {
        ++dropped;
        continue;
      }
      auto& cells = cells_[written];
      if (cells.empty()) order_.push_back(written);
      reordered = reordered || order_.back() != written;
      cells.push_back({nodes, number});
    }
  }
  if (dropped != 0) notes_.push_back(counted(dropped, "cell") + " left out: MEDIT has no such types");
  if (reordered) notes_.push_back("cells were reordered: MEDIT groups them by type");
}

std::vector<int32_t> MeditWriter::references_of(const Array& array) const {
  std::vector<int32_t> values(array.count());
  with_type(array.type, [&](auto zero) {
    using T = decltype(zero);
    for (size_t i = 0; i < values.size(); ++i) values[i] = static_cast<int32_t>(array.values<T>()[i]);
  });
  return values;
}

bool is_reference(const Array& array) {
  return array.components == 1 && !is_float(array.type) &&
         (array.name == reference_name || array.name == "gmsh:physical");
}

void MeditWriter::choose_references() {
  for (const Array& array : mesh_.arrays) {
    if (!is_reference(array)) continue;
    if (array.domain == Domain::point && point_references_.empty()) point_references_ = references_of(array);
    if (array.domain == Domain::cell && cell_references_.empty()) cell_references_ = references_of(array);
  }
  point_references_.resize(mesh_.point_count());
  if (!cell_references_.empty()) {
    note_block_names(mesh_, notes_);
    return;
  }
  std::vector<std::string> names;
  for (const CellBlock& block : mesh_.blocks) {
    int32_t reference = 0;
    if (!block.name.empty()) {
      auto found = std::find(names.begin(), names.end(), block.name);
      if (found == names.end()) {
        names.push_back(block.name);
        found = names.end() - 1;
        notes_.push_back("block \"" + block.name + "\" has reference " + std::to_string(names.size()));
      }
      reference = static_cast<int32_t>(found - names.begin()) + 1;
    }
    cell_references_.insert(cell_references_.end(), block.size(), reference);
  }
}

void MeditWriter::note_arrays() {
  for (const Array& array : mesh_.arrays) {
    if (is_reference(array) && (array.domain == Domain::point || array.domain == Domain::cell)) continue;
    if (array.name.starts_with("medit:") && array.type == Scalar::u8) continue;
    note_array(array, notes_);
  }
  for (const auto& [key, value] : mesh_.metadata) note_metadata(key, notes_);
}

bool MeditWriter::flagged(const char* name, Domain domain, uint64_t element) const {
  const Array* array = mesh_.find(name, domain);
  return array != nullptr && array->type == Scalar::u8 && array->components == 1 &&
         array->bytes[element] != std::byte{0};
}

void MeditWriter::put_int(int64_t value, char behind) {
  if (!binary_) {
    out_.put_number(value);
    out_.put(behind);
    return;
  }
  out_.put_raw(static_cast<int32_t>(value));
  position_ += sizeof(int32_t);
}

void MeditWriter::begin(const char* name, int32_t code, uint64_t count, uint64_t bytes_each) {
  if (!binary_) {
    out_.put(std::string("\n") + name + "\n" + std::to_string(count) + "\n");
    return;
  }
  out_.put_raw(code);
  position_ += sizeof code;
  out_.put_raw(static_cast<int64_t>(position_ + sizeof(int64_t) + sizeof(int32_t) + count * bytes_each));
  position_ += sizeof(int64_t);
  put_int(static_cast<int64_t>(count), ' ');
}

void MeditWriter::put_vertices() {
  begin("Vertices", code_vertices, mesh_.point_count(), 3 * sizeof(double) + sizeof(int32_t));
  const size_t size = mesh_.points.tuple_size();
  for (uint64_t i = 0; i < mesh_.point_count(); ++i) {
    const std::byte* from = mesh_.points.bytes.data() + i * size;
    if (!binary_) {
      put_scalars(out_, from, mesh_.points.type, 3);
      out_.put(' ');
    } else {
      with_type(mesh_.points.type, [&](auto zero) {
        using T = decltype(zero);
        for (size_t k = 0; k < 3; ++k) out_.put_raw(static_cast<double>(load<T>(from + k * sizeof(T))));
      });
      position_ += 3 * sizeof(double);
    }
    put_int(point_references_[i], '\n');
  }
}

void MeditWriter::put_flags(const FlagKind& kind) {
  std::vector<uint64_t> elements;
  if (kind.type == CellType::vertex) {
    for (uint64_t i = 0; i < mesh_.point_count(); ++i) {
      if (flagged(kind.array, Domain::point, i)) elements.push_back(i);
    }
  } else {
    const auto& cells = cells_[kind.type];
    for (uint64_t i = 0; i < cells.size(); ++i) {
      if (flagged(kind.array, Domain::cell, cells[i].number)) elements.push_back(i);
    }
  }
  if (elements.empty()) return;
  begin(kind.name, kind.code, elements.size(), sizeof(int32_t));
  for (const uint64_t element : elements) put_int(static_cast<int64_t>(element) + 1, '\n');
}

Result<std::vector<std::string>> MeditWriter::write() {
  if (binary_ && mesh_.point_count() > INT32_MAX) {
    return failure(ErrorCode::usage, "MEDIT numbers points in 31 bits, and the mesh has " +
                                         std::to_string(mesh_.point_count()));
  }
  collect();
  choose_references();
  if (!binary_) {
    out_.put(std::string("MeshVersionFormatted ") + (mesh_.points.type == Scalar::f32 ? "1" : "2") +
             "\nDimension 3\n");
    note_nan_payloads(mesh_, notes_);
  } else {
    for (const int32_t value : {1, 3, code_dimension}) put_int(value, ' ');
    out_.put_raw(static_cast<int64_t>(position_ + sizeof(int64_t) + sizeof(int32_t)));
    position_ += sizeof(int64_t);
    put_int(3, ' ');
    if (mesh_.points.type != Scalar::f64) notes_.push_back("positions are written as doubles");
  }
  put_vertices();
  std::vector<uint32_t> nodes;
  for (const CellType type : order_) {
    const CellKind& kind = *kind_of(type);
    begin(kind.name, kind.code, cells_[type].size(), (nodes_of(type) + 1) * sizeof(int32_t));
    for (const Cell& cell : cells_[type]) {
      nodes.assign(cell.nodes.begin(), cell.nodes.end());
      if (type == CellType::wedge) swap_wedge(nodes.data());
      for (const uint32_t node : nodes) put_int(int64_t{node} + 1, ' ');
      put_int(cell_references_[cell.number], '\n');
    }
  }
  for (const FlagKind& kind : flag_kinds) put_flags(kind);
  if (binary_) {
    out_.put_raw(code_end);
  } else {
    out_.put("\nEnd\n");
  }
  note_arrays();
  MAILLE_CHECK(out_.finish());
  return std::move(notes_);
}

Result<std::vector<std::string>> write_medit_text(const Mesh& mesh, Sink& sink, const WriteOptions&) {
  return MeditWriter(mesh, sink, false).write();
}
Result<std::vector<std::string>> write_medit_binary(const Mesh& mesh, Sink& sink, const WriteOptions&) {
  return MeditWriter(mesh, sink, true).write();
}

bool recognise_medit(Bytes first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()), first_bytes.size());
  const size_t at = text.find("MeshVersionFormatted");
  return at != std::string_view::npos && at < 200;
}

}  // namespace

const Format& medit_format() {
  static const Format format{
      {"mesh", {".mesh"}, "MEDIT, text", true}, recognise_medit, read_medit, write_medit_text};
  return format;
}

const Format& meditb_format() {
  static const Format format{
      {"meshb", {".meshb"}, "MEDIT, binary", false}, is_meshb, read_medit, write_medit_binary};
  return format;
}

}  // namespace maille
