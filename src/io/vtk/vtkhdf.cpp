// VTKHDF, versions 1 and 2: unstructured grids and poly data, in any number of parts and steps of time. See
// VTK's "VTKHDF file format". Rows of all parts and steps stand one after the other in each dataset; counts
// for each part, and for each step where its rows begin, tell them apart. "Part" is a piece of a step.
#include "io/vtk/vtkhdf.h"

#include <algorithm>
#include <array>
#include <limits>

#include "io/buffered_writer.h"
#include "io/format.h"
#include "io/hdf5/hdf5_file.h"
#include "io/reading.h"
#include "io/vtk/joined_parts.h"
#include "io/vtk/part_cells.h"
#include "io/vtk/vtk_field_data.h"

namespace maille {
namespace {

const std::string group_root = "VTKHDF";

/// A group of cells: an unstructured grid has one, poly data four. Poly data tells no types: they follow from
/// the group and the number of points.
struct Kind {
  const char* folder;
  CellType one, two, three, four, more;  ///< by number of points, where there are no types
};
constexpr uint64_t most_rows = uint64_t{1} << 31;  ///< of one part
constexpr CellType refused = CellType::mixed;
constexpr Kind grid_kinds[] = {{"", refused, refused, refused, refused, refused}};
constexpr Kind poly_kinds[] = {{"Vertices/", CellType::vertex, CellType::poly_vertex, CellType::poly_vertex,
                                CellType::poly_vertex, CellType::poly_vertex},
                               {"Lines/", CellType::poly_line, CellType::line, CellType::poly_line,
                                CellType::poly_line, CellType::poly_line},
                               {"Polygons/", CellType::polygon, CellType::polygon, CellType::triangle,
                                CellType::quad, CellType::polygon},
                               {"Strips/", refused, refused, refused, refused, refused}};

CellType type_of(const Kind& kind, uint64_t points) {
  const CellType types[] = {kind.one, kind.two, kind.three, kind.four};
  return points >= 1 && points <= 4 ? types[points - 1] : kind.more;
}

/// How many rows of something each part of the file has, up to the last part that is read: as sums, since
/// what is asked for is mostly where parts begin.
class Counts {
 public:
  void add(uint64_t count) { starts_.push_back(starts_.back() + count); }
  size_t parts() const { return starts_.size() - 1; }
  uint64_t operator[](size_t part) const { return starts_[part + 1] - starts_[part]; }
  uint64_t between(size_t first, size_t end) const { return starts_[end] - starts_[first]; }

 private:
  std::vector<uint64_t> starts_ = {0};
};

/// Cells of one kind, of all parts of the step, as the datasets have them: offsets and numbers count from
/// each part's own begin.
struct StepCells {
  Counts counts, ids;                  ///< cells, and numbers of points in them
  Counts faces, face_ids, cell_faces;  ///< of polyhedra; no parts where there are none
  uint64_t first_cell = 0;             ///< of the step, in the file
  Array connectivity, offsets, types;
  Array face_points, face_offsets, faces_of_cells, cell_face_offsets;
};

Array slice(const Array& array, uint64_t first, uint64_t count) {
  Array part = make_array(array.name, array.domain, array.type, array.components);
  const auto size = static_cast<ptrdiff_t>(array.tuple_size());
  const auto begin = array.bytes.begin() + static_cast<ptrdiff_t>(first) * size;
  part.bytes.assign(begin, begin + static_cast<ptrdiff_t>(count) * size);
  return part;
}

// Reads one step: its parts are one after the other in `mesh_` and `cells_` and then joined (join_parts()).
// Everything is asked of Hdf5File, which checks rows against datasets, and sizes against bytes of the file.
class VtkHdfReader {
 public:
  VtkHdfReader(const Hdf5File& file, uint64_t bytes, const ReadOptions& options)
      : file_(file),
        options_(options),
        budget_(file.name(), bytes * packed_factor(bytes), options.limits),
        bytes_(bytes) {}

  Result<ReadResult> read(std::optional<uint64_t> step);
  Result<std::vector<double>> times();

 private:
  /// HDF5 packs with deflate, so the file may hold more than its bytes: 16 times Budget's 64. How many bytes
  /// each dataset has in the file is looked at, too (is_plausible() in hdf5_file.cpp).
  static uint64_t packed_factor(uint64_t bytes) { return bytes > UINT64_MAX / 16 ? 1 : 16; }

  Result<Counts> counts(const std::string& path);
  Result<uint64_t> step_number(const std::string& name, uint64_t otherwise, size_t column = 0);
  Result<> find_steps();
  Result<> find_parts();
  Result<> read_points();
  Result<StepCells> read_cells(const Kind& kind, size_t column);
  Result<> read_faces(StepCells& cells, uint64_t first_offset);
  Result<Array> integers(const std::string& path, uint64_t first, uint64_t count);
  Result<Array> ends(const Array& offsets, uint64_t first, uint64_t count);
  Result<Array> types_of(const Kind& kind, const StepCells& cells, size_t part, const Array& ends);
  Result<std::optional<PartFaces>> faces_of(const StepCells& cells, size_t part);
  Result<> append_part(const Kind& kind, const StepCells& cells, size_t part);
  Result<> read_all_cells();
  Result<> read_data(const std::string& group, Domain domain, uint64_t first, uint64_t count);
  Result<> read_field_data();
  tl::unexpected<Error> malformed(const std::string& what) const {
    return failure(ErrorCode::malformed_input, file_.name() + ": " + what);
  }

  const Hdf5File& file_;
  const ReadOptions& options_;
  Budget budget_;
  uint64_t bytes_;
  std::span<const Kind> kinds_;
  std::optional<uint64_t> step_;  ///< that is read, where there are steps
  uint64_t steps_ = 0;
  double time_ = 0;
  Counts points_;
  size_t first_part_ = 0, end_part_ = 0;
  uint64_t first_point_ = 0, first_cell_ = 0, cells_count_ = 0;
  Mesh mesh_;
  CellStore cells_;
  BlockShapes shapes_;
  std::vector<uint64_t> first_points_, first_cells_;  ///< by part that is read
  PartMarks marks_;
  std::vector<std::string> notes_;
};

/// Counts up to the last part that is read. Each takes a byte of the file at least (find_parts()), however
/// well they are packed.
Result<Counts> VtkHdfReader::counts(const std::string& path) {
  const Array array = MAILLE_TRY(integers(path, 0, end_part_));
  Counts counts;
  for (size_t i = 0; i < end_part_; ++i) {
    const uint64_t count = array.components == 1 ? integer_at(array, i) : UINT64_MAX;
    // 2^32 parts of so many add up to less than 2^64, so sums do not overflow.
    if (count >= most_rows)
      return malformed("\"" + path + "\" holds " + std::to_string(static_cast<int64_t>(count)) +
                       ", which is no count");
    counts.add(count);
  }
  return counts;
}

Result<Array> VtkHdfReader::integers(const std::string& path, uint64_t first, uint64_t count) {
  Array array =
      MAILLE_TRY(file_.rows(path, first, count, make_array(path, Domain::mesh, Scalar::u64, 1), budget_));
  if (is_float(array.type) || array.components != 1)
    return malformed("\"" + path + "\" must hold whole numbers, one in each row");
  return array;
}

/// What the group Steps says of this step, or `otherwise`, which is so in a file without steps. Poly data has
/// a column for each kind of cells.
Result<uint64_t> VtkHdfReader::step_number(const std::string& name, uint64_t otherwise, size_t column) {
  const std::string path = group_root + "/Steps/" + name;
  if (!step_ || !file_.find(path)) return otherwise;
  const Array row =
      MAILLE_TRY(file_.rows(path, *step_, 1, make_array(path, Domain::mesh, Scalar::u64, 1), budget_));
  const size_t at = row.components == 1 ? 0 : column;
  const bool there = !is_float(row.type) && at < row.components;
  const uint64_t value = there ? integer_at(row, at) : UINT64_MAX;
  if (value >= most_rows)
    return malformed("\"" + path + "\" tells no row for step " + std::to_string(*step_));
  return value;
}

Result<> VtkHdfReader::find_steps() {
  if (!file_.is_group(group_root)) return malformed("it has no group \"VTKHDF\", so it is no file of VTK");
  const std::string type = file_.text(group_root, "Type").value_or("");
  if (type == "UnstructuredGrid") kinds_ = grid_kinds;
  if (type == "PolyData") kinds_ = poly_kinds;
  const int64_t version = file_.number(group_root, "Version").value_or(0);
  if (kinds_.empty() || version < 1 || version > 2) {
    return failure(ErrorCode::unsupported, file_.name() + ": VTKHDF " + std::to_string(version) +
                                               " of type \"" + type +
                                               "\" cannot be read, but UnstructuredGrid and PolyData of "
                                               "versions 1 and 2 can");
  }
  const int64_t steps = file_.number(group_root + "/Steps", "NSteps").value_or(0);
  const auto values = file_.find(group_root + "/Steps/Values");
  steps_ = steps < 0 ? 0 : static_cast<uint64_t>(steps);
  if (steps_ > 0 && (!values || values->rows() < steps_))
    return malformed("its Steps have fewer values than steps (" + std::to_string(steps_) + ")");
  return {};
}

Result<std::vector<double>> VtkHdfReader::times() {
  MAILLE_CHECK(find_steps());
  std::vector<double> times;
  if (steps_ == 0) return times;
  const Array values = MAILLE_TRY(file_.rows(group_root + "/Steps/Values", 0, steps_,
                                             make_array("Values", Domain::mesh, Scalar::f64, 1), budget_));
  if (!is_float(values.type) || values.components != 1) return malformed("its times are no numbers");
  for (uint64_t i = 0; i < steps_; ++i)
    times.push_back(values.type == Scalar::f32 ? double{values.values<float>()[i]}
                                               : values.values<double>()[i]);
  return times;
}

/// Finds the parts of the step.
Result<> VtkHdfReader::find_parts() {
  const std::string path = group_root + "/NumberOfPoints";
  const auto dataset = file_.find(path);
  if (!dataset) return malformed("\"" + path + "\" is missing");
  const uint64_t first = MAILLE_TRY(step_number("PartOffsets", 0));
  const uint64_t parts = MAILLE_TRY(step_number("NumberOfParts", step_ && steps_ > 1 ? 1 : dataset->rows()));
  if (first > dataset->rows() || parts > dataset->rows() - first)
    return malformed("a step has parts " + std::to_string(first) + " to " + std::to_string(first + parts) +
                     ", but there are " + std::to_string(dataset->rows()));
  first_part_ = first;
  end_part_ = first + parts;
  if (end_part_ > bytes_) return malformed("it has more parts than bytes");
  points_ = MAILLE_TRY(counts(path));
  return {};
}

Result<> VtkHdfReader::read_points() {
  first_point_ = MAILLE_TRY(step_number("PointOffsets", 0));
  const uint64_t count = points_.between(first_part_, end_part_);
  if (count > max_points) return malformed("there are 2^32 points or more");
  Array array = MAILLE_TRY(file_.rows(group_root + "/Points", first_point_, count, Array(), budget_));
  if (!is_float(array.type) || array.components != 3)
    return malformed("its points have not three coordinates");
  mesh_.points.type = array.type;
  mesh_.points.bytes = std::move(array.bytes);
  uint64_t before = 0;
  for (size_t part = first_part_; part < end_part_; ++part) {
    first_points_.push_back(before);
    before += points_[part];
  }
  return {};
}

Result<StepCells> VtkHdfReader::read_cells(const Kind& kind, size_t column) {
  const std::string folder = group_root + "/" + kind.folder;
  StepCells cells;
  cells.counts = MAILLE_TRY(counts(folder + "NumberOfCells"));
  cells.ids = MAILLE_TRY(counts(folder + "NumberOfConnectivityIds"));
  cells.first_cell = MAILLE_TRY(step_number("CellOffsets", 0, column));
  const uint64_t first_id = MAILLE_TRY(step_number("ConnectivityIdOffsets", 0, column));
  // Each part has one offset more than cells. How many parts stand before tells a grid its first part; poly
  // data, whose kinds may change at different steps, the cells before.
  size_t before = first_part_;
  if (kinds_.size() > 1) {
    for (before = 0; before < first_part_ && cells.counts.between(0, before) < cells.first_cell;) ++before;
  }
  const uint64_t count = cells.counts.between(first_part_, end_part_);
  const uint64_t first_offset = cells.first_cell + before;
  const uint64_t offsets = count + (end_part_ - first_part_);
  if (count == 0) return cells;
  const uint64_t ids = cells.ids.between(first_part_, end_part_);
  cells.connectivity = MAILLE_TRY(integers(folder + "Connectivity", first_id, ids));
  cells.offsets = MAILLE_TRY(integers(folder + "Offsets", first_offset, offsets));
  if (kinds_.size() == 1) {
    cells.types = MAILLE_TRY(integers(group_root + "/Types", cells.first_cell, count));
    MAILLE_CHECK(read_faces(cells, first_offset));
  }
  return cells;
}

/// Writers leave steps out of what they say of faces, but write them for all parts before: so the sum over
/// these is where faces of the step begin.
Result<> VtkHdfReader::read_faces(StepCells& cells, uint64_t first_offset) {
  if (!file_.find(group_root + "/NumberOfFaces")) return {};
  cells.faces = MAILLE_TRY(counts(group_root + "/NumberOfFaces"));
  cells.face_ids = MAILLE_TRY(counts(group_root + "/NumberOfFaceConnectivityIds"));
  cells.cell_faces = MAILLE_TRY(counts(group_root + "/NumberOfPolyhedronToFaceIds"));
  const auto rows = [&](const char* name, const Counts& counts, uint64_t more) {
    const uint64_t parts = end_part_ - first_part_;
    return integers(group_root + "/" + name, counts.between(0, first_part_) + more * first_part_,
                    counts.between(first_part_, end_part_) + more * parts);
  };
  cells.face_points = MAILLE_TRY(rows("FaceConnectivity", cells.face_ids, 0));
  cells.face_offsets = MAILLE_TRY(rows("FaceOffsets", cells.faces, 1));
  cells.faces_of_cells = MAILLE_TRY(rows("PolyhedronToFaces", cells.cell_faces, 0));
  cells.cell_face_offsets =
      MAILLE_TRY(integers(group_root + "/PolyhedronOffsets", first_offset, cells.offsets.count()));
  return {};
}

/// Where the lists of a part end: the file has where they begin, and the end of the last one behind.
Result<Array> VtkHdfReader::ends(const Array& offsets, uint64_t first, uint64_t count) {
  if (integer_at(offsets, first) != 0)
    return malformed("\"" + offsets.name + "\": a part begins at " +
                     std::to_string(integer_at(offsets, first)) + ", not 0");
  return slice(offsets, first + 1, count);
}

Result<Array> VtkHdfReader::types_of(const Kind& kind, const StepCells& cells, size_t part,
                                     const Array& ends) {
  if (kinds_.size() == 1)
    return slice(cells.types, cells.counts.between(first_part_, part), cells.counts[part]);
  Array types = make_array("Types", Domain::mesh, Scalar::u8, 1);
  for (uint64_t i = 0, begin = 0, end = 0; i < ends.count(); ++i, begin = end) {
    end = integer_at(ends, i);
    const CellType type = type_of(kind, end - begin);
    if (type == refused) {
      return failure(ErrorCode::unsupported,
                     file_.name() +
                         ": triangle strips cannot be read; ParaView's filter Triangulate makes "
                         "triangles of them");
    }
    types.bytes.push_back(static_cast<std::byte>(type));
  }
  return types;
}

Result<std::optional<PartFaces>> VtkHdfReader::faces_of(const StepCells& cells, size_t part) {
  if (cells.faces.parts() == 0 || cells.cell_faces[part] == 0) return std::nullopt;
  const size_t parts_before = part - first_part_;
  const auto before = [&](const Counts& counts) { return counts.between(first_part_, part); };
  Array face_ends =
      MAILLE_TRY(ends(cells.face_offsets, before(cells.faces) + parts_before, cells.faces[part]));
  Array cell_ends =
      MAILLE_TRY(ends(cells.cell_face_offsets, before(cells.counts) + parts_before, cells.counts[part]));
  return PartFaces::lists(
      slice(cells.face_points, before(cells.face_ids), cells.face_ids[part]), std::move(face_ends),
      slice(cells.faces_of_cells, before(cells.cell_faces), cells.cell_faces[part]), std::move(cell_ends));
}

Result<> VtkHdfReader::append_part(const Kind& kind, const StepCells& cells, size_t part) {
  const uint64_t count = cells.counts[part];
  if (count == 0) return {};
  PartCells own;
  own.connectivity = slice(cells.connectivity, cells.ids.between(first_part_, part), cells.ids[part]);
  own.ends =
      MAILLE_TRY(ends(cells.offsets, cells.counts.between(first_part_, part) + (part - first_part_), count));
  own.types = MAILLE_TRY(types_of(kind, cells, part, own.ends));
  own.faces = MAILLE_TRY(faces_of(cells, part));
  const uint64_t first = cells_.count();
  MAILLE_CHECK(append_part_cells(std::move(own), first_points_[part - first_part_], points_[part],
                                 file_.name() + ": part " + std::to_string(part), budget_, cells_));
  for (uint64_t i = first; i < cells_.count(); ++i) shapes_.add(1, cells_.type(i), "");
  return {};
}

/// Reads cells part by part, and in each kind by kind, which is the order of arrays on cells.
Result<> VtkHdfReader::read_all_cells() {
  std::vector<std::pair<const Kind*, StepCells>> kinds;
  for (size_t k = 0; k < kinds_.size(); ++k) {
    // A file of polygons alone may lack the other kinds.
    if (kinds_.size() > 1 && !file_.find(group_root + "/" + kinds_[k].folder + "NumberOfCells")) continue;
    kinds.emplace_back(&kinds_[k], MAILLE_TRY(read_cells(kinds_[k], k)));
    first_cell_ += kinds.back().second.first_cell;
  }
  for (size_t part = first_part_; part < end_part_; ++part) {
    first_cells_.push_back(cells_.count());
    for (const auto& [kind, cells] : kinds) MAILLE_CHECK(append_part(*kind, cells, part));
  }
  MAILLE_CHECK(report_progress(options_.progress, "reading", 0.5));
  cells_count_ = cells_.count();
  return {};
}

/// Reads arrays of all parts at once, as their rows follow each other.
Result<> VtkHdfReader::read_data(const std::string& group, Domain domain, uint64_t first, uint64_t count) {
  const std::string folder = group_root + "/" + group;
  const auto active = [&](const char* attribute, const std::string& name) {
    return file_.text(folder, attribute) == name;
  };
  for (const std::string& name : file_.members(folder)) {
    const std::string path = folder + "/" + name;
    const auto dataset = file_.find(path);
    if (!dataset || !dataset->type) {
      notes_.push_back("array \"" + path + "\" holds no numbers and was left out");
      continue;
    }
    const uint64_t at = MAILLE_TRY(step_number(group + "Offsets/" + name, first));
    Array array =
        MAILLE_TRY(file_.rows(path, at, count, make_array(name, domain, *dataset->type, 1), budget_));
    if (array.components == 0) continue;
    if (active("Normals", name) && array.components == 3) array.role = Role::normal;
    if (active("TCoords", name)) array.role = Role::texture_coordinate;
    if (active("Tangents", name)) array.role = Role::tangent;
    if (active("GlobalIds", name)) (domain == Domain::point ? marks_.point_ids : marks_.cell_ids) = name;
    mesh_.arrays.push_back(std::move(array));
  }
  return {};
}

Result<> VtkHdfReader::read_field_data() {
  const std::string folder = group_root + "/FieldData";
  for (const std::string& name : file_.members(folder)) {
    const auto dataset = file_.find(folder + "/" + name);
    if (!dataset || !dataset->type) {
      notes_.push_back("array \"" + folder + "/" + name + "\" holds no numbers and was left out");
      continue;
    }
    // With steps each has a row, unless it says how many.
    const uint64_t first = MAILLE_TRY(step_number("FieldDataOffsets/" + name, step_ ? *step_ : 0));
    const uint64_t count = MAILLE_TRY(step_number("FieldDataSizes/" + name, step_ ? 1 : dataset->rows(), 1));
    mesh_.arrays.push_back(MAILLE_TRY(file_.rows(
        folder + "/" + name, first, count, make_array(name, Domain::mesh, *dataset->type, 1), budget_)));
  }
  if (!step_ || mesh_.find("TimeValue", Domain::mesh) != nullptr) return {};
  mesh_.arrays.push_back(time_array(time_));
  return {};
}

Result<ReadResult> VtkHdfReader::read(std::optional<uint64_t> step) {
  const std::vector<double> all = MAILLE_TRY(times());
  if (step && *step >= steps_)
    return failure(ErrorCode::usage, file_.name() + ": there are " + std::to_string(steps_) + " time steps");
  if (steps_ > 0) {
    step_ = step.value_or(steps_ - 1);
    time_ = all[*step_];
  }
  MAILLE_CHECK(find_parts());
  MAILLE_CHECK(read_points());
  MAILLE_CHECK(read_all_cells());
  MAILLE_CHECK(read_data("PointData", Domain::point, first_point_, mesh_.point_count()));
  MAILLE_CHECK(read_data("CellData", Domain::cell, first_cell_, cells_count_));
  MAILLE_CHECK(read_field_data());
  // What was not found may be there in truth, so a mesh without it must not pass for whole.
  if (file_.is_broken()) return malformed("it is damaged: the library of HDF5 gave up");
  if (steps_ > 1 && !step)
    notes_.push_back("the mesh and its arrays are those of the last of " + std::to_string(steps_) +
                     " time steps");
  mesh_.blocks = shapes_.take(cells_);
  // join_parts() relies on a valid mesh.
  if (auto ok = validate(mesh_); !ok) return malformed(ok.error().message);
  MAILLE_CHECK(join_parts(file_.name(), first_points_, first_cells_, marks_, nullptr, mesh_, notes_));
  return ReadResult{std::move(mesh_), std::move(notes_)};
}

Result<ReadResult> read_with_step(const Source& source, const ReadOptions& options,
                                  std::optional<uint64_t> step) {
  const std::unique_ptr<Hdf5File> file = MAILLE_TRY(Hdf5File::open(source));
  return VtkHdfReader(*file, source.size(), options).read(step);
}

Result<ReadResult> read_vtkhdf(const Source& source, const ReadOptions& options) {
  return read_with_step(source, options, std::nullopt);
}

Result<std::vector<std::string>> write_vtkhdf(const Mesh&, Sink& sink, const WriteOptions&) {
  return failure(ErrorCode::usage, sink.name() + ": VTKHDF files cannot be written; write .vtu");
}

}  // namespace

Result<ReadResult> read_vtkhdf_step(const Source& source, const ReadOptions& options, uint64_t step) {
  return read_with_step(source, options, step);
}

Result<std::vector<double>> vtkhdf_times(const Source& source) {
  const std::unique_ptr<Hdf5File> file = MAILLE_TRY(Hdf5File::open(source));
  const ReadOptions options;
  return VtkHdfReader(*file, source.size(), options).times();
}

const Format& vtkhdf_format() {
  static const Format format{
      {"vtkhdf", {".vtkhdf", ".hdf"}, "VTKHDF: unstructured grids and poly data; reading only", true, false},
      is_hdf5,
      read_vtkhdf,
      write_vtkhdf};
  return format;
}

}  // namespace maille
