// OpenFOAM's polyMesh, written: points, faces, owner, neighbour, boundary, zones. Inner faces come first, by
// owner and then neighbour, and point from the lesser cell to the greater; those of the patches follow. The
// mesh is read in parts, and faces are sorted out of core.
#include <maille/path.h>
#include <maille/series.h>

#include <algorithm>
#include <filesystem>

#include "base/bytes.h"
#include "base/sort_unique.h"
#include "io/foam/case_sink.h"
#include "io/foam/foam_case.h"
#include "io/foam/foam_field_writer.h"
#include "io/foam/foam_writer.h"
#include "io/foam/polymesh.h"
#include "io/foam/polymesh_faces.h"
#include "io/foam/polymesh_groups.h"
#include "io/foam/polymesh_zone_lists.h"
#include "io/folder_sink.h"
#include "io/format.h"
#include "io/notes.h"
#include "io/reading.h"
#include "mesh/cell_faces.h"
#include "mesh/mesh_as_source.h"

namespace maille {
namespace {

/// blockMesh's name of the patch of all faces that are in no other.
constexpr char rest_name[] = "defaultFaces";
/// Types of patches that need no other entries; others (cyclic, processor, ...) do, in the file "boundary".
constexpr std::string_view plain_types[] = {"patch", "wall", "symmetry", "symmetryPlane", "empty", "wedge"};

// One pass over the cells fills the table of faces and the lists of zones; then each file is a pass over the
// sorted faces. So memory is what sorting is given, whatever the mesh's size.
class PolyMeshWriter {
 public:
  PolyMeshWriter(MeshSource& mesh, FolderSink& sink, bool ascii, uint64_t memory, const std::string& folder)
      : mesh_(mesh),
        description_(mesh.description()),
        sink_(sink),
        binary_(!ascii),
        groups_(description_),
        file_(sink, binary_, description_.point_type == Scalar::f32),
        out_(file_.out()),
        // Three fourths of the memory sort the faces, which are the most by far; an eighth is for each kind
        // of zones. Chosen, not swept.
        table_(memory / 4 * 3, folder, sink.name()),
        cell_zones_(memory / 8, folder),
        point_zones_(memory / 8, folder),
        face_zones_(memory / 8, folder),
        fields_(written_, sink, ascii) {}

  Result<std::vector<std::string>> write();
  /// Behind write(): the fields of a time, of a mesh with the same points and cells.
  Result<> write_fields(MeshSource& values) { return fields_.write_time(values); }
  std::vector<std::string> field_notes() { return fields_.take_notes(); }

 private:
  /// The note in the headers of files of faces: how many there are of all. OpenFOAM's tools read it.
  std::string note_of_sizes() const;
  Result<> put_points();
  Result<> put_faces();
  Result<> put_compact_faces();
  Result<> put_owners();
  Result<> put_neighbours();
  void put_boundary();
  template <class F>
  Result<> for_each_written(F f) {
    return table_.visit(last_, f);
  }
  Result<> collect();
  Result<> collect(const MeshDescription::Block& block, uint64_t first, uint64_t count);
  Result<> add_cell(const MeshDescription::Block& block, uint64_t i, uint64_t place);
  Result<> collect_point_zones();
  void place_patches();
  void note();

  MeshSource& mesh_;
  const MeshDescription& description_;
  FolderSink& sink_;
  bool binary_;
  FoamGroups groups_;
  std::vector<FoamPatch> patches_;
  FoamWriter file_;
  BufferedWriter& out_;  ///< of file_
  FoamFaceTable table_;
  FoamZoneLists<2> cell_zones_, point_zones_;  ///< zone, element
  FoamZoneLists<4> face_zones_;                ///< zone, place in it, face, whether it is flipped
  std::optional<FoamLabels> names_;
  std::vector<FoamLabels> zone_labels_;
  CellPiece piece_;
  std::vector<uint32_t> nodes_;
  std::vector<uint64_t> zones_;
  uint64_t last_ = FoamFaceTable::no_patch;  ///< the patch that takes the rest, where it is not the last
  std::vector<std::string> notes_;
  FoamWritten written_;
  FoamFieldWriter fields_;
};

std::string PolyMeshWriter::note_of_sizes() const {
  return "nPoints:" + std::to_string(description_.points) + "  nCells:" + std::to_string(table_.cells) +
         "  nFaces:" + std::to_string(table_.faces) + "  nInternalFaces:" + std::to_string(table_.inner);
}

Result<> PolyMeshWriter::put_points() {
  file_.begin_list(description_.points);
  const Scalar type = description_.point_type;
  const size_t size = 3 * size_of(type);
  constexpr uint64_t at_once = 4096;
  std::vector<std::byte> positions;
  for (uint64_t first = 0; first < description_.points; first += at_once) {
    const uint64_t count = std::min(at_once, description_.points - first);
    positions.resize(count * size);
    MAILLE_CHECK(mesh_.read_points(first, count, positions));
    if (binary_ && is_float(type)) out_.put_bytes(positions);
    for (uint64_t i = 0; i < count && !(binary_ && is_float(type)); ++i) {
      const std::byte* const from = positions.data() + i * size;
      if (!binary_) {
        out_.put('(');
        put_scalars(out_, from, type, 3);
        out_.put(")\n");
        continue;
      }
      with_type(type, [&](auto zero) {
        using T = decltype(zero);
        for (size_t k = 0; k < 3; ++k) out_.put_raw(static_cast<double>(load<T>(from + k * sizeof(T))));
      });
    }
  }
  file_.end_list();
  return {};
}

/// Writes faces in binary: where each begins in the list of all their corners, then that list.
Result<> PolyMeshWriter::put_compact_faces() {
  uint64_t place = 0;
  file_.begin_list(table_.faces + 1);
  file_.put_label(0);
  MAILLE_CHECK(for_each_written([&](const FoamFaceTable::Face& face) -> Result<> {
    file_.put_label(place += face.corners.size());
    return {};
  }));
  file_.end_list();
  file_.begin_list(place);
  MAILLE_CHECK(for_each_written([&](const FoamFaceTable::Face& face) -> Result<> {
    for (const uint32_t corner : face.corners) file_.put_label(corner);
    return {};
  }));
  file_.end_list();
  return {};
}

Result<> PolyMeshWriter::put_faces() {
  if (binary_) return put_compact_faces();
  file_.begin_list(table_.faces);
  MAILLE_CHECK(for_each_written([&](const FoamFaceTable::Face& face) -> Result<> {
    out_.put_number(face.corners.size());
    for (size_t i = 0; i < face.corners.size(); ++i) {
      out_.put(i == 0 ? '(' : ' ');
      out_.put_number(face.corners[i]);
    }
    out_.put(")\n");
    return {};
  }));
  file_.end_list();
  return {};
}

/// Writes owners, and notes which faces zones have: their numbers are known here.
Result<> PolyMeshWriter::put_owners() {
  file_.begin_list(table_.faces);
  uint64_t number = 0;
  MAILLE_CHECK(for_each_written([&](const FoamFaceTable::Face& face) -> Result<> {
    file_.put_label(face.owner);
    for (const FoamFaceTable::Mark& mark : face.marks)
      MAILLE_CHECK(face_zones_.add({mark.zone, mark.order, number, uint64_t{mark.flipped}}));
    ++number;
    return {};
  }));
  file_.end_list();
  return {};
}

Result<> PolyMeshWriter::put_neighbours() {
  // In binary, nothing stands behind the count of an empty list.
  if (binary_ && table_.inner == 0) {
    out_.put("0\n");
    return {};
  }
  file_.begin_list(table_.inner);
  MAILLE_CHECK(for_each_written([&](const FoamFaceTable::Face& face) -> Result<> {
    if (face.neighbour == FoamFaceTable::no_cell) return {};
    file_.put_label(face.neighbour);
    return {};
  }));
  file_.end_list();
  return {};
}

/// Writes the patches, which are text in either form.
void PolyMeshWriter::put_boundary() {
  std::string text = std::to_string(patches_.size()) + "\n(\n";
  for (const FoamPatch& patch : patches_) {
    text += "    " + patch.name + "\n    {\n        type            " + patch.type + ";\n";
    text += "        nFaces          " + std::to_string(patch.faces) + ";\n";
    text += "        startFace       " + std::to_string(patch.first) + ";\n";
    text += (patch.entries.empty() ? "" : "        " + patch.entries + "\n") + "    }\n";
  }
  out_.put(text + ")\n");
}

/// Takes a cell. `place`: where it is in the mesh; it is number `i` of those at hand.
Result<> PolyMeshWriter::add_cell(const MeshDescription::Block& block, uint64_t i, uint64_t place) {
  const auto type = static_cast<CellType>(piece_.types[i]);
  nodes_.clear();
  for (uint64_t k = piece_.offsets[i]; k < piece_.offsets[i + 1]; ++k)
    nodes_.push_back(static_cast<uint32_t>(piece_.connectivity[k]));
  static const std::string none;
  const std::string& label = names_ ? names_->name(i) : none;
  if (is_face(type)) {
    const FoamGroups::Target target = groups_.of_face(block.name, label);
    written_.faces.add(place);
    return target.zone ? table_.add_zone_face(nodes_, target.number) : table_.add_face(nodes_, target.number);
  }
  const uint64_t cell = table_.cells;
  // A cell that polyMesh cannot hold is counted by the table, for a note.
  if (!MAILLE_TRY(table_.add_cell(type, nodes_, face_sizes_of(piece_, i)))) return {};
  written_.cells.add(place);
  zones_.clear();
  const auto add_zone = [&](const std::string& name) {
    if (!name.empty()) zones_.push_back(groups_.cell_zones.number(name));
  };
  add_zone(block.name.empty() ? label : block.name);
  for (const FoamLabels& labels : zone_labels_) add_zone(labels.name(i));
  sort_unique(zones_);
  for (const uint64_t zone : zones_) MAILLE_CHECK(cell_zones_.add({zone, cell}));
  return {};
}

Result<> PolyMeshWriter::collect(const MeshDescription::Block& block, uint64_t first, uint64_t count) {
  MAILLE_CHECK(mesh_.read_cells(first, count, piece_));
  if (names_) MAILLE_CHECK(names_->read(mesh_, first, count));
  for (FoamLabels& labels : zone_labels_) MAILLE_CHECK(labels.read(mesh_, first, count));
  for (uint64_t i = 0; i < count; ++i) MAILLE_CHECK(add_cell(block, i, first + i));
  return {};
}

Result<> PolyMeshWriter::collect() {
  for (size_t i = 0; i < description_.arrays.size(); ++i) {
    const Array& array = description_.arrays[i];
    if (is_foam_label_array(array)) names_.emplace(array, i);
    if (is_foam_zone_array(array, foam_cell_zones, Domain::cell)) zone_labels_.emplace_back(array, i);
  }
  constexpr uint64_t at_once = 4096;
  uint64_t begin = 0;
  for (const MeshDescription::Block& block : description_.blocks) {
    for (uint64_t i = 0; i < block.cells; i += at_once)
      MAILLE_CHECK(collect(block, begin + i, std::min(at_once, block.cells - i)));
    begin += block.cells;
  }
  groups_.take_types(description_);
  MAILLE_CHECK(collect_point_zones());
  return table_.join();
}

Result<> PolyMeshWriter::collect_point_zones() {
  constexpr uint64_t at_once = 4096;
  for (size_t i = 0; i < description_.arrays.size(); ++i) {
    if (!is_foam_zone_array(description_.arrays[i], foam_point_zones, Domain::point)) continue;
    FoamLabels labels(description_.arrays[i], i);
    for (uint64_t first = 0; first < description_.points; first += at_once) {
      const uint64_t count = std::min(at_once, description_.points - first);
      MAILLE_CHECK(labels.read(mesh_, first, count));
      for (uint64_t k = 0; k < count; ++k) {
        if (labels.name(k).empty()) continue;
        MAILLE_CHECK(point_zones_.add({groups_.point_zones.number(labels.name(k)), first + k}));
      }
    }
  }
  return {};
}

void PolyMeshWriter::place_patches() {
  patches_ = groups_.patches();
  for (size_t i = 0; i < table_.patch_faces.size(); ++i) patches_[i].faces = table_.patch_faces[i];
  // A patch of this name that is there already comes last, so that it can take the rest.
  const auto named =
      std::find_if(patches_.begin(), patches_.end(), [](const auto& p) { return p.name == rest_name; });
  if (table_.rest != 0 && named == patches_.end()) {
    patches_.push_back({rest_name, "patch", 0, 0, ""});
  } else if (table_.rest != 0) {
    last_ = static_cast<uint64_t>(named - patches_.begin());
    std::rotate(named, named + 1, patches_.end());
  }
  if (table_.rest != 0) patches_.back().faces += table_.rest;
  uint64_t faces = table_.inner;
  for (FoamPatch& patch : patches_) {
    patch.first = faces;
    faces += patch.faces;
  }
  // Labels of 32 bits are OpenFOAM's default; larger ones are written only if some number needs them.
  const uint64_t most = std::max({description_.points, table_.cells, faces + 1, table_.corners});
  file_.set_wide_labels(most > INT32_MAX);
}

void PolyMeshWriter::note() {
  const auto say = [&](uint64_t count, const char* what, const std::string& why) {
    if (count != 0) notes_.push_back(counted(count, what) + " " + why);
  };
  say(table_.left_out, "cell", "left out: polyMesh has linear volume cells and faces only");
  say(table_.simplified, "cell", "with a point twice in a face became cells of fewer corners");
  say(table_.same_side, "face",
      "between cells that lie on the same side of it: one of the two is inside out");
  say(table_.between_cells, "face", "between two cells left out: patches are at the boundary");
  say(table_.loose, "face", "of no volume cell left out");
  say(table_.repeated, "face", "in two patches written to the first only");
  say(table_.turned, "face", "turned over: those of polyMesh are seen from outside");
  say(table_.rest, "face", std::string("at the boundary, in no block, in the patch \"") + rest_name + "\"");
  for (const FoamPatch& patch : patches_) {
    if (patch.entries.empty() &&
        std::find(std::begin(plain_types), std::end(plain_types), patch.type) == std::end(plain_types))
      notes_.push_back("patch \"" + patch.name + "\" is of type " + patch.type +
                       ", whose other entries (such as its neighbour) have to be added to the file boundary");
  }
  if (binary_ ? !is_float(description_.point_type) : description_.point_type != Scalar::f64)
    notes_.push_back("positions are written as doubles");
  for (const auto& [key, value] : description_.metadata) {
    const auto known = {foam_patch_prefix,        foam_entries_prefix,
                        foam_type_prefix,         foam_cell_zones.metadata,
                        foam_face_zones.metadata, foam_point_zones.metadata,
                        foam_field_prefix,        foam_text_prefix,
                        foam_case_prefix,         foam_time_key,
                        foam_banner_key};
    const auto begins = [&key = key](const char* prefix) { return key.starts_with(prefix); };
    if (std::none_of(known.begin(), known.end(), begins)) note_metadata(key, value, notes_);
  }
}

Result<std::vector<std::string>> PolyMeshWriter::write() {
  if (description_.points > max_points)
    return failure(ErrorCode::unsupported,
                   sink_.name() + ": more than 2^32 points cannot be written in this format");
  MAILLE_CHECK(collect());
  place_patches();
  MAILLE_CHECK(file_.begin("points", "vectorField"));
  MAILLE_CHECK(put_points());
  MAILLE_CHECK(file_.end());
  MAILLE_CHECK(file_.begin("faces", binary_ ? "faceCompactList" : "faceList"));
  MAILLE_CHECK(put_faces());
  MAILLE_CHECK(file_.end());
  MAILLE_CHECK(file_.begin("owner", "labelList", note_of_sizes()));
  MAILLE_CHECK(put_owners());
  MAILLE_CHECK(file_.end());
  MAILLE_CHECK(file_.begin("neighbour", "labelList", note_of_sizes()));
  MAILLE_CHECK(put_neighbours());
  MAILLE_CHECK(file_.end());
  MAILLE_CHECK(file_.begin("boundary", "polyBoundaryMesh"));
  put_boundary();
  MAILLE_CHECK(file_.end());
  MAILLE_CHECK(cell_zones_.write(foam_cell_zones, groups_.cell_zones, file_));
  MAILLE_CHECK(face_zones_.write(foam_face_zones, groups_.face_zones, file_));
  MAILLE_CHECK(point_zones_.write(foam_point_zones, groups_.point_zones, file_));
  note();
  written_.points = description_.points;
  written_.inner = table_.inner;
  written_.patches = patches_;
  written_.visit = [this](const auto& f) { return for_each_written(f); };
  return std::move(notes_);
}

/// Tells of arrays that are neither groups nor a field, or what belongs to one ("p:gradient").
void note_arrays(const std::vector<Array>& arrays, const MeshDescription& mesh,
                 std::vector<std::string>& notes) {
  for (const Array& array : arrays) {
    const bool of_field = std::any_of(mesh.metadata.begin(), mesh.metadata.end(), [&](const auto& entry) {
      return entry.first.starts_with(foam_field_prefix) &&
             entry.first.size() > sizeof foam_field_prefix - 1 &&
             (array.name + ":").starts_with(entry.first.substr(sizeof foam_field_prefix - 1) + ":");
    });
    if (!is_foam_group_array(array) && !of_field) note_array(array, notes);
  }
}

void append(std::vector<std::string>& notes, std::vector<std::string> more) {
  notes.insert(notes.end(), more.begin(), more.end());
}

}  // namespace

Result<std::vector<std::string>> write_polymesh(MeshSource& mesh, FolderSink& sink, bool ascii,
                                                uint64_t memory, const std::string& folder) {
  PolyMeshWriter writer(mesh, sink, ascii, memory, folder);
  std::vector<std::string> notes = MAILLE_TRY(writer.write());
  MAILLE_CHECK(writer.write_fields(mesh));
  append(notes, writer.field_notes());
  note_arrays(mesh.description().arrays, mesh.description(), notes);
  note_arrays(mesh.description().mesh_arrays, mesh.description(), notes);
  return notes;
}

struct CaseWriter::Implementation {
  std::unique_ptr<MeshSource> mesh;
  PolyMeshWriter writer;
  std::vector<std::string> notes;
  uint64_t left_out = 0;  ///< times without fields of OpenFOAM

  // Without temporary files: the mesh is in memory, too.
  Implementation(const Mesh& first, FolderSink& sink, bool ascii)
      : mesh(mesh_as_source(first)), writer(*mesh, sink, ascii, ~uint64_t{0}, "") {}
};

CaseWriter::CaseWriter(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
CaseWriter::CaseWriter(CaseWriter&&) noexcept = default;
CaseWriter::~CaseWriter() = default;

Result<CaseWriter> CaseWriter::begin(const Mesh& mesh, Sink& sink, bool ascii) {
  auto* const folder = dynamic_cast<FolderSink*>(&sink);
  if (folder == nullptr)
    return failure(ErrorCode::usage, sink.name() + ": is one file, but a polyMesh is a folder of files");
  CaseWriter made(std::make_unique<Implementation>(mesh, *folder, ascii));
  Implementation& all = *made.implementation_;
  all.notes = MAILLE_TRY(all.writer.write());
  MAILLE_CHECK(all.writer.write_fields(*all.mesh));
  note_arrays(mesh.arrays, all.mesh->description(), all.notes);
  if (ascii) note_nan_payloads(mesh, all.notes);
  return made;
}

Result<> CaseWriter::add(const Mesh& mesh) {
  const auto values = mesh_as_source(mesh);
  const MeshDescription& first = implementation_->mesh->description();
  if (mesh.point_count() != first.points || mesh.cell_count() != first.cells)
    return failure(ErrorCode::usage, "the fields of another time are those of another mesh");
  const bool has_time = std::any_of(mesh.metadata.begin(), mesh.metadata.end(),
                                    [](const auto& entry) { return entry.first == foam_time_key; });
  implementation_->left_out += has_time || mesh.arrays.empty() ? 0 : 1;
  return implementation_->writer.write_fields(*values);
}

std::vector<std::string> CaseWriter::notes() {
  append(implementation_->notes, implementation_->writer.field_notes());
  if (const uint64_t left_out = std::exchange(implementation_->left_out, 0); left_out != 0)
    implementation_->notes.push_back(counted(left_out, "later time") +
                                     " left out: their arrays did not come from fields of OpenFOAM");
  return std::exchange(implementation_->notes, {});
}

Result<std::vector<std::string>> write_polymesh(const Mesh& mesh, Sink& sink, const WriteOptions& options) {
  return MAILLE_TRY(CaseWriter::begin(mesh, sink, options.ascii)).notes();
}

std::string polymesh_folder(const std::string& path) {
  std::filesystem::path folder = to_path(path);
  if (folder.has_relative_path() && folder.filename().empty()) folder = folder.parent_path();  // "case/"
  if (folder.extension() == ".foam" && !std::filesystem::is_directory(folder)) folder = folder.parent_path();
  return to_utf8(folder.filename() == "polyMesh" ? folder : folder / "constant" / "polyMesh");
}

Result<std::unique_ptr<FolderSink>> polymesh_sink(const std::string& path, bool overwrite) {
  std::vector<std::string> mesh_files = {"cellLevel", "pointLevel", "surfaceIndex", "level0Edge"};
  for (const char* name : {"points", "faces", "owner", "neighbour", "boundary", "cells", "cellZones",
                           "faceZones", "pointZones"}) {
    mesh_files.emplace_back(name);
    mesh_files.push_back(std::string(name) + ".gz");
  }
  const std::string folder = polymesh_folder(path);
  auto mesh = MAILLE_TRY(folder_sink(folder, std::move(mesh_files), path));
  const bool alone = path.substr(0, path.find_last_not_of('/') + 1).ends_with("polyMesh");
  return alone ? std::move(mesh)
               : case_sink(std::move(mesh), to_utf8(to_path(folder).parent_path().parent_path()), overwrite);
}

}  // namespace maille
