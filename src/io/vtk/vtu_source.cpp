// VTU files read in parts: the XML is parsed, the appended data stay where they are. Only raw appended data
// will do, as places in base64 or in text are not known without reading all before them.
#include <maille/mesh_source.h>

#include <algorithm>
#include <map>

#include "base/bytes.h"
#include "io/buffered_writer.h"
#include "io/byte_order.h"
#include "io/mesh_sources.h"
#include "io/vtk/vtk_xml_reader.h"
#include "io/vtk/vtu.h"

namespace maille {
namespace {

/// The XML before appended data is read in pieces until these begin. The bound keeps a file without appended
/// data from being read whole; chosen, not swept: names and metadata of a .maille file take 16 MiB at most.
constexpr uint64_t most_xml = uint64_t{64} << 20;

/// The bytes of one appended array, wherever they are and however they are compressed. Of a compressed one
/// the table of blocks stays in memory (8 bytes for each), and the block that was unpacked last.
class AppendedArray {
 public:
  AppendedArray() = default;
  AppendedArray(const Source& source, const VtkXml& xml, uint64_t at, std::string where)
      : source_(&source), xml_(&xml), at_(at), where_(std::move(where)) {}

  /// Finds out how many bytes there are.
  Result<uint64_t> open() {
    if (xml_->compressor == VtkCompressor::none) {
      size_ = MAILLE_TRY(number(at_));
      data_ = at_ + xml_->header_size;
      if (size_ > source_->size() || data_ > source_->size() - size_)
        return bad("they go on behind the end of the file");
      return size_;
    }
    const uint64_t blocks = MAILLE_TRY(number(at_));
    block_size_ = MAILLE_TRY(number(at_ + xml_->header_size));
    const uint64_t last = MAILLE_TRY(number(at_ + 2 * uint64_t{xml_->header_size}));
    const uint64_t table = at_ + 3 * uint64_t{xml_->header_size};
    // Before anything is allocated: the table must be in the file, and a block is no larger than most_block.
    if (blocks > source_->size() / xml_->header_size || block_size_ > most_block || last > block_size_)
      return bad("their blocks are too many or too large");
    data_ = table + blocks * xml_->header_size;
    std::vector<std::byte> sizes(blocks * xml_->header_size);
    if (data_ > source_->size()) return bad("they go on behind the end of the file");
    MAILLE_CHECK(source_->read_at(table, sizes));
    ends_.reserve(blocks);
    uint64_t end = 0;
    for (uint64_t i = 0; i < blocks; ++i) {
      end += number_in(sizes.data() + i * xml_->header_size);
      // Compared at each step, so the sum cannot overflow.
      if (end > source_->size()) return bad("they go on behind the end of the file");
      ends_.push_back(end);
    }
    if (data_ + end > source_->size()) return bad("they go on behind the end of the file");
    size_ = blocks == 0 ? 0 : (blocks - 1) * block_size_ + (last == 0 ? block_size_ : last);
    return size_;
  }

  /// Bytes from `first` on; the caller has checked that they are there.
  Result<> read(uint64_t first, std::span<std::byte> out) {
    if (xml_->compressor == VtkCompressor::none) return source_->read_at(data_ + first, out);
    // block_size_ is not 0 here: an array of such blocks has no bytes that could be asked for.
    while (!out.empty()) {
      const uint64_t block = first / block_size_;
      MAILLE_CHECK(load_block(block));
      const uint64_t from = first - block * block_size_;
      const size_t part = std::min<size_t>(out.size(), unpacked_.size() - from);
      std::copy_n(unpacked_.begin() + static_cast<ptrdiff_t>(from), part, out.begin());
      out = out.subspan(part);
      first += part;
    }
    return {};
  }

 private:
  // Chosen, not swept: VTK's blocks are far smaller by default. It bounds what one block may take in memory.
  static constexpr uint64_t most_block = uint64_t{256} << 20;

  tl::unexpected<Error> bad(const std::string& what) const {
    return failure(ErrorCode::malformed_input, where_ + ": its data are damaged: " + what);
  }
  uint64_t number_in(const std::byte* from) const {
    std::byte bytes[8] = {};
    std::copy_n(from, xml_->header_size, bytes);
    if (xml_->swapped) std::reverse(bytes, bytes + xml_->header_size);
    return load<uint64_t>(bytes);
  }
  Result<uint64_t> number(uint64_t at) const {
    std::byte bytes[8] = {};
    if (at > source_->size() || source_->size() - at < xml_->header_size)
      return bad("they begin behind the end of the file");
    MAILLE_CHECK(source_->read_at(at, std::span(bytes, xml_->header_size)));
    return number_in(bytes);
  }
  Result<> load_block(uint64_t block) {
    if (block == loaded_) return {};
    const uint64_t begin = block == 0 ? 0 : ends_[block - 1];
    packed_.resize(ends_[block] - begin);
    MAILLE_CHECK(source_->read_at(data_ + begin, packed_));
    const uint64_t size = std::min(block_size_, size_ - block * block_size_);
    unpacked_.resize(size);
    // A block that could not be unpacked is not the loaded one.
    loaded_ = UINT64_MAX;
    if (!unpack_vtk_block(xml_->compressor, packed_, unpacked_))
      return bad("block " + std::to_string(block) + " does not decompress to the size stated");
    loaded_ = block;
    return {};
  }

  const Source* source_ = nullptr;
  const VtkXml* xml_ = nullptr;
  uint64_t at_ = 0, data_ = 0, size_ = 0;
  std::string where_;
  uint64_t block_size_ = 0;
  std::vector<uint64_t> ends_;  ///< of the compressed blocks
  std::vector<std::byte> packed_, unpacked_;
  uint64_t loaded_ = UINT64_MAX;
};

/// A DataArray that is read in parts: its name, type and components, without values, and where these are.
struct Column {
  Array description;
  uint64_t tuples = 0;
  AppendedArray data;
};

struct Piece {
  uint64_t points = 0, cells = 0;
  Column positions, connectivity, ends, types;
  std::vector<Column> arrays;
};

/// Pieces are one after the other, in points, cells and arrays, as in a whole read. Meshes whose pieces have
/// to be joined are refused as unsupported, as are texts and polyhedra: the reader of whole files does these.
class VtuSource final : public MeshSource {
 public:
  VtuSource(const Source& source, const Limits& limits)
      : source_(source), budget_(source.name(), source.size(), limits) {}

  Result<> open();

  const MeshDescription& description() const override { return description_; }
  Result<> read_points(uint64_t first, uint64_t count, std::span<std::byte> out) override {
    return read_column([](Piece& piece) -> Column& { return piece.positions; }, true, first, count, out);
  }
  Result<> read_cells(uint64_t first, uint64_t count, CellPiece& out) override;
  Result<> read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) override {
    const bool on_points = description_.arrays[array].domain == Domain::point;
    return read_column([&](Piece& piece) -> Column& { return piece.arrays[array]; }, on_points, first, count,
                       out);
  }

 private:
  Result<> load_xml();
  Result<> open_piece(pugi::xml_node piece);
  Result<Column> open_column(pugi::xml_node node, const std::string& where, uint64_t tuples);
  Result<> check_pieces() const;
  Result<> open_data(pugi::xml_node data, Domain domain, Piece& piece, const std::string& where);
  Result<Array> read_field(pugi::xml_node node, const std::string& where);
  Result<> read_fields(pugi::xml_node grid);
  Result<> read(Column& column, uint64_t first, uint64_t count, std::span<std::byte> out);
  Result<> read_integers(Column& column, uint64_t first, uint64_t count, std::vector<uint64_t>& out);
  Result<> check_shapes(uint64_t first, uint64_t count) const;
  Result<> read_piece_cells(Piece& piece, uint64_t first, uint64_t count, uint64_t base, CellPiece& out);
  template <class Of>
  Result<> read_column(Of of, bool on_points, uint64_t first, uint64_t count, std::span<std::byte> out);
  tl::unexpected<Error> malformed(const std::string& where, const std::string& what) const {
    return failure(ErrorCode::malformed_input, where + ": " + what);
  }
  tl::unexpected<Error> unsupported(const std::string& what) const {
    return failure(ErrorCode::unsupported, source_.name() + ": " + what);
  }

  const Source& source_;
  Budget budget_;
  VtkXml xml_;
  uint64_t appended_ = 0;
  MeshDescription description_;
  std::vector<Piece> pieces_;
  VtkFieldData field_;
  bool has_block_array_ = false;
  // Of the cells that are read, kept for the next call: pages that come and go cost as much as reading.
  std::vector<std::byte> bytes_;
  std::vector<uint64_t> ends_, types_;
};

/// Reads up to the underscore with which the appended data begin, doubling what was read until it is there.
Result<> VtuSource::load_xml() {
  std::string text;
  size_t underscore = std::string::npos;
  while (underscore == std::string::npos) {
    const uint64_t more =
        std::min<uint64_t>(source_.size() - text.size(), std::max<uint64_t>(text.size(), 1 << 16));
    if (more == 0 || text.size() > most_xml)
      return unsupported("it has no appended data, so it cannot be read in parts");
    const size_t at = text.size();
    text.resize(at + more);
    MAILLE_CHECK(source_.read_at(at, std::as_writable_bytes(std::span(text.data() + at, more))));
    const size_t tag = text.find("<AppendedData");
    const size_t close = tag == std::string::npos ? tag : text.find('>', tag);
    if (close != std::string::npos) underscore = text.find('_', close);
  }
  const size_t tag = text.find("<AppendedData");
  const std::string_view attributes = std::string_view(text).substr(tag, underscore - tag);
  if (attributes.find("raw") == std::string_view::npos)
    return unsupported("its appended data are base64, which cannot be read in parts");
  appended_ = underscore + 1;
  const std::string head = text.substr(0, tag) + "</VTKFile>";
  xml_ = MAILLE_TRY(parse_vtk_xml(std::as_bytes(std::span(head.data(), head.size())), source_.name(),
                                  {"UnstructuredGrid"}));
  return {};
}

Result<Column> VtuSource::open_column(pugi::xml_node node, const std::string& where, uint64_t tuples) {
  Column column;
  const auto type = scalar_of_vtk(node.attribute("type").as_string());
  if (!type) return malformed(where, "its type is no VTK number type");
  const long long components = node.attribute("NumberOfComponents").as_llong(1);
  if (components < 1 || components > 0xffff) return malformed(where, "NumberOfComponents must be 1 to 65535");
  if (std::string_view(node.attribute("format").as_string()) != "appended")
    return unsupported("not all of its arrays are appended, so it cannot be read in parts");
  const uint64_t offset = node.attribute("offset").as_ullong(UINT64_MAX);
  if (offset > source_.size() - appended_)
    return malformed(where, "its offset points behind the end of the file");
  column.description =
      make_array(node.attribute("Name").as_string(), Domain::mesh, *type, static_cast<uint32_t>(components));
  column.data = AppendedArray(source_, xml_, appended_ + offset, where);
  const uint64_t size = MAILLE_TRY(column.data.open());
  column.tuples = size / column.description.tuple_size();
  if (tuples != UINT64_MAX && (column.tuples != tuples || size % column.description.tuple_size() != 0)) {
    return malformed(
        where, "it has " + std::to_string(column.tuples) + " tuples instead of " + std::to_string(tuples));
  }
  return column;
}

Result<> VtuSource::open_data(pugi::xml_node data, Domain domain, Piece& piece, const std::string& where) {
  for (const pugi::xml_node node : data.children()) {
    const std::string_view tag = node.name();
    if (tag != "DataArray" && tag != "Array") continue;
    if (std::string_view(node.attribute("type").as_string()) == "String")
      return unsupported("it has arrays of text, which cannot be read in parts");
    // It says the same as the names of the blocks, so it is no array of the mesh.
    if (node.attribute(vtu_block_mark)) {
      has_block_array_ = true;
      continue;
    }
    const std::string place = where + ", array \"" + node.attribute("Name").as_string() + "\"";
    Column column =
        MAILLE_TRY(open_column(node, place, domain == Domain::point ? piece.points : piece.cells));
    column.description.domain = domain;
    column.description.role = vtk_role_of(column.description, data, node);
    piece.arrays.push_back(std::move(column));
  }
  return {};
}

Result<> VtuSource::open_piece(pugi::xml_node node) {
  const std::string where = xml_.file + ": piece " + std::to_string(pieces_.size());
  Piece piece;
  piece.points = node.attribute("NumberOfPoints").as_ullong(0);
  piece.cells = node.attribute("NumberOfCells").as_ullong(0);
  if (piece.points == 0 && piece.cells == 0) return {};
  piece.positions =
      MAILLE_TRY(open_column(node.child("Points").child("DataArray"), where + ", Points", piece.points));
  if (piece.positions.description.components != 3) return malformed(where, "Points need 3 components");
  const pugi::xml_node cells = node.child("Cells");
  const auto named = [&](const char* name) {
    return cells.find_child_by_attribute("DataArray", "Name", name);
  };
  if (named("faces") || named("face_connectivity"))
    return unsupported("it has polyhedra, which cannot be read in parts");
  piece.connectivity = MAILLE_TRY(open_column(named("connectivity"), where + ", connectivity", UINT64_MAX));
  piece.ends = MAILLE_TRY(open_column(named("offsets"), where + ", offsets", piece.cells));
  piece.types = MAILLE_TRY(open_column(named("types"), where + ", types", piece.cells));
  for (const Column* column : {&piece.connectivity, &piece.ends, &piece.types}) {
    if (is_float(column->description.type) || column->description.components != 1)
      return malformed(where, "connectivity, offsets and types must be integers with one component");
  }
  MAILLE_CHECK(open_data(node.child("PointData"), Domain::point, piece, where + ", PointData"));
  MAILLE_CHECK(open_data(node.child("CellData"), Domain::cell, piece, where + ", CellData"));
  const auto same = [](const Column& a, const Column& b) {
    return a.description.name == b.description.name && a.description.type == b.description.type &&
           a.description.domain == b.description.domain &&
           a.description.components == b.description.components;
  };
  if (!pieces_.empty() && (!std::equal(piece.arrays.begin(), piece.arrays.end(), pieces_[0].arrays.begin(),
                                       pieces_[0].arrays.end(), same) ||
                           piece.positions.description.type != pieces_[0].positions.description.type)) {
    return malformed(where, "pieces must have the same arrays in the same order");
  }
  description_.points += piece.points;
  description_.cells += piece.cells;
  description_.corners += piece.connectivity.tuples;
  pieces_.push_back(std::move(piece));
  return {};
}

/// An array of the field data, whose values may also stand in its tag.
Result<Array> VtuSource::read_field(pugi::xml_node node, const std::string& where) {
  if (std::string_view(node.attribute("format").as_string()) != "appended")
    return read_data_array(xml_, node, where, budget_);
  Column column = MAILLE_TRY(open_column(node, where, UINT64_MAX));
  Array array = column.description;
  MAILLE_CHECK(budget_.take(column.tuples, array.tuple_size()));
  array.resize(column.tuples);
  MAILLE_CHECK(read(column, 0, column.tuples, array.bytes));
  return array;
}

/// Reads fields, which are small, whole; the budget bounds them.
Result<> VtuSource::read_fields(pugi::xml_node grid) {
  for (const pugi::xml_node data : {grid.child("FieldData"), grid.parent().child("FieldData")}) {
    for (const pugi::xml_node node : data.children()) {
      const std::string name = node.attribute("Name").as_string();
      const std::string where = xml_.file + ": FieldData, array \"" + name + "\"";
      const bool text = std::string_view(node.attribute("type").as_string()) == "String" || is_own_text(node);
      // read_field() knows numbers only, and texts are stored as bytes.
      pugi::xml_document copy;
      pugi::xml_node number = copy.append_copy(node);
      if (text) {
        number.attribute("type").set_value("UInt8");
        number.remove_attribute("NumberOfComponents");
      }
      Array array = MAILLE_TRY(read_field(number, where));
      if (!text) {
        array.role = vtk_role_of(array, data, node);
        field_.arrays.push_back(std::move(array));
        continue;
      }
      field_.strings.push_back({name, split_texts(array.bytes), bool(node.attribute(vtk_own_text_mark))});
    }
  }
  return {};
}

/// Refuses pieces that have points or cells in common: what they share is joined by a whole read only.
Result<> VtuSource::check_pieces() const {
  if (pieces_.size() < 2) return {};
  for (const Column& column : pieces_[0].arrays) {
    const std::string& name = column.description.name;
    if (name == "vtkGhostType" || name == "vtkGhostLevels" || name == "GlobalPointIds")
      return failure(ErrorCode::unsupported,
                     xml_.file + ": pieces with \"" + name + "\" are not read in parts");
  }
  return {};
}

Result<> VtuSource::open() {
  MAILLE_CHECK(load_xml());
  const pugi::xml_node grid = xml_.document.child("VTKFile").child("UnstructuredGrid");
  for (const pugi::xml_node piece : grid.children("Piece")) MAILLE_CHECK(open_piece(piece));
  MAILLE_CHECK(check_pieces());
  MAILLE_CHECK(read_fields(grid));
  const Array sizes = field_.take_array(vtk_blocks_name).value_or(Array());
  uint64_t cells = 0;
  for (const NamedRun& shape : vtk_block_shapes(sizes, field_.take_strings(vtk_block_names_name))) {
    description_.blocks.push_back({shape.name, shape.type, shape.cells});
    cells += shape.cells;
  }
  if (cells != description_.cells) description_.blocks.clear();
  if (description_.blocks.empty() && description_.cells != 0)
    description_.blocks.push_back({"", CellType::mixed, description_.cells});
  if (!pieces_.empty()) {
    description_.point_type = pieces_[0].positions.description.type;
    for (const Column& column : pieces_[0].arrays) description_.arrays.push_back(column.description);
  }
  if (has_block_array_) field_.take_strings(std::string(vtk_block_array_name) + "_labels");
  for (Array& array : description_.arrays) field_.give_labels(array);
  for (Array& array : field_.arrays) field_.give_labels(array);
  Mesh fields;
  VtkTexts texts;
  field_.move_to(fields, texts);
  texts.finish(fields);
  description_.mesh_arrays = std::move(fields.arrays);
  description_.metadata = std::move(fields.metadata);
  return {};
}

Result<> VtuSource::read(Column& column, uint64_t first, uint64_t count, std::span<std::byte> out) {
  const size_t size = column.description.tuple_size();
  if (count > column.tuples || first > column.tuples - count || out.size() != count * size) {
    return failure(ErrorCode::usage,
                   source_.name() + ": elements " + std::to_string(first) + " and the " +
                       std::to_string(count) +
                       " behind it are not all there, or the room for them is of another size");
  }
  MAILLE_CHECK(column.data.read(first * size, out));
  if (xml_.swapped) swap_numbers(out, size_of(column.description.type));
  return {};
}

template <class Of>
Result<> VtuSource::read_column(Of of, bool on_points, uint64_t first, uint64_t count,
                                std::span<std::byte> out) {
  for (Piece& piece : pieces_) {
    const uint64_t here = on_points ? piece.points : piece.cells;
    const uint64_t part = first < here ? std::min(count, here - first) : 0;
    if (part != 0) {
      Column& column = of(piece);
      const size_t size = part * column.description.tuple_size();
      if (size > out.size()) break;
      MAILLE_CHECK(read(column, first, part, out.first(size)));
      out = out.subspan(size);
      count -= part;
    }
    first = first > here ? first - here : 0;
  }
  if (count == 0 && out.empty()) return {};
  return failure(
      ErrorCode::usage,
      source_.name() +
          ": more elements were asked for than there are, or the room for them is of another size");
}

/// Appends whole numbers to `out`.
Result<> VtuSource::read_integers(Column& column, uint64_t first, uint64_t count,
                                  std::vector<uint64_t>& out) {
  bytes_.resize(count * size_of(column.description.type));
  MAILLE_CHECK(read(column, first, count, bytes_));
  const size_t before = out.size();
  out.resize(before + count);
  with_type(column.description.type, [&](auto zero) {
    using T = decltype(zero);
    for (uint64_t i = 0; i < count; ++i)
      out[before + i] = static_cast<uint64_t>(load<T>(bytes_.data() + i * sizeof(T)));
  });
  return {};
}

/// Whether types and sizes of the cells that were read belong together. `first`: for the message. Most cells
/// are like the one before, so its type and size are compared first.
Result<> VtuSource::check_shapes(uint64_t first, uint64_t count) const {
  const uint64_t before = ends_.size() - count;
  uint64_t good_type = 256, good_size = 0;
  for (uint64_t i = 0; i < count; ++i) {
    const uint64_t size = ends_[i + before] - (i + before == 0 ? 0 : ends_[i + before - 1]);
    if (types_[i] == good_type && size == good_size) continue;
    const auto type = static_cast<CellType>(std::min<uint64_t>(types_[i], 255));
    if (std::string_view(name_of(type)) == "unknown" || type == CellType::polyhedron ||
        type == CellType::mixed || (nodes_of(type) != 0 && nodes_of(type) != size)) {
      return malformed(xml_.file, "cell " + std::to_string(first + i) + " has type " +
                                      std::to_string(types_[i]) + " and " + std::to_string(size) +
                                      " points, which do not belong together");
    }
    good_type = types_[i];
    good_size = size;
  }
  return {};
}

Result<> VtuSource::read_piece_cells(Piece& piece, uint64_t first, uint64_t count, uint64_t base,
                                     CellPiece& out) {
  ends_.clear();
  types_.clear();
  // The file has where cells end; a part also needs where its first one begins, which is the end of the cell
  // before.
  const uint64_t before = first == 0 ? 0 : 1;
  MAILLE_CHECK(read_integers(piece.ends, first - before, count + before, ends_));
  MAILLE_CHECK(read_integers(piece.types, first, count, types_));
  const uint64_t begin = before == 0 ? 0 : ends_[0];
  if (!std::is_sorted(ends_.begin(), ends_.end()) || begin > ends_.back() ||
      ends_.back() > piece.connectivity.tuples) {
    return malformed(xml_.file, "the offsets of cells " + std::to_string(first) +
                                    " and behind decrease or go beyond the connectivity");
  }
  const size_t at = out.connectivity.size();
  MAILLE_CHECK(read_integers(piece.connectivity, begin, ends_.back() - begin, out.connectivity));
  const std::span points = std::span(out.connectivity).subspan(at);
  const auto beyond =
      std::find_if(points.begin(), points.end(), [&](uint64_t point) { return point >= piece.points; });
  if (beyond != points.end()) {
    return malformed(xml_.file, "a cell from " + std::to_string(first) + " on uses point " +
                                    std::to_string(static_cast<int64_t>(*beyond)) + ", but there are " +
                                    std::to_string(piece.points) + " points");
  }
  if (base != 0) {
    for (uint64_t& point : points) point += base;
  }
  MAILLE_CHECK(check_shapes(first, count));
  // Wraps around where it is negative; sums with ends come out right modulo 2^64.
  const uint64_t shift = out.offsets.back() - begin;  // wraps around
  const size_t cells = out.types.size();
  out.types.resize(cells + count);
  out.offsets.resize(cells + count + 1);
  for (uint64_t i = 0; i < count; ++i) {
    out.types[cells + i] = static_cast<uint8_t>(types_[i]);
    out.offsets[cells + i + 1] = shift + ends_[i + before];
  }
  return {};
}

Result<> VtuSource::read_cells(uint64_t first, uint64_t count, CellPiece& out) {
  out.types.clear();
  out.connectivity.clear();
  out.offsets.assign(1, 0);
  uint64_t base = 0;
  for (Piece& piece : pieces_) {
    const uint64_t part = first < piece.cells ? std::min(count, piece.cells - first) : 0;
    if (part != 0) MAILLE_CHECK(read_piece_cells(piece, first, part, base, out));
    count -= part;
    first = first > piece.cells ? first - piece.cells : 0;
    base += piece.points;
  }
  if (count != 0)
    return failure(ErrorCode::usage, source_.name() + ": more cells were asked for than there are");
  return {};
}

}  // namespace

Result<std::unique_ptr<MeshSource>> open_vtu_source(const Source& source, const Limits& limits) {
  auto opened = std::make_unique<VtuSource>(source, limits);
  MAILLE_CHECK(opened->open());
  return std::unique_ptr<MeshSource>(std::move(opened));
}

}  // namespace maille
