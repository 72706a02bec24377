// Gmsh's .msh files, versions 2.x and 4.1, text and binary: sections "$Name ... $EndName".
#include "io/gmsh.h"

#include <algorithm>
#include <limits>
#include <map>

#include "io/cell_store.h"
#include "io/format.h"
#include "io/token_reader.h"

namespace maille {
namespace {

// Gmsh and VTK number edges and faces of the quadratic elements in other orders.
constexpr uint8_t tet10[] = {0, 1, 2, 3, 4, 5, 6, 7, 9, 8};
constexpr uint8_t hex20[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15};
constexpr uint8_t hex27[] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  11, 13, 9,  16, 18,
                             19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25, 26};
// The triangle 0 1 2 of a wedge is seen from outside in VTK, from inside in Gmsh.
constexpr uint8_t prism6[] = {0, 2, 1, 3, 5, 4};
constexpr uint8_t prism15[] = {0, 2, 1, 3, 5, 4, 7, 9, 6, 13, 14, 12, 8, 11, 10};
constexpr uint8_t prism18[] = {0, 2, 1, 3, 5, 4, 7, 9, 6, 13, 14, 12, 8, 11, 10, 16, 17, 15};
constexpr uint8_t pyramid13[] = {0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12};
constexpr uint8_t pyramid14[] = {0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12, 13};

constexpr GmshType types[] = {{1, CellType::line, 2, {}},
                              {2, CellType::triangle, 3, {}},
                              {3, CellType::quad, 4, {}},
                              {4, CellType::tetrahedron, 4, {}},
                              {5, CellType::hexahedron, 8, {}},
                              {6, CellType::wedge, 6, prism6},
                              {7, CellType::pyramid, 5, {}},
                              {8, CellType::quadratic_edge, 3, {}},
                              {9, CellType::quadratic_triangle, 6, {}},
                              {10, CellType::biquadratic_quad, 9, {}},
                              {11, CellType::quadratic_tetrahedron, 10, tet10},
                              {12, CellType::triquadratic_hexahedron, 27, hex27},
                              {13, CellType::biquadratic_quadratic_wedge, 18, prism18},
                              {14, CellType::lagrange_pyramid, 14, pyramid14},
                              {15, CellType::vertex, 1, {}},
                              {16, CellType::quadratic_quad, 8, {}},
                              {17, CellType::quadratic_hexahedron, 20, hex20},
                              {18, CellType::quadratic_wedge, 15, prism15},
                              {19, CellType::quadratic_pyramid, 13, pyramid13}};

const GmshType* type_numbered(int64_t number) {
  for (const GmshType& type : types) {
    if (type.number == number) return &type;
  }
  return nullptr;
}

/// The places of numbers that need not be 1 to n.
class NumberIndex {
 public:
  void add(int64_t number) { numbers_.push_back(number); }
  uint64_t size() const { return numbers_.size(); }
  const std::vector<int64_t>& numbers() const { return numbers_; }
  bool in_order() const { return in_order_; }
  /// Call when all are there. Of equal numbers the first counts.
  void finish() {
    for (size_t i = 0; in_order_ && i < numbers_.size(); ++i)
      in_order_ = numbers_[i] == static_cast<int64_t>(i) + 1;
    if (in_order_) return;
    for (size_t i = 0; i < numbers_.size(); ++i) sorted_.emplace_back(numbers_[i], i);
    std::sort(sorted_.begin(), sorted_.end());
  }
  /// UINT64_MAX when it is not there.
  uint64_t find(int64_t number) const {
    if (in_order_)
      return number >= 1 && static_cast<uint64_t>(number) <= numbers_.size()
                 ? static_cast<uint64_t>(number) - 1
                 : UINT64_MAX;
    const auto at = std::lower_bound(sorted_.begin(), sorted_.end(), std::pair<int64_t, uint64_t>(number, 0));
    return at != sorted_.end() && at->first == number ? at->second : UINT64_MAX;
  }

 private:
  std::vector<int64_t> numbers_;
  std::vector<std::pair<int64_t, uint64_t>> sorted_;
  bool in_order_ = true;
};

class GmshReader {
 public:
  GmshReader(const Source& source, std::string_view text, const ReadOptions& options)
      : in_(text, source.name()),
        text_(text),
        budget_(source.name(), text.size(), options.limits),
        pace_(budget_, options.progress, text.size()) {}

  Result<ReadResult> read();

 private:
  using Entity = std::pair<int, int64_t>;  // dimension and tag

  Result<> read_section(const std::string& name);
  Result<> read_format();
  Result<> read_names();
  Result<> read_nodes_2();
  Result<> read_elements_2();
  Result<> read_entities(bool partitioned);
  Result<> read_partitions();
  Result<> skip_parent();
  Result<> read_nodes_4();
  Result<> read_elements_4();
  Result<> read_periodic();
  Result<> read_data(Domain domain);
  Result<> read_point();
  Result<> add_element(const GmshType& type, int64_t number, int64_t physical, int64_t geometrical);
  Result<> skip_section(const std::string& name);
  Result<std::string> quoted();
  void add_tags(Mesh& mesh);

  // Numbers, as text or in binary.
  bool integer(int64_t& value) { return binary_ ? raw<int32_t>(value) : in_.integer(value); }
  bool size(int64_t& value) { return binary_ ? raw<int64_t>(value) : in_.integer(value); }
  bool real(double& value) {
    if (binary_) return raw<double>(value);
    Number number;
    if (!in_.number(number)) return false;
    value = number.value;
    return true;
  }
  template <class T, class To>
  bool raw(To& value) {
    if (static_cast<size_t>(in_.scanner.end() - in_.scanner.here()) < sizeof(T)) return false;
    std::byte bytes[sizeof(T)];
    std::memcpy(bytes, in_.scanner.here(), sizeof(T));
    if (swapped_) std::reverse(bytes, bytes + sizeof(T));
    value = static_cast<To>(load<T>(bytes));
    in_.scanner.jump(in_.scanner.here() + sizeof(T));
    return true;
  }
  tl::unexpected<Error> expected(const std::string& what) {
    if (!binary_) return in_.expected(what);
    return malformed_byte(in_.name(), in_.scanner.position(), "there should be " + what);
  }
  tl::unexpected<Error> malformed(const std::string& what) const {
    return binary_ ? malformed_byte(in_.name(), in_.scanner.position(), what) : in_.malformed(what);
  }
  std::string name_of_group(CellType type, int64_t physical) const {
    const auto found =
        names_.find({dimension_of(type), physical < 0 ? -std::max(physical, -INT64_MAX) : physical});
    return found == names_.end() ? "" : found->second;
  }

  TokenReader in_;
  std::string_view text_;
  Budget budget_;
  ReadingPace pace_;
  bool binary_ = false, swapped_ = false;
  int version_ = 0;
  std::map<Entity, std::string> names_;
  std::map<Entity, std::vector<int64_t>> entities_;  ///< their physical groups
  RealColumn positions_;
  NumberIndex nodes_, elements_;
  bool has_nodes_ = false, has_elements_ = false;
  CellStore cells_;
  BlockShapes shapes_;
  std::vector<int32_t> physical_, geometrical_;
  std::vector<Array> arrays_;
  std::vector<std::pair<std::string, std::string>> metadata_;
  std::vector<std::string> notes_;
  uint64_t more_tags_ = 0, parametric_ = 0;
};

Result<> GmshReader::read_format() {
  Number version;
  int64_t binary = 0, size = 0;
  if (!in_.number(version) || !in_.integer(binary) || !in_.integer(size))
    return in_.expected("version, kind and size of numbers");
  version_ = static_cast<int>(version.value);
  const bool known = version_ == 2 || (version.value > 4.05 && version.value < 4.2);
  if (!known) {
    return failure(
        ErrorCode::unsupported,
        in_.name() + ": it has version " + std::to_string(version.value).substr(0, 3) +
            " of Gmsh's format; versions 2 and 4.1 can be read: save it again with gmsh -format msh41");
  }
  if (size != 8) return malformed("numbers of " + std::to_string(size) + " bytes are not known, only of 8");
  metadata_.emplace_back(gmsh_version_key, version_ == 2 ? "2.2" : "4.1");
  binary_ = binary == 1;
  if (!binary_) return {};
  in_.scanner.skip_line();
  int64_t one = 0;
  if (!raw<int32_t>(one)) return expected("the number 1");
  swapped_ = one != 1;
  if (swapped_ && one != 0x01000000)
    return malformed("the number behind the header is not 1 in either byte order");
  return {};
}

Result<std::string> GmshReader::quoted() {
  in_.scanner.skip_blanks();
  std::string_view rest = trim(in_.scanner.rest_of_line());
  if (rest.size() >= 2 && rest.front() == '"' && rest.back() == '"') rest = rest.substr(1, rest.size() - 2);
  return std::string(rest);
}

Result<> GmshReader::read_names() {
  const uint64_t count = MAILLE_TRY(in_.count("physical names"));
  for (uint64_t i = 0; i < count; ++i) {
    int64_t dimension = 0, tag = 0;
    if (!in_.integer(dimension) || !in_.integer(tag))
      return in_.expected("dimension and tag of a physical name");
    std::string name = MAILLE_TRY(quoted());
    metadata_.emplace_back(gmsh_names_prefix + std::to_string(dimension) + "." + std::to_string(tag), name);
    names_[{static_cast<int>(dimension), tag}] = std::move(name);
  }
  return {};
}

Result<> GmshReader::read_point() {
  for (int k = 0; k < 3; ++k) {
    if (binary_) {
      double value = 0;
      if (!raw<double>(value)) return expected("a coordinate of a node");
      positions_.add(value);
    } else {
      Number number;
      if (!in_.number(number)) return expected("a coordinate of a node");
      positions_.add(number);
    }
  }
  return {};
}

Result<> GmshReader::read_nodes_2() {
  const uint64_t count = MAILLE_TRY(in_.count("nodes"));
  if (binary_) in_.scanner.skip_line();
  if (has_nodes_ || count > max_points)
    return malformed("there are two sections of nodes, or 2^32 nodes and more");
  for (uint64_t i = 0; i < count; ++i) {
    MAILLE_CHECK(pace_.step(i, count, 4 * sizeof(double), in_.scanner.position()));
    int64_t number = 0;
    if (!integer(number)) return expected("the number of a node");
    nodes_.add(number);
    MAILLE_CHECK(read_point());
  }
  has_nodes_ = true;
  nodes_.finish();
  return {};
}

Result<> GmshReader::add_element(const GmshType& type, int64_t number, int64_t physical,
                                 int64_t geometrical) {
  uint32_t found[27];
  for (unsigned k = 0; k < type.nodes; ++k) {
    int64_t node = 0;
    if (!(version_ == 2 ? integer(node) : size(node)))
      return expected("a node of element " + std::to_string(number));
    const uint64_t place = nodes_.find(node);
    if (place == UINT64_MAX)
      return malformed("element " + std::to_string(number) + " uses node " + std::to_string(node) +
                       ", which is not there");
    found[k] = static_cast<uint32_t>(place);
  }
  for (unsigned k = 0; k < type.nodes; ++k)
    cells_.nodes.push_back(found[type.order.empty() ? k : type.order[k]]);
  elements_.add(number);
  physical_.push_back(static_cast<int32_t>(physical));
  geometrical_.push_back(static_cast<int32_t>(geometrical));
  cells_.end_cells(1, type.type, type.nodes);
  shapes_.add(1, type.type, name_of_group(type.type, physical));
  return {};
}

Result<> GmshReader::read_elements_2() {
  const uint64_t count = MAILLE_TRY(in_.count("elements"));
  if (binary_) in_.scanner.skip_line();
  for (uint64_t i = 0; i < count;) {
    int64_t number = 0, type_number = 0, tags = 0, follow = 1;
    const bool ok = binary_ ? integer(type_number) && integer(follow) && integer(tags)
                            : integer(number) && integer(type_number) && integer(tags);
    if (!ok)
      return expected("the type and number of tags of element " + std::to_string(i + 1) + " of " +
                      std::to_string(count));
    const GmshType* const type = type_numbered(type_number);
    if (type == nullptr)
      return malformed("element type " + std::to_string(type_number) +
                       " cannot be read; types up to second order can");
    if (follow < 1 || static_cast<uint64_t>(follow) > count - i || tags < 0)
      return malformed("the number of elements or tags is out of range");
    for (int64_t k = 0; k < follow; ++k, ++i) {
      MAILLE_CHECK(pace_.step(i, count, (type->nodes + 6) * sizeof(uint32_t), in_.scanner.position()));
      if (binary_ && !integer(number)) return expected("the number of an element");
      int64_t physical = 0, geometrical = 0, more = 0;
      for (int64_t tag = 0; tag < tags; ++tag) {
        if (!integer(tag == 0 ? physical : tag == 1 ? geometrical : more))
          return expected("a tag of an element");
      }
      if (tags > 2) ++more_tags_;
      MAILLE_CHECK(add_element(*type, number, physical, geometrical));
    }
  }
  return {};
}

Result<> GmshReader::read_partitions() {
  int64_t partitions = 0, ghosts = 0, value = 0;
  if (!size(partitions) || !size(ghosts)) return expected("the numbers of partitions and ghosts");
  for (int64_t i = 0; i < ghosts; ++i) {
    if (!integer(value) || !integer(value)) return expected("an entity of ghosts and its partition");
  }
  notes_.push_back("partitions left out");
  return {};
}

Result<> GmshReader::skip_parent() {
  int64_t partitions = 0, value = 0;
  if (!integer(value) || !integer(value) || !size(partitions))
    return expected("an entity's parent and its number of partitions");
  for (int64_t i = 0; i < partitions; ++i) {
    if (!integer(value)) return expected("a partition of an entity");
  }
  return {};
}

/// Of a mesh that was partitioned, elements are of the entities of partitions: these have the groups.
Result<> GmshReader::read_entities(bool partitioned) {
  if (partitioned) MAILLE_CHECK(read_partitions());
  int64_t counts[4] = {};
  for (int64_t& count : counts) {
    if (!size(count) || count < 0) return expected("the numbers of entities");
  }
  for (int dimension = 0; dimension < 4; ++dimension) {
    for (int64_t i = 0; i < counts[dimension]; ++i) {
      MAILLE_CHECK(budget_.take(1, 64));
      int64_t tag = 0, groups = 0, group = 0;
      double box = 0;
      if (!integer(tag)) return expected("the tag of an entity");
      if (partitioned) MAILLE_CHECK(skip_parent());
      for (int k = 0; k < (dimension == 0 ? 3 : 6); ++k) {
        if (!real(box)) return expected("the box of an entity");
      }
      std::vector<int64_t>& physical = entities_[{dimension, tag}];
      physical.clear();
      if (!size(groups)) return expected("the number of groups of an entity");
      for (int64_t k = 0; k < groups; ++k) {
        if (!integer(group)) return expected("a group of an entity");
        physical.push_back(group);
      }
      if (dimension == 0) continue;
      if (!size(groups)) return expected("the number of entities at an entity's border");
      for (int64_t k = 0; k < groups; ++k) {
        if (!integer(group)) return expected("an entity at an entity's border");
      }
    }
  }
  return {};
}

Result<> GmshReader::read_nodes_4() {
  int64_t head[4] = {}, blocks_done = 0;
  for (int64_t& value : head) {
    if (!size(value)) return expected("the numbers of blocks and nodes");
  }
  if (has_nodes_ || head[1] < 0 || static_cast<uint64_t>(head[1]) > max_points)
    return malformed("there are two sections of nodes, or 2^32 nodes and more");
  const auto total = static_cast<uint64_t>(head[1]);
  for (; blocks_done < head[0]; ++blocks_done) {
    int64_t dimension = 0, tag = 0, parametric = 0, count = 0, number = 0;
    if (!integer(dimension) || !integer(tag) || !integer(parametric) || !size(count))
      return expected("the head of a block of nodes");
    if (count < 0 || static_cast<uint64_t>(count) > total - nodes_.size())
      return malformed("the blocks have more nodes than the section says");
    const uint64_t first = nodes_.size();
    for (int64_t i = 0; i < count; ++i) {
      MAILLE_CHECK(pace_.step(nodes_.size(), total, 4 * sizeof(double), in_.scanner.position()));
      if (!size(number)) return expected("the number of a node");
      nodes_.add(number);
    }
    if (count == 0 && in_.scanner.at_end()) return expected("more blocks of nodes");
    const int64_t more = parametric != 0 ? std::clamp<int64_t>(dimension, 0, 3) : 0;
    for (uint64_t i = first; i < nodes_.size(); ++i) {
      MAILLE_CHECK(read_point());
      double skipped = 0;
      for (int64_t k = 0; k < more; ++k) {
        if (!real(skipped)) return expected("a parametric coordinate of a node");
      }
    }
    if (more != 0) parametric_ += static_cast<uint64_t>(count);
  }
  if (nodes_.size() != total) return malformed("the blocks have fewer nodes than the section says");
  has_nodes_ = true;
  nodes_.finish();
  return {};
}

Result<> GmshReader::read_elements_4() {
  int64_t head[4] = {};
  for (int64_t& value : head) {
    if (!size(value)) return expected("the numbers of blocks and elements");
  }
  for (int64_t block = 0; block < head[0]; ++block) {
    int64_t dimension = 0, tag = 0, type_number = 0, count = 0, number = 0;
    if (!integer(dimension) || !integer(tag) || !integer(type_number) || !size(count))
      return expected("the head of a block of elements");
    const GmshType* const type = type_numbered(type_number);
    if (type == nullptr)
      return malformed("element type " + std::to_string(type_number) +
                       " cannot be read; types up to second order can");
    const auto entity = entities_.find({static_cast<int>(dimension), tag});
    const bool grouped = entity != entities_.end() && !entity->second.empty();
    const int64_t physical = grouped ? entity->second[0] : 0;
    if (grouped && entity->second.size() > 1 && count > 0) {
      notes_.push_back("entity " + std::to_string(tag) + " of dimension " + std::to_string(dimension) +
                       " is in " + std::to_string(entity->second.size()) +
                       " physical groups; its elements keep the first");
    }
    if (count <= 0 && in_.scanner.at_end()) return expected("more blocks of elements");
    for (int64_t i = 0; i < count; ++i) {
      MAILLE_CHECK(pace_.step(static_cast<uint64_t>(i), static_cast<uint64_t>(count),
                              (type->nodes + 6) * sizeof(uint32_t), in_.scanner.position()));
      if (!size(number)) return expected("the number of an element");
      MAILLE_CHECK(add_element(*type, number, physical, tag));
    }
  }
  return {};
}

/// Kept as text, up to its end.
Result<> GmshReader::read_periodic() {
  if (binary_) {
    notes_.push_back("section Periodic left out");
    return skip_section("Periodic");
  }
  const char* const from = in_.scanner.here();
  const size_t at = static_cast<size_t>(from - text_.data());
  const size_t end = text_.find("$EndPeriodic", at);
  if (end == std::string_view::npos) return in_.malformed("$EndPeriodic is missing");
  metadata_.emplace_back(gmsh_periodic_key, std::string(trim(text_.substr(at, end - at))));
  return skip_section("Periodic");
}

Result<> GmshReader::read_data(Domain domain) {
  const NumberIndex& index = domain == Domain::point ? nodes_ : elements_;
  const uint64_t texts = MAILLE_TRY(in_.count("texts"));
  std::string name;
  in_.scanner.skip_line();
  for (uint64_t i = 0; i < texts; ++i) {
    if (in_.scanner.at_end()) return in_.malformed("the file ends inside the name of data");
    const std::string text = MAILLE_TRY(quoted());
    if (i == 0) name = text;
    in_.scanner.skip_line_end();
  }
  const uint64_t reals = MAILLE_TRY(in_.count("numbers"));
  Number number;
  std::string time;
  for (uint64_t i = 0; i < reals; ++i) {
    if (!in_.number(number)) return in_.expected("a number of data \"" + name + "\"");
    if (i == 0 && number.value != 0) time = std::to_string(number.value);
  }
  const uint64_t integers = MAILLE_TRY(in_.count("whole numbers"));
  int64_t step = 0, components = 1, entries = 0, more = 0;
  for (uint64_t i = 0; i < integers; ++i) {
    if (!in_.integer(i == 0 ? step : i == 1 ? components : i == 2 ? entries : more))
      return in_.expected("a whole number of data \"" + name + "\"");
  }
  if (components < 1 || components > 100 || entries < 0)
    return in_.malformed("data \"" + name + "\" should have 1 to 100 components");
  const auto same = [&](const Array& array) { return array.domain == domain && array.name == name; };
  if (std::any_of(arrays_.begin(), arrays_.end(), same)) name += " (step " + std::to_string(step) + ")";
  if (!time.empty()) metadata_.emplace_back("gmsh.time." + name, time);
  Array array = make_array(name, domain, Scalar::f64, static_cast<uint32_t>(components));
  const uint64_t count = index.size();
  // No more than the entries can fill, so that a small file does not make many large arrays.
  if (static_cast<uint64_t>(entries) > text_.size())
    return in_.malformed("data \"" + name + "\" has more entries than the file can hold");
  MAILLE_CHECK(budget_.take(count * static_cast<uint64_t>(components), sizeof(double)));
  array.resize(count);
  std::fill(array.values<double>().begin(), array.values<double>().end(),
            std::numeric_limits<double>::quiet_NaN());
  if (binary_) in_.scanner.skip_line();
  for (int64_t i = 0; i < entries; ++i) {
    int64_t element = 0;
    if (!integer(element)) return expected("the element of a value of data \"" + name + "\"");
    const uint64_t place = index.find(element);
    if (place == UINT64_MAX)
      return malformed("data \"" + name + "\" names element " + std::to_string(element) +
                       ", which is not there");
    for (int64_t k = 0; k < components; ++k) {
      double value = 0;
      if (!real(value)) return expected("a value of data \"" + name + "\"");
      array.values<double>()[place * static_cast<uint64_t>(components) + static_cast<uint64_t>(k)] = value;
    }
  }
  if (static_cast<uint64_t>(entries) < count) {
    notes_.push_back("data \"" + name + "\" has values for " + std::to_string(entries) + " of " +
                     std::to_string(count) + " elements; the others are NaN");
  }
  arrays_.push_back(std::move(array));
  return {};
}

Result<> GmshReader::skip_section(const std::string& name) {
  const size_t at = static_cast<size_t>(in_.scanner.here() - text_.data());
  const size_t end = text_.find("$End" + name, at);
  if (end == std::string_view::npos) return malformed("$End" + name.substr(0, 40) + " is missing");
  while (in_.scanner.here() < text_.data() + end && !binary_) in_.scanner.skip_line();
  in_.scanner.jump(text_.data() + end);
  return {};
}

Result<> GmshReader::read_section(const std::string& name) {
  if (name == "NOD" && version_ == 0) {
    return failure(ErrorCode::unsupported,
                   in_.name() +
                       ": it has version 1 of Gmsh's format; versions 2 and 4.1 can be read: save it "
                       "again with gmsh -format msh41");
  }
  if (name != "MeshFormat" && version_ == 0) return in_.malformed("the file should begin with $MeshFormat");
  if (name == "MeshFormat") return read_format();
  if (name == "PhysicalNames") return read_names();
  if (name == "Nodes") return version_ == 2 ? read_nodes_2() : read_nodes_4();
  if (name == "Elements") {
    if (has_elements_) return malformed("there are two sections of elements");
    has_elements_ = true;
    MAILLE_CHECK(version_ == 2 ? read_elements_2() : read_elements_4());
    elements_.finish();
    return {};
  }
  if (name == "Entities" && version_ == 4) return read_entities(false);
  if (name == "PartitionedEntities" && version_ == 4) return read_entities(true);
  if (name == "NodeData") return read_data(Domain::point);
  if (name == "ElementData") return read_data(Domain::cell);
  if (name == "Periodic") return read_periodic();
  if (name != "Comments") notes_.push_back("section " + name.substr(0, 40) + " left out");
  return skip_section(name);
}

void GmshReader::add_tags(Mesh& mesh) {
  const auto add = [&](const char* name, Domain domain, Scalar type, const auto& values) {
    Array array = make_array(name, domain, type, 1);
    const Bytes bytes = std::as_bytes(std::span(values));
    array.bytes.assign(bytes.begin(), bytes.end());
    mesh.arrays.push_back(std::move(array));
  };
  const auto any = [](const std::vector<int32_t>& values) {
    return std::any_of(values.begin(), values.end(), [](int32_t value) { return value != 0; });
  };
  if (!nodes_.in_order()) add(gmsh_node_name, Domain::point, Scalar::i64, nodes_.numbers());
  if (any(physical_)) add(gmsh_physical_name, Domain::cell, Scalar::i32, physical_);
  if (any(geometrical_)) add(gmsh_geometrical_name, Domain::cell, Scalar::i32, geometrical_);
  if (!elements_.in_order()) add(gmsh_element_name, Domain::cell, Scalar::i64, elements_.numbers());
}

Result<ReadResult> GmshReader::read() {
  in_.scanner.skip_byte_order_mark();
  while (!in_.at_end()) {
    const std::string word(in_.word());
    if (version_ == 0 && word.starts_with('(')) {
      return failure(
          ErrorCode::unsupported,
          in_.name() + ": it seems to be a mesh of ANSYS Fluent, which cannot be read; only Gmsh's .msh can");
    }
    if (word.empty() || word[0] != '$')
      return in_.malformed("there should be the name of a section, but found \"" + word.substr(0, 40) + "\"");
    const std::string name = word.substr(1);
    in_.scanner.skip_line();
    MAILLE_CHECK(read_section(name));
    if (std::string(in_.word()) != "$End" + name)
      return in_.malformed("there should be $End" + name.substr(0, 40) +
                           "; the section is longer than it says");
  }
  if (version_ == 0) return in_.malformed("there is no section $MeshFormat");
  ReadResult result;
  Mesh& mesh = result.mesh;
  mesh.points = positions_.take("position", Domain::point, 3);
  add_tags(mesh);
  for (Array& array : arrays_) mesh.arrays.push_back(std::move(array));
  mesh.blocks = shapes_.take(cells_);
  mesh.metadata = std::move(metadata_);
  if (more_tags_ != 0)
    notes_.push_back("tags of partitions of " + counted(more_tags_, "element") + " left out");
  if (parametric_ != 0)
    notes_.push_back("parametric coordinates of " + counted(parametric_, "node") + " left out");
  result.notes = std::move(notes_);
  return result;
}

bool recognise_gmsh(Bytes first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()), first_bytes.size());
  return text.starts_with("$MeshFormat") || text.starts_with("$Comments");
}

}  // namespace

std::span<const GmshType> gmsh_types() {
  return types;
}

const GmshType* gmsh_type(CellType type, size_t nodes) {
  if (type == CellType::polygon && nodes == 3) type = CellType::triangle;
  if (type == CellType::polygon && nodes == 4) type = CellType::quad;
  for (const GmshType& known : gmsh_types()) {
    if (known.type == type && known.nodes == nodes) return &known;
  }
  return nullptr;
}

Result<ReadResult> read_gmsh(const Source& source, const ReadOptions& options) {
  const InputBytes input = MAILLE_TRY(InputBytes::load(source));
  return GmshReader(source, input.text(), options).read();
}

const Format& gmsh_format() {
  static const Format format{{"msh", {".msh"}, "Gmsh, versions 2.2 and 4.1, text or binary", true},
                             recognise_gmsh,
                             read_gmsh,
                             write_gmsh};
  return format;
}

}  // namespace maille
