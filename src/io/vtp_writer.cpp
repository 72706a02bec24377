#include <algorithm>
#include <array>
#include <functional>
#include <limits>

#include "base/bytes.h"
#include "base/result.h"
#include "io/buffered_writer.h"
#include "io/cells.h"
#include "io/reading.h"
#include "io/vtk_data.h"
#include "io/vtp.h"

namespace maille {
namespace {

enum Kind : size_t { verts, lines, polys, kinds, unknown = kinds };
constexpr const char* kind_elements[kinds] = {"Verts", "Lines", "Polys"};

Kind kind_of(CellType type) {
  switch (type) {
    case CellType::vertex:
    case CellType::poly_vertex:
      return verts;
    case CellType::line:
    case CellType::poly_line:
      return lines;
    case CellType::triangle:
    case CellType::quad:
    case CellType::polygon:
    case CellType::pixel:
    case CellType::triangle_strip:
      return polys;
    default:
      return unknown;
  }
}

/// Cells of one kind, in the order written, with their numbers in the mesh.
struct Cells {
  std::vector<uint32_t> connectivity;
  std::vector<uint64_t> ends;
  std::vector<uint64_t> cells;         ///< numbers in the mesh
  std::vector<uint64_t> corner_order;  ///< corners in the mesh
};

/// One DataArray: the attributes of its tag and its bytes, borrowed or owned.
struct Data {
  std::string attributes;
  Scalar type = Scalar::u8;
  uint32_t components = 1;
  Bytes borrowed;
  std::vector<std::byte> owned;

  Bytes bytes() const { return owned.empty() ? borrowed : Bytes(owned); }
};

/// A group of arrays within an element ("PointData"), as they appear.
struct Section {
  std::string open, close;
  std::vector<Data> arrays;
};

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&' || c == '<' || c == '>' || c == '"' || (c >= 0 && c < ' ')) {
      out += "&#" + std::to_string(static_cast<int>(c)) + ";";
    } else {
      out += c;
    }
  }
  return out;
}

class VtpWriter {
 public:
  VtpWriter(const Mesh& mesh, Sink& sink, const WriteOptions& options)
      : mesh_(mesh), out_(sink), options_(options), sink_name_(sink.name()) {}

  Result<std::vector<std::string>> write();

 private:
  void collect_cells();
  void add_cell(Kind kind, CellType type, uint64_t cell, uint64_t corner, std::span<const uint32_t> nodes);
  bool in_order() const { return in_order_ && dropped_ == 0; }
  void add_field_data();
  void add_block_names();
  void add_points();
  void add_arrays(Domain domain, const char* element);
  void add_cells(Kind kind);
  Data describe(const Array& array, const std::string& more) const;
  std::vector<std::byte> permuted(const Array& array) const;
  Data strings(const std::string& name, std::span<const std::string> values) const;
  template <class T>
  Data numbers(const char* name, const std::vector<T>& values) const;
  std::string active_attributes(Domain domain) const;
  std::string role_mark(const Array& array) const;
  const Array* first_of(Domain domain, Role role) const;

  void put_document();
  void put_array(const Data& data, uint64_t& offset);
  void put_ascii(const Data& data);
  void put_appended(const Data& data);

  const Mesh& mesh_;
  BufferedWriter out_;
  const WriteOptions& options_;
  std::string sink_name_;
  std::array<Cells, kinds> cells_;
  std::vector<Section> field_, piece_;
  std::vector<std::string> notes_;
  uint64_t dropped_ = 0;
  bool in_order_ = true;
};

void VtpWriter::add_cell(Kind kind, CellType type, uint64_t cell, uint64_t corner,
                         std::span<const uint32_t> nodes) {
  Cells& cells = cells_[kind];
  // A pixel's third and fourth nodes are swapped against a quad's.
  static constexpr size_t pixel_order[4] = {0, 1, 3, 2};
  for (size_t i = 0; i < nodes.size(); ++i) {
    const size_t k = type == CellType::pixel ? pixel_order[i] : i;
    cells.connectivity.push_back(nodes[k]);
    cells.corner_order.push_back(corner + k);
  }
  cells.ends.push_back(cells.connectivity.size());
  cells.cells.push_back(cell);
}

void VtpWriter::collect_cells() {
  Kind last = verts;
  uint64_t strips = 0;
  for_each_cell(mesh_, [&](CellType type, uint64_t cell, uint64_t corner, std::span<const uint32_t> nodes) {
    const Kind kind = kind_of(type);
    if (kind == unknown) {
      ++dropped_;
      return;
    }
    in_order_ = in_order_ && kind >= last && type != CellType::pixel && type != CellType::triangle_strip;
    last = kind;
    if (type != CellType::triangle_strip) {
      add_cell(kind, type, cell, corner, nodes);
      return;
    }
    ++strips;
    for (size_t i = 0; i + 2 < nodes.size(); ++i) {
      const size_t odd = i & 1;
      for (const size_t k : {i, i + 1 + odd, i + 2 - odd}) {
        cells_[polys].connectivity.push_back(nodes[k]);
        cells_[polys].corner_order.push_back(corner + k);
      }
      cells_[polys].ends.push_back(cells_[polys].connectivity.size());
      cells_[polys].cells.push_back(cell);
    }
  });
  if (strips != 0) notes_.push_back(counted(strips, "triangle strip") + " split into triangles");
  if (dropped_ != 0) {
    notes_.push_back(counted(dropped_, "volume or quadratic cell") +
                     " left out: VTP holds vertices, lines and polygons only");
  } else if (!in_order_) {
    notes_.push_back("cells were reordered: VTP has vertices first, then lines, then polygons");
  }
}

/// Tuples in the order in which the cells are written.
std::vector<std::byte> VtpWriter::permuted(const Array& array) const {
  std::vector<std::byte> bytes;
  const size_t size = array.tuple_size();
  for (const Cells& cells : cells_) {
    for (const uint64_t i : array.domain == Domain::cell ? cells.cells : cells.corner_order) {
      const std::byte* from = array.bytes.data() + i * size;
      bytes.insert(bytes.end(), from, from + size);
    }
  }
  return bytes;
}

Data VtpWriter::describe(const Array& array, const std::string& more) const {
  Data data;
  data.type = array.type;
  data.components = array.components;
  data.attributes = "type=\"" + std::string(vtk_name_of(array.type)) + "\" Name=\"" + escaped(array.name) +
                    "\" NumberOfComponents=\"" + std::to_string(array.components) + "\"" + more;
  const bool follows_cells = array.domain == Domain::cell || array.domain == Domain::corner;
  if (follows_cells && !in_order()) {
    data.owned = permuted(array);
  } else {
    data.borrowed = array.bytes;
  }
  return data;
}

Data VtpWriter::strings(const std::string& name, std::span<const std::string> values) const {
  Data data;
  data.attributes = "type=\"String\" Name=\"" + escaped(name) + "\" NumberOfTuples=\"" +
                    std::to_string(values.size()) + "\"";
  for (const std::string& value : values) {
    const Bytes bytes = std::as_bytes(std::span(value.data(), value.size()));
    data.owned.insert(data.owned.end(), bytes.begin(), bytes.end());
    data.owned.push_back(std::byte{0});
  }
  return data;
}

template <class T>
Data VtpWriter::numbers(const char* name, const std::vector<T>& values) const {
  // 32 bits where they do: VTK reads either, and the file is half the size.
  const bool wide = !values.empty() && *std::max_element(values.begin(), values.end()) >
                                           static_cast<uint64_t>(std::numeric_limits<int32_t>::max());
  Data data;
  data.type = wide ? Scalar::i64 : Scalar::i32;
  data.attributes = std::string("type=\"") + vtk_name_of(data.type) + "\" Name=\"" + name + "\"";
  const size_t size = size_of(data.type);
  data.owned.resize(values.size() * size);
  for (size_t i = 0; i < values.size(); ++i) {
    const auto value = static_cast<uint64_t>(values[i]);
    std::memcpy(data.owned.data() + i * size, &value, size);  // little-endian: the low bytes come first
  }
  return data;
}

/// The array that becomes the active attribute of this meaning, if VTK takes one of its shape.
const Array* VtpWriter::first_of(Domain domain, Role role) const {
  for (const Array& array : mesh_.arrays) {
    const uint32_t n = array.components;
    const bool suits = role == Role::colour               ? array.type == Scalar::u8 && (n == 3 || n == 4)
                       : role == Role::texture_coordinate ? n <= 3
                                                          : n == 3;
    if (array.domain == domain && array.role == role && suits && !array.name.empty()) return &array;
  }
  return nullptr;
}

std::string VtpWriter::active_attributes(Domain domain) const {
  std::string text;
  const std::pair<const char*, Role> attributes[] = {{"Scalars", Role::colour},
                                                     {"Normals", Role::normal},
                                                     {"Tangents", Role::tangent},
                                                     {"TCoords", Role::texture_coordinate}};
  for (const auto& [attribute, role] : attributes) {
    if (const Array* array = first_of(domain, role)) {
      text += std::string(" ") + attribute + "=\"" + escaped(array->name) + "\"";
    }
  }
  return text;
}

/// For meanings that the active attributes do not tell.
std::string VtpWriter::role_mark(const Array& array) const {
  if (array.role == Role::none) return "";
  const bool attributes = array.domain == Domain::point || array.domain == Domain::cell;
  if (attributes && first_of(array.domain, array.role) == &array) return "";
  return std::string(" maille_role=\"") + name_of(array.role) + "\"";
}

void VtpWriter::add_block_names() {
  bool named = false;
  for (const CellBlock& block : mesh_.blocks) named = named || !block.name.empty();
  if (!named || mesh_.find("block", Domain::cell)) return;
  Array array = make_array("block", Domain::cell, Scalar::u32, 1, Role::label);
  uint32_t number = 0;
  for (const CellBlock& block : mesh_.blocks) {
    const size_t from = array.count();
    array.resize(from + block.size());
    std::fill(array.values<uint32_t>().begin() + static_cast<ptrdiff_t>(from), array.values<uint32_t>().end(),
              number++);
    array.labels.push_back(block.name);
  }
  Data data = describe(array, role_mark(array));
  if (data.owned.empty()) data.owned = std::move(array.bytes);
  data.borrowed = {};
  piece_.back().arrays.push_back(std::move(data));
  field_.back().arrays.push_back(strings("block_labels", array.labels));
  notes_.push_back("VTP has no named blocks: their names are in the cell array \"block\"");
}

void VtpWriter::add_field_data() {
  Section section{"<FieldData>", "</FieldData>", {}};
  for (const auto& [key, value] : mesh_.metadata) {
    section.arrays.push_back(strings(key, std::span(&value, 1)));
  }
  bool corners = false;
  for (const Array& array : mesh_.arrays) {
    if (array.role == Role::label) section.arrays.push_back(strings(array.name + "_labels", array.labels));
    if (array.domain != Domain::mesh && array.domain != Domain::corner) continue;
    corners = corners || array.domain == Domain::corner;
    const std::string tuples = " NumberOfTuples=\"" + std::to_string(array.count()) + "\"";
    const std::string mark = array.domain == Domain::corner ? " maille_domain=\"corner\"" : "";
    section.arrays.push_back(describe(array, tuples + mark + role_mark(array)));
  }
  if (corners) {
    notes_.push_back("VTP has no arrays on corners: they are in FieldData, where only maille knows them");
  }
  field_.push_back(std::move(section));
}

void VtpWriter::add_points() {
  Array points = make_array("Points", Domain::point, mesh_.points.type, 3);
  Data data = describe(points, "");
  data.borrowed = mesh_.points.bytes;
  Section section{"<Points>", "</Points>", {}};
  section.arrays.push_back(std::move(data));
  piece_.push_back(std::move(section));
}

void VtpWriter::add_arrays(Domain domain, const char* element) {
  Section section{
      std::string("<") + element + active_attributes(domain) + ">", std::string("</") + element + ">", {}};
  for (const Array& array : mesh_.arrays) {
    if (array.domain == domain) section.arrays.push_back(describe(array, role_mark(array)));
  }
  piece_.push_back(std::move(section));
}

void VtpWriter::add_cells(Kind kind) {
  Section section{
      std::string("<") + kind_elements[kind] + ">", std::string("</") + kind_elements[kind] + ">", {}};
  section.arrays.push_back(numbers("connectivity", cells_[kind].connectivity));
  section.arrays.push_back(numbers("offsets", cells_[kind].ends));
  piece_.push_back(std::move(section));
}

void VtpWriter::put_ascii(const Data& data) {
  const size_t size = size_of(data.type);
  const Bytes bytes = data.bytes();
  const size_t per_line = data.components > 1 ? data.components : 12;
  for (size_t i = 0; i * size < bytes.size(); ++i) {
    out_.put(i % per_line == 0 ? '\n' : ' ');
    put_scalar(out_, bytes.data() + i * size, data.type);
  }
  out_.put('\n');
}

void VtpWriter::put_array(const Data& data, uint64_t& offset) {
  out_.put("<DataArray " + data.attributes);
  if (options_.ascii) {
    out_.put(" format=\"ascii\">");
    put_ascii(data);
    out_.put("</DataArray>\n");
    return;
  }
  out_.put(" format=\"appended\" offset=\"" + std::to_string(offset) + "\"/>\n");
  offset += sizeof(uint64_t) + data.bytes().size();
}

void VtpWriter::put_appended(const Data& data) {
  const Bytes bytes = data.bytes();
  const uint64_t size = bytes.size();
  if (!options_.big_endian) {
    out_.put_raw(size);
    out_.put_bytes(bytes);
    return;
  }
  const auto put_reversed = [&](const std::byte* from, size_t count) {
    for (size_t k = count; k-- > 0;) out_.put(static_cast<char>(from[k]));
  };
  put_reversed(reinterpret_cast<const std::byte*>(&size), sizeof size);
  for (size_t i = 0; i < bytes.size(); i += size_of(data.type)) {
    put_reversed(bytes.data() + i, size_of(data.type));
  }
}

void VtpWriter::put_document() {
  const auto for_each_data = [&](const std::function<void(const Data&)>& act) {
    for (const auto* sections : {&field_, &piece_}) {
      for (const Section& section : *sections) {
        for (const Data& data : section.arrays) act(data);
      }
    }
  };
  uint64_t offset = 0;
  const auto put_sections = [&](const std::vector<Section>& sections) {
    for (const Section& section : sections) {
      out_.put(section.open + "\n");
      for (const Data& data : section.arrays) put_array(data, offset);
      out_.put(section.close + "\n");
    }
  };
  out_.put("<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"");
  out_.put(options_.big_endian ? "BigEndian" : "LittleEndian");
  out_.put("\" header_type=\"UInt64\">\n<PolyData>\n");
  put_sections(field_);
  out_.put("<Piece NumberOfPoints=\"" + std::to_string(mesh_.point_count()) + "\"");
  for (const Kind kind : {verts, lines, polys}) {
    out_.put(std::string(" NumberOf") + kind_elements[kind] + "=\"" +
             std::to_string(cells_[kind].ends.size()) + "\"");
  }
  out_.put(" NumberOfStrips=\"0\">\n");
  put_sections(piece_);
  out_.put("</Piece>\n</PolyData>\n");
  if (!options_.ascii) {
    out_.put("<AppendedData encoding=\"raw\">\n_");
    for_each_data([&](const Data& data) { put_appended(data); });
    out_.put("\n</AppendedData>\n");
  }
  out_.put("</VTKFile>\n");
}

Result<std::vector<std::string>> VtpWriter::write() {
  collect_cells();
  if (dropped_ != 0 && dropped_ == mesh_.cell_count()) {
    return failure(ErrorCode::usage,
                   sink_name_ + ": VTP holds vertices, lines and polygons, but the mesh has none");
  }
  add_field_data();
  add_points();
  add_arrays(Domain::point, "PointData");
  add_arrays(Domain::cell, "CellData");
  add_block_names();
  for (const Kind kind : {verts, lines, polys}) add_cells(kind);
  put_document();
  MAILLE_CHECK(out_.finish());
  return std::move(notes_);
}

}  // namespace

Result<std::vector<std::string>> write_vtp(const Mesh& mesh, Sink& sink, const WriteOptions& options) {
  return VtpWriter(mesh, sink, options).write();
}

}  // namespace maille
