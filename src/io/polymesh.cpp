// OpenFOAM's polyMesh, a folder of files: points; faces; for each face the cell it belongs to (owner) and,
// for the first ones, the cell on its other side (neighbour); boundary, the patches of faces without one.
// Normals point from owner to neighbour. Text or binary, each file possibly packed with gzip.
#include <algorithm>
#include <filesystem>

#include "base/bytes.h"
#include "io/cell_faces.h"
#include "io/cell_store.h"
#include "io/format.h"
#include "io/gzip.h"
#include "io/token_reader.h"

namespace maille {
namespace {

/// One file: its header, and the lists behind it.
class FoamFile {
 public:
  static Result<FoamFile> open(const std::string& folder, const std::string& name, const Limits& limits) {
    FoamFile file;
    std::string path = folder + "/" + name;
    if (!std::filesystem::exists(path) && std::filesystem::exists(path + ".gz")) path += ".gz";
    file.source_ = MAILLE_TRY(file_source(path));
    file.bytes_ = MAILLE_TRY(InputBytes::load(*file.source_));
    std::string_view text = file.bytes_.text();
    if (is_gzip(file.bytes_.bytes())) {
      file.unpacked_ = MAILLE_TRY(gunzip(file.bytes_.bytes(), limits.mesh_bytes, path));
      text = {reinterpret_cast<const char*>(file.unpacked_.data()), file.unpacked_.size()};
    }
    file.name_ = path;
    file.text_ = text;
    file.at_ = text.data();
    file.end_ = text.data() + text.size();
    MAILLE_CHECK(file.read_header());
    return file;
  }

  uint64_t size() const { return text_.size(); }
  bool binary() const { return binary_; }
  tl::unexpected<Error> malformed(const std::string& what) const {
    return malformed_byte(name_, static_cast<uint64_t>(at_ - text_.data()), what);
  }
  bool at_end() {
    skip();
    return at_ == end_;
  }
  /// A name, a number, or one of the characters that stand for themselves.
  std::string_view word() {
    skip();
    const char* const from = at_;
    while (at_ != end_ && !TextScanner::is_white(*at_) && !is_sign(*at_)) ++at_;
    if (at_ == from && at_ != end_) ++at_;
    return {from, static_cast<size_t>(at_ - from)};
  }
  bool take(char sign) {
    skip();
    if (at_ == end_ || *at_ != sign) return false;
    ++at_;
    return true;
  }
  bool label(int64_t& value) {
    skip();
    const auto [behind, error] = std::from_chars(at_, end_, value);
    if (error != std::errc()) return false;
    at_ = behind;
    return true;
  }
  bool scalar(double& value) {
    skip();
    Number number;
    const char* const behind = parse_number(at_, end_, number);
    if (behind == nullptr) return false;
    value = number.value;
    at_ = behind;
    return true;
  }
  /// The count of a list, and whether "(" follows; otherwise the list is "count{value}".
  Result<uint64_t> begin_list(bool& values) {
    int64_t count = 0;
    if (!label(count) || count < 0) return malformed("there should be the length of a list");
    // No list is longer than the file but one that repeats a value.
    values = take('(');
    if (!values && count != 0 && !take('{'))
      return malformed("there should be \"(\" or \"{\" behind the length of a list");
    return static_cast<uint64_t>(count);
  }
  Result<> end_list(bool values) {
    if (!take(values ? ')' : '}')) return malformed("a list is longer or shorter than it says");
    return {};
  }
  /// A list of labels, appended to `out`.
  Result<> labels(std::vector<int64_t>& out, Budget& budget) {
    bool values = false;
    const uint64_t count = MAILLE_TRY(begin_list(values));
    if (count == 0) return values ? end_list(values) : Result<>();
    if (values && count > text_.size()) return malformed("a list is longer than the file");
    MAILLE_CHECK(budget.take(count, sizeof(int64_t)));
    int64_t value = 0;
    if (!values) {
      if (!label(value)) return malformed("there should be a number");
      out.insert(out.end(), count, value);
      return end_list(values);
    }
    for (uint64_t i = 0; i < count; ++i) {
      const bool ok = !binary_ ? label(value) : wide_label_ ? raw<int64_t>(value) : raw<int32_t>(value);
      if (!ok)
        return malformed("there should be number " + std::to_string(i) + " of " + std::to_string(count));
      out.push_back(value);
    }
    return end_list(values);
  }
  template <class T, class To>
  bool raw(To& value) {
    if (static_cast<size_t>(end_ - at_) < sizeof(T)) return false;
    value = static_cast<To>(load<T>(at_));
    at_ += sizeof(T);
    return true;
  }
  bool coordinate(double& value) {
    return !binary_ ? scalar(value) : wide_scalar_ ? raw<double>(value) : raw<float>(value);
  }
  bool is_single() const { return binary_ && !wide_scalar_; }
  const std::string& kind() const { return class_; }

 private:
  static bool is_sign(char c) { return c == '(' || c == ')' || c == '{' || c == '}' || c == ';'; }
  void skip() {
    for (;;) {
      while (at_ != end_ && TextScanner::is_white(*at_)) ++at_;
      if (end_ - at_ < 2 || *at_ != '/') return;
      const std::string_view rest(at_, static_cast<size_t>(end_ - at_));
      size_t end = 0;
      if (rest[1] == '/') {
        end = rest.find('\n');
      } else if (rest[1] == '*') {
        end = rest.find("*/", 2);
        if (end != std::string_view::npos) end += 2;
      } else {
        return;
      }
      at_ = end == std::string_view::npos ? end_ : at_ + end;
    }
  }
  Result<> read_header() {
    if (word() != "FoamFile" || !take('{')) return malformed("there should be a header \"FoamFile\"");
    while (!take('}')) {
      if (at_end()) return malformed("the file ends inside its header");
      const std::string key(word());
      skip();
      const char* const from = at_;
      while (at_ != end_ && *at_ != ';') ++at_;
      const std::string_view value(from, static_cast<size_t>(at_ - from));
      if (key == "format") binary_ = value == "binary";
      if (key == "class") class_ = value;
      if (key == "arch" && value.find("MSB") != std::string_view::npos) {
        return failure(ErrorCode::unsupported, name_ + ": its numbers are big-endian, which cannot be read");
      }
      if (key == "arch") {
        wide_label_ = value.find("label=64") != std::string_view::npos;
        wide_scalar_ = value.find("scalar=32") == std::string_view::npos;
      }
      take(';');
    }
    return {};
  }

  std::unique_ptr<Source> source_;
  InputBytes bytes_;
  std::vector<std::byte> unpacked_;
  std::string name_, class_;
  std::string_view text_;
  const char* at_ = nullptr;
  const char* end_ = nullptr;
  bool binary_ = false, wide_label_ = false, wide_scalar_ = true;
};

struct Patch {
  std::string name, type;
  uint64_t first = 0, faces = 0;
};

class PolyMeshReader {
 public:
  PolyMeshReader(std::string folder, const ReadOptions& options)
      : folder_(std::move(folder)), options_(options), budget_(folder_, folder_bytes(), options.limits) {}

  Result<ReadResult> read();

 private:
  uint64_t folder_bytes() const {
    uint64_t bytes = 0;
    for (const char* name :
         {"points", "faces", "owner", "neighbour", "points.gz", "faces.gz", "owner.gz", "neighbour.gz"}) {
      std::error_code error;
      const auto size = std::filesystem::file_size(folder_ + "/" + name, error);
      if (!error) bytes += size;
    }
    return bytes;
  }
  Result<FoamFile> open(const char* name) { return FoamFile::open(folder_, name, options_.limits); }
  Result<> read_points();
  Result<> read_faces();
  Result<std::vector<uint64_t>> read_cells_of_faces(const char* name);
  Result<> read_boundary();
  Result<> check_faces() const;
  void collect_cells();
  void add_cell(std::span<const uint64_t> faces, uint64_t cell);
  bool add_known_cell(std::span<const uint64_t> faces);
  Result<> add_patches();
  std::span<const uint32_t> face(uint64_t i) const {
    return std::span(corners_).subspan(i == 0 ? 0 : ends_[i - 1], ends_[i] - (i == 0 ? 0 : ends_[i - 1]));
  }
  tl::unexpected<Error> malformed(const std::string& what) const {
    return failure(ErrorCode::malformed_input, folder_ + ": " + what);
  }

  std::string folder_;
  const ReadOptions& options_;
  Budget budget_;
  Mesh mesh_;
  std::vector<uint32_t> corners_;
  std::vector<uint64_t> ends_;
  std::vector<uint64_t> owner_, neighbour_;
  uint64_t cells_ = 0;
  std::vector<Patch> patches_;
  std::vector<std::vector<uint32_t>> outward_;  ///< faces of the cell at hand
  CellStore store_;
  BlockShapes shapes_;
};

Result<> PolyMeshReader::read_points() {
  FoamFile file = MAILLE_TRY(open("points"));
  bool values = false;
  const uint64_t count = MAILLE_TRY(file.begin_list(values));
  if (!values && count != 0) return file.malformed("points cannot be one repeated value");
  if (count > max_points || count > file.size())
    return file.malformed("there are more points than the file can hold, or 2^32");
  mesh_.points.type = file.is_single() ? Scalar::f32 : Scalar::f64;
  MAILLE_CHECK(budget_.take(count, 3 * sizeof(double)));
  mesh_.points.resize(count);
  for (uint64_t i = 0; i < count; ++i) {
    if (!file.binary() && !file.take('(')) return file.malformed("there should be a point");
    for (uint64_t k = 0; k < 3; ++k) {
      double value = 0;
      if (!file.coordinate(value))
        return file.malformed("there should be a coordinate of point " + std::to_string(i));
      if (mesh_.points.type == Scalar::f32) {
        mesh_.points.values<float>()[3 * i + k] = static_cast<float>(value);
      } else {
        mesh_.points.values<double>()[3 * i + k] = value;
      }
    }
    if (!file.binary() && !file.take(')')) return file.malformed("there should be \")\" behind a point");
  }
  return count == 0 && !values ? Result<>() : file.end_list(true);
}

/// Lists of points one after the other, or in binary the places where each begins and all their points.
Result<> PolyMeshReader::read_faces() {
  FoamFile file = MAILLE_TRY(open("faces"));
  std::vector<int64_t> points;
  if (file.kind() == "faceCompactList") {
    std::vector<int64_t> places;
    MAILLE_CHECK(file.labels(places, budget_));
    MAILLE_CHECK(file.labels(points, budget_));
    const bool whole = places.empty()
                           ? points.empty()
                           : places.front() == 0 && places.back() == static_cast<int64_t>(points.size());
    if (!whole || !std::is_sorted(places.begin(), places.end()))
      return file.malformed("the faces do not follow each other in the list of their points");
    for (size_t i = 1; i < places.size(); ++i) ends_.push_back(static_cast<uint64_t>(places[i]));
  } else {
    bool values = false;
    const uint64_t count = MAILLE_TRY(file.begin_list(values));
    for (uint64_t i = 0; i < count; ++i) {
      MAILLE_CHECK(file.labels(points, budget_));
      ends_.push_back(points.size());
    }
    if (count != 0) MAILLE_CHECK(file.end_list(values));
  }
  corners_.reserve(points.size());
  for (const int64_t point : points) {
    if (point < 0 || static_cast<uint64_t>(point) >= mesh_.point_count())
      return file.malformed("a face uses point " + std::to_string(point) + ", but there are " +
                            std::to_string(mesh_.point_count()) + " points");
    corners_.push_back(static_cast<uint32_t>(point));
  }
  return {};
}

Result<std::vector<uint64_t>> PolyMeshReader::read_cells_of_faces(const char* name) {
  FoamFile file = MAILLE_TRY(open(name));
  std::vector<int64_t> labels;
  MAILLE_CHECK(file.labels(labels, budget_));
  // Older versions give every face a neighbour, -1 for none.
  while (!labels.empty() && labels.back() == -1) labels.pop_back();
  std::vector<uint64_t> cells;
  for (const int64_t cell : labels) {
    // A cell has a face at least, and a face two cells at most.
    if (cell < 0 || static_cast<uint64_t>(cell) >= 2 * ends_.size())
      return file.malformed("there is no cell " + std::to_string(cell) + " with " +
                            std::to_string(ends_.size()) + " faces");
    cells_ = std::max(cells_, static_cast<uint64_t>(cell) + 1);
    cells.push_back(static_cast<uint64_t>(cell));
  }
  return cells;
}

Result<> PolyMeshReader::read_boundary() {
  FoamFile file = MAILLE_TRY(open("boundary"));
  bool values = false;
  const uint64_t count = MAILLE_TRY(file.begin_list(values));
  for (uint64_t i = 0; i < count; ++i) {
    Patch patch;
    patch.name = std::string(file.word());
    if (!file.take('{')) return file.malformed("there should be \"{\" behind the name of a patch");
    while (!file.take('}')) {
      if (file.at_end()) return file.malformed("the file ends inside a patch");
      const std::string key(file.word());
      int64_t number = 0;
      if (key == "nFaces" || key == "startFace") {
        if (!file.label(number) || number < 0)
          return file.malformed("there should be a number behind " + key);
        (key == "nFaces" ? patch.faces : patch.first) = static_cast<uint64_t>(number);
      }
      if (key == "type") patch.type = std::string(file.word());
      while (!file.at_end() && file.word() != ";") {
      }
    }
    patches_.push_back(std::move(patch));
  }
  return {};
}

Result<> PolyMeshReader::check_faces() const {
  if (owner_.size() != ends_.size() || neighbour_.size() > ends_.size()) {
    return malformed("there are " + std::to_string(ends_.size()) + " faces, owners of " +
                     std::to_string(owner_.size()) + " and neighbours of " +
                     std::to_string(neighbour_.size()));
  }
  for (const Patch& patch : patches_) {
    if (patch.faces > ends_.size() || patch.first > ends_.size() - patch.faces)
      return malformed("patch " + patch.name.substr(0, 40) + " goes beyond the last face");
  }
  return {};
}

/// A tetrahedron, hexahedron, wedge or pyramid, if its faces are those of one.
bool PolyMeshReader::add_known_cell(std::span<const uint64_t> faces) {
  size_t triangles = 0, quads = 0;
  for (const auto& face : outward_) (face.size() == 3 ? triangles : quads) += 1;
  const bool small = std::all_of(outward_.begin(), outward_.end(),
                                 [](const auto& face) { return face.size() == 3 || face.size() == 4; });
  CellType type = CellType::polyhedron;
  if (triangles == 4 && quads == 0) type = CellType::tetrahedron;
  if (triangles == 0 && quads == 6) type = CellType::hexahedron;
  if (triangles == 2 && quads == 3) type = CellType::wedge;
  if (triangles == 4 && quads == 1) type = CellType::pyramid;
  if (!small || type == CellType::polyhedron) return false;
  // The base is a quad of a pyramid, a triangle of a wedge, any face of others; seen from inside.
  const size_t base_size = type == CellType::pyramid || type == CellType::hexahedron ? 4 : 3;
  const auto base = std::find_if(outward_.begin(), outward_.end(),
                                 [&](const auto& face) { return face.size() == base_size; });
  std::vector<uint32_t> nodes{(*base)[0]};
  for (size_t i = base_size; i > 1; --i) nodes.push_back((*base)[i - 1]);
  // VTK's wedge is the exception: its triangle 0 1 2 is seen from outside.
  if (type == CellType::wedge) std::reverse(nodes.begin() + 1, nodes.end());
  const auto in_base = [&](uint32_t point) {
    return std::find(base->begin(), base->end(), point) != base->end();
  };
  const size_t above = nodes_of(type) - base_size;
  for (size_t i = 0; i < above; ++i) {
    // The point beyond the edge that leaves the base here; of an apex, any.
    uint32_t found = UINT32_MAX;
    for (auto face = outward_.begin(); face != outward_.end() && found == UINT32_MAX; ++face) {
      for (size_t k = 0; face != base && k < face->size(); ++k) {
        const uint32_t next = (*face)[(k + 1) % face->size()];
        if ((*face)[k] == nodes[i] && !in_base(next)) found = next;
      }
    }
    if (found == UINT32_MAX) return false;
    nodes.push_back(found);
  }
  // Whether these nodes have exactly the faces the cell has.
  std::vector<std::vector<uint32_t>> made, given = outward_;
  for (const auto& places : faces_of(type)) {
    std::vector<uint32_t> made_face;
    for (const int8_t place : places) {
      if (place >= 0) made_face.push_back(nodes[static_cast<size_t>(place)]);
    }
    made.push_back(std::move(made_face));
  }
  for (auto* list : {&made, &given}) {
    for (auto& one : *list) std::rotate(one.begin(), std::min_element(one.begin(), one.end()), one.end());
    std::sort(list->begin(), list->end());
  }
  if (made != given || faces.size() != made.size()) return false;
  store_.nodes.insert(store_.nodes.end(), nodes.begin(), nodes.end());
  store_.end_cell(type);
  shapes_.add(1, type, "");
  return true;
}

void PolyMeshReader::add_cell(std::span<const uint64_t> faces, uint64_t cell) {
  outward_.clear();
  for (const uint64_t number : faces) {
    const auto corners = face(number);
    outward_.emplace_back(corners.begin(), corners.end());
    // Seen from the neighbour the face is turned over; it keeps its first corner.
    if (owner_[number] != cell && !corners.empty())
      std::reverse(outward_.back().begin() + 1, outward_.back().end());
  }
  if (add_known_cell(faces)) return;
  for (const auto& corners : outward_) {
    store_.nodes.insert(store_.nodes.end(), corners.begin(), corners.end());
    store_.face_sizes.push_back(static_cast<uint32_t>(corners.size()));
  }
  store_.end_cell(CellType::polyhedron);
  shapes_.add(1, CellType::polyhedron, "");
}

void PolyMeshReader::collect_cells() {
  // Faces of each cell, as a list and the places where cells begin in it.
  std::vector<uint64_t> begins(cells_ + 1);
  for (const auto* side : {&owner_, &neighbour_}) {
    for (const uint64_t cell : *side) ++begins[cell + 1];
  }
  for (uint64_t i = 0; i < cells_; ++i) begins[i + 1] += begins[i];
  std::vector<uint64_t> faces(begins.back()), next(begins.begin(), begins.end() - 1);
  for (uint64_t i = 0; i < owner_.size(); ++i) {
    faces[next[owner_[i]]++] = i;
    if (i < neighbour_.size() && neighbour_[i] != owner_[i]) faces[next[neighbour_[i]]++] = i;
  }
  for (uint64_t cell = 0; cell < cells_; ++cell) {
    add_cell(std::span(faces).subspan(begins[cell], next[cell] - begins[cell]), cell);
  }
}

Result<> PolyMeshReader::add_patches() {
  for (const Patch& patch : patches_) {
    const auto all = [&](size_t size) {
      for (uint64_t i = patch.first; i < patch.first + patch.faces; ++i) {
        if (face(i).size() != size) return false;
      }
      return true;
    };
    const CellType type = all(3) ? CellType::triangle : all(4) ? CellType::quad : CellType::polygon;
    // Patches may share faces, so each takes from the budget.
    MAILLE_CHECK(budget_.take(patch.faces, 5 * sizeof(uint32_t)));
    for (uint64_t i = patch.first; i < patch.first + patch.faces; ++i) {
      const auto corners = face(i);
      MAILLE_CHECK(budget_.take(corners.size(), sizeof(uint32_t)));
      store_.nodes.insert(store_.nodes.end(), corners.begin(), corners.end());
      store_.end_cell(type);
    }
    shapes_.add(patch.faces, type, patch.name);
    mesh_.metadata.emplace_back("openfoam.patch." + patch.name, patch.type);
  }
  return {};
}

Result<ReadResult> PolyMeshReader::read() {
  MAILLE_CHECK(read_points());
  MAILLE_CHECK(read_faces());
  MAILLE_CHECK(report_progress(options_.progress, "reading", 0.5));
  owner_ = MAILLE_TRY(read_cells_of_faces("owner"));
  neighbour_ = MAILLE_TRY(read_cells_of_faces("neighbour"));
  MAILLE_CHECK(read_boundary());
  MAILLE_CHECK(check_faces());
  MAILLE_CHECK(budget_.take(corners_.size(), 2 * sizeof(uint32_t)));
  MAILLE_CHECK(budget_.take(cells_, 4 * sizeof(uint64_t)));
  collect_cells();
  MAILLE_CHECK(add_patches());
  ReadResult result;
  result.mesh = std::move(mesh_);
  result.mesh.blocks = shapes_.take(store_);
  for (const char* other : {"cellZones", "faceZones", "pointZones"}) {
    if (std::filesystem::exists(folder_ + "/" + other) ||
        std::filesystem::exists(folder_ + "/" + other + ".gz")) {
      result.notes.push_back(std::string(other) + " left out");
    }
  }
  return result;
}

/// The folder of a file in it, of a case's ".foam" file, or of the case.
std::string folder_of(const std::string& name) {
  namespace fs = std::filesystem;
  const fs::path path(name);
  const fs::path folder = fs::is_directory(path) ? path : path.parent_path();
  for (const char* inside : {"constant/polyMesh", "polyMesh"}) {
    if (fs::is_directory(folder / inside)) return (folder / inside).string();
  }
  return folder.empty() ? "." : folder.string();
}

Result<ReadResult> read_polymesh(const Source& source, const ReadOptions& options) {
  std::error_code error;
  if (!std::filesystem::exists(source.name(), error)) {
    return failure(ErrorCode::malformed_input,
                   source.name() + ": a polyMesh is a folder of files; name the folder or a file in it");
  }
  const std::string folder = folder_of(source.name());
  if (!std::filesystem::exists(folder + "/points") && !std::filesystem::exists(folder + "/points.gz")) {
    return failure(
        ErrorCode::cannot_read,
        "cannot read " + source.name() + ": there is no mesh of OpenFOAM (constant/polyMesh) in this folder");
  }
  return PolyMeshReader(folder, options).read();
}

Result<std::vector<std::string>> write_polymesh(const Mesh&, Sink& sink, const WriteOptions&) {
  return failure(
      ErrorCode::usage,
      sink.name() + ": a polyMesh is a folder of files, which cannot be written; write .vtu or .msh");
}

bool recognise_polymesh(Bytes first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()), first_bytes.size());
  return text.find("FoamFile") != std::string_view::npos ||
         text.find("OpenFOAM: The Open Source CFD Toolbox") != std::string_view::npos;
}

}  // namespace

const Format& polymesh_format() {
  static const Format format{
      {"polymesh", {".foam"}, "OpenFOAM's polyMesh, a folder; reading only", true, false},
      recognise_polymesh,
      read_polymesh,
      write_polymesh};
  return format;
}

}  // namespace maille
