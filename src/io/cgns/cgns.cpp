// CGNS, the general notation of CFD, in files of HDF5: zones become blocks with names, their solutions
// arrays. Source: "CGNS Standard Interface Data Structures" (SIDS).
#include "io/cgns/cgns.h"

#include <maille/with_type.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <set>
#include <tuple>

#include "io/cgns/cgns_cells.h"
#include "io/format.h"
#include "io/reading.h"
#include "io/zone_fields.h"

namespace maille {
namespace {

constexpr std::string_view adf_signature = "@(#)ADF Database";

struct Zone {
  CgnsNode node;
  std::vector<CgnsNode> children;
  std::string prefix, name;  ///< of names of its blocks
  int cell_dimension = 3;
  size_t space_dimension = 3;
  bool structured = false;
  /// In each direction; an unstructured one has one.
  std::vector<uint64_t> points_along, cells_along;
  uint64_t first_point = 0, points = 0;
  std::vector<ElementRun> cells;  ///< of the base's dimension: those that solutions at cells mean
  std::set<std::pair<Domain, std::string>> arrays;

  tl::unexpected<Error> malformed(const std::string& file, const std::string& what) const {
    return failure(ErrorCode::malformed_input, file + ": zone \"" + node.path + "\": " + what);
  }
};

/// A table of names, so many for each step; empty where there is none.
struct StepNames {
  std::vector<std::string> all, used;  ///< those of the step that is read are used

  static bool has(const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  }
  bool is_of_another_step(const std::string& name) const { return has(all, name) && !has(used, name); }
};

/// Reads one step, zone after zone: points, cells, boundary conditions, solutions. Arrays of all zones are
/// put together at the end, when the types of all are known.
class CgnsReader {
 public:
  CgnsReader(const Hdf5File& file, uint64_t bytes, const ReadOptions& options)
      : file_(file.name()),
        options_(options),
        // As VTKHDF: deflate packs up to 16 times what Budget allows for.
        budget_(file_, bytes > UINT64_MAX / 16 ? bytes : bytes * 16, options.limits),
        tree_(file, budget_),
        cells_(file_, tree_, budget_) {}

  Result<ReadResult> read(std::optional<uint64_t> step);
  Result<std::vector<double>> times();

 private:
  Result<> find_bases();
  Result<> find_zones(const CgnsNode& base);
  Result<StepNames> step_names(const std::vector<CgnsNode>& nodes, const char* label, const char* name) const;
  Result<> read_zone(Zone& zone);
  Result<> read_sizes(Zone& zone);
  Result<> read_points(Zone& zone);
  Result<> add_points();
  Result<std::optional<Array>> inner_values(const Zone& zone, const CgnsNode& node,
                                            const std::vector<CgnsNode>& group,
                                            std::span<const uint64_t> along);
  Result<> read_solution(Zone& zone, const CgnsNode& node);
  Result<> read_conditions(const Zone& zone, const CgnsNode& group);
  Result<> read_condition(const Zone& zone, const CgnsNode& node);
  Result<> mark_points(const Zone& zone, const std::string& name, const std::vector<int64_t>& values,
                       bool range);
  Result<> mark_cells(const Zone& zone, const std::string& name, const std::vector<int64_t>& values,
                      bool range);
  Result<> finish_marks();
  void leave_out(const std::vector<CgnsNode>& nodes, std::initializer_list<std::string_view> known);
  void note_left_out();
  tl::unexpected<Error> malformed(const std::string& what) const {
    return failure(ErrorCode::malformed_input, file_ + ": " + what);
  }

  const std::string& file_;
  const ReadOptions& options_;
  Budget budget_;
  CgnsTree tree_;
  CgnsCells cells_;
  std::vector<CgnsNode> bases_;
  std::vector<double> times_;
  std::optional<uint64_t> step_;  ///< that is read, where there are steps
  std::vector<Zone> zones_;
  std::vector<std::array<Array, 3>> axes_;  ///< by zone
  ZoneFields fields_;
  /// Boundary conditions: points or cells by name.
  std::map<std::pair<Domain, std::string>, std::vector<uint64_t>> marks_;
  std::map<std::string, uint64_t> left_out_;
  CommentRoom room_;
  Mesh mesh_;
  std::vector<std::string> notes_;
};

Result<> CgnsReader::find_bases() {
  for (const CgnsNode& node : MAILLE_TRY(tree_.children({"", "", ""}))) {
    if (node.label == "CGNSBase_t") bases_.push_back(node);
  }
  if (bases_.empty()) return malformed("it has no CGNSBase_t, so it is no file of CGNS");
  for (const CgnsNode& base : bases_) {
    const std::vector<CgnsNode> children = MAILLE_TRY(tree_.children(base));
    const CgnsNode* const series = find_node(children, "BaseIterativeData_t");
    if (series == nullptr || !times_.empty()) continue;
    const std::vector<CgnsNode> arrays = MAILLE_TRY(tree_.children(*series));
    const CgnsNode* const times = find_node(arrays, "DataArray_t", "TimeValues");
    if (times == nullptr) continue;
    const Array values = MAILLE_TRY(tree_.values(*times));
    if (!values.bytes.empty() && !is_float(values.type)) return malformed("its times are no numbers");
    with_type(values.type, [&](auto zero) {
      for (const auto time : values.values<decltype(zero)>()) times_.push_back(static_cast<double>(time));
    });
  }
  return {};
}

Result<std::vector<double>> CgnsReader::times() {
  MAILLE_CHECK(find_bases());
  return times_;
}

Result<StepNames> CgnsReader::step_names(const std::vector<CgnsNode>& nodes, const char* label,
                                         const char* name) const {
  const CgnsNode* const series = find_node(nodes, label);
  if (!step_ || series == nullptr) return StepNames();
  const std::vector<CgnsNode> arrays = MAILLE_TRY(tree_.children(*series));
  const CgnsNode* const node = find_node(arrays, "DataArray_t", name);
  if (node == nullptr) return StepNames();
  StepNames names;
  names.all = MAILLE_TRY(tree_.names(*node));
  const size_t each = names.all.size() / times_.size();
  const auto first = names.all.begin() + static_cast<ptrdiff_t>(*step_ * each);
  names.used.assign(first, first + static_cast<ptrdiff_t>(each));
  return names;
}

Result<> CgnsReader::find_zones(const CgnsNode& base) {
  const std::vector<CgnsNode> children = MAILLE_TRY(tree_.children(base));
  const std::vector<int64_t> dimensions = MAILLE_TRY(tree_.integers(base));
  if (dimensions.size() != 2 || dimensions[0] < 1 || dimensions[1] < dimensions[0] || dimensions[1] > 3)
    return malformed("base \"" + base.name + "\" has not two dimensions of 1 to 3");
  const StepNames steps = MAILLE_TRY(step_names(children, "BaseIterativeData_t", "ZonePointers"));
  for (const CgnsNode& node : children) {
    if (node.label != "Zone_t") continue;
    if (steps.is_of_another_step(node.name)) continue;
    Zone zone;
    zone.node = node;
    zone.name = bases_.size() == 1 ? node.name : base.name + "/" + node.name;
    zone.cell_dimension = static_cast<int>(dimensions[0]);
    zone.space_dimension = static_cast<size_t>(dimensions[1]);
    zones_.push_back(std::move(zone));
  }
  leave_out(children, {"Zone_t", "BaseIterativeData_t"});
  return {};
}

void CgnsReader::leave_out(const std::vector<CgnsNode>& nodes,
                           std::initializer_list<std::string_view> known) {
  for (const CgnsNode& node : nodes) {
    const auto is_label = [&](std::string_view label) { return node.label == label; };
    if (std::none_of(known.begin(), known.end(), is_label))
      ++left_out_[node.label.empty() ? "without a label" : node.label];
  }
}

/// The sizes of a zone: points, then cells, then what nobody uses, for each direction.
Result<> CgnsReader::read_sizes(Zone& zone) {
  const CgnsNode* const type = find_node(zone.children, "ZoneType_t");
  zone.structured = type == nullptr || MAILLE_TRY(tree_.text(*type)).starts_with("Structured");
  const std::vector<int64_t> sizes = MAILLE_TRY(tree_.integers(zone.node));
  const size_t directions = zone.structured ? static_cast<size_t>(zone.cell_dimension) : 1;
  if (sizes.size() != 3 * directions) return zone.malformed(file_, "it has not three sizes a direction");
  zone.points = 1;
  for (size_t k = 0; k < directions; ++k) {
    const int64_t points = sizes[k];
    if (points < (zone.structured ? 1 : 0) || static_cast<uint64_t>(points) > max_points)
      return zone.malformed(file_, "its sizes are not from 1 to 2^32 - 2");
    zone.points_along.push_back(static_cast<uint64_t>(points));
    zone.cells_along.push_back(static_cast<uint64_t>(points) - 1);
    // Both factors are below 2^32.
    zone.points *= static_cast<uint64_t>(points);
    if (zone.points > max_points) return zone.malformed(file_, "there are 2^32 points or more");
  }
  return {};
}

/// Without the planes of ghosts around the values (Rind_t: so many before and behind in each direction). None
/// where there are not as many values as the sizes say.
Result<std::optional<Array>> CgnsReader::inner_values(const Zone& zone, const CgnsNode& node,
                                                      const std::vector<CgnsNode>& group,
                                                      std::span<const uint64_t> along) {
  Array all = MAILLE_TRY(tree_.values(node));
  uint64_t begin[3] = {}, size[3] = {1, 1, 1}, whole[3] = {1, 1, 1};
  const CgnsNode* const rind_node = find_node(group, "Rind_t");
  std::vector<int64_t> rind(2 * along.size());
  if (rind_node != nullptr) rind = MAILLE_TRY(tree_.integers(*rind_node));
  if (rind.size() != 2 * along.size()) return zone.malformed(file_, "its Rind_t is not of its dimension");
  uint64_t product = 1;
  for (size_t k = 0; k < along.size(); ++k) {
    for (const int64_t planes : {rind[2 * k], rind[2 * k + 1]}) {
      if (planes < 0 || planes > INT32_MAX) return zone.malformed(file_, "its Rind_t is out of range");
    }
    begin[k] = static_cast<uint64_t>(rind[2 * k]);
    size[k] = along[k];
    whole[k] = size[k] + begin[k] + static_cast<uint64_t>(rind[2 * k + 1]);
    if (whole[k] != 0 && product > all.count() / whole[k]) return std::nullopt;
    product *= whole[k];
  }
  if (product != all.count()) return std::nullopt;
  if (std::equal(size, size + 3, whole)) return all;
  ++left_out_["Rind_t (planes of ghosts)"];
  Array inner = make_array(all.name, all.domain, all.type, 1);
  MAILLE_CHECK(budget_.take(size[0] * size[1] * size[2], inner.tuple_size()));
  for (uint64_t z = 0; z < size[2]; ++z) {
    for (uint64_t y = 0; y < size[1]; ++y) {
      const uint64_t row = begin[0] + whole[0] * (begin[1] + y + whole[1] * (begin[2] + z));
      const auto from = all.bytes.begin() + static_cast<ptrdiff_t>(row * all.tuple_size());
      inner.bytes.insert(inner.bytes.end(), from, from + static_cast<ptrdiff_t>(size[0] * all.tuple_size()));
    }
  }
  return inner;
}

Result<> CgnsReader::read_points(Zone& zone) {
  const StepNames steps =
      MAILLE_TRY(step_names(zone.children, "ZoneIterativeData_t", "GridCoordinatesPointers"));
  // The original grid has this name, those of later steps any other.
  const std::string name = steps.used.empty() ? "GridCoordinates" : steps.used[0];
  const CgnsNode* grid = find_node(zone.children, "GridCoordinates_t", name);
  if (grid == nullptr) grid = find_node(zone.children, "GridCoordinates_t");
  if (grid == nullptr) return zone.malformed(file_, "it has no coordinates");
  const std::vector<CgnsNode> arrays = MAILLE_TRY(tree_.children(*grid));
  static constexpr const char* names[] = {"CoordinateX", "CoordinateY", "CoordinateZ"};
  std::array<Array, 3> axes;
  for (size_t k = 0; k < zone.space_dimension; ++k) {
    const CgnsNode* const node = find_node(arrays, "DataArray_t", names[k]);
    if (node == nullptr) {
      return failure(ErrorCode::unsupported, file_ + ": zone \"" + zone.node.path + "\" has no " + names[k] +
                                                 "; coordinates other than X, Y and Z cannot be read");
    }
    auto axis = MAILLE_TRY(inner_values(zone, *node, arrays, zone.points_along));
    if (!axis || !is_float(axis->type))
      return zone.malformed(file_, std::string("there is not one number for each point in ") + names[k]);
    if (axis->type == Scalar::f64) mesh_.points.type = Scalar::f64;
    axes[k] = *std::move(axis);
  }
  axes_.push_back(std::move(axes));
  return {};
}

/// When all types are known: f64 where a zone has it.
Result<> CgnsReader::add_points() {
  uint64_t points = 0;
  for (const Zone& zone : zones_) points += zone.points;
  if (points > max_points) return malformed("there are 2^32 points or more");
  MAILLE_CHECK(budget_.take(points, mesh_.points.tuple_size()));
  mesh_.points.resize(points);
  for (size_t z = 0; z < zones_.size(); ++z) {
    for (size_t k = 0; k < zones_[z].space_dimension; ++k) {
      const Array& axis = axes_[z][k];
      with_type(mesh_.points.type, [&](auto to) {
        with_type(axis.type, [&](auto from) {
          size_t at = 3 * zones_[z].first_point + k;
          for (const auto value : axis.values<decltype(from)>()) {
            mesh_.points.values<decltype(to)>()[at] = static_cast<decltype(to)>(value);
            at += 3;
          }
        });
      });
    }
  }
  return {};
}

Result<> CgnsReader::read_solution(Zone& zone, const CgnsNode& node) {
  const std::vector<CgnsNode> nodes = MAILLE_TRY(tree_.children(node));
  const CgnsNode* const location = find_node(nodes, "GridLocation_t");
  const std::string place = location == nullptr ? "Vertex" : MAILLE_TRY(tree_.text(*location));
  const bool partial =
      find_node(nodes, "IndexRange_t") != nullptr || find_node(nodes, "IndexArray_t") != nullptr;
  if ((place != "Vertex" && place != "CellCenter") || partial) {
    notes_.push_back("solution \"" + node.name + "\" of zone \"" + zone.name + "\" left out: it is " +
                     (partial ? "for a part of the zone only" : "at " + place));
    return {};
  }
  const bool at_points = place == "Vertex";
  const std::vector<ElementRun> points = {{zone.first_point, zone.points}};
  const std::vector<ElementRun>& runs = at_points ? points : zone.cells;
  std::vector<uint64_t> along = at_points ? zone.points_along : zone.cells_along;
  uint64_t count = 0;
  for (const ElementRun& run : runs) count += run.count;
  if (!zone.structured) along = {count};
  for (const CgnsNode& array : nodes) {
    if (array.label != "DataArray_t") continue;
    auto values = MAILLE_TRY(inner_values(zone, array, nodes, along));
    if (!values) {
      notes_.push_back("array \"" + array.name + "\" of zone \"" + zone.name + "\" left out: it has not " +
                       std::to_string(count) + " values, one for each " + (at_points ? "point" : "cell"));
      continue;
    }
    const Domain domain = at_points ? Domain::point : Domain::cell;
    // Several solutions may have arrays of one name.
    const bool is_new = zone.arrays.insert({domain, array.name}).second;
    values->domain = domain;
    if (!is_new) values->name = node.name + "/" + array.name;
    fields_.add(runs, *std::move(values));
  }
  leave_out(nodes, {"DataArray_t", "GridLocation_t", "Rind_t", "Ordinal_t"});
  return {};
}

/// Elements, or points of an unstructured zone, as a list or from one to another; of a structured zone points
/// by their indices.
Result<> CgnsReader::mark_points(const Zone& zone, const std::string& name,
                                 const std::vector<int64_t>& values, bool range) {
  std::vector<uint64_t>& points = marks_[{Domain::point, name}];
  const size_t directions = zone.points_along.size();
  const auto mark = [&](const int64_t* index) -> Result<> {
    uint64_t point = 0, step = 1;
    for (size_t k = 0; k < directions; step *= zone.points_along[k++]) {
      if (index[k] < 1 || static_cast<uint64_t>(index[k]) > zone.points_along[k])
        return zone.malformed(file_, "boundary condition \"" + name + "\" is outside of its points");
      point += (static_cast<uint64_t>(index[k]) - 1) * step;
    }
    MAILLE_CHECK(budget_.take(1, sizeof(uint64_t)));
    points.push_back(zone.first_point + point);
    return {};
  };
  if (!range) {
    for (size_t i = 0; i + directions <= values.size(); i += directions) MAILLE_CHECK(mark(&values[i]));
    return {};
  }
  int64_t from[3] = {1, 1, 1}, to[3] = {1, 1, 1}, at[3];
  if (values.size() != 2 * directions) return zone.malformed(file_, "a PointRange is not of its dimension");
  for (size_t k = 0; k < directions; ++k)
    std::tie(from[k], to[k]) = std::minmax(values[k], values[directions + k]);
  // Each point marked takes from the budget, and one outside of the zone ends this, so sizes are bounded.
  for (at[2] = from[2]; at[2] <= to[2]; ++at[2]) {
    for (at[1] = from[1]; at[1] <= to[1]; ++at[1]) {
      for (at[0] = from[0]; at[0] <= to[0]; ++at[0]) MAILLE_CHECK(mark(at));
    }
  }
  return {};
}

Result<> CgnsReader::mark_cells(const Zone& zone, const std::string& name, const std::vector<int64_t>& values,
                                bool range) {
  if (range && values.size() != 2) return zone.malformed(file_, "a PointRange is not of its dimension");
  if (range && cells_.is_section(name, values[0], values[1])) return {};
  const auto mark = [&](int64_t element) -> Result<> {
    const std::optional<uint64_t> cell = MAILLE_TRY(cells_.cell_of(element, zone.prefix + name));
    if (!cell) return {};
    MAILLE_CHECK(budget_.take(1, sizeof(uint64_t)));
    marks_[{Domain::cell, name}].push_back(*cell);
    return {};
  };
  if (!range) {
    for (const int64_t element : values) MAILLE_CHECK(mark(element));
    return {};
  }
  for (int64_t element = values[0]; element <= values[1]; ++element) MAILLE_CHECK(mark(element));
  return {};
}

Result<> CgnsReader::read_condition(const Zone& zone, const CgnsNode& node) {
  const std::vector<CgnsNode> nodes = MAILLE_TRY(tree_.children(node));
  const CgnsNode* const location = find_node(nodes, "GridLocation_t");
  const std::string place = location == nullptr ? "Vertex" : MAILLE_TRY(tree_.text(*location));
  const CgnsNode* points = nullptr;
  for (const char* name : {"PointRange", "PointList", "ElementRange", "ElementList"}) {
    for (const CgnsNode& child : nodes) {
      if (points == nullptr && child.name == name) points = &child;
    }
  }
  leave_out(nodes, {"GridLocation_t", "IndexRange_t", "IndexArray_t", "Ordinal_t"});
  const std::string type = MAILLE_TRY(tree_.text(node));
  if (room_.take(node.name + type))
    mesh_.metadata.emplace_back("cgns.boundary." + zone.prefix + node.name, type);
  if (points == nullptr) return {};
  const bool range = points->label == "IndexRange_t";
  const bool at_points = place == "Vertex" && !points->name.starts_with("Element");
  const std::vector<int64_t> values = MAILLE_TRY(tree_.integers(*points));
  if (at_points) return mark_points(zone, node.name, values, range);
  if (!zone.structured) return mark_cells(zone, node.name, values, range);
  notes_.push_back("boundary condition \"" + node.name + "\" of zone \"" + zone.name +
                   "\" left out: it is at faces of a structured zone");
  return {};
}

Result<> CgnsReader::read_conditions(const Zone& zone, const CgnsNode& group) {
  const std::vector<CgnsNode> nodes = MAILLE_TRY(tree_.children(group));
  for (const CgnsNode& node : nodes) {
    if (node.label == "BC_t") MAILLE_CHECK(read_condition(zone, node));
  }
  leave_out(nodes, {"BC_t", "Ordinal_t"});
  return {};
}

Result<> CgnsReader::read_zone(Zone& zone) {
  zone.children = MAILLE_TRY(tree_.children(zone.node));
  zone.prefix = zones_.size() == 1 ? "" : zone.name + "/";
  MAILLE_CHECK(read_sizes(zone));
  MAILLE_CHECK(read_points(zone));
  if (zone.structured) {
    MAILLE_CHECK(cells_.add_grid(zone.points_along, zone.first_point, zone.name));
  } else {
    MAILLE_CHECK(cells_.add_sections(zone.children, zone.first_point, zone.points, zone.prefix, zone.name));
  }
  zone.cells = cells_.cells_of(zone.cell_dimension);
  const StepNames steps =
      MAILLE_TRY(step_names(zone.children, "ZoneIterativeData_t", "FlowSolutionPointers"));
  for (const CgnsNode& node : zone.children) {
    if (node.label == "ZoneBC_t") MAILLE_CHECK(read_conditions(zone, node));
    const bool solution = node.label == "FlowSolution_t" || node.label == "DiscreteData_t";
    if (solution && !steps.is_of_another_step(node.name)) MAILLE_CHECK(read_solution(zone, node));
  }
  leave_out(zone.children, {"ZoneType_t", "GridCoordinates_t", "Elements_t", "FlowSolution_t",
                            "DiscreteData_t", "ZoneBC_t", "ZoneIterativeData_t", "Ordinal_t"});
  zone.children.clear();
  return {};
}

Result<> CgnsReader::finish_marks() {
  for (const auto& [key, elements] : marks_) {
    Array array = make_array(key.second, key.first, Scalar::u8, 1);
    const uint64_t count = key.first == Domain::point ? mesh_.point_count() : cells_.count();
    MAILLE_CHECK(budget_.take(count, 1));
    array.resize(count);
    for (const uint64_t element : elements) array.bytes[element] = std::byte{1};
    mesh_.arrays.push_back(std::move(array));
  }
  return {};
}

void CgnsReader::note_left_out() {
  std::string list;
  for (const auto& [label, count] : left_out_)
    list += (list.empty() ? "" : ", ") + std::to_string(count) + " " + label;
  if (!list.empty()) notes_.push_back("nodes left out: " + list);
}

Result<ReadResult> CgnsReader::read(std::optional<uint64_t> step) {
  MAILLE_CHECK(find_bases());
  if (step && *step >= times_.size())
    return failure(ErrorCode::usage, file_ + ": there are " + std::to_string(times_.size()) + " time steps");
  if (!times_.empty()) step_ = step.value_or(times_.size() - 1);
  for (const CgnsNode& base : bases_) MAILLE_CHECK(find_zones(base));
  uint64_t points = 0;
  for (size_t z = 0; z < zones_.size(); ++z) {
    zones_[z].first_point = points;
    MAILLE_CHECK(read_zone(zones_[z]));
    points += zones_[z].points;
    MAILLE_CHECK(report_progress(options_.progress, "reading",
                                 static_cast<double>(z + 1) / static_cast<double>(zones_.size() + 1)));
    if (points > max_points) return malformed("there are 2^32 points or more");
  }
  MAILLE_CHECK(room_.check(file_));
  MAILLE_CHECK(add_points());
  MAILLE_CHECK(fields_.finish(cells_.count(), budget_, mesh_, notes_));
  MAILLE_CHECK(finish_marks());
  if (step_) {
    mesh_.arrays.push_back(time_array(times_[*step_]));
  }
  if (times_.size() > 1 && !step)
    notes_.push_back("the mesh and its solutions are those of the last of " + std::to_string(times_.size()) +
                     " time steps");
  if (const uint64_t faces = cells_.faces_of_unread(); faces > 0)
    notes_.push_back("polyhedra that are given by ParentElements alone are not read: their " +
                     counted(faces, "face") + " are the cells");
  note_left_out();
  mesh_.blocks = cells_.take();
  return ReadResult{std::move(mesh_), std::move(notes_)};
}

bool is_adf(Bytes bytes) {
  return bytes.size() >= adf_signature.size() &&
         std::memcmp(bytes.data(), adf_signature.data(), adf_signature.size()) == 0;
}

Result<std::unique_ptr<Hdf5File>> open_cgns(const Source& source) {
  std::byte first[adf_signature.size()] = {};
  if (source.size() >= sizeof(first)) MAILLE_CHECK(source.read_at(0, first));
  if (!is_adf(first)) return Hdf5File::open(source);
  return failure(ErrorCode::unsupported, source.name() +
                                             ": a CGNS file in the older format ADF; run `adf2hdf` on it "
                                             "(Debian: cgns-convert), which makes HDF5 of it");
}

Result<ReadResult> read_with_step(const Source& source, const ReadOptions& options,
                                  std::optional<uint64_t> step) {
  const std::unique_ptr<Hdf5File> file = MAILLE_TRY(open_cgns(source));
  return CgnsReader(*file, source.size(), options).read(step);
}

Result<ReadResult> read_cgns(const Source& source, const ReadOptions& options) {
  return read_with_step(source, options, std::nullopt);
}

Result<std::vector<std::string>> write_cgns(const Mesh&, Sink& sink, const WriteOptions&) {
  return failure(ErrorCode::usage, sink.name() + ": CGNS files cannot be written; write .vtu or .msh");
}

// Files of HDF5 are told apart by their names: what is in them lies behind the first bytes.
bool recognise_cgns(Bytes bytes) {
  return is_adf(bytes) || is_hdf5(bytes);
}

}  // namespace

Result<ReadResult> read_cgns_step(const Source& source, const ReadOptions& options, uint64_t step) {
  return read_with_step(source, options, step);
}

Result<std::vector<double>> cgns_times(const Source& source) {
  const std::unique_ptr<Hdf5File> file = MAILLE_TRY(open_cgns(source));
  const ReadOptions options;
  return CgnsReader(*file, source.size(), options).times();
}

const Format& cgns_format() {
  static const Format format{
      {"cgns", {".cgns"}, "CGNS in HDF5: structured and unstructured zones; reading only", true, false},
      recognise_cgns,
      read_cgns,
      write_cgns};
  return format;
}

}  // namespace maille
