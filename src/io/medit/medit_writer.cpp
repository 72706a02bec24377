#include <algorithm>
#include <map>
#include <type_traits>
#include <utility>

#include "base/bytes.h"
#include "io/buffered_writer.h"
#include "io/cells.h"
#include "io/medit/medit.h"
#include "io/notes.h"
#include "io/reading.h"

namespace maille {
namespace {

const MeditCellKind* kind_of(CellType type) {
  for (const MeditCellKind& kind : medit_cell_kinds) {
    if (kind.type == type) return &kind;
  }
  return nullptr;
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
  /// Sorts cells by type, as sections want them, and notes what cannot be written.
  void collect();
  void choose_references();
  void note_arrays();
  std::vector<int32_t> references_of(const Array& array) const;
  bool flagged(const char* name, Domain domain, uint64_t element) const;
  void begin(const char* name, int32_t code, uint64_t count, uint64_t bytes_each);
  void put_int(int64_t value, char behind);
  void put_vertices();
  void put_flags(const MeditFlagKind& kind);

  const Mesh& mesh_;
  BufferedWriter out_;
  bool binary_;
  /// Bytes written so far: a binary section begins with the place where the next one begins. Not counted in
  /// text.
  uint64_t position_ = 0;
  std::vector<CellType> order_;
  std::map<CellType, std::vector<Cell>> cells_;
  std::vector<int32_t> point_references_, cell_references_;
  const Array *point_array_ = nullptr, *cell_array_ = nullptr;  ///< where the references come from
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
      // MEDIT has no polygons: those of three and four corners are its triangles and quadrilaterals (see
      // `written`). A kind without a code exists in text only.
      const MeditCellKind* kind = kind_of(written);
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

/// References have 32 bits: an array with a larger value is none, and named as left out.
bool fits_references(const Array& array) {
  return with_type(array.type, [&](auto zero) {
    using T = decltype(zero);
    const auto values = array.values<T>();
    if constexpr (std::is_integral_v<T>)
      return std::all_of(values.begin(), values.end(), [](T value) { return std::in_range<int32_t>(value); });
    return false;
  });
}
bool is_reference(const Array& array) {
  return array.components == 1 && (array.name == medit_reference_name || array.name == "gmsh:physical") &&
         fits_references(array);
}

// References come from an array of MEDIT's or Gmsh's, or number the names of blocks, in the order of their
// first use.
void MeditWriter::choose_references() {
  for (const Array& array : mesh_.arrays) {
    if (!is_reference(array)) continue;
    if (array.domain == Domain::point && point_array_ == nullptr) point_array_ = &array;
    if (array.domain == Domain::cell && cell_array_ == nullptr) cell_array_ = &array;
  }
  if (point_array_ != nullptr) point_references_ = references_of(*point_array_);
  if (cell_array_ != nullptr) cell_references_ = references_of(*cell_array_);
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
    if (&array == point_array_ || &array == cell_array_) continue;
    if (array.name.starts_with("medit:") && array.type == Scalar::u8) continue;
    note_array(array, notes_);
  }
  for (const auto& [key, value] : mesh_.metadata) note_metadata(key, value, notes_);
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
  // Version 3 of the format: positions of 64 bits, numbers of 32.
  out_.put_raw(static_cast<int64_t>(position_ + sizeof(int64_t) + sizeof(int32_t) + count * bytes_each));
  position_ += sizeof(int64_t);
  put_int(static_cast<int64_t>(count), ' ');
}

void MeditWriter::put_vertices() {
  begin("Vertices", medit_vertices, mesh_.point_count(), 3 * sizeof(double) + sizeof(int32_t));
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

void MeditWriter::put_flags(const MeditFlagKind& kind) {
  std::vector<uint64_t> elements;
  if (kind.type == CellType::vertex) {
    for (uint64_t i = 0; i < mesh_.point_count(); ++i) {
      if (flagged(kind.array, Domain::point, i)) elements.push_back(i);
    }
  } else {
    const auto& cells = cells_[kind.type];
    // Elements are numbered within their type, as they are written.
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
    // The cookie, the version, and the section of the dimension, which is only a number without a count.
    for (const int32_t value : {1, 3, medit_dimension}) put_int(value, ' ');
    out_.put_raw(static_cast<int64_t>(position_ + sizeof(int64_t) + sizeof(int32_t)));
    position_ += sizeof(int64_t);
    put_int(3, ' ');
    if (mesh_.points.type != Scalar::f64) notes_.push_back("positions are written as doubles");
  }
  put_vertices();
  std::vector<uint32_t> nodes;
  for (const CellType type : order_) {
    const MeditCellKind& kind = *kind_of(type);
    begin(kind.name, kind.code, cells_[type].size(), (nodes_of(type) + 1) * sizeof(int32_t));
    for (const Cell& cell : cells_[type]) {
      nodes.assign(cell.nodes.begin(), cell.nodes.end());
      if (type == CellType::wedge) swap_medit_wedge(nodes.data());
      for (const uint32_t node : nodes) put_int(int64_t{node} + 1, ' ');
      put_int(cell_references_[cell.number], '\n');
    }
  }
  for (const MeditFlagKind& kind : medit_flag_kinds) put_flags(kind);
  if (binary_) {
    out_.put_raw(medit_end);
  } else {
    out_.put("\nEnd\n");
  }
  note_arrays();
  MAILLE_CHECK(out_.finish());
  return std::move(notes_);
}

}  // namespace

Result<std::vector<std::string>> write_medit_text(const Mesh& mesh, Sink& sink, const WriteOptions&) {
  return MeditWriter(mesh, sink, false).write();
}
Result<std::vector<std::string>> write_medit_binary(const Mesh& mesh, Sink& sink, const WriteOptions&) {
  return MeditWriter(mesh, sink, true).write();
}

}  // namespace maille
