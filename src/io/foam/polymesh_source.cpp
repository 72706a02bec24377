// OpenFOAM's polyMesh read in parts. Faces know their cells, not cells their faces, so the faces are sorted
// by cell out of core, and the cells made of them stand in a temporary file; points stay where they are,
// those of a text are written as numbers to another one. The mesh is the same as that of the reader in
// memory: cells, then faces of patches, then those of zones.
#include <maille/path.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "io/budget.h"
#include "io/cell_file.h"
#include "io/cell_store.h"
#include "io/foam/foam_processors.h"
#include "io/foam/polymesh.h"
#include "io/foam/polymesh_zones.h"
#include "io/list_sorter.h"
#include "io/mesh_sources.h"

namespace maille {
namespace {

/// The most corners of a face, and of a cell: both are held at once. Real ones have some dozens. Chosen, not
/// swept.
constexpr uint64_t most_corners = uint64_t{1} << 22;

/// A list of labels, read front to back: binary or text, or one value repeated.
class LabelList {
 public:
  explicit LabelList(FoamReader file) : file_(std::move(file)) {}

  Result<> begin() {
    count_ = MAILLE_TRY(file_.begin_list(values_));
    done_ = 0;
    if (values_ && count_ > file_.size()) return file_.malformed("a list is longer than the file");
    if (!values_ && count_ > 0 && !file_.label(repeated_)) return file_.malformed("there should be a number");
    return {};
  }
  uint64_t count() const { return count_; }
  bool at_end() const { return done_ == count_; }
  /// Its length is a claim that costs no bytes.
  bool is_repeated() const { return !values_ && count_ > 1; }
  Result<int64_t> next() {
    int64_t value = repeated_;
    if (at_end()) return file_.malformed("a list is shorter than another file says");
    if (values_ && !file_.next_label(value))
      return file_.malformed("there should be number " + std::to_string(done_) + " of " +
                             std::to_string(count_));
    ++done_;
    return value;
  }
  Result<> skip() {
    // count_ is no more than the file's size where values follow, so the product does not overflow.
    if (values_ && file_.binary()) file_.jump(file_.position() + count_ * file_.label_bytes());
    // One value repeated has no bound on its count: there is nothing to go through.
    if (!values_ || file_.binary()) done_ = count_;
    while (!at_end()) MAILLE_TRY(next());
    return end();
  }
  Result<> end() { return count_ == 0 && !values_ ? Result<>() : file_.end_list(values_); }
  FoamReader& file() { return file_; }

 private:
  FoamReader file_;
  bool values_ = false;
  uint64_t count_ = 0, done_ = 0;
  int64_t repeated_ = 0;
};

tl::unexpected<Error> too_large(const FoamReader& file) {
  return failure(ErrorCode::unsupported, file.source().name() + ": a face has more than " +
                                             std::to_string(most_corners) +
                                             " corners, so it cannot be read in parts");
}

/// The faces, front to back: lists of points one after the other, or places and then all points, for which
/// two readers of the same file run side by side.
class FaceList {
 public:
  static Result<FaceList> open(const std::string& folder) {
    FaceList list(LabelList(MAILLE_TRY(FoamReader::open_in_parts(folder, "faces"))));
    FoamReader& file = list.points_.file();
    list.compact_ = file.kind() == "faceCompactList";
    if (!list.compact_) {
      list.count_ = MAILLE_TRY(file.begin_list(list.values_));
      return list;
    }
    list.places_.emplace(MAILLE_TRY(FoamReader::open_in_parts(folder, "faces")));
    MAILLE_CHECK(list.places_->begin());
    // Faces of which each begins where the one before does. A few bytes may claim any number of them, which
    // took a second, until temporary files were too large.
    if (list.places_->is_repeated()) return file.malformed("there are faces without corners");
    MAILLE_CHECK(list.points_.begin());
    MAILLE_CHECK(list.points_.skip());
    MAILLE_CHECK(list.points_.begin());
    list.count_ = std::max<uint64_t>(list.places_->count(), 1) - 1;
    if (list.places_->count() > 0) list.place_ = MAILLE_TRY(list.places_->next());
    return list.place_ == 0 ? Result<FaceList>(std::move(list)) : list.scattered();
  }

  uint64_t count() const { return count_; }
  /// `points`: how many there are.
  Result<> next(uint64_t points, std::vector<uint32_t>& corners) {
    corners.clear();
    if (!compact_) MAILLE_CHECK(points_.begin());
    uint64_t size = points_.count();
    if (compact_) {
      const int64_t place = MAILLE_TRY(places_->next());
      // Places must rise: two readers go through the file side by side, and neither can go back.
      if (place < place_) return scattered();
      size = static_cast<uint64_t>(place - place_);
      place_ = place;
    }
    if (size > most_corners) return too_large(points_.file());
    for (uint64_t i = 0; i < size; ++i) {
      const int64_t point = MAILLE_TRY(points_.next());
      if (point < 0 || static_cast<uint64_t>(point) >= points)
        return points_.file().malformed("a face uses point " + std::to_string(point) + ", but there are " +
                                        std::to_string(points) + " points");
      corners.push_back(static_cast<uint32_t>(point));
    }
    return compact_ ? Result<>() : points_.end();
  }
  Result<> end() {
    if (!compact_) return count_ == 0 ? Result<>() : points_.file().end_list(values_);
    if (!points_.at_end()) return scattered();
    MAILLE_CHECK(places_->end());
    return points_.end();
  }

 private:
  explicit FaceList(LabelList points) : points_(std::move(points)) {}
  tl::unexpected<Error> scattered() {
    return points_.file().malformed("the faces do not follow each other in the list of their points");
  }

  LabelList points_;
  std::optional<LabelList> places_;
  bool compact_ = false, values_ = false;
  uint64_t count_ = 0;
  int64_t place_ = 0;
};

// open() makes everything; afterwards reading is from temporary files and the file of points. Memory: half of
// what is allowed for sorting faces, a sixteenth for each kind of zones.
class PolyMeshSource final : public MeshSource {
 public:
  PolyMeshSource(std::string folder, const PartsOptions& options)
      : folder_(std::move(folder)),
        options_(options),
        budget_(folder_, folder_bytes(), {}),
        faces_(options.memory / 2, options.folder),
        cell_zones_(foam_cell_zones, options.memory / 16, options.folder),
        face_zones_(foam_face_zones, options.memory / 16, options.folder),
        point_zones_(foam_point_zones, options.memory / 16, options.folder),
        zone_faces_(options.memory / 16, options.folder) {}

  Result<> open();
  const MeshDescription& description() const override { return description_; }
  Result<> read_points(uint64_t first, uint64_t count, std::span<std::byte> out) override;
  Result<> read_cells(uint64_t first, uint64_t count, CellPiece& out) override {
    return cells_->read(first, count, out);
  }
  Result<> read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) override;

 private:
  /// What the budget is measured against: files of a few bytes may claim long lists by repeating a value.
  uint64_t folder_bytes() const {
    uint64_t bytes = 0;
    for (const char* name :
         {"points", "faces", "owner", "neighbour", "cellZones", "faceZones", "pointZones"}) {
      std::error_code error;
      const auto size = std::filesystem::file_size(to_path(folder_ + "/" + name), error);
      if (!error) bytes += size;
    }
    return bytes;
  }
  Result<FoamReader> open_file(const char* name) { return FoamReader::open_in_parts(folder_, name); }
  Result<> find_points();
  Result<> write_points(FoamReader& file);
  Result<> read_boundary();
  Result<> collect_faces();
  Result<> add_face(uint64_t face, int64_t owner, int64_t neighbour, const std::vector<uint32_t>& corners);
  Result<> make_cells();
  Result<> add_patch(const FoamPatch& patch);
  Result<> read_zones(FoamZones& zones, const FoamZoneKind& kind, uint64_t elements);
  Result<> add_face_zones();
  Result<> add_zone_arrays(FoamZones& zones, const FoamZoneKind& kind, Domain domain, uint64_t elements);
  template <class Visit>
  Result<> visit_patch(const FoamPatch& patch, Visit visit);
  tl::unexpected<Error> malformed(const std::string& what) const {
    return failure(ErrorCode::malformed_input, folder_ + ": " + what);
  }

  std::string folder_;
  PartsOptions options_;
  Budget budget_;  ///< of temporary files: what a file says many times over
  MeshDescription description_;
  std::optional<FoamReader> points_;
  uint64_t points_at_ = 0;
  std::optional<ScratchFile> written_points_;  ///< of a text
  std::vector<FoamPatch> patches_;
  uint64_t first_patch_face_ = 0, all_faces_ = 0, all_cells_ = 0;
  ListSorter<3> faces_;  ///< by cell, face, and whether the cell is the face's neighbour
  std::optional<CellFile> patch_faces_, cells_;
  BlockShapes shapes_;
  FoamZones cell_zones_, face_zones_, point_zones_;
  FoamZoneFaces zone_faces_;
  std::vector<ScratchFile> arrays_;  ///< up to the last element that is in a zone
};

Result<> PolyMeshSource::find_points() {
  points_ = MAILLE_TRY(open_file("points"));
  FoamReader& file = *points_;
  bool values = false;
  const uint64_t count = MAILLE_TRY(file.begin_list(values));
  if (!values && count != 0) return file.malformed("points cannot be one repeated value");
  if (count > max_points || count > file.size())
    return file.malformed("there are more points than the file can hold, or 2^32");
  description_.points = count;
  description_.point_type = file.is_single() ? Scalar::f32 : Scalar::f64;
  points_at_ = file.position();
  if (!file.binary()) {
    MAILLE_CHECK(write_points(file));
    // Binary points are read where they are.
  } else {
    const uint64_t bytes = 3 * count * size_of(description_.point_type);
    if (bytes > file.size() - points_at_) return file.malformed("there are fewer points than it says");
    file.jump(points_at_ + bytes);
  }
  return count == 0 && !values ? Result<>() : file.end_list(true);
}

Result<> PolyMeshSource::write_points(FoamReader& file) {
  written_points_ = MAILLE_TRY(ScratchFile::create(options_.folder));
  for (uint64_t i = 0; i < description_.points; ++i) {
    double position[3] = {};
    if (!file.take('(')) return file.malformed("there should be a point");
    for (double& value : position) {
      if (!file.coordinate(value))
        return file.malformed("there should be a coordinate of point " + std::to_string(i));
    }
    if (!file.take(')')) return file.malformed("there should be \")\" behind a point");
    MAILLE_CHECK(written_points_->append(std::as_bytes(std::span(position))));
  }
  return {};
}

Result<> PolyMeshSource::read_boundary() {
  FoamReader file = MAILLE_TRY(open_file("boundary"));
  patches_ = MAILLE_TRY(read_foam_patches(file));
  first_patch_face_ = ~uint64_t{0};
  for (const FoamPatch& patch : patches_) {
    if (patch.faces > 0) first_patch_face_ = std::min(first_patch_face_, patch.first);
  }
  return {};
}

Result<> PolyMeshSource::add_face(uint64_t face, int64_t owner, int64_t neighbour,
                                  const std::vector<uint32_t>& corners) {
  for (const int64_t cell : {owner, neighbour}) {
    if (cell == -1 && cell == neighbour && owner != -1) continue;
    // A cell has a face at least, and a face two cells at most.
    if (cell < 0 || static_cast<uint64_t>(cell) >= 2 * all_faces_)
      return malformed("there is no cell " + std::to_string(cell) + " with " + std::to_string(all_faces_) +
                       " faces");
    all_cells_ = std::max(all_cells_, static_cast<uint64_t>(cell) + 1);
  }
  MAILLE_CHECK(faces_.add({static_cast<uint64_t>(owner), face, 0}, corners));
  if (neighbour != -1 && neighbour != owner)
    MAILLE_CHECK(faces_.add({static_cast<uint64_t>(neighbour), face, 1}, corners));
  // Faces from the first patch on are kept, to be blocks of faces later.
  return face >= first_patch_face_ ? patch_faces_->add(CellType::polygon, corners) : Result<>();
}

Result<> PolyMeshSource::collect_faces() {
  FaceList faces = MAILLE_TRY(FaceList::open(folder_));
  LabelList owners(MAILLE_TRY(open_file("owner"))), neighbours(MAILLE_TRY(open_file("neighbour")));
  MAILLE_CHECK(owners.begin());
  MAILLE_CHECK(neighbours.begin());
  all_faces_ = faces.count();
  if (owners.count() != all_faces_ || neighbours.count() > all_faces_) {
    return malformed("there are " + std::to_string(all_faces_) + " faces, owners of " +
                     std::to_string(owners.count()) + " and neighbours of " +
                     std::to_string(neighbours.count()));
  }
  MAILLE_CHECK(read_zones(face_zones_, foam_face_zones, all_faces_));
  std::vector<uint32_t> corners;
  bool ended = false;
  for (uint64_t face = 0; face < all_faces_; ++face) {
    if (face % 65536 == 0)
      MAILLE_CHECK(report_progress(options_.progress, "reading faces",
                                   static_cast<double>(face) / static_cast<double>(all_faces_)));
    MAILLE_CHECK(faces.next(description_.points, corners));
    MAILLE_CHECK(budget_.take(corners.size() + 2, 2 * sizeof(uint32_t)));
    const int64_t owner = MAILLE_TRY(owners.next());
    // Older versions give every face a neighbour, -1 for none.
    const int64_t neighbour = neighbours.at_end() ? -1 : MAILLE_TRY(neighbours.next());
    if (ended && neighbour != -1) return malformed("there is no cell -1");
    ended = neighbour == -1;
    MAILLE_CHECK(add_face(face, owner, neighbour, corners));
    const auto zones = MAILLE_TRY(face_zones_.of(face));
    MAILLE_CHECK(zone_faces_.add(zones, corners));
  }
  MAILLE_CHECK(faces.end());
  MAILLE_CHECK(owners.end());
  MAILLE_CHECK(neighbours.end());
  MAILLE_CHECK(patch_faces_->end());
  return faces_.sort();
}

Result<> PolyMeshSource::make_cells() {
  FoamFaces outward;
  FoamCell made;
  const std::string none;
  for (uint64_t cell = 0; cell < all_cells_; ++cell) {
    if (cell % 65536 == 0)
      MAILLE_CHECK(report_progress(options_.progress, "joining faces",
                                   static_cast<double>(cell) / static_cast<double>(all_cells_)));
    outward.clear();
    while (faces_.front() != nullptr && faces_.front()->numbers[0] == cell) {
      outward.add(faces_.front()->list, faces_.front()->numbers[2] != 0);
      MAILLE_CHECK(faces_.take());
      if (outward.corners.size() > most_corners || outward.sizes.size() > most_corners)
        return failure(ErrorCode::unsupported, folder_ + ": cell " + std::to_string(cell) +
                                                   " has too many corners to be read in parts");
    }
    make_foam_cell(outward, made);
    const bool polyhedron = made.type == CellType::polyhedron;
    MAILLE_CHECK(cells_->add(made.type, made.nodes,
                             polyhedron ? std::span<const uint32_t>(outward.sizes) : std::span<uint32_t>()));
    const auto zones = MAILLE_TRY(cell_zones_.of(cell));
    const bool named = cell_zones_.are_runs() && !zones.empty();
    shapes_.add(1, made.type, named ? cell_zones_.names()[zones[0].zone] : none);
  }
  return {};
}

template <class Visit>
Result<> PolyMeshSource::visit_patch(const FoamPatch& patch, Visit visit) {
  CellPiece piece;
  std::vector<uint32_t> corners;
  constexpr uint64_t at_once = 4096;
  for (uint64_t i = 0; i < patch.faces; i += at_once) {
    const uint64_t first = patch.first - first_patch_face_ + i;
    MAILLE_CHECK(patch_faces_->read(first, std::min(at_once, patch.faces - i), piece));
    for (uint64_t k = 0; k < piece.size(); ++k) {
      corners.clear();
      for (uint64_t c = piece.offsets[k]; c < piece.offsets[k + 1]; ++c)
        corners.push_back(static_cast<uint32_t>(piece.connectivity[c]));
      MAILLE_CHECK(visit(corners));
    }
  }
  return {};
}

Result<> PolyMeshSource::add_patch(const FoamPatch& patch) {
  if (patch.faces > all_faces_ || patch.first > all_faces_ - patch.faces)
    return malformed("patch " + patch.name.substr(0, 40) + " goes beyond the last face");
  // Patches may share faces, so each takes from the budget.
  FoamPatchType types;
  MAILLE_CHECK(visit_patch(patch, [&](const std::vector<uint32_t>& corners) {
    types.add(corners.size());
    return budget_.take(corners.size() + 5, sizeof(uint32_t));
  }));
  MAILLE_CHECK(visit_patch(
      patch, [&](const std::vector<uint32_t>& corners) { return cells_->add(types.type(), corners); }));
  shapes_.add(patch.faces, types.type(), patch.name);
  add_foam_metadata(patch, description_.metadata);
  return {};
}

Result<> PolyMeshSource::read_zones(FoamZones& zones, const FoamZoneKind& kind, uint64_t elements) {
  if (!has_foam_zones(folder_, kind)) return {};
  FoamReader file = MAILLE_TRY(open_file(kind.file));
  return zones.read(file, elements, budget_);
}

Result<> PolyMeshSource::add_face_zones() {
  const auto add_cell = [&](CellType type, std::span<const uint32_t> corners) {
    return cells_->add(type, corners);
  };
  return zone_faces_.add_blocks(face_zones_, shapes_, add_cell);
}

Result<> PolyMeshSource::add_zone_arrays(FoamZones& zones, const FoamZoneKind& kind, Domain domain,
                                         uint64_t elements) {
  std::vector<Array> arrays = foam_zone_arrays(zones, kind, domain);
  if (arrays.empty()) return {};
  const size_t first = arrays_.size();
  for (const Array& array : arrays) {
    MAILLE_CHECK(budget_.take(elements, array.tuple_size()));
    arrays_.push_back(MAILLE_TRY(ScratchFile::create(options_.folder)));
  }
  MAILLE_CHECK(zones.rewind());
  for (uint64_t i = 0; i < elements; ++i) {
    const auto uses = MAILLE_TRY(zones.of(i));
    for (size_t k = 0; k < arrays.size(); ++k) {
      std::array<std::byte, sizeof(uint32_t)> label{};
      if (k < uses.size()) put_foam_label(arrays[k].type, uses[k].zone + 1, label.data());
      MAILLE_CHECK(arrays_[first + k].append(Bytes(label).first(arrays[k].tuple_size())));
    }
  }
  for (Array& array : arrays) description_.arrays.push_back(std::move(array));
  return {};
}

/// Reads an array of zones. Faces of patches are behind the cells, and in no zone of these: what is not in
/// the temporary file is 0, no label.
Result<> PolyMeshSource::read_array(size_t number, uint64_t first, uint64_t count, std::span<std::byte> out) {
  const Array& array = description_.arrays[number];
  const size_t size = array.tuple_size();
  const uint64_t all = description_.count_of(array);
  if (count > all || first > all - count || out.size() != size * count)
    return failure(ErrorCode::usage, folder_ + ": more values were asked for than there are");
  const uint64_t there = arrays_[number].size() - std::min(arrays_[number].size(), first * size);
  const auto read = static_cast<size_t>(std::min<uint64_t>(there, out.size()));
  std::fill(out.begin() + static_cast<ptrdiff_t>(read), out.end(), std::byte{0});
  return read == 0 ? Result<>() : arrays_[number].read_at(first * size, out.first(read));
}

Result<> PolyMeshSource::open() {
  patch_faces_ = MAILLE_TRY(CellFile::create(options_.folder));
  cells_ = MAILLE_TRY(CellFile::create(options_.folder));
  MAILLE_CHECK(find_points());
  MAILLE_CHECK(read_boundary());
  MAILLE_CHECK(collect_faces());
  MAILLE_CHECK(read_zones(cell_zones_, foam_cell_zones, all_cells_));
  MAILLE_CHECK(make_cells());
  for (const FoamPatch& patch : patches_) MAILLE_CHECK(add_patch(patch));
  MAILLE_CHECK(add_face_zones());
  MAILLE_CHECK(cells_->end());
  description_.cells = cells_->cells();
  MAILLE_CHECK(read_zones(point_zones_, foam_point_zones, description_.points));
  for (const auto& [zones, kind] :
       {std::pair(&cell_zones_, &foam_cell_zones), std::pair(&face_zones_, &foam_face_zones),
        std::pair(&point_zones_, &foam_point_zones)})
    add_foam_zone_metadata(*zones, *kind, description_.metadata);
  if (!cell_zones_.are_runs())
    MAILLE_CHECK(add_zone_arrays(cell_zones_, foam_cell_zones, Domain::cell, all_cells_));
  MAILLE_CHECK(add_zone_arrays(point_zones_, foam_point_zones, Domain::point, description_.points));
  description_.corners = cells_->corners();
  for (const NamedRun& run : shapes_.runs()) description_.blocks.push_back({run.name, run.type, run.cells});
  if (description_.blocks.empty() && description_.cells > 0)
    description_.blocks.push_back({"", CellType::mixed, description_.cells});
  return {};
}

Result<> PolyMeshSource::read_points(uint64_t first, uint64_t count, std::span<std::byte> out) {
  const size_t size = 3 * size_of(description_.point_type);
  if (count > description_.points || first > description_.points - count || out.size() != size * count)
    return failure(ErrorCode::usage, folder_ + ": more points were asked for than there are");
  return written_points_ ? written_points_->read_at(first * size, out)
                         : points_->source().read_at(points_at_ + first * size, out);
}

}  // namespace

Result<std::unique_ptr<MeshSource>> open_polymesh_source(const std::string& path,
                                                         const PartsOptions& options) {
  if (foam_case_of(path).time || !foam_times_of(path).empty())
    return failure(ErrorCode::unsupported,
                   path +
                       ": a case with fields is read whole; its mesh, constant/polyMesh, "
                       "can be read in parts");
  auto opened = std::make_unique<PolyMeshSource>(foam_folder_of(path), options);
  MAILLE_CHECK(opened->open());
  return std::unique_ptr<MeshSource>(std::move(opened));
}

}  // namespace maille
