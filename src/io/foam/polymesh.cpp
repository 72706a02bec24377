// OpenFOAM's polyMesh, a folder of files: points; faces; for each face the cell it belongs to (owner) and,
// for the first ones, the cell on its other side (neighbour); boundary, the patches of faces without one.
// Normals point from owner to neighbour. Text or binary, each file possibly packed with gzip. Source:
// OpenFOAM user guide, "Mesh description", and its own code for binary files.
#include "io/foam/polymesh.h"

#include <maille/path.h>

#include <algorithm>
#include <filesystem>

#include "io/cell_store.h"
#include "io/foam/foam_field_reader.h"
#include "io/foam/foam_processors.h"
#include "io/foam/polymesh_zones.h"
#include "io/format.h"

namespace maille {
namespace {

// Reads a mesh whole: lists of one folder, or those of all processors joined; then cells from faces, patches
// as blocks of faces, zones, and the fields of a time if one is asked for. The budget counts the bytes of all
// files.
class PolyMeshReader {
 public:
  PolyMeshReader(std::string folder, const ReadOptions& options)
      : folder_(std::move(folder)),
        options_(options),
        budget_(folder_, folder_bytes(), options.limits),
        joined_(options.limits) {}
  /// Reads the mesh that was divided among these processors.
  PolyMeshReader(std::string folder, std::vector<FoamPart> processors, const ReadOptions& options)
      : folder_(std::move(folder)),
        processors_(std::move(processors)),
        options_(options),
        budget_(folder_, bytes_of_processors(), options.limits),
        joined_(options.limits) {}
  /// Reads the mesh of one processor.
  PolyMeshReader(const FoamPart& part, const ReadOptions& options) : PolyMeshReader(part.mesh(), options) {
    block_ = part.block;
  }

  Result<ReadResult> read();
  /// The same with the fields of a time.
  Result<ReadResult> read_with_fields(const std::string& case_folder, const FoamTime& time);

 private:
  uint64_t bytes_of_processors() const {
    uint64_t bytes = 0;
    for (const FoamPart& processor : processors_) {
      // A file of several processors counts once.
      if (processor.block.value_or(0) == 0) bytes += folder_bytes(processor.mesh());
    }
    return bytes;
  }
  uint64_t folder_bytes() const { return folder_bytes(folder_); }
  static uint64_t folder_bytes(const std::string& folder) {
    uint64_t bytes = 0;
    for (const char* name :
         {"points", "faces", "owner", "neighbour", "cellZones", "faceZones", "pointZones"}) {
      for (const char* ending : {"", ".gz"}) {
        std::error_code error;
        const auto size = std::filesystem::file_size(to_path(folder + "/" + name + ending), error);
        if (!error) bytes += size;
      }
    }
    return bytes;
  }
  Result<FoamReader> open(const char* name) {
    return FoamReader::open(folder_, name, options_.limits, block_);
  }
  Result<> read_lists();
  Result<> read_processors();
  Result<> read_points();
  Result<> read_faces();
  Result<std::vector<uint64_t>> read_cells_of_faces(const char* name);
  Result<> check_faces() const;
  Result<> collect_cells();
  Result<> add_cell(std::span<const uint64_t> faces, uint64_t cell);
  Result<> add_patches();
  Result<> read_zones(FoamZones& zones, const FoamZoneKind& kind, uint64_t elements);
  Result<> add_face_zones();
  Result<> add_zone_arrays(FoamZones& zones, const FoamZoneKind& kind, Domain domain, uint64_t elements);
  std::span<const uint32_t> face(uint64_t i) const {
    return std::span(corners_).subspan(i == 0 ? 0 : ends_[i - 1], ends_[i] - (i == 0 ? 0 : ends_[i - 1]));
  }
  tl::unexpected<Error> malformed(const std::string& what) const {
    return failure(ErrorCode::malformed_input, folder_ + ": " + what);
  }

  std::string folder_;
  std::vector<FoamPart> processors_;
  std::optional<uint64_t> block_;
  const ReadOptions& options_;
  Budget budget_;
  FoamProcessors joined_;
  Mesh mesh_;
  std::vector<uint32_t> corners_;
  std::vector<uint64_t> ends_;
  std::vector<uint64_t> owner_, neighbour_;
  uint64_t cells_ = 0;
  std::vector<FoamPatch> patches_;
  FoamPlaces places_;
  FoamFaces outward_;  ///< faces of the cell at hand
  FoamCell made_;
  CellStore store_;
  BlockShapes shapes_;
  static constexpr uint64_t in_memory = ~uint64_t{0};
  FoamZones cell_zones_{foam_cell_zones, in_memory, ""}, face_zones_{foam_face_zones, in_memory, ""},
      point_zones_{foam_point_zones, in_memory, ""};
};

Result<> PolyMeshReader::read_points() {
  FoamReader file = MAILLE_TRY(open("points"));
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

/// Reads faces: lists of points one after the other, or in binary the places where each begins and all their
/// points.
Result<> PolyMeshReader::read_faces() {
  FoamReader file = MAILLE_TRY(open("faces"));
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
  FoamReader file = MAILLE_TRY(open(name));
  std::vector<int64_t> labels;
  MAILLE_CHECK(file.labels(labels, budget_));
  // Older versions give every face a neighbour, -1 for none.
  while (!labels.empty() && labels.back() == -1) labels.pop_back();
  std::vector<uint64_t> cells;
  for (const int64_t cell : labels) {
    // A cell has a face at least, and a face two cells at most: so numbers of cells are bounded by what was
    // really read.
    if (cell < 0 || static_cast<uint64_t>(cell) >= 2 * ends_.size())
      return file.malformed("there is no cell " + std::to_string(cell) + " with " +
                            std::to_string(ends_.size()) + " faces");
    cells_ = std::max(cells_, static_cast<uint64_t>(cell) + 1);
    cells.push_back(static_cast<uint64_t>(cell));
  }
  return cells;
}

Result<> PolyMeshReader::check_faces() const {
  if (owner_.size() != ends_.size() || neighbour_.size() > ends_.size()) {
    return malformed("there are " + std::to_string(ends_.size()) + " faces, owners of " +
                     std::to_string(owner_.size()) + " and neighbours of " +
                     std::to_string(neighbour_.size()));
  }
  for (const FoamPatch& patch : patches_) {
    if (patch.faces > ends_.size() || patch.first > ends_.size() - patch.faces)
      return malformed("patch " + patch.name.substr(0, 40) + " goes beyond the last face");
  }
  return {};
}

Result<> PolyMeshReader::add_cell(std::span<const uint64_t> faces, uint64_t cell) {
  outward_.clear();
  for (const uint64_t number : faces) outward_.add(face(number), owner_[number] != cell);
  make_foam_cell(outward_, made_);
  store_.nodes.insert(store_.nodes.end(), made_.nodes.begin(), made_.nodes.end());
  if (made_.type == CellType::polyhedron)
    store_.face_sizes.insert(store_.face_sizes.end(), outward_.sizes.begin(), outward_.sizes.end());
  store_.end_cell(made_.type);
  static const std::string none;
  const auto zones = MAILLE_TRY(cell_zones_.of(cell));
  const bool named = cell_zones_.are_runs() && !zones.empty();
  shapes_.add(1, made_.type, named ? cell_zones_.names()[zones[0].zone] : none);
  return {};
}

Result<> PolyMeshReader::collect_cells() {
  // Faces of each cell, as a list and the places where cells begin in it: counted first, then sorted in by
  // number.
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
    MAILLE_CHECK(add_cell(std::span(faces).subspan(begins[cell], next[cell] - begins[cell]), cell));
  }
  return {};
}

Result<> PolyMeshReader::add_patches() {
  for (const FoamPatch& patch : patches_) {
    FoamPatchType patch_type;
    for (uint64_t i = patch.first; i < patch.first + patch.faces; ++i) patch_type.add(face(i).size());
    const CellType type = patch_type.type();
    // Patches may share faces, so each takes from the budget: a short file could name all faces any number of
    // times.
    MAILLE_CHECK(budget_.take(patch.faces, 5 * sizeof(uint32_t)));
    for (uint64_t i = patch.first; i < patch.first + patch.faces; ++i) {
      const auto corners = face(i);
      MAILLE_CHECK(budget_.take(corners.size(), sizeof(uint32_t)));
      store_.nodes.insert(store_.nodes.end(), corners.begin(), corners.end());
      store_.end_cell(type);
    }
    shapes_.add(patch.faces, type, patch.name);
    add_foam_metadata(patch, mesh_.metadata);
    places_.patches.push_back({patch.name, patch.type, store_.count() - patch.faces, patch.faces,
                               std::span(std::as_const(owner_)).subspan(patch.first, patch.faces)});
  }
  return {};
}

Result<> PolyMeshReader::read_zones(FoamZones& zones, const FoamZoneKind& kind, uint64_t elements) {
  if (!processors_.empty()) {
    FoamProcessors::ZoneElements given = joined_.zones(kind);
    if (given.names.empty()) return {};
    return zones.take(std::move(given.names), given.elements);
  }
  if (!has_foam_zones(folder_, kind)) return {};
  FoamReader file = MAILLE_TRY(open(kind.file));
  return zones.read(file, elements, budget_);
}

/// Adds zones of faces as blocks of faces, behind those of the patches.
Result<> PolyMeshReader::add_face_zones() {
  if (face_zones_.layers() == 0) return {};
  FoamZoneFaces zone_faces(in_memory, "");
  for (uint64_t i = 0; i < ends_.size(); ++i) {
    const auto uses = MAILLE_TRY(face_zones_.of(i));
    MAILLE_CHECK(budget_.take(uses.size() * (face(i).size() + 12), sizeof(uint32_t)));
    MAILLE_CHECK(zone_faces.add(uses, face(i)));
  }
  const auto add_cell = [&](CellType type, std::span<const uint32_t> corners) -> Result<> {
    store_.nodes.insert(store_.nodes.end(), corners.begin(), corners.end());
    store_.end_cell(type);
    return {};
  };
  return zone_faces.add_blocks(face_zones_, shapes_, add_cell);
}

/// Adds arrays that name the zones of all elements; those behind the first `elements`, faces of patches, are
/// in no zone.
Result<> PolyMeshReader::add_zone_arrays(FoamZones& zones, const FoamZoneKind& kind, Domain domain,
                                         uint64_t elements) {
  std::vector<Array> arrays = foam_zone_arrays(zones, kind, domain);
  const uint64_t count = domain == Domain::point ? mesh_.point_count() : store_.count();
  for (Array& array : arrays) {
    MAILLE_CHECK(budget_.take(count, array.tuple_size()));
    array.resize(count);
  }
  MAILLE_CHECK(zones.rewind());
  for (uint64_t i = 0; i < elements && !arrays.empty(); ++i) {
    const auto uses = MAILLE_TRY(zones.of(i));
    for (size_t k = 0; k < uses.size(); ++k)
      put_foam_label(arrays[k].type, uses[k].zone + 1, arrays[k].bytes.data() + i * arrays[k].tuple_size());
  }
  for (Array& array : arrays) mesh_.arrays.push_back(std::move(array));
  return {};
}

Result<> PolyMeshReader::read_lists() {
  MAILLE_CHECK(read_points());
  MAILLE_CHECK(read_faces());
  MAILLE_CHECK(report_progress(options_.progress, "reading", 0.5));
  owner_ = MAILLE_TRY(read_cells_of_faces("owner"));
  neighbour_ = MAILLE_TRY(read_cells_of_faces("neighbour"));
  FoamReader boundary = MAILLE_TRY(open("boundary"));
  patches_ = MAILLE_TRY(read_foam_patches(boundary));
  return check_faces();
}

Result<> PolyMeshReader::read_processors() {
  for (const FoamPart& processor : processors_) {
    PolyMeshReader part(processor, options_);
    MAILLE_CHECK(part.read_lists());
    const FoamLists lists = {std::move(part.mesh_.points), std::move(part.corners_),   std::move(part.ends_),
                             std::move(part.owner_),       std::move(part.neighbour_), part.cells_,
                             std::move(part.patches_)};
    MAILLE_CHECK(joined_.add(processor, lists, budget_));
  }
  FoamLists all = MAILLE_TRY(joined_.finish());
  mesh_.points = std::move(all.points);
  corners_ = std::move(all.corners);
  ends_ = std::move(all.ends);
  owner_ = std::move(all.owner);
  neighbour_ = std::move(all.neighbour);
  cells_ = all.cells;
  patches_ = std::move(all.patches);
  return check_faces();
}

Result<ReadResult> PolyMeshReader::read() {
  MAILLE_CHECK(processors_.empty() ? read_lists() : read_processors());
  MAILLE_CHECK(budget_.take(corners_.size(), 2 * sizeof(uint32_t)));
  MAILLE_CHECK(budget_.take(cells_, 4 * sizeof(uint64_t)));
  MAILLE_CHECK(read_zones(cell_zones_, foam_cell_zones, cells_));
  MAILLE_CHECK(collect_cells());
  MAILLE_CHECK(add_patches());
  MAILLE_CHECK(read_zones(face_zones_, foam_face_zones, ends_.size()));
  MAILLE_CHECK(add_face_zones());
  MAILLE_CHECK(read_zones(point_zones_, foam_point_zones, mesh_.point_count()));
  for (const auto& [zones, kind] :
       {std::pair(&cell_zones_, &foam_cell_zones), std::pair(&face_zones_, &foam_face_zones),
        std::pair(&point_zones_, &foam_point_zones)})
    add_foam_zone_metadata(*zones, *kind, mesh_.metadata);
  if (!cell_zones_.are_runs())
    MAILLE_CHECK(add_zone_arrays(cell_zones_, foam_cell_zones, Domain::cell, cells_));
  MAILLE_CHECK(add_zone_arrays(point_zones_, foam_point_zones, Domain::point, mesh_.point_count()));
  ReadResult result;
  result.mesh = std::move(mesh_);
  result.mesh.blocks = shapes_.take(store_);
  return result;
}

Result<ReadResult> PolyMeshReader::read_with_fields(const std::string& case_folder, const FoamTime& time) {
  ReadResult result = MAILLE_TRY(read());
  places_.mesh = folder_;
  places_.points = result.mesh.point_count();
  places_.cells = cells_;
  places_.all_cells = result.mesh.cell_count();
  places_.owners = std::span<const uint64_t>(owner_).first(neighbour_.size());
  places_.most_owned = most_owned_faces(places_.owners, neighbour_);
  FoamFieldReader fields(places_, options_.limits, budget_, result.mesh, result.notes);
  for (const char* inside : {"system", "constant"}) {
    for (FoamText& text : read_foam_texts(case_folder, inside, result.notes))
      result.mesh.metadata.emplace_back(foam_case_prefix + text.path, std::move(text.text));
  }
  const FoamFieldJoiner joiner(joined_.parts(), {places_.points, cells_, neighbour_.size(), patches_},
                               options_.limits);
  if (!processors_.empty()) fields.set_joiner(joiner);
  MAILLE_CHECK(fields.read(case_folder, time));
  return result;
}

/// The mesh of a case, with the fields of a time if one is said. Without a mesh of its own, that of its
/// processors.
Result<ReadResult> read_case(const std::string& case_folder, const std::optional<FoamTime>& time,
                             const ReadOptions& options) {
  const std::string folder = foam_folder_of(case_folder);
  if (has_foam_file(folder + "/points") && !(time && time->divided)) {
    PolyMeshReader reader(folder, options);
    return time ? reader.read_with_fields(case_folder, *time) : reader.read();
  }
  std::vector<FoamPart> processors = MAILLE_TRY(foam_processors_of(case_folder));
  if (processors.empty()) {
    return failure(ErrorCode::cannot_read, "cannot read " + case_folder +
                                               ": there is no mesh of OpenFOAM (constant/polyMesh) in this "
                                               "folder; of other meshes name the files (the "
                                               "command: compress -r takes all)");
  }
  PolyMeshReader reader(case_folder, std::move(processors), options);
  return time ? reader.read_with_fields(case_folder, *time) : reader.read();
}

Result<ReadResult> read_polymesh(const Source& source, const ReadOptions& options) {
  std::error_code error;
  if (!std::filesystem::exists(to_path(source.name()), error)) {
    return failure(ErrorCode::malformed_input,
                   source.name() + ": a polyMesh is a folder of files; name the folder or a file in it");
  }
  const FoamCasePath place = foam_case_of(source.name());
  const std::string folder = foam_case_folder(source.name());
  if (place.time) return read_case(folder, place.time, options);
  const std::vector<FoamTime> times = foam_times_of(source.name());
  ReadResult result =
      MAILLE_TRY(read_case(folder, times.empty() ? std::nullopt : std::optional(times.front()), options));
  if (!place.folder.empty() && has_other_processors(folder)) {
    result.notes.emplace_back(
        "fields in the folders of processors left out: pointProcAddressing, which decomposePar writes, is "
        "not "
        "there, so that they may be of another mesh");
  }
  if (times.size() > 1) {
    result.notes.push_back("the fields are those of time " + times[0].name + ", the first of " +
                           std::to_string(times.size()) +
                           (times[1].divided ? "; compress takes them all"
                                             : "; " + folder + "/" + times[1].name + " names another"));
  }
  return result;
}

bool recognise_polymesh(Bytes first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()), first_bytes.size());
  return text.find("FoamFile") != std::string_view::npos ||
         text.find("OpenFOAM: The Open Source CFD Toolbox") != std::string_view::npos;
}

}  // namespace

Result<ReadResult> read_foam_step(const std::string& case_folder, const ReadOptions& options, uint64_t step) {
  const std::vector<FoamTime> times = foam_times_of(case_folder);
  if (step >= times.size())
    return failure(ErrorCode::usage, case_folder + ": has " + std::to_string(times.size()) + " times only");
  return read_case(foam_case_folder(case_folder), times[step], options);
}

const Format& polymesh_format() {
  static const Format format{{"polymesh", {".foam"}, "OpenFOAM's polyMesh, a folder", true},
                             recognise_polymesh,
                             read_polymesh,
                             write_polymesh};
  return format;
}

}  // namespace maille
