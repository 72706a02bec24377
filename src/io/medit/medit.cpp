// MEDIT .mesh, the text format of INRIA's meshers, and its binary form .meshb: sections that begin with a
// keyword and a count. Every element ends in a number, its reference.
#include <algorithm>

#include "io/cell_store.h"
#include "io/format.h"
#include "io/medit/medit.h"
#include "io/token_reader.h"

namespace maille {
namespace {

/// Names of sections left out that are noted; the rest is counted, as a hostile file may have millions.
constexpr uint64_t most_named = 10;

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
  // Files without a dimension are taken to have three.
  int64_t dimension_ = 3;
  std::vector<std::string> notes_;

 private:
  Result<> read_section(const std::string& section);
  Result<> read_vertices();
  Result<> read_cells(const MeditCellKind& kind);
  Result<> read_flags(const MeditFlagKind& kind);
  void add_flags(Mesh& mesh);

  RealColumn positions_;
  uint64_t points_ = 0;
  std::vector<int32_t> point_references_, cell_references_;
  CellStore cells_;
  BlockShapes shapes_;
  struct Flags {
    const MeditFlagKind* kind;
    std::vector<uint64_t> elements;
  };
  std::vector<Flags> flags_;
  uint64_t sections_left_out_ = 0;
};

Result<> MeditReader::read_vertices() {
  points_ = MAILLE_TRY(count());
  // A second section would move the points that cells before it were checked against.
  if (positions_.size() != 0) return expected("one section Vertices only");
  if (points_ > max_points)
    return failure(ErrorCode::malformed_input, name_ + ": there are 2^32 points or more");
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

Result<> MeditReader::read_cells(const MeditCellKind& kind) {
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
    if (kind.type == CellType::wedge) swap_medit_wedge(cells_.nodes.data() + cells_.nodes.size() - nodes);
    if (!integer(value)) return expected("a reference (" + element + std::to_string(i + 1) + ")");
    cell_references_.push_back(static_cast<int32_t>(value));
    cells_.end_cells(1, kind.type, nodes);
  }
  shapes_.add(count, kind.type, "");
  return {};
}

// Numbers are checked in add_flags(): the elements they name may stand further on in the file.
Result<> MeditReader::read_flags(const MeditFlagKind& kind) {
  const uint64_t count = MAILLE_TRY(this->count());
  Flags flags{&kind, {}};
  for (uint64_t i = 0; i < count; ++i) {
    MAILLE_CHECK(pace_.step(i, count, sizeof(uint64_t), position()));
    int64_t value = 0;
    if (!integer(value)) return expected("a number of an element (" + std::string(kind.name) + ")");
    // Numbers below 1 wrap around to large ones, which are found missing later.
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
  for (const MeditCellKind& kind : medit_cell_kinds) {
    if (section == kind.name) return read_cells(kind);
  }
  for (const MeditFlagKind& kind : medit_flag_kinds) {
    if (section == kind.name) return read_flags(kind);
  }
  if (sections_left_out_++ < most_named) notes_.push_back("section " + section.substr(0, 40) + " left out");
  return skip_section();
}

void MeditReader::add_flags(Mesh& mesh) {
  // MEDIT numbers the elements of each type from 1 on, across all sections of this type; here are their cells
  // by type.
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
    // Several lists may fill one array: "medit:required" holds edges, triangles and quadrilaterals.
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

// References that are all zero say nothing and are left out.
void add_references(Mesh& mesh, Domain domain, const std::vector<int32_t>& values) {
  if (std::all_of(values.begin(), values.end(), [](int32_t value) { return value == 0; })) return;
  Array array = make_array(medit_reference_name, domain, Scalar::i32, 1);
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
  if (sections_left_out_ > most_named)
    notes_.push_back(counted(sections_left_out_ - most_named, "more section") + " left out");
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
    if (!begun_) MAILLE_CHECK(begin());
    if (in_.at_end()) return std::string();
    const std::string word(in_.word());
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
    // What is left out ends at the next word that begins with a letter. A number such as "nan" ends it too,
    // and is then left out as a section of this name.
    while (!in_.at_end() && !std::isalpha(static_cast<unsigned char>(in_.scanner.peek()))) in_.scanner.word();
    return {};
  }
  tl::unexpected<Error> expected(const std::string& what) override { return in_.expected(what); }
  uint64_t position() const override { return in_.scanner.position(); }

 private:
  Result<> begin() {
    begun_ = true;
    if (in_.at_end() || !in_.word().starts_with("MeshVersion"))
      return in_.malformed("a MEDIT file begins with MeshVersionFormatted");
    int64_t version = 0;
    if (!in_.integer(version)) return in_.expected("the version of the format");
    return {};
  }

  TokenReader in_;
  bool begun_ = false;
};

class MeditBinaryReader final : public MeditReader {
 public:
  MeditBinaryReader(const Source& source, Bytes bytes, const ReadOptions& options)
      : MeditReader(source, bytes.size(), options), bytes_(bytes) {}

  Result<> begin() {
    // A binary file begins with the number 1 in the writer's byte order, then the version.
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
    // Every section says where the next one begins. It has to lie further on, so that a hostile file cannot
    // make this go round in circles.
    if (next_ != 0) {
      if (next_ <= at_before_ || next_ > bytes_.size())
        return malformed("a section does not end behind its beginning");
      at_ = next_;
    }
    if (at_ == bytes_.size()) return std::string();
    at_before_ = at_;
    int32_t code = 0;
    if (!get(code)) return malformed("the file ends inside a section");
    if (code == medit_end) return std::string("End");
    int64_t next = 0;
    // Positions have 64 bits from version 3 on, counts and numbers of vertices from version 4 on.
    if (!size(next, version_ >= 3) || next < 0) return malformed("the file ends inside a section");
    next_ = static_cast<uint64_t>(next);
    // The dimension has 32 bits in all versions.
    narrow_ = code == medit_dimension;
    if (narrow_) return std::string("Dimension");
    if (code == medit_vertices) return std::string("Vertices");
    for (const MeditCellKind& kind : medit_cell_kinds) {
      if (code == kind.code) return std::string(kind.name);
    }
    for (const MeditFlagKind& kind : medit_flag_kinds) {
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
      // Version 1 stores floats; a number that says it fits a float keeps the column in single precision.
      out.add(Number{static_cast<double>(value), value, true, false});
      return true;
    }
    double value = 0;
    if (!get(value)) return false;
    out.add(value);
    return true;
  }
  // A section without a next one is the last.
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

// The cookie alone, the number 1, would fit too many files, so the version has to be plausible in the same
// byte order.
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

bool recognise_medit(Bytes first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()), first_bytes.size());
  const size_t at = text.find("MeshVersionFormatted");
  // Comments may stand before the keyword, but not many. The bound was chosen, not swept.
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
