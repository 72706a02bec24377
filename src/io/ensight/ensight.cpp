// EnSight Gold, what many solvers write for visualisation: a case file, one with the geometry, one for each
// variable. Parts become blocks with names. Its numbers are floats, in text too. Source: "EnSight User
// Manual", chapter "EnSight Gold Casefile Format".
#include "io/ensight/ensight.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "io/beside.h"
#include "io/cell_store.h"
#include "io/ensight/ensight_case.h"
#include "io/ensight/ensight_stream.h"
#include "io/format.h"

namespace maille {
namespace {

// Node i of VTK's cell is node order[i] of the element: the middle of a line comes second in EnSight, and VTK
// sees the triangle 0 1 2 of a wedge from the other side.
constexpr uint8_t bar3[] = {0, 2, 1};
constexpr uint8_t penta6[] = {0, 2, 1, 3, 5, 4};
constexpr uint8_t penta15[] = {0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13};

struct ElementType {
  std::string_view name;
  CellType type;
  std::span<const uint8_t> order;
};
constexpr ElementType element_types[] = {{"point", CellType::vertex, {}},
                                         {"bar2", CellType::line, {}},
                                         {"bar3", CellType::quadratic_edge, bar3},
                                         {"tria3", CellType::triangle, {}},
                                         {"tria6", CellType::quadratic_triangle, {}},
                                         {"quad4", CellType::quad, {}},
                                         {"quad8", CellType::quadratic_quad, {}},
                                         {"tetra4", CellType::tetrahedron, {}},
                                         {"tetra10", CellType::quadratic_tetrahedron, {}},
                                         {"pyramid5", CellType::pyramid, {}},
                                         {"pyramid13", CellType::quadratic_pyramid, {}},
                                         {"penta6", CellType::wedge, penta6},
                                         {"penta15", CellType::quadratic_wedge, penta15},
                                         {"hexa8", CellType::hexahedron, {}},
                                         {"hexa20", CellType::quadratic_hexahedron, {}},
                                         {"nsided", CellType::polygon, {}},
                                         {"nfaced", CellType::polyhedron, {}}};

/// Ghost elements have a "g_" before their type.
bool is_ghost(std::string_view name) {
  return name.starts_with("g_");
}

const ElementType* element_type(std::string_view name) {
  if (is_ghost(name)) name.remove_prefix(2);
  for (const ElementType& type : element_types) {
    if (type.name == name) return &type;
  }
  return nullptr;
}

bool ends_step(std::string_view line) {
  return line.starts_with("END TIME STEP") || line.starts_with("FILE_INDEX");
}

bool has_word(const std::string& line, std::string_view word) {
  return (" " + line + " ").find(" " + std::string(word) + " ") != std::string::npos;
}

/// Elements of one type in a part. Variables on elements have their values in the same order of sections.
struct Section {
  std::string name;  ///< "block" for the cells of a grid
  uint64_t first, count;
};

/// A part of the geometry. Its elements number the part's own points from 1 on; here all parts share one
/// list.
struct Part {
  std::string name;
  uint64_t first_point = 0, points = 0, first_cell = 0;
  std::vector<Section> sections;
};

/// Reads one step: all files of it are opened first, then geometry, then each variable into an array of the
/// whole mesh. Memory is bounded by a budget over the sizes of the files, beside the caller's limit.
class EnsightReader {
 public:
  EnsightReader(const Source& source, EnsightCase parsed, const ReadOptions& options)
      : file_(source.name()), case_(std::move(parsed)), options_(options) {
    result_.notes = case_.notes;
    case_bytes_ = source.size();
  }

  Result<ReadResult> read(std::optional<double> time) {
    MAILLE_CHECK(open_files(time));
    MAILLE_CHECK(read_geometry());
    finish_geometry();
    for (size_t i = 0; i < case_.variables.size(); ++i) {
      MAILLE_CHECK(
          report_progress(options_.progress, "reading",
                          static_cast<double>(i + 1) / static_cast<double>(case_.variables.size() + 1)));
      MAILLE_CHECK(read_variable(case_.variables[i], i + 1));
    }
    for (const EnsightConstant& constant : case_.constants) add_constant(constant);
    return std::move(result_);
  }

 private:
  struct DataFile {
    EnsightPlace place;
    std::unique_ptr<Source> source;
  };

  Result<> open_files(std::optional<double> time);
  Result<EnsightStream> open_stream(const DataFile& file, const InputBytes& input) const;
  Result<> read_geometry();
  Result<> read_header(EnsightStream& in);
  Result<> read_part(EnsightStream& in);
  Result<> read_elements(EnsightStream& in, Part& part);
  Result<> read_cells(EnsightStream& in, const Part& part, const ElementType& type, uint64_t count);
  Result<> read_polyhedra(EnsightStream& in, const Part& part, uint64_t count);
  Result<> add_nodes(EnsightStream& in, const Part& part, std::span<const int32_t> nodes);
  Result<> read_grid(EnsightStream& in, Part& part, const std::string& layout);
  Result<> read_grid_points(EnsightStream& in, const std::string& layout, std::span<const uint64_t> sizes);
  Result<> read_grid_flags(EnsightStream& in, const std::string& layout, const Part& part, uint64_t cells);
  Result<> add_grid_cells(Part& part, std::span<const uint64_t> sizes);
  Result<> read_ids(EnsightStream& in, bool there, uint64_t count, std::vector<int32_t>& ids);
  Result<> add_points(const EnsightStream& in, std::span<const float> values, uint64_t count);
  void finish_geometry();
  void add_ids(const char* name, Domain domain, const std::vector<int32_t>& ids);
  Result<> read_variable(const EnsightVariable& variable, size_t file);
  Result<> read_values(EnsightStream& in, const EnsightVariable& variable, const Part& part,
                       std::span<float> values);
  Result<> fill(EnsightStream& in, const std::string& header, uint64_t count, std::span<float> values,
                unsigned components);
  void add_constant(const EnsightConstant& constant);

  std::string file_;
  EnsightCase case_;
  const ReadOptions& options_;
  uint64_t case_bytes_ = 0;
  std::vector<DataFile> files_;  // the geometry, then variables
  std::optional<Budget> budget_;
  bool binary_ = false, node_ids_there_ = false, element_ids_there_ = false;
  bool keep_node_ids_ = false, keep_element_ids_ = false;
  std::vector<float> positions_;
  std::vector<int32_t> node_ids_, element_ids_, blanks_;
  std::vector<uint8_t> ghosts_;
  CellStore cells_;
  BlockShapes shapes_;
  std::map<int32_t, Part> parts_;
  ReadResult result_;
};

/// Opens all files first: what a step may take in memory follows from their sizes, each counted once. Several
/// variables may name one file.
Result<> EnsightReader::open_files(std::optional<double> time) {
  uint64_t bytes = case_bytes_;
  std::set<std::string> counted_files;
  const auto open = [&](const std::string& file, EnsightSets sets) -> Result<> {
    EnsightPlace place = MAILLE_TRY(case_.place(file_, file, sets, time));
    auto source = MAILLE_TRY(open_beside(file_, place.file));
    if (counted_files.insert(place.file).second) {
      bytes += source->size();
      result_.files_beside.push_back(source->name());
    }
    files_.push_back({std::move(place), std::move(source)});
    return {};
  };
  MAILLE_CHECK(open(case_.geometry, case_.geometry_sets));
  for (const EnsightVariable& variable : case_.variables) MAILLE_CHECK(open(variable.file, variable.sets));
  budget_.emplace(file_, bytes, options_.limits);
  return {};
}

/// A stream that stands at the first description of the step.
Result<EnsightStream> EnsightReader::open_stream(const DataFile& file, const InputBytes& input) const {
  EnsightStream in(input.text(), file.source->name(), binary_);
  // Only the geometry begins with the line "C Binary".
  if (binary_ && &file == &files_[0]) MAILLE_CHECK(in.keyword());
  if (file.place.many_steps)
    MAILLE_CHECK(in.enter_step(file.place.steps_before));
  else if (in.peek().starts_with("BEGIN TIME STEP"))
    MAILLE_CHECK(in.keyword());
  return in;
}

Result<> EnsightReader::read_geometry() {
  const InputBytes input = MAILLE_TRY(InputBytes::load(*files_[0].source));
  if (trim(input.text().substr(0, 20)).starts_with("Fortran Binary"))
    return failure(ErrorCode::unsupported,
                   files_[0].source->name() + ": Fortran binary is not read; C binary and text are");
  binary_ = input.text().starts_with("C Binary");
  EnsightStream in = MAILLE_TRY(open_stream(files_[0], input));
  MAILLE_CHECK(read_header(in));
  while (!in.at_end() && !ends_step(in.peek())) {
    const std::string word = MAILLE_TRY(in.keyword());
    if (word == "extents") {
      // Six numbers, in text in three lines without blanks before a sign, so they are skipped by lines.
      // Bounding boxes are computed here anyway.
      std::vector<float> unused;
      if (binary_) MAILLE_CHECK(in.floats(6, "extents", unused));
      for (int i = 0; i < 3 && !binary_; ++i) MAILLE_CHECK(in.line());
    } else if (word == "part") {
      MAILLE_CHECK(read_part(in));
    } else {
      return in.malformed("there should be a part or elements, but found \"" + word.substr(0, 40) + "\"");
    }
  }
  return {};
}

Result<> EnsightReader::read_header(EnsightStream& in) {
  for (int i = 0; i < 2; ++i) {
    const std::string text = MAILLE_TRY(in.line());
    if (!text.empty()) result_.mesh.metadata.emplace_back("ensight.description", text);
  }
  const auto ids = [&](const char* what, bool& there, bool& keep) -> Result<> {
    const std::string text = MAILLE_TRY(in.keyword());
    if (!text.starts_with(what))
      return in.malformed("there should be \"" + std::string(what) + "\", but found \"" + text.substr(0, 40) +
                          "\"");
    // "off" and "assign" have no ids in the file; "ignore" has some that mean nothing.
    keep = has_word(text, "given");
    there = keep || has_word(text, "ignore");
    return {};
  };
  MAILLE_CHECK(ids("node id", node_ids_there_, keep_node_ids_));
  return ids("element id", element_ids_there_, keep_element_ids_);
}

Result<> EnsightReader::read_part(EnsightStream& in) {
  const int32_t number = MAILLE_TRY(in.part_number());
  const auto [entry, fresh] = parts_.try_emplace(number);
  if (!fresh) return in.malformed("part " + std::to_string(number) + " is there twice");
  Part& part = entry->second;
  part.name = MAILLE_TRY(in.line());
  part.first_point = positions_.size() / 3;
  part.first_cell = cells_.count();
  const std::string layout = in.peek();
  if (layout == "part" || layout.empty() || ends_step(layout)) return {};
  MAILLE_CHECK(in.keyword());
  if (layout.starts_with("block")) return read_grid(in, part, layout);
  if (layout != "coordinates")
    return in.malformed("there should be coordinates or a block, but found \"" + layout.substr(0, 40) + "\"");
  part.points = MAILLE_TRY(in.count("points"));
  MAILLE_CHECK(read_ids(in, node_ids_there_, part.points, node_ids_));
  std::vector<float> values;
  MAILLE_CHECK(in.floats(3 * part.points, "coordinates", values));
  MAILLE_CHECK(add_points(in, values, part.points));
  return read_elements(in, part);
}

/// Appends ids to `ids`. Where a file has none, they count from 1, so that add_ids() can see that they say
/// nothing.
Result<> EnsightReader::read_ids(EnsightStream& in, bool there, uint64_t count, std::vector<int32_t>& ids) {
  if (there) return in.integers(count, "ids", ids);
  MAILLE_CHECK(budget_->take(count, sizeof(int32_t)));
  ids.resize(ids.size() + count);
  std::iota(ids.end() - static_cast<ptrdiff_t>(count), ids.end(), 1);
  return {};
}

/// Appends points from lists of all x, all y, all z.
Result<> EnsightReader::add_points(const EnsightStream& in, std::span<const float> values, uint64_t count) {
  // No overflow: counts are of 32 bits, or products that were bounded.
  if (positions_.size() / 3 + count > max_points) return in.malformed("there are 2^32 points or more");
  MAILLE_CHECK(budget_->take(count, 3 * sizeof(float)));
  for (uint64_t i = 0; i < count; ++i) {
    for (uint64_t axis = 0; axis < 3; ++axis) positions_.push_back(values[axis * count + i]);
  }
  return {};
}

Result<> EnsightReader::read_elements(EnsightStream& in, Part& part) {
  while (const ElementType* const type = element_type(in.peek())) {
    const std::string name = MAILLE_TRY(in.keyword());
    // Variables find a section by its name, so there must be one of each. It also bounds the number of
    // sections.
    const auto same = [&](const Section& section) { return section.name == name; };
    if (std::any_of(part.sections.begin(), part.sections.end(), same))
      return in.malformed("the elements " + name + " of a part are there twice");
    const uint64_t count = MAILLE_TRY(in.count("elements"));
    const uint64_t first = cells_.count();
    if (element_ids_there_) MAILLE_CHECK(in.integers(count, "ids", element_ids_));
    MAILLE_CHECK(read_cells(in, part, *type, count));
    if (!element_ids_there_) {
      for (uint64_t i = 0; i < count; ++i)
        element_ids_.push_back(static_cast<int32_t>(first - part.first_cell + i + 1));
    }
    part.sections.push_back({name, first, count});
    shapes_.add(count, type->type, part.name);
    ghosts_.resize(ghosts_.size() + count, is_ghost(name) ? 1 : 0);
  }
  return {};
}

Result<> EnsightReader::add_nodes(EnsightStream& in, const Part& part, std::span<const int32_t> nodes) {
  MAILLE_CHECK(budget_->take(nodes.size(), sizeof(uint32_t)));
  for (const int32_t node : nodes) {
    if (node < 1 || static_cast<uint64_t>(node) > part.points)
      return in.malformed("an element uses node " + std::to_string(node) + ", but its part has nodes 1 to " +
                          std::to_string(part.points));
    cells_.nodes.push_back(static_cast<uint32_t>(part.first_point + static_cast<uint64_t>(node) - 1));
  }
  return {};
}

/// The sum of lengths, none of them below zero; none if there is one. Lengths have 31 bits and are in the
/// file, so the sum cannot overflow.
std::optional<uint64_t> sum_of(std::span<const int32_t> lengths) {
  uint64_t sum = 0;
  for (const int32_t length : lengths) {
    if (length < 0) return std::nullopt;
    sum += static_cast<uint64_t>(length);
  }
  return sum;
}

Result<> EnsightReader::read_cells(EnsightStream& in, const Part& part, const ElementType& type,
                                   uint64_t count) {
  if (type.type == CellType::polyhedron) return read_polyhedra(in, part, count);
  std::vector<int32_t> lengths, nodes;
  if (type.type == CellType::polygon) {
    MAILLE_CHECK(in.integers(count, "numbers of nodes", lengths));
    const auto sum = sum_of(lengths);
    if (!sum) return in.malformed("an element has fewer than 0 nodes");
    MAILLE_CHECK(in.integers(*sum, "nodes of elements", nodes));
    MAILLE_CHECK(budget_->take(count, sizeof(uint64_t) + 1));
    MAILLE_CHECK(add_nodes(in, part, nodes));
    for (const int32_t length : lengths) cells_.end_cells(1, type.type, static_cast<uint64_t>(length));
    return {};
  }
  const unsigned each = nodes_of(type.type);
  // count has 31 bits, so the product fits; integers() compares it with the file.
  MAILLE_CHECK(in.integers(count * each, "nodes of elements", nodes));
  std::vector<int32_t> old(each);
  for (uint64_t i = 0; i < count && !type.order.empty(); ++i) {
    const auto cell = nodes.begin() + static_cast<ptrdiff_t>(i * each);
    std::copy_n(cell, each, old.begin());
    for (unsigned k = 0; k < each; ++k) cell[k] = old[type.order[k]];
  }
  MAILLE_CHECK(add_nodes(in, part, nodes));
  cells_.end_cells(count, type.type, each);
  return {};
}

// Lists: faces of each element, corners of each face, then all nodes. Each sum is the length of the next
// list, so the iterators below cannot run out.
Result<> EnsightReader::read_polyhedra(EnsightStream& in, const Part& part, uint64_t count) {
  std::vector<int32_t> faces, corners, nodes;
  MAILLE_CHECK(in.integers(count, "numbers of faces", faces));
  const auto face_count = sum_of(faces);
  if (!face_count) return in.malformed("an element has fewer than 0 faces");
  MAILLE_CHECK(in.integers(*face_count, "numbers of nodes of faces", corners));
  const auto corner_count = sum_of(corners);
  if (!corner_count) return in.malformed("a face has fewer than 0 nodes");
  MAILLE_CHECK(in.integers(*corner_count, "nodes of faces", nodes));
  MAILLE_CHECK(budget_->take(count + *face_count, 2 * sizeof(uint64_t) + 1));
  const uint64_t before = cells_.nodes.size();
  MAILLE_CHECK(add_nodes(in, part, nodes));
  // The store takes a cell by what was appended since the last one, so they are appended again one by one.
  std::vector<uint32_t> all(cells_.nodes.begin() + static_cast<ptrdiff_t>(before), cells_.nodes.end());
  cells_.nodes.resize(before);
  auto node = all.begin();
  auto face = corners.begin();
  for (const int32_t of_cell : faces) {
    for (int32_t i = 0; i < of_cell; ++i, ++face) {
      cells_.face_sizes.push_back(static_cast<uint32_t>(*face));
      cells_.nodes.insert(cells_.nodes.end(), node, node + *face);
      node += *face;
    }
    cells_.end_cell(CellType::polyhedron);
  }
  return {};
}

/// Reads a structured part: what its points are, then hexahedra, or quads, lines or a vertex where it is
/// thin.
Result<> EnsightReader::read_grid(EnsightStream& in, Part& part, const std::string& layout) {
  if (has_word(layout, "range"))
    return failure(ErrorCode::unsupported, in.name() + ": a part of a block (range) is not read");
  std::vector<int32_t> given;
  MAILLE_CHECK(in.integers(3, "sizes of the block", given));
  uint64_t sizes[3], points = 1;
  for (size_t axis = 0; axis < 3; ++axis) {
    if (given[axis] < 1)
      return in.malformed("a block has " + std::to_string(given[axis]) + " points along an axis");
    sizes[axis] = static_cast<uint64_t>(given[axis]);
    // Below 2^32 times 2^31, before it is compared.
    points *= sizes[axis];
    if (points > max_points) return in.malformed("there are 2^32 points or more");
  }
  part.points = points;
  MAILLE_CHECK(read_grid_points(in, layout, sizes));
  MAILLE_CHECK(add_grid_cells(part, sizes));
  return read_grid_flags(in, layout, part, part.sections[0].count);
}

Result<> EnsightReader::read_grid_points(EnsightStream& in, const std::string& layout,
                                         std::span<const uint64_t> sizes) {
  const uint64_t points = sizes[0] * sizes[1] * sizes[2];
  std::vector<float> values;
  const bool uniform = has_word(layout, "uniform");
  if (!uniform && !has_word(layout, "rectilinear")) {
    MAILLE_CHECK(in.floats(3 * points, "coordinates", values));
    return add_points(in, values, points);
  }
  if (positions_.size() / 3 + points > max_points) return in.malformed("there are 2^32 points or more");
  MAILLE_CHECK(in.floats(uniform ? 6 : sizes[0] + sizes[1] + sizes[2], "coordinates of the block", values));
  MAILLE_CHECK(budget_->take(points, 3 * sizeof(float)));
  // In floats, which is all that the file has.
  const auto coordinate = [&](size_t axis, uint64_t i) {
    if (uniform) return values[axis] + values[axis + 3] * static_cast<float>(i);
    const uint64_t first = axis == 0 ? 0 : axis == 1 ? sizes[0] : sizes[0] + sizes[1];
    return values[first + i];
  };
  for (uint64_t i = 0; i < points; ++i) {
    const uint64_t at[3] = {i % sizes[0], i / sizes[0] % sizes[1], i / sizes[0] / sizes[1]};
    for (size_t axis = 0; axis < 3; ++axis) positions_.push_back(coordinate(axis, at[axis]));
  }
  return {};
}

// Axes with one point are left out, so a grid of n x 1 x m points is one of quads. VTK's order of corners:
// around the lower side, then around the upper one.
Result<> EnsightReader::add_grid_cells(Part& part, std::span<const uint64_t> sizes) {
  const uint64_t strides[] = {1, sizes[0], sizes[0] * sizes[1]};
  std::vector<std::pair<uint64_t, uint64_t>> axes;  // cells along it, and the step to the next point
  for (size_t axis = 0; axis < 3; ++axis) {
    if (sizes[axis] > 1) axes.emplace_back(sizes[axis] - 1, strides[axis]);
  }
  const size_t nodes = size_t{1} << axes.size();
  static constexpr CellType types[] = {CellType::vertex, CellType::line, CellType::quad,
                                       CellType::hexahedron};
  const CellType type = types[axes.size()];
  axes.resize(3, {1, 0});
  const uint64_t cells = axes[0].first * axes[1].first * axes[2].first;
  MAILLE_CHECK(budget_->take(cells, nodes * sizeof(uint32_t) + 2 + sizeof(int32_t)));
  const uint64_t a = axes[0].second, b = axes[1].second, c = axes[2].second;
  const uint64_t steps[8] = {0, a, a + b, b, c, a + c, a + b + c, b + c};
  for (uint64_t cell = 0; cell < cells; ++cell) {
    const uint64_t i = cell % axes[0].first, j = cell / axes[0].first % axes[1].first,
                   k = cell / axes[0].first / axes[1].first;
    const uint64_t first = part.first_point + i * a + j * b + k * c;
    for (size_t n = 0; n < nodes; ++n) cells_.nodes.push_back(static_cast<uint32_t>(first + steps[n]));
  }
  part.sections.push_back({"block", cells_.count(), cells});
  cells_.end_cells(cells, type, nodes);
  shapes_.add(cells, type, part.name);
  return {};
}

/// Reads what may stand behind a grid: which points are blanked out, which cells are ghosts, ids. Each of
/// them at most once, in any order; the loop ends at anything else.
Result<> EnsightReader::read_grid_flags(EnsightStream& in, const std::string& layout, const Part& part,
                                        uint64_t cells) {
  if (has_word(layout, "iblanked")) {
    blanks_.resize(part.first_point, 1);
    MAILLE_CHECK(in.integers(part.points, "blanking of points", blanks_));
  }
  std::vector<int32_t> ghosts;
  bool nodes = false, elements = false;
  for (std::string next = in.peek();; next = in.peek()) {
    if (next == "ghost_flags" && ghosts.empty()) {
      MAILLE_CHECK(in.keyword());
      MAILLE_CHECK(in.integers(cells, "flags of ghosts", ghosts));
    } else if ((next == "node_ids" && !nodes) || (next == "element_ids" && !elements)) {
      MAILLE_CHECK(in.keyword());
      const bool of_nodes = next == "node_ids";
      (of_nodes ? nodes : elements) = true;
      MAILLE_CHECK(read_ids(in, true, of_nodes ? part.points : cells, of_nodes ? node_ids_ : element_ids_));
    } else {
      break;
    }
  }
  if (!nodes) MAILLE_CHECK(read_ids(in, false, part.points, node_ids_));
  if (!elements) MAILLE_CHECK(read_ids(in, false, cells, element_ids_));
  ghosts.resize(cells, 0);
  for (const int32_t ghost : ghosts) ghosts_.push_back(ghost != 0 ? 1 : 0);
  return {};
}

void EnsightReader::finish_geometry() {
  Mesh& mesh = result_.mesh;
  const uint64_t points = positions_.size() / 3;
  mesh.points.resize(points);
  std::copy(positions_.begin(), positions_.end(), mesh.points.values<float>().begin());
  positions_ = {};
  mesh.blocks = shapes_.take(cells_);
  if (keep_node_ids_) add_ids("ensight:node", Domain::point, node_ids_);
  if (keep_element_ids_) add_ids("ensight:element", Domain::cell, element_ids_);
  if (!blanks_.empty()) {
    blanks_.resize(points, 1);
    Array blank = make_array("ensight:iblank", Domain::point, Scalar::i32, 1);
    blank.resize(points);
    std::copy(blanks_.begin(), blanks_.end(), blank.values<int32_t>().begin());
    mesh.arrays.push_back(std::move(blank));
  }
  if (std::find(ghosts_.begin(), ghosts_.end(), 1) == ghosts_.end()) return;
  Array ghost = make_array("vtkGhostType", Domain::cell, Scalar::u8, 1);
  ghost.resize(ghosts_.size());
  std::copy(ghosts_.begin(), ghosts_.end(), ghost.values<uint8_t>().begin());
  mesh.arrays.push_back(std::move(ghost));
}

/// Keeps ids as an array, unless every part counts from 1.
void EnsightReader::add_ids(const char* name, Domain domain, const std::vector<int32_t>& ids) {
  bool plain = true;
  for (const auto& [number, part] : parts_) {
    uint64_t cells = 0;
    for (const Section& section : part.sections) cells += section.count;
    const uint64_t first = domain == Domain::point ? part.first_point : part.first_cell;
    const uint64_t count = domain == Domain::point ? part.points : cells;
    for (uint64_t i = 0; i < count && plain; ++i) plain = ids[first + i] == static_cast<int64_t>(i) + 1;
  }
  if (plain) return;
  Array array = make_array(name, domain, Scalar::i32, 1);
  array.resize(ids.size());
  std::copy(ids.begin(), ids.end(), array.values<int32_t>().begin());
  result_.mesh.arrays.push_back(std::move(array));
}

/// Reads a variable into an array of the whole mesh: NaN where a part, or elements of it, have no values.
Result<> EnsightReader::read_variable(const EnsightVariable& variable, size_t file) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(*files_[file].source));
  EnsightStream in = MAILLE_TRY(open_stream(files_[file], input));
  MAILLE_CHECK(in.line());
  const Domain domain = variable.on_points ? Domain::point : Domain::cell;
  const uint64_t count = result_.mesh.count_of(domain);
  Array array = make_array(variable.name, domain, Scalar::f32, variable.components);
  MAILLE_CHECK(budget_->take(count, array.tuple_size()));
  array.resize(count);
  const std::span<float> values = array.values<float>();
  std::fill(values.begin(), values.end(), std::numeric_limits<float>::quiet_NaN());
  std::set<int32_t> seen;
  while (!in.at_end() && !ends_step(in.peek())) {
    const std::string word = MAILLE_TRY(in.keyword());
    if (word != "part")
      return in.malformed("there should be a part, but found \"" + word.substr(0, 40) + "\"");
    const int32_t number = MAILLE_TRY(in.part_number());
    const auto part = parts_.find(number);
    if (part == parts_.end())
      return in.malformed("there is no part " + std::to_string(number) + " in the geometry");
    if (!seen.insert(number).second)
      return in.malformed("part " + std::to_string(number) + " is there twice");
    MAILLE_CHECK(read_values(in, variable, part->second, values));
  }
  result_.mesh.arrays.push_back(std::move(array));
  return {};
}

Result<> EnsightReader::read_values(EnsightStream& in, const EnsightVariable& variable, const Part& part,
                                    std::span<float> values) {
  const unsigned components = variable.components;
  std::set<std::string> seen;
  for (;;) {
    const std::string header = in.peek();
    const std::string name = header.substr(0, header.find(' '));
    const auto is_it = [&](const Section& section) { return section.name == name; };
    const auto section = std::find_if(part.sections.begin(), part.sections.end(), is_it);
    const bool of_points = variable.on_points && (name == "coordinates" || name == "block");
    if (!of_points && (variable.on_points || section == part.sections.end())) return {};
    MAILLE_CHECK(in.keyword());
    if (!seen.insert(name).second) return in.malformed("values of \"" + name + "\" are there twice");
    const uint64_t first = of_points ? part.first_point : section->first;
    const uint64_t count = of_points ? part.points : section->count;
    MAILLE_CHECK(fill(in, header, count, values.subspan(first * components, count * components), components));
  }
}

/// Reads the values of one section. They come one component after the other. Values equal to the header's
/// "undef" are none (NaN); with "partial" a list of the elements that have values comes before them.
Result<> EnsightReader::fill(EnsightStream& in, const std::string& header, uint64_t count,
                             std::span<float> values, unsigned components) {
  std::vector<float> undefined, read;
  std::vector<int32_t> list;
  const bool partial = has_word(header, "partial");
  if (has_word(header, "undef")) MAILLE_CHECK(in.floats(1, "value that is none", undefined));
  const uint64_t given = partial ? MAILLE_TRY(in.count("values")) : count;
  if (partial) MAILLE_CHECK(in.integers(given, "numbers of elements", list));
  MAILLE_CHECK(in.floats(given * components, "values", read));
  for (uint64_t i = 0; i < given; ++i) {
    if (partial && (list[i] < 1 || static_cast<uint64_t>(list[i]) > count))
      return in.malformed("there is a value of element " + std::to_string(list[i]) + " of " +
                          std::to_string(count));
    const uint64_t to = partial ? static_cast<uint64_t>(list[i]) - 1 : i;
    for (unsigned k = 0; k < components; ++k) {
      const float value = read[k * given + i];
      // Of a symmetric tensor EnSight has 13 before 23, VTK has it behind: 4 and 5 change places.
      const unsigned at = components == 6 && k >= 4 ? 9 - k : k;
      if (undefined.empty() || value != undefined[0]) values[to * components + at] = value;
    }
  }
  return {};
}

void EnsightReader::add_constant(const EnsightConstant& constant) {
  Array array = make_array(constant.name, Domain::mesh, Scalar::f64, 1);
  array.resize(constant.values.size());
  std::copy(constant.values.begin(), constant.values.end(), array.values<double>().begin());
  result_.mesh.arrays.push_back(std::move(array));
}

Result<EnsightCase> case_of(const Source& source) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  return read_ensight_case(input.text(), source.name());
}

/// Reads the last step, as readers of other formats with steps do.
Result<ReadResult> read_ensight(const Source& source, const ReadOptions& options) {
  EnsightCase parsed = MAILLE_TRY(case_of(source));
  const size_t steps = parsed.times().size();
  if (steps > 1)
    parsed.notes.push_back("the mesh and its arrays are those of the last of " + std::to_string(steps) +
                           " time steps");
  return EnsightReader(source, std::move(parsed), options).read(std::nullopt);
}

Result<std::vector<std::string>> write_ensight(const Mesh&, Sink& sink, const WriteOptions&) {
  return failure(ErrorCode::usage, sink.name() + ": EnSight files cannot be written; write .vtu");
}

}  // namespace

Result<ReadResult> read_ensight_step(const Source& source, const ReadOptions& options, uint64_t step) {
  EnsightCase parsed = MAILLE_TRY(case_of(source));
  const std::vector<double> times = parsed.times();
  if (step >= times.size())
    return failure(ErrorCode::usage, source.name() + ": there is no step " + std::to_string(step) +
                                         "; it has " + counted(times.size(), "step"));
  return EnsightReader(source, std::move(parsed), options).read(times[static_cast<size_t>(step)]);
}

Result<std::vector<double>> ensight_times(const Source& source) {
  return MAILLE_TRY(case_of(source)).times();
}

const Format& ensight_format() {
  static const Format format{
      {"ensight", {".case", ".encas"}, "EnSight Gold, results of solvers; reading only", false, false},
      recognise_ensight,
      read_ensight,
      write_ensight};
  return format;
}

}  // namespace maille
