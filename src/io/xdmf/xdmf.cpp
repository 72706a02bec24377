// XDMF, versions 2 and 3: grids of cells described in XML, with values there or in files of HDF5 beside it.
// Source: "XDMF Model and Format" (xdmf.org).
#include "io/xdmf/xdmf.h"

#include <maille/with_type.h>

#include <algorithm>
#include <map>
#include <optional>
#include <pugixml.hpp>
#include <set>

#include "io/beside.h"
#include "io/cell_store.h"
#include "io/hdf5/hdf5_file.h"
#include "io/letters.h"
#include "io/numbers.h"
#include "io/reading.h"
#include "io/text_scanner.h"
#include "io/zone_fields.h"

namespace maille {
namespace {

struct ElementType {
  const char *name, *old_name;
  int64_t number;  ///< in mixed topologies
  CellType type;
  uint64_t nodes;  ///< 0: told by the file
};
// Programs do not agree on the order of nodes of quadratic wedges and hexahedra, so these are not read.
constexpr ElementType element_types[] = {
    {"polyvertex", "", 1, CellType::poly_vertex, 0},
    {"polyline", "", 2, CellType::poly_line, 0},
    {"polygon", "", 3, CellType::polygon, 0},
    {"triangle", "", 4, CellType::triangle, 3},
    {"quadrilateral", "quad", 5, CellType::quad, 4},
    {"tetrahedron", "tet", 6, CellType::tetrahedron, 4},
    {"pyramid", "", 7, CellType::pyramid, 5},
    {"wedge", "", 8, CellType::wedge, 6},
    {"hexahedron", "hex", 9, CellType::hexahedron, 8},
    {"edge_3", "", 34, CellType::quadratic_edge, 3},
    {"quadrilateral_9", "quad_9", 35, CellType::biquadratic_quad, 9},
    {"triangle_6", "tri_6", 36, CellType::quadratic_triangle, 6},
    {"quadrilateral_8", "quad_8", 37, CellType::quadratic_quad, 8},
    {"tetrahedron_10", "tet_10", 38, CellType::quadratic_tetrahedron, 10},
    {"pyramid_13", "", 39, CellType::quadratic_pyramid, 13}};

template <class Matches>
const ElementType* element_type(Matches matches) {
  const auto known = std::find_if(std::begin(element_types), std::end(element_types), matches);
  return known == std::end(element_types) ? nullptr : known;
}

/// An attribute has other names in version 2.
std::string attribute(const pugi::xml_node& node, const char* name, const char* old_name) {
  const pugi::xml_attribute found = node.attribute(name);
  return found ? found.value() : node.attribute(old_name).value();
}

bool is_collection(const pugi::xml_node& grid, std::string_view type) {
  const std::string kind = lower_case(attribute(grid, "GridType", "Type"));
  const std::string collection = lower_case(grid.attribute("CollectionType").value());
  return (kind == "collection" && (collection.empty() ? "spatial" : collection) == type) ||
         (kind == "tree" && type == "spatial");
}

/// Reads the grids of one step, each with points, cells and arrays of its own.
class XdmfReader {
 public:
  XdmfReader(const Source& source, const ReadOptions& options) : source_(source), options_(options) {}

  Result<> parse();
  Result<ReadResult> read(std::optional<uint64_t> step);
  Result<std::vector<double>> times() const;

 private:
  struct Grid {
    pugi::xml_node node, topology, geometry;
  };

  Result<> find_grids(const pugi::xml_node& node, unsigned depth);
  Result<pugi::xml_node> part_of(const pugi::xml_node& grid, const char* name) const;
  Result<> make_budget();
  Result<Array> values(const pugi::xml_node& item);
  Result<Array> values_in_text(const pugi::xml_node& item);
  Result<Array> values_in_hdf5(const std::string& text);
  Result<> read_grid(const Grid& grid);
  Result<> read_points(const Grid& grid);
  Result<> read_cells(const Grid& grid);
  Result<> read_mixed(const std::vector<int64_t>& values, const std::string& name);
  Result<> add_nodes(std::span<const int64_t> nodes);
  Result<> read_arrays(const Grid& grid);
  tl::unexpected<Error> malformed(const std::string& what) const {
    return failure(ErrorCode::malformed_input, source_.name() + ": " + what);
  }
  tl::unexpected<Error> unsupported(const std::string& what) const {
    return failure(ErrorCode::unsupported, source_.name() + ": " + what);
  }

  const Source& source_;
  const ReadOptions& options_;
  pugi::xml_document document_;
  std::map<std::string, pugi::xml_node> named_;  ///< grids
  pugi::xml_node series_;
  std::vector<Grid> grids_;  ///< that are read
  std::optional<Budget> budget_;
  std::string opened_;  ///< of files of HDF5, of which one is open at once
  std::unique_ptr<Hdf5File> file_;
  std::vector<Array> points_;  ///< by grid
  uint64_t first_point_ = 0, grid_points_ = 0, first_cell_ = 0;
  CellStore cells_;
  BlockShapes shapes_;
  ZoneFields fields_;
  Mesh mesh_;
  std::set<std::string> left_out_;
  std::vector<std::string> notes_, files_beside_;
};

Result<> XdmfReader::parse() {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source_));
  const auto parsed = document_.load_buffer(input.bytes().data(), input.bytes().size());
  if (!parsed)
    return malformed("byte " + std::to_string(parsed.offset) + ": it is no XML (" + parsed.description() +
                     ")");
  const pugi::xml_node domain = document_.child("Xdmf").child("Domain");
  if (!domain.child("Grid")) return malformed("there should be an Xdmf with a Domain and a Grid");
  for (const pugi::xml_node grid : domain.children("Grid")) {
    named_.emplace(grid.attribute("Name").value(), grid);
    if (!series_ && is_collection(grid, "temporal")) series_ = grid;
  }
  return {};
}

Result<std::vector<double>> XdmfReader::times() const {
  std::vector<double> times;
  for (const pugi::xml_node grid : series_.children("Grid")) {
    const std::string_view text = trim(grid.child("Time").attribute("Value").value());
    Number number;
    if (parse_number(text.data(), text.data() + text.size(), number) != text.data() + text.size())
      return malformed("a Grid of its series has no Time with a Value");
    times.push_back(number.value);
  }
  return times;
}

/// A part of the grid itself, or of the one whose name stands in an XInclude, as writers of series have it:
/// xpointer(//Grid[@Name="mesh"]/*[self::Topology or self::Geometry]). Nothing else of XPath is known.
Result<pugi::xml_node> XdmfReader::part_of(const pugi::xml_node& grid, const char* name) const {
  if (const pugi::xml_node part = grid.child(name)) return part;
  for (const pugi::xml_node node : grid.children()) {
    if (!std::string_view(node.name()).ends_with("include")) continue;
    const std::string_view pointer = node.attribute("xpointer").value();
    constexpr std::string_view begin = "xpointer(//Grid[@Name=";
    if (!pointer.starts_with(begin) || pointer.size() <= begin.size()) continue;
    const std::string_view rest = pointer.substr(begin.size() + 1);
    const auto found = named_.find(std::string(rest.substr(0, rest.find(pointer[begin.size()]))));
    if (found != named_.end() && found->second.child(name)) return found->second.child(name);
  }
  return malformed("grid \"" + std::string(grid.attribute("Name").value()) + "\" has no " + name);
}

Result<> XdmfReader::find_grids(const pugi::xml_node& node, unsigned depth) {
  if (is_collection(node, "spatial") && depth < 16) {
    for (const pugi::xml_node child : node.children("Grid")) MAILLE_CHECK(find_grids(child, depth + 1));
    return {};
  }
  const std::string kind = lower_case(attribute(node, "GridType", "Type"));
  if (!kind.empty() && kind != "uniform")
    return unsupported("a Grid of type \"" + kind + "\" cannot be read where it stands; Uniform can");
  const pugi::xml_node topology = MAILLE_TRY(part_of(node, "Topology"));
  const pugi::xml_node geometry = MAILLE_TRY(part_of(node, "Geometry"));
  grids_.push_back({node, topology, geometry});
  return {};
}

/// Over the sizes of all files that the grids name.
Result<> XdmfReader::make_budget() {
  uint64_t bytes = source_.size();
  std::set<std::string> files;
  const auto add = [&](const pugi::xml_node& parent) -> Result<> {
    for (const pugi::xml_node item : parent.children("DataItem")) {
      const std::string text(trim(item.text().get()));
      const std::string file = text.substr(0, text.find(':'));
      if (lower_case(item.attribute("Format").value()) != "hdf" || !files.insert(file).second) continue;
      const auto opened = MAILLE_TRY(open_beside(source_.name(), file));
      bytes += opened->size() > UINT64_MAX / 32 ? 0 : 16 * opened->size();  // packed by deflate, as VTKHDF
      files_beside_.push_back(opened->name());
    }
    return {};
  };
  for (const Grid& grid : grids_) {
    MAILLE_CHECK(add(grid.topology));
    MAILLE_CHECK(add(grid.geometry));
    for (const pugi::xml_node node : grid.node.children("Attribute")) MAILLE_CHECK(add(node));
  }
  budget_.emplace(source_.name(), bytes, options_.limits);
  return {};
}

/// The numbers of a DataItem in the order of the file, each a tuple.
Result<Array> XdmfReader::values(const pugi::xml_node& item) {
  const std::string kind = lower_case(attribute(item, "ItemType", "Type"));
  const std::string format = lower_case(item.attribute("Format").value());
  if (!item) return malformed("a DataItem is missing");
  if ((!kind.empty() && kind != "uniform") || item.attribute("Reference"))
    return unsupported("a DataItem of type \"" + kind + "\" or with a Reference cannot be read; Uniform can");
  if (format == "hdf") return values_in_hdf5(std::string(trim(item.text().get())));
  if (format.empty() || format == "xml") return values_in_text(item);
  return unsupported("a DataItem of format \"" + format + "\" cannot be read; XML and HDF can");
}

Result<Array> XdmfReader::values_in_text(const pugi::xml_node& item) {
  const std::string type = lower_case(attribute(item, "NumberType", "DataType"));
  const int precision = item.attribute("Precision").as_int(4);
  const bool real = type.empty() || type == "float";
  const Scalar scalar = real && precision == 8 ? Scalar::f64 : real ? Scalar::f32 : Scalar::i64;
  const std::string_view text = item.text().get();
  Array array = make_array("", Domain::mesh, scalar, 1);
  MAILLE_CHECK(budget_->take(text.size() / 2 + 1, array.tuple_size()));
  TextScanner scanner(text);
  for (scanner.skip_white(); !scanner.at_end(); scanner.skip_white()) {
    const char* const begin = text.data() + scanner.position();
    Number number;
    int64_t integer = 0;
    if (real ? !scanner.number(number) : !scanner.integer(integer))
      return malformed("in a DataItem there should be a number, but found \"" +
                       std::string(begin, std::min<size_t>(20, text.size() - scanner.position())) + "\"");
    array.resize(array.count() + 1);
    const size_t last = array.count() - 1;
    if (scalar == Scalar::f64) array.values<double>()[last] = number.value;
    if (scalar == Scalar::f32) array.values<float>()[last] = number.single;
    if (scalar == Scalar::i64) array.values<int64_t>()[last] = integer;
  }
  return array;
}

Result<Array> XdmfReader::values_in_hdf5(const std::string& text) {
  const size_t colon = text.find(':');
  if (colon == std::string::npos) return malformed("\"" + text + "\" should be FILE:/PATH");
  const std::string name = text.substr(0, colon), path = text.substr(colon + 1);
  if (file_ == nullptr || opened_ != name) {
    const auto source = MAILLE_TRY(open_beside(source_.name(), name));
    file_ = MAILLE_TRY(Hdf5File::open(*source));
    opened_ = name;
  }
  const auto dataset = file_->find(path);
  Array array = MAILLE_TRY(file_->rows(path, 0, dataset ? dataset->rows() : 0,
                                       make_array("", Domain::mesh, Scalar::f64, 1), *budget_));
  array.components = 1;
  return array;
}

Result<> XdmfReader::read_points(const Grid& grid) {
  const std::string kind = lower_case(attribute(grid.geometry, "GeometryType", "Type"));
  const bool flat = kind == "xy";
  if (!flat && !kind.empty() && kind != "xyz")
    return unsupported("a Geometry of type \"" + kind + "\" cannot be read; XYZ and XY can");
  Array values = MAILLE_TRY(this->values(grid.geometry.child("DataItem")));
  const uint64_t axes = flat ? 2 : 3;
  if (!is_float(values.type) || values.count() % axes != 0)
    return malformed("its points have not " + std::to_string(axes) + " coordinates in floating-point");
  grid_points_ = values.count() / axes;
  if (grid_points_ > max_points - first_point_) return malformed("there are 2^32 points or more");
  if (flat) {
    const size_t size = size_of(values.type);
    Array solid = make_array("", Domain::mesh, values.type, 1);
    MAILLE_CHECK(budget_->take(grid_points_, 3 * size));
    solid.resize(3 * grid_points_);
    for (uint64_t i = 0; i < grid_points_; ++i)
      std::copy_n(values.bytes.data() + 2 * i * size, 2 * size, solid.bytes.data() + 3 * i * size);
    values = std::move(solid);
  }
  if (values.type == Scalar::f64) mesh_.points.type = Scalar::f64;
  points_.push_back(std::move(values));
  return {};
}

Result<> XdmfReader::add_nodes(std::span<const int64_t> nodes) {
  for (const int64_t node : nodes) {
    if (node < 0 || static_cast<uint64_t>(node) >= grid_points_)
      return malformed("a cell uses point " + std::to_string(node) + ", but its grid has " +
                       std::to_string(grid_points_));
    cells_.nodes.push_back(static_cast<uint32_t>(first_point_ + static_cast<uint64_t>(node)));
  }
  return {};
}

Result<> XdmfReader::read_cells(const Grid& grid) {
  const std::string kind = lower_case(attribute(grid.topology, "TopologyType", "Type"));
  const std::string name = grids_.size() == 1 ? "" : grid.node.attribute("Name").value();
  const Array array = MAILLE_TRY(values(grid.topology.child("DataItem")));
  if (is_float(array.type) && array.count() != 0) return malformed("a Topology is not of integers");
  MAILLE_CHECK(budget_->take(array.count(), sizeof(int64_t) + 2 * sizeof(uint32_t)));
  std::vector<int64_t> nodes;
  with_type(array.type, [&](auto zero) {
    for (const auto value : array.values<decltype(zero)>()) nodes.push_back(static_cast<int64_t>(value));
  });
  if (kind == "mixed") return read_mixed(nodes, name);
  const ElementType* const type = element_type([&](const ElementType& known) {
    return kind == known.name || (!kind.empty() && kind == known.old_name);
  });
  if (type == nullptr)
    return unsupported(
        "a Topology of type \"" + kind +
        "\" cannot be read; linear cells, Mixed and quadratic faces, tetrahedra and pyramids can");
  const uint64_t each =
      type->nodes != 0 ? type->nodes : grid.topology.attribute("NodesPerElement").as_ullong(1);
  if (each == 0 || nodes.size() % each != 0)
    return malformed("a Topology has not " + std::to_string(each) + " points for each cell");
  MAILLE_CHECK(add_nodes(nodes));
  cells_.end_cells(nodes.size() / each, type->type, each);
  shapes_.add(nodes.size() / each, type->type, name);
  return {};
}

/// Each cell is its type, for those of any number of points that number, and its points.
Result<> XdmfReader::read_mixed(const std::vector<int64_t>& values, const std::string& name) {
  const std::span<const int64_t> all(values);
  for (size_t at = 0; at < all.size();) {
    const int64_t number = all[at++];
    const ElementType* const type =
        element_type([&](const ElementType& known) { return known.number == number; });
    if (type == nullptr)
      return unsupported("cells of type " + std::to_string(number) + " in a mixed Topology cannot be read");
    int64_t nodes = static_cast<int64_t>(type->nodes);
    if (nodes == 0) nodes = at < all.size() ? all[at++] : -1;
    if (nodes < 0 || static_cast<uint64_t>(nodes) > all.size() - at)
      return malformed("a mixed Topology ends inside a cell");
    MAILLE_CHECK(add_nodes(all.subspan(at, static_cast<size_t>(nodes))));
    // Lines are polylines of two points there, as points are polyvertices of one.
    const bool line = type->type == CellType::poly_line && nodes == 2;
    const bool vertex = type->type == CellType::poly_vertex && nodes == 1;
    const CellType cell = line ? CellType::line : vertex ? CellType::vertex : type->type;
    cells_.end_cells(1, cell, static_cast<uint64_t>(nodes));
    shapes_.add(1, cell, name);
    at += static_cast<size_t>(nodes);
  }
  return {};
}

Result<> XdmfReader::read_arrays(const Grid& grid) {
  for (const pugi::xml_node node : grid.node.children()) {
    const std::string_view tag = node.name();
    if (tag == "Topology" || tag == "Geometry" || tag == "Time" || tag.ends_with("include")) continue;
    const std::string center = lower_case(node.attribute("Center").value());
    const bool at_points = center.empty() || center == "node", at_cells = center == "cell";
    const std::string name = node.attribute("Name").value();
    if (tag != "Attribute" || (!at_points && !at_cells)) {
      left_out_.insert(std::string(tag) + " \"" + name + "\"" + (center.empty() ? "" : " at " + center));
      continue;
    }
    Array array = MAILLE_TRY(values(node.child("DataItem")));
    const uint64_t cells = cells_.count() - first_cell_, count = at_points ? grid_points_ : cells;
    if (count == 0) continue;
    const uint64_t components = array.count() / count;
    if (components == 0 || components > UINT16_MAX || components * count != array.count())
      return malformed("Attribute \"" + name + "\" has " + std::to_string(array.count()) + " values for " +
                       std::to_string(count) + (at_points ? " points" : " cells"));
    array.components = static_cast<uint32_t>(components);
    array.name = name;
    array.domain = at_points ? Domain::point : Domain::cell;
    fields_.add({{at_points ? first_point_ : first_cell_, count}}, std::move(array));
  }
  return {};
}

Result<> XdmfReader::read_grid(const Grid& grid) {
  MAILLE_CHECK(read_points(grid));
  MAILLE_CHECK(read_cells(grid));
  MAILLE_CHECK(read_arrays(grid));
  first_point_ += grid_points_;
  first_cell_ = cells_.count();
  if (file_ == nullptr || !file_->is_broken()) return {};
  return malformed("\"" + opened_ + "\" is damaged: the library of HDF5 gave up");
}

Result<ReadResult> XdmfReader::read(std::optional<uint64_t> step) {
  const std::vector<double> times = MAILLE_TRY(this->times());
  if (step && *step >= times.size())
    return failure(ErrorCode::usage,
                   source_.name() + ": there are " + std::to_string(times.size()) + " time steps");
  uint64_t at = step.value_or(times.empty() ? 0 : times.size() - 1);
  for (const pugi::xml_node grid :
       (series_ ? series_ : document_.child("Xdmf").child("Domain")).children("Grid"))
    if (!series_ || at-- == 0) MAILLE_CHECK(find_grids(grid, 0));
  if (series_ && named_.size() > 2) notes_.push_back("grids beside the series left out");
  MAILLE_CHECK(make_budget());
  for (const Grid& grid : grids_) MAILLE_CHECK(read_grid(grid));
  MAILLE_CHECK(budget_->take(first_point_, mesh_.points.tuple_size()));
  mesh_.points.resize(first_point_);
  size_t to = 0;
  with_type(mesh_.points.type, [&](auto zero) {
    for (const Array& part : points_) {
      with_type(part.type, [&](auto from) {
        for (const auto value : part.values<decltype(from)>())
          mesh_.points.values<decltype(zero)>()[to++] = static_cast<decltype(zero)>(value);
      });
    }
  });
  MAILLE_CHECK(fields_.finish(cells_.count(), *budget_, mesh_, notes_));
  if (series_ && !times.empty()) {
    mesh_.arrays.push_back(time_array(times[step.value_or(times.size() - 1)]));
  }
  if (times.size() > 1 && !step)
    notes_.push_back("the mesh and its arrays are those of the last of " + std::to_string(times.size()) +
                     " time steps");
  for (const std::string& what : left_out_) notes_.push_back(what + " left out");
  mesh_.blocks = shapes_.take(cells_);
  return ReadResult{std::move(mesh_), std::move(notes_), std::move(files_beside_)};
}

Result<ReadResult> read_with_step(const Source& source, const ReadOptions& options,
                                  std::optional<uint64_t> step) {
  XdmfReader reader(source, options);
  MAILLE_CHECK(reader.parse());
  return reader.read(step);
}

}  // namespace

Result<ReadResult> read_xdmf(const Source& source, const ReadOptions& options) {
  return read_with_step(source, options, std::nullopt);
}

Result<ReadResult> read_xdmf_step(const Source& source, const ReadOptions& options, uint64_t step) {
  return read_with_step(source, options, step);
}

Result<std::vector<double>> xdmf_times(const Source& source) {
  const ReadOptions options;
  XdmfReader reader(source, options);
  MAILLE_CHECK(reader.parse());
  return reader.times();
}

}  // namespace maille
