#include "io/vtk/vtu.h"

#include <maille/parts.h>

#include <algorithm>

#include "base/bytes.h"
#include "io/beside.h"
#include "io/buffered_writer.h"
#include "io/cell_store.h"
#include "io/reading.h"
#include "io/vtk/joined_parts.h"
#include "io/vtk/part_cells.h"
#include "io/vtk/vtk_xml_reader.h"

namespace maille {
namespace {

/// Reads pieces, of one file or several: points, cells and their arrays one after the other, as VTK does;
/// then joins what they have in common. `apart`: as read_parts() has it.
class VtuReader {
 public:
  VtuReader(std::string name, uint64_t plausible, const ReadOptions& options, CellKeys* apart = nullptr)
      : name_(std::move(name)), options_(options), budget_(name_, plausible, options.limits), apart_(apart) {}

  Result<> add_file(const VtkXml& xml);
  Result<ReadResult> finish();

 private:
  Result<> read_piece(const VtkXml& xml, pugi::xml_node piece);
  Result<> read_points(const VtkXml& xml, pugi::xml_node piece, uint64_t points, const std::string& where);
  Result<std::optional<PartFaces>> read_faces(const VtkXml& xml, pugi::xml_node cells, uint64_t count,
                                              const std::string& where);
  Result<> read_cells(const VtkXml& xml, pugi::xml_node piece, uint64_t points, uint64_t count,
                      const std::string& where);
  Result<> read_data(const VtkXml& xml, pugi::xml_node data, Domain domain, uint64_t count,
                     const std::string& where);
  Result<std::optional<Array>> integers(const VtkXml& xml, pugi::xml_node cells, const char* name,
                                        uint64_t count, const std::string& where);
  void build_blocks();
  tl::unexpected<Error> malformed(const std::string& where, const std::string& what) const {
    return failure(ErrorCode::malformed_input, where + ": " + what);
  }

  std::string name_;
  const ReadOptions& options_;
  Budget budget_;
  Mesh mesh_;
  CellStore cells_;
  VtkFieldData field_;
  VtkTexts texts_;
  std::vector<std::string> notes_;
  size_t pieces_ = 0;
  std::vector<uint64_t> first_points_, first_cells_;  ///< by piece
  PartMarks marks_;
  CellKeys* apart_;  ///< not null: not all parts of the mesh are there
  bool has_points_ = false;
  bool has_block_array_ = false;
};

Result<> VtuReader::read_points(const VtkXml& xml, pugi::xml_node piece, uint64_t points,
                                const std::string& where) {
  const pugi::xml_node node = piece.child("Points").child("DataArray");
  if (!node) {
    if (points == 0) return {};
    return malformed(where, "it has points but no DataArray in Points");
  }
  Array array = MAILLE_TRY(read_data_array(xml, node, where + ", Points", budget_));
  if (array.components != 3 || array.count() != points) {
    if (points == 0 && array.bytes.empty()) return {};
    return malformed(where, "Points hold " + std::to_string(array.count()) + " tuples of " +
                                std::to_string(array.components) + " numbers, but NumberOfPoints is " +
                                std::to_string(points) + " of 3 numbers");
  }
  // The first piece that has points decides; pieces without any may say any type.
  if (!has_points_) mesh_.points.type = array.type;
  has_points_ = true;
  if (mesh_.points.type != array.type) {
    return malformed(where, "its points have another type than those of the pieces before");
  }
  if (points > max_points - mesh_.point_count()) return malformed(where, "there are 2^32 points or more");
  if (mesh_.points.bytes.empty()) {
    mesh_.points.bytes = std::move(array.bytes);
  } else {
    mesh_.points.bytes.insert(mesh_.points.bytes.end(), array.bytes.begin(), array.bytes.end());
  }
  return {};
}

/// Reads one of the arrays that make up the cells: integers with one component, `count` of them unless that
/// is UINT64_MAX. None when it is not there.
Result<std::optional<Array>> VtuReader::integers(const VtkXml& xml, pugi::xml_node cells, const char* name,
                                                 uint64_t count, const std::string& where) {
  const pugi::xml_node node = cells.find_child_by_attribute("DataArray", "Name", name);
  if (!node) return std::optional<Array>();
  Array array = MAILLE_TRY(read_data_array(xml, node, where + ", " + name, budget_));
  if (is_float(array.type) || array.components != 1) {
    return malformed(where, std::string(name) + " must be integers with one component");
  }
  if (count != UINT64_MAX && array.count() != count) {
    return malformed(where, "there are " + std::to_string(array.count()) + " " + name +
                                ", but NumberOfCells is " + std::to_string(count));
  }
  return std::optional<Array>(std::move(array));
}

/// Reads the faces of the polyhedra, in either form (see PartFaces); nothing where they are in none.
Result<std::optional<PartFaces>> VtuReader::read_faces(const VtkXml& xml, pugi::xml_node cells,
                                                       uint64_t count, const std::string& where) {
  const auto read = [&](const char* name) { return integers(xml, cells, name, UINT64_MAX, where); };
  auto stream = MAILLE_TRY(read("faces"));
  auto stream_ends = MAILLE_TRY(read("faceoffsets"));
  if (stream && stream_ends && stream_ends->count() == count)
    return PartFaces::stream(std::move(*stream), std::move(*stream_ends));
  auto corners = MAILLE_TRY(read("face_connectivity"));
  auto face_ends = MAILLE_TRY(read("face_offsets"));
  auto cell_faces = MAILLE_TRY(read("polyhedron_to_faces"));
  auto cell_ends = MAILLE_TRY(read("polyhedron_offsets"));
  if (!corners || !face_ends || !cell_faces || !cell_ends || cell_ends->count() != count) return std::nullopt;
  return PartFaces::lists(std::move(*corners), std::move(*face_ends), std::move(*cell_faces),
                          std::move(*cell_ends));
}

Result<> VtuReader::read_cells(const VtkXml& xml, pugi::xml_node piece, uint64_t points, uint64_t count,
                               const std::string& in) {
  const std::string where = in + ", Cells";
  if (count == 0) return {};
  const pugi::xml_node node = piece.child("Cells");
  auto connectivity = MAILLE_TRY(integers(xml, node, "connectivity", UINT64_MAX, where));
  auto ends = MAILLE_TRY(integers(xml, node, "offsets", count, where));
  auto types = MAILLE_TRY(integers(xml, node, "types", count, where));
  if (!connectivity || !ends || !types) {
    return malformed(where, "there should be " + std::to_string(count) +
                                " cells, but an array \"connectivity\", \"offsets\" or \"types\" is missing");
  }
  auto faces = MAILLE_TRY(read_faces(xml, node, count, where));
  PartCells part{std::move(*connectivity), std::move(*ends), std::move(*types), std::move(faces)};
  return append_part_cells(std::move(part), mesh_.point_count() - points, points, where, budget_, cells_);
}

Result<> VtuReader::read_data(const VtkXml& xml, pugi::xml_node data, Domain domain, uint64_t count,
                              const std::string& in) {
  const std::string where = in + ", " + (domain == Domain::point ? "PointData" : "CellData");
  // Empty pieces may lack their arrays, as those of processes without a share of the mesh do.
  if (pieces_ > 0 && count == 0) return {};
  return append_vtk_arrays(xml, data, domain, count, where, pieces_ == 0, budget_, texts_, mesh_.arrays);
}

Result<> VtuReader::read_piece(const VtkXml& xml, pugi::xml_node piece) {
  const std::string where = xml.file + ": piece " + std::to_string(pieces_);
  const uint64_t points = piece.attribute("NumberOfPoints").as_ullong(0);
  const uint64_t cells = piece.attribute("NumberOfCells").as_ullong(0);
  first_points_.push_back(mesh_.point_count());
  first_cells_.push_back(cells_.count());
  MAILLE_CHECK(read_points(xml, piece, points, where));
  MAILLE_CHECK(read_cells(xml, piece, points, cells, where));
  // The first piece that has something decides which arrays there are.
  if (pieces_ == 0 && points == 0 && cells == 0) return {};
  MAILLE_CHECK(read_data(xml, piece.child("PointData"), Domain::point, points, where));
  MAILLE_CHECK(read_data(xml, piece.child("CellData"), Domain::cell, cells, where));
  if (piece.child("CellData").find_child_by_attribute(vtu_block_mark, "1")) has_block_array_ = true;
  if (const auto ids = piece.child("PointData").attribute("GlobalIds")) marks_.point_ids = ids.as_string();
  if (const auto ids = piece.child("CellData").attribute("GlobalIds")) marks_.cell_ids = ids.as_string();
  ++pieces_;
  return {};
}

Result<> VtuReader::add_file(const VtkXml& xml) {
  const pugi::xml_node grid = xml.document.child("VTKFile").child("UnstructuredGrid");
  if (!grid) return malformed(xml.file, "there is no UnstructuredGrid element");
  for (const pugi::xml_node piece : grid.children("Piece")) {
    MAILLE_CHECK(read_piece(xml, piece));
    MAILLE_CHECK(report_progress(options_.progress, "reading", 0.5));
  }
  VtkFieldData field = MAILLE_TRY(read_vtk_field_data(xml, grid, budget_));
  // Each file of a parallel mesh repeats the fields of the whole, so the first ones count.
  if (field_.arrays.empty() && field_.strings.empty()) field_ = std::move(field);
  return {};
}

void VtuReader::build_blocks() {
  const Array sizes = field_.take_array(vtk_blocks_name).value_or(Array());
  const std::vector<NamedRun> shapes = vtk_block_shapes(sizes, field_.take_strings(vtk_block_names_name));
  if (shapes.empty() || !cells_.fits(shapes)) {
    mesh_.blocks = cells_.take();
    return;
  }
  mesh_.blocks = cells_.take(shapes);
  // The array that shows names of blocks to VTK's users says the same as the blocks, so it goes.
  if (!has_block_array_) return;
  const auto is_block = [](const Array& array) {
    return array.domain == Domain::cell && array.name == vtk_block_array_name;
  };
  mesh_.arrays.erase(std::remove_if(mesh_.arrays.begin(), mesh_.arrays.end(), is_block), mesh_.arrays.end());
  field_.take_strings(std::string(vtk_block_array_name) + "_labels");
}

Result<ReadResult> VtuReader::finish() {
  build_blocks();
  for (auto* arrays : {&mesh_.arrays, &field_.arrays}) {
    for (Array& array : *arrays) field_.give_labels(array);
  }
  field_.move_to(mesh_, texts_);
  texts_.finish(mesh_);
  check_vtk_corner_arrays(mesh_, notes_);
  if (auto ok = validate(mesh_); !ok) return malformed(name_, ok.error().message);
  MAILLE_CHECK(join_parts(name_, first_points_, first_cells_, marks_, apart_, mesh_, notes_));
  return ReadResult{std::move(mesh_), std::move(notes_)};
}

// Files that are named are looked at like everything that a file refers to (beside.h).
Result<std::vector<std::string>> parts_of(const VtkXml& head) {
  std::vector<std::string> paths;
  const pugi::xml_node grid = head.document.child("VTKFile").child("PUnstructuredGrid");
  for (const pugi::xml_node piece : grid.children("Piece"))
    paths.push_back(MAILLE_TRY(path_beside(head.file, piece.attribute("Source").as_string())));
  if (paths.empty()) return failure(ErrorCode::malformed_input, head.file + ": it names no pieces");
  return paths;
}

Result<ReadResult> read_files(const std::string& name, std::span<const std::string> paths, CellKeys* apart,
                              const ReadOptions& options) {
  std::vector<std::unique_ptr<Source>> sources;
  uint64_t size = 0;
  for (const std::string& path : paths) {
    sources.push_back(MAILLE_TRY(file_source(path)));
    size += sources.back()->size();
  }
  // As plausible_bytes() has it for packed files: whether they are is not known yet.
  VtuReader reader(name, size * 16, options, apart);
  for (const auto& source : sources) {
    const InputBytes input = MAILLE_TRY(InputBytes::load(*source));
    const VtkXml xml = MAILLE_TRY(parse_vtk_xml(input.bytes(), source->name(), {"UnstructuredGrid"}));
    MAILLE_CHECK(reader.add_file(xml));
  }
  return reader.finish();
}

}  // namespace

Result<ReadResult> read_vtu(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  const VtkXml xml =
      MAILLE_TRY(parse_vtk_xml(input.bytes(), source.name(), {"UnstructuredGrid", "PUnstructuredGrid"}));
  if (xml.document.child("VTKFile").child("PUnstructuredGrid")) {
    std::vector<std::string> parts = MAILLE_TRY(parts_of(xml));
    ReadResult result = MAILLE_TRY(read_files(xml.file, parts, nullptr, options));
    result.files_beside = std::move(parts);
    return result;
  }
  VtuReader reader(source.name(), plausible_bytes(xml, input.bytes().size()), options);
  MAILLE_CHECK(reader.add_file(xml));
  return reader.finish();
}

Result<std::vector<std::string>> parts_of_mesh(const std::string& path) {
  if (!path.ends_with(".pvtu")) return std::vector<std::string>();
  const std::unique_ptr<Source> source = MAILLE_TRY(file_source(path));
  const InputBytes input = MAILLE_TRY(InputBytes::load(*source));
  return parts_of(MAILLE_TRY(parse_vtk_xml(input.bytes(), path, {"PUnstructuredGrid"})));
}

Result<ReadResult> read_parts(std::span<const std::string> paths, const ReadOptions& options,
                              CellKeys* apart) {
  if (paths.empty()) return ReadResult();
  return read_files(paths[0], paths, apart, options);
}

}  // namespace maille
