#include "io/vtk/vtp.h"

#include <algorithm>
#include <array>

#include "base/bytes.h"
#include "io/buffered_writer.h"
#include "io/reading.h"
#include "io/vtk/vtk_xml_reader.h"

namespace maille {
namespace {

enum Kind : size_t { verts, lines, polys, strips, kinds };
constexpr const char* kind_elements[kinds] = {"Verts", "Lines", "Polys", "Strips"};
constexpr const char* kind_counts[kinds] = {"NumberOfVerts", "NumberOfLines", "NumberOfPolys",
                                            "NumberOfStrips"};

/// Cells of one kind, of all pieces so far, in numbers of points of the whole mesh.
struct Cells {
  std::vector<uint64_t> offsets{0};
  std::vector<uint32_t> connectivity;
};

/// A cell array of all pieces so far, in parts, because cells are ordered by kind and not by piece. Within
/// each kind pieces follow each other.
struct CellArray {
  Array array;
  std::array<std::vector<std::byte>, kinds> parts;
};

/// Reads pieces one after the other and puts their cells together by kind. Strips become triangles, which the
/// model of meshes could hold, but of which other formats and the codec of surfaces make more; values of a
/// strip go to each of its triangles.
class VtpReader {
 public:
  VtpReader(VtkXml xml, uint64_t file_bytes, const ReadOptions& options)
      : xml_(std::move(xml)),
        options_(options),
        budget_(xml_.file, plausible_bytes(xml_, file_bytes), options.limits) {}

  Result<ReadResult> read();

 private:
  Result<> read_piece(pugi::xml_node piece, size_t number);
  Result<uint64_t> read_points(pugi::xml_node piece, const std::string& where);
  Result<> read_cells(pugi::xml_node piece, Kind kind, uint64_t points, const std::string& where);
  Result<> append_cells(Kind kind, const Array& connectivity, const Array& offsets, uint64_t points,
                        const std::string& where);
  Result<> append_strip(Cells& into, std::span<const uint32_t> strip);
  Result<> read_cell_data(pugi::xml_node piece, const std::string& where, bool first);
  Result<> append_cell_tuples(CellArray& into, const Array& values, const std::string& where);
  Result<> read_field_data();
  void build_blocks();
  void join_cell_arrays();

  tl::unexpected<Error> malformed(const std::string& where, const std::string& what) const {
    return failure(ErrorCode::malformed_input, where + ": " + what);
  }

  VtkXml xml_;
  const ReadOptions& options_;
  Budget budget_;
  Mesh mesh_;
  VtkTexts texts_;
  std::vector<std::string> notes_;
  std::array<Cells, kinds> cells_;
  std::vector<CellArray> cell_arrays_;
  /// Of the current piece: number of cells of each kind, and triangles made of each strip.
  std::array<uint64_t, kinds> piece_cells_ = {};
  std::vector<uint64_t> piece_strips_;
  uint64_t strip_count_ = 0;
};

Result<uint64_t> VtpReader::read_points(pugi::xml_node piece, const std::string& where) {
  const uint64_t points = piece.attribute("NumberOfPoints").as_ullong(0);
  const pugi::xml_node node = piece.child("Points").child("DataArray");
  if (!node) {
    if (points == 0) return points;
    return malformed(where, "it has points but no DataArray in Points");
  }
  Array array = MAILLE_TRY(read_data_array(xml_, node, where + ", Points", budget_));
  if (array.bytes.empty() && points == 0) return points;
  if (array.components != 3 || array.count() != points) {
    return malformed(where, "Points hold " + std::to_string(array.count()) + " tuples of " +
                                std::to_string(array.components) + " numbers, but NumberOfPoints is " +
                                std::to_string(points) + " of 3 numbers");
  }
  if (mesh_.points.bytes.empty()) {
    mesh_.points.type = array.type;
  } else if (mesh_.points.type != array.type) {
    return malformed(where, "its points have another type than those of the pieces before");
  }
  if (points > max_points - mesh_.point_count()) return malformed(where, "there are 2^32 points or more");
  mesh_.points.bytes.insert(mesh_.points.bytes.end(), array.bytes.begin(), array.bytes.end());
  return points;
}

Result<> VtpReader::append_strip(Cells& into, std::span<const uint32_t> strip) {
  // Every second triangle is turned, so that all have the first one's orientation.
  for (size_t i = 0; i + 2 < strip.size(); ++i) {
    const size_t odd = i & 1;
    // A strip makes three corners of each of its numbers, so it is counted apart.
    MAILLE_CHECK(budget_.take(1, 3 * sizeof(uint32_t) + sizeof(uint64_t)));
    into.connectivity.insert(into.connectivity.end(), {strip[i], strip[i + 1 + odd], strip[i + 2 - odd]});
    into.offsets.push_back(into.connectivity.size());
  }
  piece_strips_.push_back(strip.size() < 3 ? 0 : strip.size() - 2);
  return {};
}

Result<> VtpReader::append_cells(Kind kind, const Array& connectivity, const Array& offsets, uint64_t points,
                                 const std::string& where) {
  const uint64_t base = mesh_.point_count() - points;
  Cells& cells = cells_[kind];
  std::vector<uint32_t> cell;
  uint64_t begin = 0;
  for (size_t c = 0; c < offsets.count(); ++c) {
    const uint64_t end = integer_at(offsets, c);
    if (end < begin || end > connectivity.count()) {
      return malformed(where, "the end of cell " + std::to_string(c) + " is offset " + std::to_string(end) +
                                  ", outside of " + std::to_string(begin) + " to " +
                                  std::to_string(connectivity.count()));
    }
    cell.clear();
    for (uint64_t i = begin; i < end; ++i) {
      // Negative numbers are huge here, and fail the same test.
      const uint64_t point = integer_at(connectivity, static_cast<size_t>(i));
      if (point >= points) {
        return malformed(where, "cell " + std::to_string(c) + " uses point " +
                                    std::to_string(static_cast<int64_t>(point)) + ", but the piece has " +
                                    std::to_string(points) + " points");
      }
      cell.push_back(static_cast<uint32_t>(base + point));
    }
    begin = end;
    if (kind == strips) {
      MAILLE_CHECK(append_strip(cells, cell));
      continue;
    }
    cells.connectivity.insert(cells.connectivity.end(), cell.begin(), cell.end());
    cells.offsets.push_back(cells.connectivity.size());
  }
  return {};
}

Result<> VtpReader::read_cells(pugi::xml_node piece, Kind kind, uint64_t points, const std::string& in) {
  const std::string where = in + ", " + kind_elements[kind];
  const uint64_t count = piece.attribute(kind_counts[kind]).as_ullong(0);
  const pugi::xml_node node = piece.child(kind_elements[kind]);
  const pugi::xml_node connectivity_node = node.find_child_by_attribute("DataArray", "Name", "connectivity");
  const pugi::xml_node offsets_node = node.find_child_by_attribute("DataArray", "Name", "offsets");
  piece_cells_[kind] = count;
  if (count == 0) return {};
  if (!connectivity_node || !offsets_node) {
    return malformed(where, "there should be " + std::to_string(count) +
                                " cells, but an array \"connectivity\" or \"offsets\" is missing");
  }
  const Array connectivity =
      MAILLE_TRY(read_data_array(xml_, connectivity_node, where + ", connectivity", budget_));
  const Array offsets = MAILLE_TRY(read_data_array(xml_, offsets_node, where + ", offsets", budget_));
  if (is_float(connectivity.type) || is_float(offsets.type) || connectivity.components != 1 ||
      offsets.components != 1) {
    return malformed(where, "connectivity and offsets must be integers with one component");
  }
  if (offsets.count() != count) {
    return malformed(where, "there are " + std::to_string(offsets.count()) + " offsets, but " +
                                kind_counts[kind] + " is " + std::to_string(count));
  }
  MAILLE_CHECK(budget_.take(connectivity.count(), sizeof(uint32_t)));
  MAILLE_CHECK(budget_.take(offsets.count(), sizeof(uint64_t)));
  return append_cells(kind, connectivity, offsets, points, where);
}

Result<> VtpReader::append_cell_tuples(CellArray& into, const Array& values, const std::string& where) {
  uint64_t cells = 0;
  for (const uint64_t count : piece_cells_) cells += count;
  if (values.count() != cells) {
    return malformed(where, "it has " + std::to_string(values.count()) + " tuples for " +
                                std::to_string(cells) + " cells");
  }
  const size_t size = values.tuple_size();
  const std::byte* at = values.bytes.data();
  // Tuples of a piece come in VTK's order of kinds. The counts add up to what was checked above.
  for (const Kind kind : {verts, lines, polys}) {
    into.parts[kind].insert(into.parts[kind].end(), at, at + piece_cells_[kind] * size);
    at += piece_cells_[kind] * size;
  }
  for (const uint64_t triangles : piece_strips_) {
    MAILLE_CHECK(budget_.take(triangles, size));
    for (uint64_t i = 0; i < triangles; ++i)
      into.parts[strips].insert(into.parts[strips].end(), at, at + size);
    at += size;
  }
  return {};
}

Result<> VtpReader::read_cell_data(pugi::xml_node piece, const std::string& in, bool first) {
  const std::string where = in + ", CellData";
  size_t index = 0;
  MAILLE_CHECK(for_each_vtk_array(
      xml_, piece.child("CellData"), Domain::cell, where, budget_, texts_,
      [&](Array array, const std::string& place) {
        if (first) {
          CellArray cell_array;
          cell_array.array = make_array(array.name, Domain::cell, array.type, array.components, array.role);
          cell_arrays_.push_back(std::move(cell_array));
        } else if (index == cell_arrays_.size() || cell_arrays_[index].array.name != array.name ||
                   cell_arrays_[index].array.type != array.type ||
                   cell_arrays_[index].array.components != array.components) {
          return Result<>(malformed(place, "pieces must have the same arrays in the same order"));
        }
        return append_cell_tuples(cell_arrays_[index++], array, place);
      }));
  if (!first && index != cell_arrays_.size()) {
    return malformed(where, "an array of the first piece is missing");
  }
  return {};
}

Result<> VtpReader::read_piece(pugi::xml_node piece, size_t number) {
  const std::string where = xml_.file + ": piece " + std::to_string(number);
  const uint64_t points = MAILLE_TRY(read_points(piece, where));
  piece_strips_.clear();
  for (const Kind kind : {verts, lines, polys, strips}) {
    MAILLE_CHECK(read_cells(piece, kind, points, where));
  }
  strip_count_ += piece_strips_.size();
  MAILLE_CHECK(append_vtk_arrays(xml_, piece.child("PointData"), Domain::point, points, where + ", PointData",
                                 number == 0, budget_, texts_, mesh_.arrays));
  return read_cell_data(piece, where, number == 0);
}

Result<> VtpReader::read_field_data() {
  const pugi::xml_node poly_data = xml_.document.child("VTKFile").child("PolyData");
  VtkFieldData field = MAILLE_TRY(read_vtk_field_data(xml_, poly_data, budget_));
  for (auto* arrays : {&mesh_.arrays, &field.arrays}) {
    for (Array& array : *arrays) field.give_labels(array);
  }
  for (CellArray& cell_array : cell_arrays_) field.give_labels(cell_array.array);
  field.move_to(mesh_, texts_);
  return {};
}

/// The block's type: that of cells which all have one size, else the general type.
CellType type_of(Kind kind, const Cells& cells) {
  const auto all = [&](uint64_t nodes) {
    for (size_t i = 0; i + 1 < cells.offsets.size(); ++i) {
      if (cells.offsets[i + 1] - cells.offsets[i] != nodes) return false;
    }
    return true;
  };
  if (kind == verts) return all(1) ? CellType::vertex : CellType::poly_vertex;
  if (kind == lines) return all(2) ? CellType::line : CellType::poly_line;
  return all(3) ? CellType::triangle : all(4) ? CellType::quad : CellType::polygon;
}

void VtpReader::build_blocks() {
  for (const Kind kind : {verts, lines, polys, strips}) {
    Cells& cells = cells_[kind];
    if (cells.offsets.size() == 1) continue;
    CellBlock block;
    block.type = type_of(kind, cells);
    if (nodes_of(block.type) == 0) block.offsets = std::move(cells.offsets);
    block.connectivity = std::move(cells.connectivity);
    mesh_.blocks.push_back(std::move(block));
  }
  if (strip_count_ != 0) {
    notes_.push_back(std::to_string(strip_count_) + " triangle strips were split into triangles");
  }
}

// Tuples are kept by kind until all pieces are read, because each kind is one block and VTK's files have the
// kinds piece by piece.
void VtpReader::join_cell_arrays() {
  for (CellArray& cell_array : cell_arrays_) {
    Buffer<std::byte>& bytes = cell_array.array.bytes;
    bytes = std::move(cell_array.parts[0]);
    for (size_t kind = 1; kind < kinds; ++kind) {
      const std::vector<std::byte>& part = cell_array.parts[kind];
      bytes.insert(bytes.end(), part.begin(), part.end());
    }
    mesh_.arrays.push_back(std::move(cell_array.array));
  }
}

Result<ReadResult> VtpReader::read() {
  const pugi::xml_node poly_data = xml_.document.child("VTKFile").child("PolyData");
  if (!poly_data) return malformed(xml_.file, "there is no PolyData element");
  size_t number = 0;
  for (const pugi::xml_node piece : poly_data.children("Piece")) {
    MAILLE_CHECK(read_piece(piece, number));
    ++number;
    MAILLE_CHECK(report_progress(options_.progress, "reading", 0.5));
  }
  if (number == 0) return malformed(xml_.file, "there is no Piece, so nothing to read");
  build_blocks();
  MAILLE_CHECK(read_field_data());
  join_cell_arrays();
  texts_.finish(mesh_);
  check_vtk_corner_arrays(mesh_, notes_);
  MAILLE_CHECK(validate(mesh_));
  return ReadResult{std::move(mesh_), std::move(notes_)};
}

}  // namespace

Result<ReadResult> read_vtp(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  VtkXml xml = MAILLE_TRY(parse_vtk_xml(input.bytes(), source.name(), {"PolyData"}));
  return VtpReader(std::move(xml), input.bytes().size(), options).read();
}

}  // namespace maille
