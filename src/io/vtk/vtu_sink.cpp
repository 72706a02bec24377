// VTU files written in parts: the counts are known, so every array has its place before the first value
// comes, and parts may come in any order. Memory is one part; the file is written in place and appears when
// it is complete.
#include <maille/mesh_source.h>
#include <maille/xml.h>

#include <algorithm>
#include <cstring>
#include <optional>

#include "base/region_file.h"
#include "base/result.h"
#include "io/vtk/vtk_field_data.h"
#include "io/vtk/vtk_polyhedron.h"
#include "io/vtk/vtk_xml_writer.h"
#include "io/vtk/vtu.h"

namespace maille {
namespace {

/// Where the values of an array are, counted from the underscore of the appended data.
struct Region {
  uint64_t begin = 0, size = 0;
};

/// The XML is built first, with a region for each array, in the order in which the tags stand; then it is
/// written, and the values go to their regions. What is not written stays zero, and commit() refuses a file
/// whose cells are not complete.
class VtuSink final : public MeshSink {
 public:
  VtuSink(const std::string& path, const MeshDescription& description)
      : file_(path), description_(description) {}

  Result<> open();
  Result<> write_points(uint64_t first, Bytes positions) override {
    return write(points_, first * 3 * size_of(description_.point_type), positions);
  }
  Result<> write_array(size_t array, uint64_t first, Bytes tuples) override {
    return write(arrays_[array], first * description_.arrays[array].tuple_size(), tuples);
  }
  Result<> write_cells(const CellPiece& cells) override;
  Result<> commit() override;
  std::vector<std::string> notes() const override {
    auto note = vtk_xml_note({description_.arrays, description_.mesh_arrays}, description_.metadata);
    auto notes = note ? std::vector<std::string>{std::move(*note)} : std::vector<std::string>();
    note_pyramids(lagrange_pyramids_, notes);
    return notes;
  }

 private:
  Region add(const std::string& tag, uint64_t size);
  void add_values(const std::string& tag, Bytes values);
  void add_texts(const std::string& name, const std::vector<std::string>& values, bool own = true);
  void add_blocks();
  void add_fields();
  void add_data(Domain domain, const char* element);
  bool has_names() const;
  Result<> write_names(uint64_t cells);
  uint64_t entries() const;
  uint64_t face_entries() const;
  Result<> write_sizes();
  Result<> write(const Region& region, uint64_t at, Bytes bytes);
  Result<> write_integers(const Region& region, uint64_t first, std::span<const uint64_t> values,
                          Scalar type);

  RegionFile file_;
  MeshDescription description_;
  std::string xml_;
  uint64_t next_ = 0;  ///< place of the next array in the appended data
  std::vector<Region> regions_;
  std::vector<std::pair<Region, std::vector<std::byte>>> values_;  ///< known from the beginning
  Region points_, connectivity_, ends_, types_, faces_, face_ends_;
  std::optional<Region> names_;  ///< number of the block by cell: what VTK's users see of it
  std::vector<Region> arrays_;
  Scalar point_number_ = Scalar::i32, end_number_ = Scalar::i32;
  uint64_t cells_ = 0, corners_ = 0, lagrange_pyramids_ = 0;
  uint64_t entries_ = 0, face_entries_ = 0;  ///< of the connectivity and the faces of the file
  std::vector<uint64_t> points_of_piece_, ends_of_piece_, faces_of_piece_, face_ends_of_piece_, sorted_;
  std::vector<uint32_t> narrow_;
  size_t named_block_ = 0;
  uint64_t named_end_ = 0;
};

/// As vtu_writer.cpp has it: the array of names is left out where the mesh has one of this name.
bool VtuSink::has_names() const {
  const auto same = [](const Array& array) {
    return array.domain == Domain::cell && array.name == vtk_block_array_name;
  };
  return vtk_has_names(description_.blocks) &&
         std::none_of(description_.arrays.begin(), description_.arrays.end(), same);
}

Region VtuSink::add(const std::string& tag, uint64_t size) {
  xml_ += "<DataArray " + tag + " format=\"appended\" offset=\"" + std::to_string(next_) + "\"/>\n";
  const Region region{next_ + sizeof(uint64_t), size};
  next_ += sizeof(uint64_t) + size;
  regions_.push_back(region);
  return region;
}

/// Adds an array of the field data.
void VtuSink::add_values(const std::string& tag, Bytes values) {
  if (values.size() <= most_inline_bytes) {
    xml_ += "<DataArray " + tag + vtk_xml_inline(values);
    return;
  }
  const Region region = add(tag, values.size());
  values_.emplace_back(region, std::vector<std::byte>(values.begin(), values.end()));
}

/// Adds texts; `own`: what was no text in a VTK file, as bytes (see vtk_own_text_mark).
void VtuSink::add_texts(const std::string& name, const std::vector<std::string>& values, bool own) {
  std::string text;
  for (const std::string& value : values) text.append(value).push_back('\0');
  const std::string mark = own ? std::string(" ") + vtk_own_text_mark + "=\"1\"" : "";
  add_values("type=\"" + std::string(own ? "UInt8" : "String") + "\" Name=\"" + xml_escaped(name) +
                 "\" NumberOfTuples=\"" + std::to_string(own ? text.size() : values.size()) + "\"" + mark,
             std::as_bytes(std::span(text.data(), text.size())));
}

std::string tag_of(const Array& array) {
  const std::string components =
      array.components == 1 ? "" : " NumberOfComponents=\"" + std::to_string(array.components) + "\"";
  return std::string("type=\"") + vtk_name_of(array.type) + "\" Name=\"" + xml_escaped(array.name) + "\"" +
         components +
         (array.role == Role::none ? "" : std::string(" maille_role=\"") + name_of(array.role) + "\"");
}

void VtuSink::add_blocks() {
  const VtkBlocks& blocks = description_.blocks;
  if (!vtk_needs_blocks(blocks)) return;
  const Array sizes = vtk_block_sizes(blocks);
  add_values(tag_of(sizes) + " NumberOfTuples=\"" + std::to_string(sizes.count()) + "\"", sizes.bytes);
  const std::vector<std::string> names = vtk_block_names(blocks);
  if (vtk_has_names(blocks)) add_texts(vtk_block_names_name, names);
  if (has_names()) add_texts(std::string(vtk_block_array_name) + vtk_labels_suffix, names);
}

/// Adds FieldData. A text array of a VTK file is written as one only where it is on the mesh: on points and
/// cells its size is not known before the values.
void VtuSink::add_fields() {
  xml_ += "<FieldData>\n";
  add_blocks();
  const auto is_text = [&](const Array& array) {
    return array.domain == Domain::mesh && array.components == 1 && is_vtk_text(description_.metadata, array);
  };
  for (const Array& array : description_.mesh_arrays) {
    if (is_text(array)) {
      add_texts(array.name, vtk_texts_of(array), false);
      continue;
    }
    add_values(tag_of(array) + " NumberOfTuples=\"" + std::to_string(array.count()) + "\"", array.bytes);
  }
  for (const auto* arrays : {&description_.arrays, &description_.mesh_arrays}) {
    for (const Array& array : *arrays) {
      if (array.role == Role::label && !is_text(array)) add_texts(array.name + "_labels", array.labels);
    }
  }
  for (const auto& [key, value] : description_.metadata) {
    if (key == vtk_text_key) continue;
    add_texts(key, {value}, !was_vtk_text(description_.metadata, Domain::mesh, key));
  }
  xml_ += "</FieldData>\n";
}

void VtuSink::add_data(Domain domain, const char* element) {
  xml_ += std::string("<") + element + ">\n";
  for (size_t i = 0; i < description_.arrays.size(); ++i) {
    const Array& array = description_.arrays[i];
    if (array.domain == domain)
      arrays_[i] = add(tag_of(array), description_.count_of(array) * array.tuple_size());
  }
  if (domain == Domain::cell && has_names()) {
    const Array names = make_array(vtk_block_array_name, Domain::cell, Scalar::u32, 1, Role::label);
    names_ = add(tag_of(names) + " " + vtu_block_mark + "=\"1\"", description_.cells * sizeof(uint32_t));
  }
  xml_ += std::string("</") + element + ">\n";
}

Result<> VtuSink::open() {
  // 64 bits only where 32 do not do, as vtk_xml_numbers() has it, so both ways write the same types.
  if (description_.points > INT32_MAX) point_number_ = Scalar::i64;
  if (description_.corners > INT32_MAX) end_number_ = Scalar::i64;
  arrays_.resize(description_.arrays.size());
  xml_ =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n";
  add_fields();
  xml_ += "<Piece NumberOfPoints=\"" + std::to_string(description_.points) + "\" NumberOfCells=\"" +
          std::to_string(description_.cells) + "\">\n<Points>\n";
  points_ = add(tag_of(make_array("Points", Domain::point, description_.point_type, 3)),
                description_.points * 3 * size_of(description_.point_type));
  xml_ += "</Points>\n";
  add_data(Domain::point, "PointData");
  add_data(Domain::cell, "CellData");
  xml_ += "<Cells>\n";
  connectivity_ = add(tag_of(make_array("connectivity", Domain::mesh, point_number_, 1)),
                      entries() * size_of(point_number_));
  ends_ = add(tag_of(make_array("offsets", Domain::mesh, end_number_, 1)),
              description_.cells * size_of(end_number_));
  types_ = add(tag_of(make_array("types", Domain::mesh, Scalar::u8, 1)), description_.cells);
  if (description_.polyhedra.cells > 0) {
    faces_ = add(tag_of(make_array("faces", Domain::mesh, point_number_, 1)),
                 face_entries() * size_of(point_number_));
    face_ends_ = add(tag_of(make_array("faceoffsets", Domain::mesh, Scalar::i64, 1)),
                     description_.cells * sizeof(int64_t));
  }
  xml_ += "</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
  MAILLE_CHECK(file_.open());
  MAILLE_CHECK(file_.write_at(0, std::as_bytes(std::span(xml_.data(), xml_.size()))));
  return write_sizes();
}

/// Writes what is known from the beginning: sizes of all arrays, values of some, and the file's end.
Result<> VtuSink::write_sizes() {
  for (const Region& region : regions_) {
    MAILLE_CHECK(file_.write_at(xml_.size() + region.begin - sizeof(uint64_t),
                                std::as_bytes(std::span(&region.size, 1))));
  }
  for (const auto& [region, bytes] : values_) MAILLE_CHECK(write(region, 0, bytes));
  values_.clear();
  constexpr std::string_view end = "\n</AppendedData>\n</VTKFile>\n";
  return file_.write_at(xml_.size() + next_, std::as_bytes(std::span(end.data(), end.size())));
}

Result<> VtuSink::write(const Region& region, uint64_t at, Bytes bytes) {
  // So a caller that writes too much cannot overwrite the next array.
  if (at > region.size || bytes.size() > region.size - at) {
    return failure(ErrorCode::usage, file_.path() + ": more values than the mesh was described to have");
  }
  return file_.write_at(xml_.size() + region.begin + at, bytes);
}

Result<> VtuSink::write_integers(const Region& region, uint64_t first, std::span<const uint64_t> values,
                                 Scalar type) {
  if (size_of(type) == sizeof(uint64_t))
    return write(region, first * sizeof(uint64_t), std::as_bytes(values));
  narrow_.resize(values.size());
  for (size_t i = 0; i < values.size(); ++i) narrow_[i] = static_cast<uint32_t>(values[i]);
  return write(region, first * sizeof(uint32_t), std::as_bytes(std::span(narrow_)));
}

/// Writes the numbers of the blocks of the next cells.
Result<> VtuSink::write_names(uint64_t cells) {
  std::vector<uint32_t> numbers;
  for (uint64_t i = cells_; i < cells_ + cells; ++i) {
    // Empty blocks are passed over. Cells beyond the last block were refused before, by the region's size.
    for (; named_block_ < description_.blocks.size() && named_end_ <= i; ++named_block_)
      named_end_ += description_.blocks[named_block_].cells;
    numbers.push_back(static_cast<uint32_t>(named_block_ - 1));
  }
  return write(*names_, cells_ * sizeof(uint32_t), std::as_bytes(std::span(numbers)));
}

// Of a polyhedron VTK's connectivity has each point once, not each corner of its faces.
uint64_t VtuSink::entries() const {
  return description_.corners - description_.polyhedra.corners + description_.polyhedra.points;
}

// In the stream of faces (VTK up to 9.3): number of faces, and for each its number of corners and these.
uint64_t VtuSink::face_entries() const {
  return description_.polyhedra.cells + description_.polyhedra.faces + description_.polyhedra.corners;
}

Result<> VtuSink::write_cells(const CellPiece& cells) {
  if (names_) MAILLE_CHECK(write_names(cells.size()));
  const bool by_faces = std::find(cells.types.begin(), cells.types.end(),
                                  static_cast<uint8_t>(CellType::polyhedron)) != cells.types.end();
  if (by_faces && (description_.polyhedra.cells == 0 || cells.cell_faces.size() != cells.size() + 1))
    return failure(ErrorCode::usage, file_.path() + ": polyhedra that the mesh was not described to have");
  for (auto* list : {&points_of_piece_, &ends_of_piece_, &faces_of_piece_, &face_ends_of_piece_})
    list->clear();
  if (description_.polyhedra.cells == 0) {
    ends_of_piece_.resize(cells.size());
    for (size_t i = 0; i < cells.size(); ++i) ends_of_piece_[i] = entries_ + cells.offsets[i + 1];
  }
  for (uint64_t i = 0; i < cells.size() && description_.polyhedra.cells > 0; ++i) {
    const auto at = [&](uint64_t k) { return cells.connectivity.begin() + static_cast<ptrdiff_t>(k); };
    if (static_cast<CellType>(cells.types[i]) == CellType::polyhedron) {
      const auto corners =
          std::span(cells.connectivity).subspan(cells.offsets[i], cells.offsets[i + 1] - cells.offsets[i]);
      append_vtk_polyhedron(corners, face_sizes_of(cells, i), sorted_, points_of_piece_, faces_of_piece_);
      face_ends_of_piece_.push_back(face_entries_ + faces_of_piece_.size());
    } else {
      points_of_piece_.insert(points_of_piece_.end(), at(cells.offsets[i]), at(cells.offsets[i + 1]));
      face_ends_of_piece_.push_back(~uint64_t{0});  // -1
    }
    ends_of_piece_.push_back(entries_ + points_of_piece_.size());
  }
  const auto& points = description_.polyhedra.cells == 0 ? cells.connectivity : points_of_piece_;
  MAILLE_CHECK(write_integers(connectivity_, entries_, points, point_number_));
  MAILLE_CHECK(write_integers(ends_, cells_, ends_of_piece_, end_number_));
  MAILLE_CHECK(write(types_, cells_, std::as_bytes(std::span(cells.types))));
  if (description_.polyhedra.cells > 0) {
    MAILLE_CHECK(write_integers(faces_, face_entries_, faces_of_piece_, point_number_));
    MAILLE_CHECK(write_integers(face_ends_, cells_, face_ends_of_piece_, Scalar::i64));
  }
  entries_ += points.size();
  face_entries_ += faces_of_piece_.size();
  corners_ += cells.connectivity.size();
  cells_ += cells.types.size();
  lagrange_pyramids_ += static_cast<uint64_t>(
      std::count(cells.types.begin(), cells.types.end(), static_cast<uint8_t>(CellType::lagrange_pyramid)));
  return {};
}

Result<> VtuSink::commit() {
  const bool whole =
      entries_ == entries() && (description_.polyhedra.cells == 0 || face_entries_ == face_entries());
  if (cells_ != description_.cells || corners_ != description_.corners || !whole) {
    return failure(ErrorCode::usage, file_.path() + ": " + std::to_string(cells_) + " cells with " +
                                         std::to_string(corners_) + " corners were written, not the " +
                                         std::to_string(description_.cells) + " with " +
                                         std::to_string(description_.corners) + " described");
  }
  return file_.commit();
}

}  // namespace

Result<std::unique_ptr<MeshSink>> vtu_sink(const std::string& path, const MeshDescription& description) {
  auto sink = std::make_unique<VtuSink>(path, description);
  MAILLE_CHECK(sink->open());
  return std::unique_ptr<MeshSink>(std::move(sink));
}

}  // namespace maille
