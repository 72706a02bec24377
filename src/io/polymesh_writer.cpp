// OpenFOAM's polyMesh, written: points, faces, owner, neighbour, boundary. Inner faces come first, by owner
// and then neighbour, and point from the lesser cell to the greater; those of the patches follow.
#include <algorithm>
#include <filesystem>
#include <map>

#include "base/bytes.h"
#include "io/buffered_writer.h"
#include "io/folder_sink.h"
#include "io/format.h"
#include "io/notes.h"
#include "io/polymesh.h"
#include "io/polymesh_faces.h"
#include "io/reading.h"

namespace maille {
namespace {

/// blockMesh's name of the patch of all faces that are in no other.
constexpr char rest_name[] = "defaultFaces";
/// As `maille generate` has them: names of cells, and the type of a patch behind the prefix.
constexpr char patch_array[] = "patch", patch_prefix[] = "patch.";
/// Other types (cyclic, processor, ...) need entries of their own in the file "boundary".
constexpr std::string_view plain_types[] = {"patch", "wall", "symmetry", "symmetryPlane", "empty", "wedge"};

/// What OpenFOAM takes for a name: no blank, sign or directive, and not what begins like a number.
std::string foam_word(const std::string& name) {
  std::string word;
  for (const char c : name) {
    const bool sign = static_cast<unsigned char>(c) <= ' ' || c == 0x7f ||
                      std::string_view("\"'/;{}()[]$#\\").find(c) != std::string_view::npos;
    word += sign ? '_' : c;
  }
  if (word.empty() || std::string_view("0123456789+-.").find(word[0]) != std::string_view::npos)
    word.insert(word.begin(), '_');
  return word;
}

/// The patches of a mesh: those its metadata names, in that order, then those that blocks name.
class FoamPatches {
 public:
  explicit FoamPatches(const Mesh& mesh) {
    names_ = mesh.find(patch_array, Domain::cell);
    if (names_ != nullptr && (names_->role != Role::label || names_->components != 1)) names_ = nullptr;
    for (const auto& [key, value] : mesh.metadata) {
      if (key.starts_with(foam_patch_prefix)) type(number(key.substr(sizeof foam_patch_prefix - 1)), value);
    }
    for (const auto& [key, value] : mesh.metadata) {
      if (!key.starts_with(foam_entries_prefix) || !is_plain_entries(value)) continue;
      patches[number(key.substr(sizeof foam_entries_prefix - 1))].entries = value;
    }
    for (const CellBlock& block : mesh.blocks) {
      if (is_face(block.type) && !block.name.empty()) number(block.name);
    }
    collect(mesh);
    for (const auto& [key, value] : mesh.metadata) {
      const auto known =
          key.starts_with(patch_prefix) ? numbers_.find(key.substr(sizeof patch_prefix - 1)) : numbers_.end();
      if (known != numbers_.end()) type(known->second, value);
    }
  }

  /// Of a cell that is a face, by its number in the mesh.
  uint64_t of(const CellBlock& block, uint64_t cell) {
    return number(block.name.empty() ? label(cell) : block.name);
  }
  uint64_t count() const { return patches.size(); }

  std::vector<FoamPatch> patches;

 private:
  void collect(const Mesh& mesh) {
    uint64_t cell = 0;
    for (const CellBlock& block : mesh.blocks) {
      for (uint64_t i = 0; i < block.size(); ++i, ++cell) {
        if (is_face(block.type_of(i))) of(block, cell);
      }
    }
  }
  std::string label(uint64_t cell) const {
    if (names_ == nullptr) return "boundary";
    return with_type(names_->type, [&](auto zero) -> std::string {
      const auto value = static_cast<uint64_t>(names_->values<decltype(zero)>()[cell]);
      return value < names_->labels.size() ? names_->labels[value] : "boundary";
    });
  }
  uint64_t number(const std::string& name) {
    const auto [known, is_new] = numbers_.emplace(name, patches.size());
    if (!is_new) return known->second;
    std::string word = foam_word(name);
    for (int i = 2; is_taken(word); ++i) word = foam_word(name) + "_" + std::to_string(i);
    patches.push_back({word, "patch", 0, 0, ""});
    return known->second;
  }
  bool is_taken(const std::string& word) const {
    return std::any_of(patches.begin(), patches.end(), [&](const auto& patch) { return patch.name == word; });
  }
  void type(uint64_t patch, const std::string& value) { patches[patch].type = foam_word(value); }

  const Array* names_ = nullptr;
  std::map<std::string, uint64_t> numbers_;
};

class PolyMeshWriter {
 public:
  PolyMeshWriter(const Mesh& mesh, FolderSink& sink, bool ascii)
      : mesh_(mesh), sink_(sink), binary_(!ascii), patches_(mesh), out_(sink) {}

  Result<std::vector<std::string>> write();

 private:
  Result<> begin(const char* name, const char* kind);
  Result<> end();
  void begin_list(uint64_t count);
  void end_list();
  void put_label(uint64_t label);
  void put_list(const std::vector<uint64_t>& labels);
  void put_points();
  void put_faces();
  void put_boundary();
  template <class F>
  void for_each_written(F f) const;
  std::span<const uint32_t> face_of(uint64_t side, bool turned);
  void place_patches();
  void note();

  const Mesh& mesh_;
  FolderSink& sink_;
  bool binary_;
  FoamPatches patches_;
  BufferedWriter out_;
  FoamFaceTable table_;
  uint64_t faces_ = 0;
  bool wide_labels_ = false;
  std::vector<uint32_t> turned_;
  std::vector<std::string> notes_;
};

Result<> PolyMeshWriter::begin(const char* name, const char* kind) {
  MAILLE_CHECK(sink_.begin_file(name));
  std::string text = "FoamFile\n{\n    version     2.0;\n    format      ";
  text += binary_ ? "binary" : "ascii";
  text += std::string(";\n    class       ") + kind + ";\n";
  if (binary_) {
    text += std::string("    arch        \"LSB;label=") + (wide_labels_ ? "64" : "32") +
            ";scalar=" + (mesh_.points.type == Scalar::f32 ? "32" : "64") + "\";\n";
  }
  if (std::string_view(kind) == "labelList") {
    text += "    note        \"nPoints:" + std::to_string(mesh_.point_count()) +
            "  nCells:" + std::to_string(table_.cells) + "  nFaces:" + std::to_string(faces_) +
            "  nInternalFaces:" + std::to_string(table_.inner.size()) + "\";\n";
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

void PolyMeshWriter::put_list(const std::vector<uint64_t>& labels) {
  // In binary, nothing stands behind the count of an empty list.
  if (binary_ && labels.empty()) return out_.put("0\n");
  begin_list(labels.size());
  for (const uint64_t label : labels) {
    put_label(label);
    if (!binary_) out_.put('\n');
  }
  end_list();
}

void PolyMeshWriter::put_points() {
  begin_list(mesh_.point_count());
  const size_t size = mesh_.points.tuple_size();
  for (uint64_t i = 0; i < mesh_.point_count(); ++i) {
    const std::byte* const from = mesh_.points.bytes.data() + i * size;
    if (!binary_) {
      out_.put('(');
      put_scalars(out_, from, mesh_.points.type, 3);
      out_.put(")\n");
    } else if (is_float(mesh_.points.type)) {
      out_.put_bytes(Bytes(from, size));
    } else {
      with_type(mesh_.points.type, [&](auto zero) {
        using T = decltype(zero);
        for (size_t k = 0; k < 3; ++k) out_.put_raw(static_cast<double>(load<T>(from + k * sizeof(T))));
      });
    }
  }
  end_list();
}

/// Calls f(owner, side, turned) for every face, in the order of the files.
template <class F>
void PolyMeshWriter::for_each_written(F f) const {
  for (const auto& face : table_.inner) f(face.owner, face.side, false);
  for (const auto& patch : table_.patches) {
    for (const auto& face : patch) f(face.owner, face.side, face.turned);
  }
  for (const auto& face : table_.rest) f(face.owner, face.side, false);
}

/// Turned over, it keeps its first corner.
std::span<const uint32_t> PolyMeshWriter::face_of(uint64_t side, bool turned) {
  const auto face = table_.corners(side);
  if (!turned) return face;
  turned_.assign(face.begin(), face.end());
  std::reverse(turned_.begin() + 1, turned_.end());
  return turned_;
}

/// In binary: where each face begins in the list of all their corners, then that list.
void PolyMeshWriter::put_faces() {
  if (binary_) {
    uint64_t place = 0;
    begin_list(faces_ + 1);
    put_label(0);
    for_each_written([&](uint64_t, uint64_t side, bool) { put_label(place += table_.corners(side).size()); });
    end_list();
    begin_list(place);
    for_each_written([&](uint64_t, uint64_t side, bool turned) {
      for (const uint32_t corner : face_of(side, turned)) put_label(corner);
    });
    return end_list();
  }
  begin_list(faces_);
  for_each_written([&](uint64_t, uint64_t side, bool turned) {
    const auto face = face_of(side, turned);
    out_.put_number(face.size());
    for (size_t i = 0; i < face.size(); ++i) {
      out_.put(i == 0 ? '(' : ' ');
      out_.put_number(face[i]);
    }
    out_.put(")\n");
  });
  end_list();
}

/// Text in either form.
void PolyMeshWriter::put_boundary() {
  std::string text = std::to_string(patches_.count()) + "\n(\n";
  for (const FoamPatch& patch : patches_.patches) {
    text += "    " + patch.name + "\n    {\n        type            " + patch.type + ";\n";
    text += "        nFaces          " + std::to_string(patch.faces) + ";\n";
    text += "        startFace       " + std::to_string(patch.first) + ";\n";
    text += (patch.entries.empty() ? "" : "        " + patch.entries + "\n") + "    }\n";
  }
  out_.put(text + ")\n");
}

void PolyMeshWriter::place_patches() {
  // A patch of this name that is there already comes last, so that it can take the rest.
  auto& list = patches_.patches;
  const auto named =
      std::find_if(list.begin(), list.end(), [](const auto& p) { return p.name == rest_name; });
  if (!table_.rest.empty() && named == list.end()) {
    list.push_back({rest_name, "patch", 0, 0, ""});
    table_.patches.emplace_back();
  } else if (!table_.rest.empty()) {
    const auto at = named - list.begin();
    std::rotate(named, named + 1, list.end());
    std::rotate(table_.patches.begin() + at, table_.patches.begin() + at + 1, table_.patches.end());
  }
  faces_ = table_.inner.size();
  for (size_t i = 0; i < list.size(); ++i) {
    list[i].first = faces_;
    list[i].faces = table_.patches[i].size() + (i + 1 == list.size() ? table_.rest.size() : 0);
    faces_ += list[i].faces;
  }
  const uint64_t most = std::max({mesh_.point_count(), table_.cells, faces_ + 1, table_.corner_count});
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
  say(table_.rest.size(), "face",
      std::string("at the boundary, in no block, in the patch \"") + rest_name + "\"");
  for (const FoamPatch& patch : patches_.patches) {
    if (patch.entries.empty() &&
        std::find(std::begin(plain_types), std::end(plain_types), patch.type) == std::end(plain_types))
      notes_.push_back("patch \"" + patch.name + "\" is of type " + patch.type +
                       ", whose other entries (such as its neighbour) have to be added to the file boundary");
  }
  uint64_t named = 0;
  for (const CellBlock& block : mesh_.blocks)
    named += !block.name.empty() && block.size() > 0 && !is_face(block.type_of(0)) ? 1 : 0;
  if (named != 0)
    notes_.push_back("the names of " + counted(named, "block") +
                     " of cells left out: polyMesh names patches only");
  if (binary_ ? !is_float(mesh_.points.type) : mesh_.points.type != Scalar::f64)
    notes_.push_back("positions are written as doubles");
  for (const Array& array : mesh_.arrays) {
    if (array.name != patch_array || array.role != Role::label) note_array(array, notes_);
  }
  for (const auto& [key, value] : mesh_.metadata) {
    if (!key.starts_with(foam_patch_prefix) && !key.starts_with(foam_entries_prefix) &&
        !key.starts_with(patch_prefix))
      note_metadata(key, notes_);
  }
  if (!binary_) note_nan_payloads(mesh_, notes_);
}

Result<std::vector<std::string>> PolyMeshWriter::write() {
  const auto patch_of = [&](const CellBlock& block, uint64_t cell) { return patches_.of(block, cell); };
  table_ = MAILLE_TRY(FoamFaceTable::make(mesh_, patches_.count(), patch_of, sink_.name()));
  place_patches();
  MAILLE_CHECK(begin("points", "vectorField"));
  put_points();
  MAILLE_CHECK(end());
  MAILLE_CHECK(begin("faces", binary_ ? "faceCompactList" : "faceList"));
  put_faces();
  MAILLE_CHECK(end());
  std::vector<uint64_t> cells;
  for_each_written([&](uint64_t owner, uint64_t, bool) { cells.push_back(owner); });
  MAILLE_CHECK(begin("owner", "labelList"));
  put_list(cells);
  MAILLE_CHECK(end());
  cells.clear();
  for (const auto& face : table_.inner) cells.push_back(face.neighbour);
  MAILLE_CHECK(begin("neighbour", "labelList"));
  put_list(cells);
  MAILLE_CHECK(end());
  MAILLE_CHECK(begin("boundary", "polyBoundaryMesh"));
  put_boundary();
  MAILLE_CHECK(end());
  note();
  return std::move(notes_);
}

}  // namespace

Result<std::vector<std::string>> write_polymesh(const Mesh& mesh, Sink& sink, const WriteOptions& options) {
  auto* const folder = dynamic_cast<FolderSink*>(&sink);
  if (folder == nullptr)
    return failure(ErrorCode::usage, sink.name() + ": is one file, but a polyMesh is a folder of files");
  return PolyMeshWriter(mesh, *folder, options.ascii).write();
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
