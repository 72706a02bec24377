// OpenFOAM's polyMesh, written: points, faces, owner, neighbour, boundary, zones. Inner faces come first, by
// owner and then neighbour, and point from the lesser cell to the greater; those of the patches follow. The
// mesh is read in parts, and faces are sorted out of core.
#include <algorithm>
#include <filesystem>

#include "base/bytes.h"
#include "io/buffered_writer.h"
#include "io/folder_sink.h"
#include "io/format.h"
#include "io/notes.h"
#include "io/polymesh.h"
#include "io/polymesh_faces.h"
#include "io/polymesh_groups.h"
#include "io/reading.h"
#include "mesh/mesh_as_source.h"

namespace maille {
namespace {

/// blockMesh's name of the patch of all faces that are in no other.
constexpr char rest_name[] = "defaultFaces";
/// Other types (cyclic, processor, ...) need entries of their own in the file "boundary".
constexpr std::string_view plain_types[] = {"patch", "wall", "symmetry", "symmetryPlane", "empty", "wedge"};

/// The elements of zones, sorted by zone, with how many each has.
template <size_t N>
struct FoamZoneLists {
  FoamZoneLists(uint64_t memory, const std::string& folder) : sorted(memory, folder) {}
  Result<> add(const std::array<uint64_t, N>& numbers) {
    if (counts.size() <= numbers[0]) counts.resize(numbers[0] + 1);
    ++counts[numbers[0]];
    return sorted.add(numbers, {});
  }
  uint64_t count(uint64_t zone) const { return zone < counts.size() ? counts[zone] : 0; }

  ListSorter<N> sorted;
  std::vector<uint64_t> counts;
};

class PolyMeshWriter {
 public:
  PolyMeshWriter(MeshSource& mesh, FolderSink& sink, bool ascii, uint64_t memory, const std::string& folder)
      : mesh_(mesh),
        description_(mesh.description()),
        sink_(sink),
        binary_(!ascii),
        groups_(description_),
        out_(sink),
        table_(memory / 4 * 3, folder, sink.name()),
        cell_zones_(memory / 8, folder),
        point_zones_(memory / 8, folder),
        face_zones_(memory / 8, folder) {}

  Result<std::vector<std::string>> write();

 private:
  Result<> begin(const char* name, const char* kind);
  Result<> end();
  void begin_list(uint64_t count);
  void end_list();
  void put_label(uint64_t label);
  Result<> put_points();
  Result<> put_faces();
  Result<> put_compact_faces();
  Result<> put_owners();
  Result<> put_neighbours();
  void put_boundary();
  template <size_t N>
  Result<> put_zones(const FoamZoneKind& kind, const FoamNames& names, FoamZoneLists<N>& lists);
  template <size_t N>
  Result<> put_zone(const FoamZoneKind& kind, uint64_t zone, FoamZoneLists<N>& lists);
  void begin_zone_list(const std::string& key, const std::string& type, uint64_t count);
  template <class F>
  Result<> for_each_written(F f) {
    return table_.visit(last_, f);
  }
  Result<> collect();
  Result<> collect(const MeshDescription::Block& block, uint64_t first, uint64_t count);
  Result<> add_cell(const MeshDescription::Block& block, uint64_t i);
  Result<> collect_point_zones();
  void place_patches();
  void note();

  MeshSource& mesh_;
  const MeshDescription& description_;
  FolderSink& sink_;
  bool binary_;
  FoamGroups groups_;
  std::vector<FoamPatch> patches_;
  BufferedWriter out_;
  FoamFaceTable table_;
  FoamZoneLists<2> cell_zones_, point_zones_;  ///< zone, element
  FoamZoneLists<4> face_zones_;                ///< zone, place in it, face, whether it is flipped
  std::optional<FoamLabels> names_;
  std::vector<FoamLabels> zone_labels_;
  CellPiece piece_;
  std::vector<uint32_t> nodes_;
  std::vector<uint64_t> zones_;
  uint64_t last_ = FoamFaceTable::no_patch;  ///< the patch that takes the rest, where it is not the last
  bool wide_labels_ = false;
  std::vector<std::string> notes_;
};

Result<> PolyMeshWriter::begin(const char* name, const char* kind) {
  MAILLE_CHECK(sink_.begin_file(name));
  std::string text = "FoamFile\n{\n    version     2.0;\n    format      ";
  text += binary_ ? "binary" : "ascii";
  text += std::string(";\n    class       ") + kind + ";\n";
  if (binary_) {
    text += std::string("    arch        \"LSB;label=") + (wide_labels_ ? "64" : "32") +
            ";scalar=" + (description_.point_type == Scalar::f32 ? "32" : "64") + "\";\n";
  }
  if (std::string_view(kind) == "labelList") {
    text += "    note        \"nPoints:" + std::to_string(description_.points) +
            "  nCells:" + std::to_string(table_.cells) + "  nFaces:" + std::to_string(table_.faces) +
            "  nInternalFaces:" + std::to_string(table_.inner) + "\";\n";
  }
  text += std::string("    location    \"constant/polyMesh\";\n    object      ") + name + ";\n}\n\n";
  out_.put(text);
  return {};
}

Result<> PolyMeshWriter::end() {
  out_.put('\n');
  return out_.finish();
}

void PolyMeshWriter::begin_list(uint64_t count) {
  out_.put_number(count);
  out_.put(binary_ ? "\n(" : "\n(\n");
}

void PolyMeshWriter::end_list() {
  out_.put(")\n");
}

void PolyMeshWriter::put_label(uint64_t label) {
  if (!binary_) {
    out_.put_number(label);
  } else if (wide_labels_) {
    out_.put_raw(static_cast<int64_t>(label));
  } else {
    out_.put_raw(static_cast<int32_t>(label));
  }
}

Result<> PolyMeshWriter::put_points() {
  begin_list(description_.points);
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
  end_list();
  return {};
}

/// Where each face begins in the list of all their corners, then that list.
Result<> PolyMeshWriter::put_compact_faces() {
  uint64_t place = 0;
  begin_list(table_.faces + 1);
  put_label(0);
  MAILLE_CHECK(for_each_written([&](const FoamFaceTable::Face& face) -> Result<> {
    put_label(place += face.corners.size());
    return {};
  }));
  end_list();
  begin_list(place);
  MAILLE_CHECK(for_each_written([&](const FoamFaceTable::Face& face) -> Result<> {
    for (const uint32_t corner : face.corners) put_label(corner);
    return {};
  }));
  end_list();
  return {};
}

Result<> PolyMeshWriter::put_faces() {
  if (binary_) return put_compact_faces();
  begin_list(table_.faces);
  MAILLE_CHECK(for_each_written([&](const FoamFaceTable::Face& face) -> Result<> {
    out_.put_number(face.corners.size());
    for (size_t i = 0; i < face.corners.size(); ++i) {
      out_.put(i == 0 ? '(' : ' ');
      out_.put_number(face.corners[i]);
    }
    out_.put(")\n");
    return {};
  }));
  end_list();
  return {};
}

/// And which faces zones have: their numbers are known here.
Result<> PolyMeshWriter::put_owners() {
  begin_list(table_.faces);
  uint64_t number = 0;
  MAILLE_CHECK(for_each_written([&](const FoamFaceTable::Face& face) -> Result<> {
    put_label(face.owner);
    if (!binary_) out_.put('\n');
    for (const FoamFaceTable::Mark& mark : face.marks)
      MAILLE_CHECK(face_zones_.add({mark.zone, mark.order, number, uint64_t{mark.flipped}}));
    ++number;
    return {};
  }));
  end_list();
  return {};
}

Result<> PolyMeshWriter::put_neighbours() {
  // In binary, nothing stands behind the count of an empty list.
  if (binary_ && table_.inner == 0) {
    out_.put("0\n");
    return {};
  }
  begin_list(table_.inner);
  MAILLE_CHECK(for_each_written([&](const FoamFaceTable::Face& face) -> Result<> {
    if (face.neighbour == FoamFaceTable::no_cell) return {};
    put_label(face.neighbour);
    if (!binary_) out_.put('\n');
    return {};
  }));
  end_list();
  return {};
}

/// Text in either form.
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

/// Of a zone, behind those of the zones before it. Flips are a byte each.
template <size_t N>
Result<> PolyMeshWriter::put_zone(const FoamZoneKind& kind, uint64_t zone, FoamZoneLists<N>& lists) {
  std::vector<uint8_t> flips;
  begin_zone_list(kind.labels, "label", lists.count(zone));
  for (uint64_t i = 0; i < lists.count(zone); ++i) {
    const auto& numbers = lists.sorted.front()->numbers;
    put_label(numbers[N == 4 ? 2 : 1]);
    if (!binary_) out_.put('\n');
    if (N == 4) flips.push_back(static_cast<uint8_t>(numbers[N - 1]));
    MAILLE_CHECK(lists.sorted.take());
  }
  out_.put(lists.count(zone) == 0 ? "0;\n" : ");\n");
  if (N != 4) return {};
  begin_zone_list("flipMap", "bool", flips.size());
  for (const uint8_t flip : flips) {
    out_.put(binary_ ? static_cast<char>(flip) : flip != 0 ? '1' : '0');
    if (!binary_) out_.put('\n');
  }
  out_.put(flips.empty() ? "0;\n" : ");\n");
  return {};
}

/// Without its "(", and so without a count, where there is nothing in it.
void PolyMeshWriter::begin_zone_list(const std::string& key, const std::string& type, uint64_t count) {
  out_.put("    " + key + " " + (count == 0 ? "" : "List<" + type + "> \n"));
  if (count > 0) begin_list(count);
}

template <size_t N>
Result<> PolyMeshWriter::put_zones(const FoamZoneKind& kind, const FoamNames& names,
                                   FoamZoneLists<N>& lists) {
  if (names.size() == 0) return {};
  MAILLE_CHECK(lists.sorted.sort());
  MAILLE_CHECK(begin(kind.file, "regIOobject"));
  out_.put_number(names.size());
  out_.put("\n(\n");
  for (uint64_t zone = 0; zone < names.size(); ++zone) {
    out_.put(names.words()[zone] + "\n{\n    type " + kind.type + ";\n");
    MAILLE_CHECK(put_zone(kind, zone, lists));
    out_.put("}\n");
  }
  out_.put(")\n");
  return end();
}

Result<> PolyMeshWriter::add_cell(const MeshDescription::Block& block, uint64_t i) {
  const auto type = static_cast<CellType>(piece_.types[i]);
  nodes_.clear();
  for (uint64_t k = piece_.offsets[i]; k < piece_.offsets[i + 1]; ++k)
    nodes_.push_back(static_cast<uint32_t>(piece_.connectivity[k]));
  static const std::string none;
  const std::string& label = names_ ? names_->name(i) : none;
  if (is_face(type)) {
    const FoamGroups::Target target = groups_.of_face(block.name, label);
    return target.zone ? table_.add_zone_face(nodes_, target.number) : table_.add_face(nodes_, target.number);
  }
  std::span<const uint32_t> sizes;
  if (type == CellType::polyhedron)
    sizes = std::span(piece_.face_sizes)
                .subspan(piece_.cell_faces[i], piece_.cell_faces[i + 1] - piece_.cell_faces[i]);
  const uint64_t cell = table_.cells;
  if (!MAILLE_TRY(table_.add_cell(type, nodes_, sizes))) return {};
  zones_.clear();
  const auto add_zone = [&](const std::string& name) {
    if (!name.empty()) zones_.push_back(groups_.cell_zones.number(name));
  };
  add_zone(block.name.empty() ? label : block.name);
  for (const FoamLabels& labels : zone_labels_) add_zone(labels.name(i));
  std::sort(zones_.begin(), zones_.end());
  zones_.erase(std::unique(zones_.begin(), zones_.end()), zones_.end());
  for (const uint64_t zone : zones_) MAILLE_CHECK(cell_zones_.add({zone, cell}));
  return {};
}

Result<> PolyMeshWriter::collect(const MeshDescription::Block& block, uint64_t first, uint64_t count) {
  MAILLE_CHECK(mesh_.read_cells(first, count, piece_));
  if (names_) MAILLE_CHECK(names_->read(mesh_, first, count));
  for (FoamLabels& labels : zone_labels_) MAILLE_CHECK(labels.read(mesh_, first, count));
  for (uint64_t i = 0; i < count; ++i) MAILLE_CHECK(add_cell(block, i));
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
  const uint64_t most = std::max({description_.points, table_.cells, faces + 1, table_.corners});
  wide_labels_ = most > INT32_MAX;
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
    const auto known = {foam_patch_prefix,        foam_entries_prefix,      foam_type_prefix,
                        foam_cell_zones.metadata, foam_face_zones.metadata, foam_point_zones.metadata};
    const auto begins = [&key = key](const char* prefix) { return key.starts_with(prefix); };
    if (std::none_of(known.begin(), known.end(), begins)) note_metadata(key, notes_);
  }
}

Result<std::vector<std::string>> PolyMeshWriter::write() {
  if (description_.points > max_points)
    return failure(ErrorCode::unsupported,
                   sink_.name() + ": more than 2^32 points cannot be written in this format");
  MAILLE_CHECK(collect());
  place_patches();
  MAILLE_CHECK(begin("points", "vectorField"));
  MAILLE_CHECK(put_points());
  MAILLE_CHECK(end());
  MAILLE_CHECK(begin("faces", binary_ ? "faceCompactList" : "faceList"));
  MAILLE_CHECK(put_faces());
  MAILLE_CHECK(end());
  MAILLE_CHECK(begin("owner", "labelList"));
  MAILLE_CHECK(put_owners());
  MAILLE_CHECK(end());
  MAILLE_CHECK(begin("neighbour", "labelList"));
  MAILLE_CHECK(put_neighbours());
  MAILLE_CHECK(end());
  MAILLE_CHECK(begin("boundary", "polyBoundaryMesh"));
  put_boundary();
  MAILLE_CHECK(end());
  MAILLE_CHECK(put_zones(foam_cell_zones, groups_.cell_zones, cell_zones_));
  MAILLE_CHECK(put_zones(foam_face_zones, groups_.face_zones, face_zones_));
  MAILLE_CHECK(put_zones(foam_point_zones, groups_.point_zones, point_zones_));
  note();
  return std::move(notes_);
}

void note_arrays(const std::vector<Array>& arrays, std::vector<std::string>& notes) {
  for (const Array& array : arrays) {
    if (!is_foam_group_array(array)) note_array(array, notes);
  }
}

}  // namespace

Result<std::vector<std::string>> write_polymesh(MeshSource& mesh, FolderSink& sink, bool ascii,
                                                uint64_t memory, const std::string& folder) {
  std::vector<std::string> notes = MAILLE_TRY(PolyMeshWriter(mesh, sink, ascii, memory, folder).write());
  note_arrays(mesh.description().arrays, notes);
  note_arrays(mesh.description().mesh_arrays, notes);
  return notes;
}

Result<std::vector<std::string>> write_polymesh(const Mesh& mesh, Sink& sink, const WriteOptions& options) {
  auto* const folder = dynamic_cast<FolderSink*>(&sink);
  if (folder == nullptr)
    return failure(ErrorCode::usage, sink.name() + ": is one file, but a polyMesh is a folder of files");
  const auto source = mesh_as_source(mesh);
  // No temporary files: the mesh is in memory, too.
  std::vector<std::string> notes =
      MAILLE_TRY(PolyMeshWriter(*source, *folder, options.ascii, ~uint64_t{0}, "").write());
  note_arrays(mesh.arrays, notes);
  if (options.ascii) note_nan_payloads(mesh, notes);
  return notes;
}

std::string polymesh_folder(const std::string& path) {
  std::filesystem::path folder(path);
  if (folder.has_relative_path() && folder.filename().empty()) folder = folder.parent_path();  // "case/"
  if (folder.extension() == ".foam" && !std::filesystem::is_directory(folder)) folder = folder.parent_path();
  return (folder.filename() == "polyMesh" ? folder : folder / "constant" / "polyMesh").string();
}

Result<std::unique_ptr<FolderSink>> polymesh_sink(const std::string& path) {
  std::vector<std::string> mesh_files = {"cellLevel", "pointLevel", "surfaceIndex", "level0Edge"};
  for (const char* name : {"points", "faces", "owner", "neighbour", "boundary", "cells", "cellZones",
                           "faceZones", "pointZones"}) {
    mesh_files.emplace_back(name);
    mesh_files.push_back(std::string(name) + ".gz");
  }
  return folder_sink(polymesh_folder(path), std::move(mesh_files), path);
}

}  // namespace maille
