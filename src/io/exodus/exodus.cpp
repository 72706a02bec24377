// Exodus II, the format of Sandia's codes, in netCDF files: element blocks and side sets become blocks with
// names, node sets arrays of 0 and 1, variables of the last time step arrays. Source: Schoof and Yarberry,
// "EXODUS II: A Finite Element Data Model", SAND92-2137, whose names of variables and orders of nodes these
// are.
#include <algorithm>
#include <cctype>
#include <cstring>
#include <limits>
#include <optional>

#include "io/cell_store.h"
#include "io/exodus/exodus.h"
#include "io/exodus/netcdf.h"
#include "io/format.h"
#include "io/hdf5/hdf5_file.h"
#include "io/reading.h"

namespace maille {
namespace {

// Node i of VTK's cell is node order[i] of the element. Exodus has the upright edges before those on top, and
// the centre before the faces; and it sees the triangle 0 1 2 of a wedge from inside.
constexpr uint8_t hex20[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15};
constexpr uint8_t hex27[] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 16, 17,
                             18, 19, 12, 13, 14, 15, 23, 24, 25, 26, 21, 22, 20};
constexpr uint8_t wedge6[] = {0, 2, 1, 3, 5, 4};
constexpr uint8_t wedge15[] = {0, 2, 1, 3, 5, 4, 8, 7, 6, 14, 13, 12, 9, 11, 10};

struct ElementType {
  const char* name;  ///< the first three letters
  uint64_t nodes;
  CellType type;
  std::span<const uint8_t> order;
};
constexpr ElementType element_types[] = {{"SPH", 1, CellType::vertex, {}},
                                         {"CIR", 1, CellType::vertex, {}},
                                         {"BAR", 2, CellType::line, {}},
                                         {"BEA", 2, CellType::line, {}},
                                         {"TRU", 2, CellType::line, {}},
                                         {"EDG", 2, CellType::line, {}},
                                         {"BAR", 3, CellType::quadratic_edge, {}},
                                         {"BEA", 3, CellType::quadratic_edge, {}},
                                         {"TRI", 3, CellType::triangle, {}},
                                         {"TRI", 6, CellType::quadratic_triangle, {}},
                                         {"QUA", 4, CellType::quad, {}},
                                         {"SHE", 4, CellType::quad, {}},
                                         {"SHE", 3, CellType::triangle, {}},
                                         {"QUA", 8, CellType::quadratic_quad, {}},
                                         {"SHE", 8, CellType::quadratic_quad, {}},
                                         {"QUA", 9, CellType::biquadratic_quad, {}},
                                         {"SHE", 9, CellType::biquadratic_quad, {}},
                                         {"TET", 4, CellType::tetrahedron, {}},
                                         {"TET", 10, CellType::quadratic_tetrahedron, {}},
                                         {"HEX", 8, CellType::hexahedron, {}},
                                         {"HEX", 20, CellType::quadratic_hexahedron, hex20},
                                         {"HEX", 27, CellType::triquadratic_hexahedron, hex27},
                                         {"WED", 6, CellType::wedge, wedge6},
                                         {"WED", 15, CellType::quadratic_wedge, wedge15},
                                         {"PYR", 5, CellType::pyramid, {}},
                                         {"PYR", 13, CellType::quadratic_pyramid, {}}};

/// The sides of elements as places among the corners of the element, in Exodus's order, each seen from
/// outside. Of elements with nodes on edges the sides have the corners only.
struct Sides {
  CellType type;
  std::vector<std::vector<uint8_t>> corners;
};

/// Nothing for elements that have no sides of faces or lines here, such as bars.
const std::vector<std::vector<uint8_t>>* sides_of(CellType type) {
  static const Sides table[] = {
      {CellType::hexahedron,
       {{0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {0, 4, 7, 3}, {0, 3, 2, 1}, {4, 5, 6, 7}}},
      {CellType::tetrahedron, {{0, 1, 3}, {1, 2, 3}, {0, 3, 2}, {0, 2, 1}}},
      {CellType::wedge, {{0, 1, 4, 3}, {1, 2, 5, 4}, {0, 3, 5, 2}, {0, 2, 1}, {3, 4, 5}}},
      {CellType::pyramid, {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {0, 4, 3}, {0, 3, 2, 1}}},
      {CellType::quad, {{0, 1}, {1, 2}, {2, 3}, {3, 0}}},
      {CellType::triangle, {{0, 1}, {1, 2}, {2, 0}}}};
  const auto linear = [](CellType of) {
    switch (of) {
      case CellType::quadratic_hexahedron:
      case CellType::triquadratic_hexahedron:
        return CellType::hexahedron;
      case CellType::quadratic_tetrahedron:
        return CellType::tetrahedron;
      case CellType::quadratic_wedge:
        return CellType::wedge;
      case CellType::quadratic_pyramid:
        return CellType::pyramid;
      case CellType::quadratic_quad:
      case CellType::biquadratic_quad:
        return CellType::quad;
      case CellType::quadratic_triangle:
        return CellType::triangle;
      default:
        return of;
    }
  };
  for (const Sides& sides : table) {
    if (sides.type == linear(type)) return &sides.corners;
  }
  return nullptr;
}

/// Reads a file in the order in which things refer to each other: points, blocks, side sets (faces of
/// elements), then arrays. Elements of all blocks are numbered through, as side sets and maps refer to them;
/// the faces of side sets are cells behind all of them, with NaN or 0 in arrays on elements.
class ExodusReader {
 public:
  /// `step`: whose variables are read; without one, the last.
  ExodusReader(const NetcdfFile& file, uint64_t bytes, const ReadOptions& options,
               std::optional<uint64_t> step)
      : file_(file),
        name_(file.name()),
        budget_(name_, bytes, options.limits),
        most_sets_(bytes / 16),
        wanted_(step) {}

  Result<ReadResult> read();

 private:
  Result<> read_points();
  Result<> read_blocks();
  Result<> read_block(uint64_t number, const std::string& name);
  Result<> read_side_sets();
  Result<> read_side_set(uint64_t number, const std::string& name);
  Result<> read_node_sets();
  Result<> read_numbers(const char* variable, const char* name, Domain domain, uint64_t count);
  Result<> read_point_table(const NetcdfFile::Variable& table, const std::vector<std::string>& names);
  Result<> read_point_variables();
  Result<> read_cell_variables();
  Result<> read_globals();
  Result<Array> nowhere(const std::string& name, Scalar type);
  tl::unexpected<Error> malformed(const std::string& what) const {
    return failure(ErrorCode::malformed_input, name_ + ": " + what);
  }

  const NetcdfFile& file_;
  std::string name_;
  Budget budget_;
  // Each set needs a variable with a name, which takes 16 bytes of the file or more: a claimed number is cut
  // to that.
  uint64_t most_sets_;  ///< each needs a variable with a name
  Mesh mesh_;
  std::optional<uint64_t> wanted_;
  uint64_t points_ = 0, elements_ = 0, steps_ = 0;
  uint64_t step_ = 0;  ///< that is read, if there are any
  CellStore cells_;
  std::vector<NamedRun> shapes_;
  /// For each element, where its nodes in Exodus's order begin in `nodes_`: sides refer to that order.
  std::vector<uint64_t> first_node_;
  std::vector<uint32_t> nodes_;
  std::vector<uint64_t> block_cells_;
  std::vector<std::string> notes_;
};

Result<> ExodusReader::read_points() {
  points_ = file_.dimension("num_nodes");
  const uint64_t dimension = file_.dimension("num_dim");
  if (dimension < 1 || dimension > 3 || points_ > max_points)
    return malformed("it has no dimension num_dim of 1 to 3, or 2^32 nodes");
  static constexpr const char* names[] = {"coordx", "coordy", "coordz"};
  Array axes[3];
  // Older files have one table "coord" of all x, all y, all z; newer ones a variable for each axis.
  const NetcdfFile::Variable* const all = file_.find("coord");
  const NetcdfFile::Variable* const first = all != nullptr ? all : file_.find(names[0]);
  if (first == nullptr) {
    if (points_ != 0) return malformed("it has nodes but no coordinates");
    return {};
  }
  if (!is_float(first->type)) return malformed("its coordinates are not floating-point");
  mesh_.points.type = first->type;
  const size_t size = size_of(first->type);
  for (size_t k = 0; k < dimension; ++k) {
    const NetcdfFile::Variable* const variable = all != nullptr ? all : file_.find(names[k]);
    if (variable == nullptr || variable->type != first->type)
      return malformed(std::string(names[k]) + " is missing or of another type");
    // The one table is read once; the variables of axes one after the other.
    if (all == nullptr || k == 0)
      axes[k] =
          MAILLE_TRY(file_.read(*variable, 0, make_array(names[k], Domain::mesh, first->type, 1), budget_));
    const Array& axis = all != nullptr ? axes[0] : axes[k];
    if (axis.count() != (all != nullptr ? dimension * points_ : points_))
      return malformed("there are not as many coordinates as nodes");
    if (k == 0) {
      MAILLE_CHECK(budget_.take(points_, 3 * size));
      mesh_.points.resize(points_);
    }
    const std::byte* from = axis.bytes.data() + (all != nullptr ? k * points_ * size : 0);
    for (uint64_t i = 0; i < points_; ++i)
      std::copy_n(from + i * size, size, mesh_.points.bytes.data() + (3 * i + k) * size);
  }
  return {};
}

/// Variables are counted from 1 in their names: "connect1", "vals_nod_var3".
std::string numbered(const std::string& name, uint64_t number) {
  return name + std::to_string(number + 1);
}

/// The names of a table where there are some, otherwise "KIND ID".
Result<std::vector<std::string>> names_of(const NetcdfFile& file, const char* table, const char* ids,
                                          const std::string& kind, uint64_t count, Budget& budget) {
  std::vector<std::string> names = MAILLE_TRY(file.strings(table, budget));
  const std::vector<int64_t> numbers = MAILLE_TRY(file.integers(ids, budget));
  for (uint64_t i = 0; i < count; ++i) {
    if (i == names.size()) names.emplace_back();
    if (names[i].empty())
      names[i] = kind + " " + std::to_string(i < numbers.size() ? numbers[i] : static_cast<int64_t>(i) + 1);
  }
  return names;
}

Result<> ExodusReader::read_block(uint64_t number, const std::string& name) {
  const std::string key = numbered("connect", number);
  const NetcdfFile::Variable* const variable = file_.find(key);
  // Blocks without elements have no connectivity.
  block_cells_.push_back(0);
  if (variable == nullptr || variable->shape.size() != 2 || variable->has_records) {
    if (file_.dimension(numbered("num_el_in_blk", number)) != 0)
      return malformed("\"" + key + "\" is missing or no table");
    return {};
  }
  const auto text = variable->texts.find("elem_type");
  // Programs write "HEX", "HEX8" or "hexahedron"; three letters and the number of nodes tell the type.
  std::string kind = text == variable->texts.end() ? "" : text->second.substr(0, 3);
  for (char& c : kind) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  const uint64_t nodes = variable->shape[1];
  const auto known =
      std::find_if(std::begin(element_types), std::end(element_types),
                   [&](const ElementType& type) { return type.nodes == nodes && kind == type.name; });
  if (known == std::end(element_types)) {
    return failure(ErrorCode::unsupported, name_ + ": elements \"" + kind + "...\" of " +
                                               std::to_string(nodes) + " nodes cannot be read");
  }
  const std::vector<int64_t> values = MAILLE_TRY(file_.integers(key, budget_));
  MAILLE_CHECK(budget_.take(values.size(), 2 * sizeof(uint32_t)));
  for (const int64_t value : values) {
    if (value < 1 || static_cast<uint64_t>(value) > points_)
      return malformed("\"" + key + "\" uses node " + std::to_string(value) + ", but there are " +
                       std::to_string(points_));
    nodes_.push_back(static_cast<uint32_t>(value - 1));
  }
  const uint64_t cells = values.size() / nodes;
  // The type was found by its number of nodes, so `nodes` is not 0 and divides the count.
  const uint32_t* from = nodes_.data() + nodes_.size() - values.size();
  for (uint64_t i = 0; i < cells; ++i, from += nodes) {
    first_node_.push_back(static_cast<uint64_t>(from - nodes_.data()));
    for (uint64_t k = 0; k < nodes; ++k)
      cells_.nodes.push_back(from[known->order.empty() ? k : known->order[k]]);
  }
  cells_.end_cells(cells, known->type, nodes);
  shapes_.push_back({cells, known->type, name});
  block_cells_.back() = cells;
  return {};
}

Result<> ExodusReader::read_blocks() {
  const uint64_t count = file_.dimension("num_el_blk");
  const std::vector<std::string> names = MAILLE_TRY(
      names_of(file_, "eb_names", "eb_prop1", "block", std::min<uint64_t>(count, most_sets_), budget_));
  for (uint64_t b = 0; b < count && b < names.size(); ++b) MAILLE_CHECK(read_block(b, names[b]));
  elements_ = cells_.count();
  return {};
}

Result<> ExodusReader::read_side_set(uint64_t number, const std::string& name) {
  const std::vector<int64_t> elements = MAILLE_TRY(file_.integers(numbered("elem_ss", number), budget_));
  const std::vector<int64_t> sides = MAILLE_TRY(file_.integers(numbered("side_ss", number), budget_));
  if (elements.size() != sides.size())
    return malformed("side set \"" + name + "\" has not as many sides as elements");
  uint64_t missing = 0;
  CellType last = CellType::mixed;
  for (size_t i = 0; i < elements.size(); ++i) {
    if (elements[i] < 1 || static_cast<uint64_t>(elements[i]) > elements_)
      return malformed("side set \"" + name + "\" uses element " + std::to_string(elements[i]) +
                       ", but there are " + std::to_string(elements_));
    const auto element = static_cast<uint64_t>(elements[i]) - 1;
    const auto* const corners = sides_of(cells_.type(element));
    const int64_t side = sides[i] - 1;
    if (corners == nullptr || side < 0 || static_cast<size_t>(side) >= corners->size()) {
      ++missing;
      continue;
    }
    const auto& places = (*corners)[static_cast<size_t>(side)];
    for (const uint8_t place : places) cells_.nodes.push_back(nodes_[first_node_[element] + place]);
    const CellType type = places.size() == 2   ? CellType::line
                          : places.size() == 3 ? CellType::triangle
                                               : CellType::quad;
    cells_.end_cells(1, type, places.size());
    // `last` is mixed until this set has its first face, so sets of one name make blocks of their own.
    if (last == CellType::mixed || shapes_.back().name != name) {
      shapes_.push_back({0, type, name});
    } else if (type != last) {
      shapes_.back().type = CellType::mixed;
    }
    ++shapes_.back().cells;
    last = type;
  }
  if (missing != 0)
    notes_.push_back(counted(missing, "side") + " of side set \"" + name +
                     "\" left out: their elements have no such sides");
  return {};
}

Result<> ExodusReader::read_side_sets() {
  const uint64_t count = std::min<uint64_t>(file_.dimension("num_side_sets"), most_sets_);
  const std::vector<std::string> names =
      MAILLE_TRY(names_of(file_, "ss_names", "ss_prop1", "side set", count, budget_));
  for (uint64_t s = 0; s < count; ++s) MAILLE_CHECK(read_side_set(s, names[s]));
  return {};
}

Result<> ExodusReader::read_node_sets() {
  const uint64_t count = std::min<uint64_t>(file_.dimension("num_node_sets"), most_sets_);
  const std::vector<std::string> names =
      MAILLE_TRY(names_of(file_, "ns_names", "ns_prop1", "node set", count, budget_));
  // Sets are members of a list; as 0 and 1 on all nodes they survive in any format that has arrays on points.
  for (uint64_t s = 0; s < count; ++s) {
    const std::vector<int64_t> nodes = MAILLE_TRY(file_.integers(numbered("node_ns", s), budget_));
    MAILLE_CHECK(budget_.take(points_, 1));
    Array array = make_array(names[s], Domain::point, Scalar::u8, 1);
    array.resize(points_);
    for (const int64_t node : nodes) {
      if (node < 1 || static_cast<uint64_t>(node) > points_)
        return malformed("node set \"" + names[s] + "\" uses node " + std::to_string(node) +
                         ", but there are " + std::to_string(points_));
      array.bytes[static_cast<size_t>(node) - 1] = std::byte{1};
    }
    mesh_.arrays.push_back(std::move(array));
  }
  return {};
}

/// Keeps the numbers of nodes or elements where they are not 1 to n; faces of side sets have 0.
Result<> ExodusReader::read_numbers(const char* variable, const char* name, Domain domain, uint64_t count) {
  const std::vector<int64_t> numbers = MAILLE_TRY(file_.integers(variable, budget_));
  if (numbers.size() != count) return {};
  bool in_order = true;
  for (size_t i = 0; i < numbers.size(); ++i)
    in_order = in_order && numbers[i] == static_cast<int64_t>(i) + 1;
  if (in_order) return {};
  Array array = make_array(name, domain, Scalar::i64, 1);
  // Faces of side sets are cells, too, so there may be many more of these than numbers.
  const uint64_t all = domain == Domain::point ? points_ : cells_.count();
  MAILLE_CHECK(budget_.take(all, array.tuple_size()));
  array.resize(all);
  std::copy(numbers.begin(), numbers.end(), array.values<int64_t>().begin());
  mesh_.arrays.push_back(std::move(array));
  return {};
}

/// The older layout: one table of all variables of nodes for each step of time.
Result<> ExodusReader::read_point_table(const NetcdfFile::Variable& table,
                                        const std::vector<std::string>& names) {
  const Array all =
      MAILLE_TRY(file_.read(table, step_, make_array("", Domain::mesh, table.type, 1), budget_));
  if (all.count() != names.size() * points_)
    return malformed("\"vals_nod_var\" has not as many values as there are variables of nodes");
  MAILLE_CHECK(budget_.take(all.bytes.size(), 1));
  const size_t size = points_ * all.tuple_size();
  for (size_t v = 0; v < names.size(); ++v) {
    Array array = make_array(names[v], Domain::point, all.type, 1);
    const auto from = all.bytes.begin() + static_cast<ptrdiff_t>(v * size);
    array.bytes.assign(from, from + static_cast<ptrdiff_t>(size));
    mesh_.arrays.push_back(std::move(array));
  }
  return {};
}

Result<> ExodusReader::read_point_variables() {
  const std::vector<std::string> names = MAILLE_TRY(file_.strings("name_nod_var", budget_));
  const NetcdfFile::Variable* const table = file_.find("vals_nod_var");
  if (steps_ != 0 && table != nullptr && table->has_records && table->shape.size() == 3)
    return read_point_table(*table, names);
  for (uint64_t v = 0; steps_ != 0 && v < names.size(); ++v) {
    const NetcdfFile::Variable* const variable = file_.find(numbered("vals_nod_var", v));
    if (variable == nullptr || !variable->has_records) {
      notes_.push_back("variable \"" + names[v] + "\" of nodes left out: it has no values of its own");
      continue;
    }
    Array array = MAILLE_TRY(
        file_.read(*variable, step_, make_array(names[v], Domain::point, variable->type, 1), budget_));
    if (array.count() != points_)
      return malformed("variable \"" + names[v] + "\" has not as many values as there are nodes");
    mesh_.arrays.push_back(std::move(array));
  }
  return {};
}

/// An array of all cells that is NaN everywhere, and that blocks with values fill in.
Result<Array> ExodusReader::nowhere(const std::string& name, Scalar type) {
  Array array = make_array(name, Domain::cell, type, 1);
  MAILLE_CHECK(budget_.take(cells_.count(), array.tuple_size()));
  array.resize(cells_.count());
  if (type == Scalar::f32) {
    for (float& value : array.values<float>()) value = std::numeric_limits<float>::quiet_NaN();
  } else {
    for (double& value : array.values<double>()) value = std::numeric_limits<double>::quiet_NaN();
  }
  return array;
}

/// Elements of blocks where the variable is not defined, and faces of side sets, have NaN.
Result<> ExodusReader::read_cell_variables() {
  const std::vector<std::string> names = MAILLE_TRY(file_.strings("name_elem_var", budget_));
  for (uint64_t v = 0; steps_ != 0 && v < names.size(); ++v) {
    Array array;
    uint64_t first = 0;
    for (uint64_t b = 0; b < block_cells_.size(); first += block_cells_[b], ++b) {
      const NetcdfFile::Variable* const variable =
          file_.find(numbered(numbered("vals_elem_var", v) + "eb", b));
      if (variable == nullptr || !variable->has_records || !is_float(variable->type)) continue;
      if (array.bytes.empty()) array = MAILLE_TRY(nowhere(names[v], variable->type));
      if (variable->type != array.type) return malformed("variable \"" + names[v] + "\" has several types");
      const Array values = MAILLE_TRY(
          file_.read(*variable, step_, make_array(names[v], Domain::cell, variable->type, 1), budget_));
      if (values.count() != block_cells_[b]) {
        return malformed("variable \"" + names[v] + "\" has not as many values as its block has elements");
      }
      std::copy(values.bytes.begin(), values.bytes.end(),
                array.bytes.begin() + static_cast<ptrdiff_t>(first * array.tuple_size()));
    }
    if (array.bytes.empty()) continue;
    mesh_.arrays.push_back(std::move(array));
  }
  return {};
}

Result<> ExodusReader::read_globals() {
  if (steps_ == 0) return {};
  if (const NetcdfFile::Variable* const time = file_.find("time_whole");
      time != nullptr && time->has_records) {
    mesh_.arrays.push_back(
        MAILLE_TRY(file_.read(*time, step_, make_array("TimeValue", Domain::mesh, time->type, 1), budget_)));
  }
  const std::vector<std::string> names = MAILLE_TRY(file_.strings("name_glo_var", budget_));
  const NetcdfFile::Variable* const variable = file_.find("vals_glo_var");
  if (variable != nullptr && variable->has_records && variable->count() == names.size()) {
    const Array all =
        MAILLE_TRY(file_.read(*variable, step_, make_array("", Domain::mesh, variable->type, 1), budget_));
    for (size_t i = 0; i < names.size(); ++i) {
      Array one = make_array(names[i], Domain::mesh, all.type, 1);
      const auto at = all.bytes.begin() + static_cast<ptrdiff_t>(i * all.tuple_size());
      one.bytes.assign(at, at + static_cast<ptrdiff_t>(all.tuple_size()));
      mesh_.arrays.push_back(std::move(one));
    }
  }
  if (steps_ > 1 && !wanted_)
    notes_.push_back("variables are those of the last of " + std::to_string(steps_) + " time steps");
  return {};
}

Result<ReadResult> ExodusReader::read() {
  steps_ = file_.dimension("time_step");
  if (wanted_ && *wanted_ >= steps_)
    return failure(ErrorCode::usage, name_ + ": there are " + std::to_string(steps_) + " time steps");
  step_ = wanted_.value_or(steps_ == 0 ? 0 : steps_ - 1);
  MAILLE_CHECK(read_points());
  MAILLE_CHECK(read_blocks());
  MAILLE_CHECK(read_side_sets());
  MAILLE_CHECK(read_numbers("node_num_map", "exodus:node", Domain::point, points_));
  MAILLE_CHECK(read_node_sets());
  MAILLE_CHECK(read_point_variables());
  MAILLE_CHECK(read_numbers("elem_num_map", "exodus:element", Domain::cell, elements_));
  MAILLE_CHECK(read_cell_variables());
  MAILLE_CHECK(read_globals());
  mesh_.blocks = cells_.take(shapes_);
  return ReadResult{std::move(mesh_), std::move(notes_)};
}

bool is_netcdf(Bytes bytes) {
  return bytes.size() >= 4 && std::memcmp(bytes.data(), "CDF", 3) == 0 && std::to_integer<int>(bytes[3]) <= 5;
}

Result<std::unique_ptr<NetcdfFile>> open_exodus(const Source& source) {
  std::byte first[8] = {};
  if (source.size() >= sizeof(first)) MAILLE_CHECK(source.read_at(0, first));
  return is_hdf5(first) ? open_netcdf_hdf5(source) : open_netcdf_classic(source);
}

Result<ReadResult> read_with_step(const Source& source, const ReadOptions& options,
                                  std::optional<uint64_t> step) {
  const std::unique_ptr<NetcdfFile> file = MAILLE_TRY(open_exodus(source));
  return ExodusReader(*file, source.size(), options, step).read();
}

Result<ReadResult> read_exodus(const Source& source, const ReadOptions& options) {
  return read_with_step(source, options, std::nullopt);
}

Result<std::vector<std::string>> write_exodus(const Mesh&, Sink& sink, const WriteOptions&) {
  return failure(ErrorCode::usage, sink.name() + ": Exodus files cannot be written; write .vtu or .msh");
}

}  // namespace

Result<ReadResult> read_exodus_step(const Source& source, const ReadOptions& options, uint64_t step) {
  return read_with_step(source, options, step);
}

Result<std::vector<double>> exodus_times(const Source& source) {
  const std::unique_ptr<NetcdfFile> file = MAILLE_TRY(open_exodus(source));
  const NetcdfFile::Variable* const variable = file->find("time_whole");
  // Each step has a time, so the file has bytes for all of them, and read() refuses what lies behind its end:
  // the claimed number of steps ends with the file.
  const uint64_t steps = variable != nullptr && variable->has_records ? file->dimension("time_step") : 0;
  Budget budget(source.name(), source.size(), {});
  std::vector<double> times;
  for (uint64_t step = 0; step < steps; ++step) {
    const Array time =
        MAILLE_TRY(file->read(*variable, step, make_array("time", Domain::mesh, variable->type, 1), budget));
    if (time.count() != 1 || !is_float(time.type))
      return failure(ErrorCode::malformed_input, source.name() + ": its times are no numbers");
    times.push_back(time.type == Scalar::f32 ? double{time.values<float>()[0]} : time.values<double>()[0]);
  }
  return times;
}

const Format& exodus_format() {
  static const Format format{
      {"exodus", {".e", ".exo", ".ex2", ".exii"}, "Exodus II; reading only", true, false},
      is_netcdf,
      read_exodus,
      write_exodus};
  return format;
}

}  // namespace maille
