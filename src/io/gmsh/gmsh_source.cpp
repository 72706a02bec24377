// Binary .msh files, versions 2.x and 4.1, read in parts: their sections are passed over once, values stay
// where they are. Nodes have to be numbered from 1 on; other files are read whole (gmsh_reader.cpp).
#include <map>
#include <sstream>

#include "io/budget.h"
#include "io/cell_store.h"
#include "io/gmsh/gmsh.h"
#include "io/mesh_sources.h"
#include "io/source_cursor.h"

namespace maille {
namespace {

/// Nodes that stand one behind the other.
struct NodeRun {
  uint64_t first, count, at, stride;  ///< `at`: of the first one's coordinates
};

/// Elements of one type, and in version 4 of one entity, that stand one behind the other.
struct ElementRun {
  uint64_t first, count, at, stride, first_corner;
  const GmshType* type;
  uint64_t tags_at, nodes_at;  ///< within an element
  unsigned tags;               ///< in the element; version 4 has them here:
  int32_t physical, geometrical;

  uint64_t end() const { return first + count; }
};

/// An array whose values have a place of their own in the file.
struct ValueRun {
  uint64_t at, stride;
};

class GmshSource final : public MeshSource {
 public:
  GmshSource(const Source& source, const Limits& limits)
      : source_(source), in_(source), budget_(source.name(), source.size(), limits) {}

  Result<> open();
  const MeshDescription& description() const override { return description_; }
  Result<> read_points(uint64_t first, uint64_t count, std::span<std::byte> out) override;
  Result<> read_cells(uint64_t first, uint64_t count, CellPiece& out) override;
  Result<> read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) override;

 private:
  // A file that changes its type with every element would need a run for each of them; such a file is read
  // whole instead. The number was chosen, not swept.
  static constexpr size_t most_runs = size_t{1} << 20;
  enum class Kind { physical, geometrical, element, values };
  struct Column {
    Kind kind;
    ValueRun run{};
  };
  using Entity = std::pair<int, int64_t>;

  Result<> read_format();
  Result<> read_names();
  Result<> read_entities();
  Result<> read_nodes_2();
  Result<> read_nodes_4();
  Result<> read_elements_2();
  Result<> read_elements_4();
  Result<> read_data(Domain domain);
  Result<> skip_section(const std::string& name);
  Result<> add_run(ElementRun run);
  Result<> pass_elements(const ElementRun& run);
  Result<> check_node(int64_t number);
  void describe();
  std::string name_of_group(CellType type, int64_t physical) const;

  Result<int64_t> integer() { return in_.take<int32_t>(swapped_); }
  Result<int64_t> size() { return in_.take<int64_t>(swapped_); }
  Result<uint64_t> count_line(const char* what);
  Result<uint64_t> check_room(int64_t count, uint64_t each) const;
  template <class T>
  T number_at(const std::byte* from) const {
    std::byte bytes[sizeof(T)];
    std::copy_n(from, sizeof(T), bytes);
    if (swapped_) std::reverse(bytes, bytes + sizeof(T));
    return load<T>(bytes);
  }
  int64_t integer_at(const std::byte* from) const {
    return version_ == 2 ? int64_t{number_at<int32_t>(from)} : number_at<int64_t>(from);
  }
  template <class Visit>
  Result<> visit_elements(uint64_t first, uint64_t count, Visit visit);
  tl::unexpected<Error> malformed(const std::string& what) const {
    return failure(ErrorCode::malformed_input,
                   source_.name() + ": byte " + std::to_string(in_.position()) + ": " + what);
  }
  tl::unexpected<Error> unsupported(const std::string& what) const {
    return failure(ErrorCode::unsupported, source_.name() + ": " + what + ", so it cannot be read in parts");
  }

  const Source& source_;
  SourceCursor in_;
  Budget budget_;
  bool swapped_ = false;
  int version_ = 0;
  MeshDescription description_;
  std::vector<NodeRun> nodes_;
  std::vector<ElementRun> elements_;
  std::map<Entity, std::string> names_;
  std::map<Entity, int64_t> groups_;  ///< the first physical group of an entity
  BlockShapes shapes_;
  std::vector<Array> value_arrays_;
  std::vector<ValueRun> value_runs_;
  std::vector<Column> columns_;
  bool elements_in_order_ = true, any_physical_ = false, any_geometrical_ = false;
};

// The line of text that announces how many things follow, in an otherwise binary file.
Result<uint64_t> GmshSource::count_line(const char* what) {
  const std::string text = MAILLE_TRY(in_.line());
  char* end = nullptr;
  const long long count = std::strtoll(text.c_str(), &end, 10);
  if (end == text.c_str() || count < 0)
    return malformed(std::string("there should be the number of ") + what);
  return static_cast<uint64_t>(count);
}

/// A count whose elements are really there: the file has at least `each` bytes for every one. This has to be
/// known before anything is sized by the count.
Result<uint64_t> GmshSource::check_room(int64_t count, uint64_t each) const {
  if (count < 0 || static_cast<uint64_t>(count) > in_.left() / each)
    return malformed("there are fewer elements in the file than it says");
  return static_cast<uint64_t>(count);
}

Result<> GmshSource::read_format() {
  std::istringstream line(MAILLE_TRY(in_.line()));
  double version = 0;
  int binary = 0, size = 0;
  if (!(line >> version >> binary >> size))
    return malformed("there should be version, kind and size of numbers");
  version_ = gmsh_version(version);
  if (version_ == 0 || binary != 1 || size != 8)
    return unsupported("it is no binary file of version 2 or 4.1");
  description_.metadata.emplace_back(gmsh_version_key, version_ == 2 ? "2.2" : "4.1");
  // Not swapped yet: this number is what tells the byte order.
  const auto one = MAILLE_TRY(in_.take<int32_t>(false));
  swapped_ = one != 1;
  return one == 1 || one == 0x01000000
             ? Result<>()
             : malformed("the number behind the header is not 1 in either byte order");
}

Result<> GmshSource::read_names() {
  const uint64_t count = MAILLE_TRY(count_line("physical names"));
  for (uint64_t i = 0; i < count; ++i) {
    const std::string text = MAILLE_TRY(in_.line());
    int dimension = 0, read = 0;
    long long tag = 0;
    if (std::sscanf(text.c_str(), "%d %lld %n", &dimension, &tag, &read) < 2)
      return malformed("there should be dimension and tag of a physical name");
    std::string name = text.substr(static_cast<size_t>(read));
    while (!name.empty() && (name.back() == ' ' || name.back() == '\t')) name.pop_back();
    if (name.size() >= 2 && name.front() == '"' && name.back() == '"') name = name.substr(1, name.size() - 2);
    description_.metadata.emplace_back(
        gmsh_names_prefix + std::to_string(dimension) + "." + std::to_string(tag), name);
    names_[{dimension, tag}] = std::move(name);
  }
  return {};
}

Result<> GmshSource::read_entities() {
  int64_t counts[4] = {};
  for (int64_t& count : counts) count = MAILLE_TRY(size());
  for (int dimension = 0; dimension < 4; ++dimension) {
    for (int64_t i = 0; i < counts[dimension]; ++i) {
      // 64 bytes stand for a node of the map; the number is estimated, not measured.
      MAILLE_CHECK(budget_.take(1, 64));
      const int64_t tag = MAILLE_TRY(integer());
      in_.jump(in_.position() + (dimension == 0 ? 3 : 6) * sizeof(double));
      const uint64_t groups = MAILLE_TRY(check_room(MAILLE_TRY(size()), 4));
      // As in the reader of whole files, an entity in several groups keeps the first.
      for (uint64_t k = 0; k < groups; ++k) {
        const int64_t group = MAILLE_TRY(integer());
        if (k == 0) groups_[{dimension, tag}] = group;
      }
      if (dimension == 0) continue;
      const uint64_t border = MAILLE_TRY(check_room(MAILLE_TRY(size()), 4));
      in_.jump(in_.position() + 4 * border);
    }
  }
  return {};
}

// Counts the nodes by their numbers. Only with 1, 2, 3, ... can an element's node be found later without a
// table of all numbers in memory.
Result<> GmshSource::check_node(int64_t number) {
  if (number == static_cast<int64_t>(description_.points) + 1) {
    ++description_.points;
    return {};
  }
  return unsupported("its nodes are not numbered from 1 on");
}

Result<> GmshSource::read_nodes_2() {
  const uint64_t count = MAILLE_TRY(count_line("nodes"));
  MAILLE_CHECK(check_room(static_cast<int64_t>(std::min<uint64_t>(count, INT64_MAX)), 28));
  // 28 bytes each: the number of 4 bytes, then the coordinates, where the run begins.
  nodes_.push_back({0, count, in_.position() + 4, 28});
  for (uint64_t i = 0; i < count; ++i) {
    MAILLE_CHECK(check_node(MAILLE_TRY(integer())));
    in_.jump(in_.position() + 24);
  }
  return {};
}

Result<> GmshSource::read_nodes_4() {
  const int64_t blocks = MAILLE_TRY(size());
  in_.jump(in_.position() + 24);
  for (int64_t b = 0; b < blocks; ++b) {
    in_.jump(in_.position() + 8);
    const int64_t parametric = MAILLE_TRY(integer());
    const uint64_t count = MAILLE_TRY(check_room(MAILLE_TRY(size()), 32));
    if (parametric != 0) return unsupported("its nodes have parameters");
    if (nodes_.size() == most_runs) return unsupported("its nodes are in too many pieces");
    const uint64_t first = description_.points;
    for (uint64_t i = 0; i < count; ++i) MAILLE_CHECK(check_node(MAILLE_TRY(size())));
    nodes_.push_back({first, count, in_.position(), 24});
    in_.jump(in_.position() + 24 * count);
  }
  return {};
}

std::string GmshSource::name_of_group(CellType type, int64_t physical) const {
  const auto found = names_.find({dimension_of(type), physical < 0 ? -physical : physical});
  return found == names_.end() ? "" : found->second;
}

/// Looks at numbers and tags of all elements once, so that the arrays of the description are the ones
/// read_gmsh() would keep.
Result<> GmshSource::pass_elements(const ElementRun& run) {
  for (uint64_t i = 0; i < run.count; ++i) {
    in_.jump(run.at + i * run.stride);
    const int64_t number = version_ == 2 ? MAILLE_TRY(integer()) : MAILLE_TRY(size());
    elements_in_order_ = elements_in_order_ && number == static_cast<int64_t>(run.first + i) + 1;
    if (version_ != 2) continue;
    const int64_t physical = run.tags > 0 ? MAILLE_TRY(integer()) : 0;
    const int64_t geometrical = run.tags > 1 ? MAILLE_TRY(integer()) : 0;
    any_physical_ = any_physical_ || physical != 0;
    any_geometrical_ = any_geometrical_ || geometrical != 0;
    shapes_.add(1, run.type->type, name_of_group(run.type->type, physical));
  }
  return {};
}

/// Joined to the run before where it goes on as that one does, so that a file with a head before each element
/// still makes few runs.
Result<> GmshSource::add_run(ElementRun run) {
  run.first = description_.cells;
  run.first_corner = description_.corners;
  MAILLE_CHECK(pass_elements(run));
  description_.cells += run.count;
  description_.corners += run.count * run.type->nodes;
  if (!elements_.empty()) {
    ElementRun& last = elements_.back();
    const bool same = last.type == run.type && last.tags == run.tags && last.physical == run.physical &&
                      last.geometrical == run.geometrical;
    // Version 2 often has a head before each element: the step from one element to the next is then longer
    // than the element, but the same for all. The first two elements tell the step.
    const uint64_t step = last.count == 1 ? run.at - last.at : last.stride;
    if (same && run.count == 1 && run.at == last.at + last.count * step && version_ == 2) {
      last.stride = step;
      ++last.count;
      return {};
    }
  }
  if (elements_.size() == most_runs) return unsupported("its elements change their type too often");
  elements_.push_back(run);
  return {};
}

Result<> GmshSource::read_elements_2() {
  const uint64_t count = MAILLE_TRY(count_line("elements"));
  while (description_.cells < count) {
    const int64_t number = MAILLE_TRY(integer()), follow = MAILLE_TRY(integer()),
                  tags = MAILLE_TRY(integer());
    const GmshType* const type = gmsh_type(number);
    if (type == nullptr) return malformed("element type " + std::to_string(number) + " cannot be read");
    // The bound keeps the length of an element within 32 bits; the number was chosen, not swept.
    if (tags < 0 || tags > 1 << 20 || follow < 1 ||
        static_cast<uint64_t>(follow) > count - description_.cells)
      return malformed("the number of elements or tags is out of range");
    const uint64_t stride = 4 * (1 + static_cast<uint64_t>(tags) + type->nodes);
    const uint64_t at = in_.position(), elements = MAILLE_TRY(check_room(follow, stride));
    MAILLE_CHECK(add_run({0, elements, at, stride, 0, type, 4, 4 * (1 + static_cast<uint64_t>(tags)),
                          static_cast<unsigned>(tags), 0, 0}));
    in_.jump(at + elements * stride);
  }
  return {};
}

Result<> GmshSource::read_elements_4() {
  const int64_t blocks = MAILLE_TRY(size());
  in_.jump(in_.position() + 24);
  for (int64_t b = 0; b < blocks; ++b) {
    const int64_t dimension = MAILLE_TRY(integer()), tag = MAILLE_TRY(integer()),
                  number = MAILLE_TRY(integer());
    const GmshType* const type = gmsh_type(number);
    if (type == nullptr) return malformed("element type " + std::to_string(number) + " cannot be read");
    const uint64_t stride = 8 * (1 + uint64_t{type->nodes});
    const uint64_t count = MAILLE_TRY(check_room(MAILLE_TRY(size()), stride)), at = in_.position();
    const auto group = groups_.find({static_cast<int>(dimension), tag});
    const int64_t physical = group == groups_.end() ? 0 : group->second;
    any_physical_ = any_physical_ || (physical != 0 && count > 0);
    any_geometrical_ = any_geometrical_ || (tag != 0 && count > 0);
    MAILLE_CHECK(add_run(
        {0, count, at, stride, 0, type, 0, 8, 0, static_cast<int32_t>(physical), static_cast<int32_t>(tag)}));
    shapes_.add(count, type->type, name_of_group(type->type, physical));
    in_.jump(at + count * stride);
  }
  return {};
}

/// Values of all nodes or elements, in their order; others are read whole.
Result<> GmshSource::read_data(Domain domain) {
  // The head is three lists of lines. Each is cut or filled to four lines below, so that the first text, the
  // first number and the whole numbers have fixed places: line 0, line 4, and lines 8 on.
  std::vector<std::string> lines;
  for (int part = 0; part < 3; ++part) {
    const uint64_t count = MAILLE_TRY(count_line("lines"));
    if (count > 64) return unsupported("its data have long heads");
    const size_t from = lines.size();
    for (uint64_t i = 0; i < count; ++i) lines.push_back(MAILLE_TRY(in_.line()));
    lines.resize(from + 4);
  }
  std::string name = lines[0];
  if (name.size() >= 2 && name.front() == '"' && name.back() == '"') name = name.substr(1, name.size() - 2);
  const double time = std::strtod(lines[4].c_str(), nullptr);
  const long long components = std::strtoll(lines[9].c_str(), nullptr, 10);
  const long long entries = std::strtoll(lines[10].c_str(), nullptr, 10);
  if (components < 1 || components > 100)
    return malformed("data \"" + name + "\" should have 1 to 100 components");
  const uint64_t elements = domain == Domain::point ? description_.points : description_.cells;
  const uint64_t stride = 4 + 8 * static_cast<uint64_t>(components);
  MAILLE_CHECK(check_room(entries, stride));
  const auto same = [&](const Array& array) { return array.domain == domain && array.name == name; };
  // Values that stand in another order would need a table of places; such files are read whole.
  if (static_cast<uint64_t>(entries) != elements || !elements_in_order_ ||
      std::any_of(value_arrays_.begin(), value_arrays_.end(), same))
    return unsupported("its data are not for all elements in their order");
  const uint64_t at = in_.position();
  for (uint64_t i = 0; i < elements; ++i) {
    in_.jump(at + i * stride);
    if (MAILLE_TRY(integer()) != static_cast<int64_t>(i) + 1)
      return unsupported("its data are not for all elements in their order");
  }
  in_.jump(at + elements * stride);
  if (time != 0) description_.metadata.emplace_back("gmsh.time." + name, std::to_string(time));
  value_arrays_.push_back(make_array(name, domain, Scalar::f64, static_cast<uint32_t>(components)));
  value_runs_.push_back({at + 4, stride});
  return {};
}

Result<> GmshSource::skip_section(const std::string& name) {
  while (!in_.at_end()) {
    const uint64_t at = in_.position();
    if (MAILLE_TRY(in_.line()) != "$End" + name) continue;
    in_.jump(at);
    return {};
  }
  return malformed("$End" + name + " is missing");
}

// Passes over all sections once. Whatever this reading cannot do ends as `unsupported`, upon which the caller
// reads the file whole.
Result<> GmshSource::open() {
  bool nodes = false, elements = false;
  while (!in_.at_end()) {
    const std::string word = MAILLE_TRY(in_.line());
    if (word.empty()) continue;
    const std::string name = word.substr(1);
    if (word[0] != '$' || (name != "MeshFormat" && version_ == 0))
      return unsupported("its sections are not known");
    const bool twice = (name == "Nodes" && nodes) || (name == "Elements" && elements);
    if (twice || name == "Periodic") return unsupported("it has sections that are read whole");
    nodes = nodes || name == "Nodes";
    elements = elements || name == "Elements";
    if (name == "MeshFormat") {
      MAILLE_CHECK(read_format());
    } else if (name == "PhysicalNames") {
      MAILLE_CHECK(read_names());
    } else if (name == "Entities" && version_ == 4) {
      MAILLE_CHECK(read_entities());
    } else if (name == "Nodes") {
      MAILLE_CHECK(version_ == 2 ? read_nodes_2() : read_nodes_4());
    } else if (name == "Elements") {
      MAILLE_CHECK(version_ == 2 ? read_elements_2() : read_elements_4());
    } else if (name == "NodeData" || name == "ElementData") {
      MAILLE_CHECK(read_data(name == "NodeData" ? Domain::point : Domain::cell));
    } else if (name == "Comments") {
      MAILLE_CHECK(skip_section(name));
    } else {
      return unsupported("it has sections that are not known");
    }
    // Behind binary data Gmsh writes a line's end before the section's end; behind text there is none.
    std::string end = MAILLE_TRY(in_.line());
    if (end.empty()) end = MAILLE_TRY(in_.line());
    if (end != "$End" + name) return malformed("there should be $End" + name);
  }
  if (version_ == 0) return unsupported("it has no section $MeshFormat");
  describe();
  return {};
}

/// Arrays and blocks as read_gmsh() has them.
void GmshSource::describe() {
  description_.point_type = Scalar::f64;
  const auto add = [&](Kind kind, const char* name, Scalar type) {
    description_.arrays.push_back(make_array(name, Domain::cell, type, 1));
    columns_.push_back({kind});
  };
  if (any_physical_) add(Kind::physical, gmsh_physical_name, Scalar::i32);
  if (any_geometrical_) add(Kind::geometrical, gmsh_geometrical_name, Scalar::i32);
  if (!elements_in_order_) add(Kind::element, gmsh_element_name, Scalar::i64);
  for (size_t i = 0; i < value_arrays_.size(); ++i) {
    description_.arrays.push_back(value_arrays_[i]);
    columns_.push_back({Kind::values, value_runs_[i]});
  }
  for (const NamedRun& run : shapes_.runs()) description_.blocks.push_back({run.name, run.type, run.cells});
  if (description_.blocks.empty() && description_.cells > 0)
    description_.blocks.push_back({"", CellType::mixed, description_.cells});
}

Result<> GmshSource::read_points(uint64_t first, uint64_t count, std::span<std::byte> out) {
  if (count > description_.points || first > description_.points - count || out.size() != 24 * count)
    return failure(ErrorCode::usage, source_.name() + ": more points were asked for than there are");
  std::vector<std::byte> bytes;
  for (const NodeRun& run : nodes_) {
    if (count == 0 || first >= run.first + run.count) continue;
    const uint64_t here = std::min(count, run.first + run.count - first);
    bytes.resize((here - 1) * run.stride + 24);
    MAILLE_CHECK(source_.read_at(run.at + (first - run.first) * run.stride, bytes));
    // The stride leaves out the numbers that stand between coordinates in version 2.
    for (uint64_t i = 0; i < here; ++i) std::copy_n(bytes.data() + i * run.stride, 24, out.data() + 24 * i);
    out = out.subspan(24 * here);
    first += here;
    count -= here;
    if (!swapped_) continue;
    std::byte* const back = out.data() - 24 * here;
    for (uint64_t i = 0; i < 3 * here; ++i) std::reverse(back + 8 * i, back + 8 * i + 8);
  }
  return {};
}

/// Calls visit(run, bytes of the element) for each. The bytes of a run are read at once, heads between
/// elements included.
template <class Visit>
Result<> GmshSource::visit_elements(uint64_t first, uint64_t count, Visit visit) {
  if (count > description_.cells || first > description_.cells - count)
    return failure(ErrorCode::usage, source_.name() + ": more cells were asked for than there are");
  // Runs follow each other in the order of cells, so the first one is found by halving; empty runs are
  // stepped over in the loop.
  auto run = std::upper_bound(elements_.begin(), elements_.end(), first,
                              [](uint64_t cell, const ElementRun& r) { return cell < r.end(); });
  std::vector<std::byte> bytes;
  for (; count > 0; ++run) {
    if (first >= run->end()) continue;
    const uint64_t here = std::min(count, run->end() - first);
    const uint64_t last = run->nodes_at + uint64_t{run->type->nodes} * (version_ == 2 ? 4 : 8);
    bytes.resize((here - 1) * run->stride + last);
    MAILLE_CHECK(source_.read_at(run->at + (first - run->first) * run->stride, bytes));
    for (uint64_t i = 0; i < here; ++i) MAILLE_CHECK(visit(*run, bytes.data() + i * run->stride));
    first += here;
    count -= here;
  }
  return {};
}

Result<> GmshSource::read_cells(uint64_t first, uint64_t count, CellPiece& out) {
  out.types.clear();
  out.connectivity.clear();
  out.offsets.assign(1, 0);
  const size_t size = version_ == 2 ? 4 : 8;
  return visit_elements(first, count, [&](const ElementRun& run, const std::byte* bytes) -> Result<> {
    for (unsigned k = 0; k < run.type->nodes; ++k) {
      const unsigned place = run.type->order.empty() ? k : run.type->order[k];
      // Numbers below 1 wrap around to large ones, so one comparison finds both kinds of wrong numbers.
      const auto node = static_cast<uint64_t>(integer_at(bytes + run.nodes_at + place * size)) - 1;
      if (node >= description_.points) {
        return failure(ErrorCode::malformed_input, source_.name() + ": an element uses node " +
                                                       std::to_string(static_cast<int64_t>(node + 1)) +
                                                       ", which is not there");
      }
      out.connectivity.push_back(node);
    }
    out.types.push_back(static_cast<uint8_t>(run.type->type));
    out.offsets.push_back(out.connectivity.size());
    return {};
  });
}

Result<> GmshSource::read_array(size_t array, uint64_t first, uint64_t count, std::span<std::byte> out) {
  const size_t size = description_.arrays[array].tuple_size();
  if (out.size() != count * size)
    return failure(ErrorCode::usage, source_.name() + ": the room for values is of another size");
  const Column& column = columns_[array];
  if (column.kind != Kind::values) {
    std::byte* to = out.data();
    return visit_elements(first, count, [&](const ElementRun& run, const std::byte* bytes) -> Result<> {
      const unsigned tag = column.kind == Kind::physical ? 0 : 1;
      if (column.kind == Kind::element) {
        store(to, integer_at(bytes));
      } else if (version_ == 4) {
        store(to, tag == 0 ? run.physical : run.geometrical);
      } else {
        store(to, run.tags > tag ? number_at<int32_t>(bytes + run.tags_at + size_t{4} * tag) : 0);
      }
      to += size;
      return {};
    });
  }
  const uint64_t all = description_.count_of(description_.arrays[array]);
  if (count > all || first > all - count)
    return failure(ErrorCode::usage, source_.name() + ": more values were asked for than there are");
  if (count == 0) return {};
  std::vector<std::byte> bytes((count - 1) * column.run.stride + size);
  MAILLE_CHECK(source_.read_at(column.run.at + first * column.run.stride, bytes));
  for (uint64_t i = 0; i < count; ++i)
    std::copy_n(bytes.data() + i * column.run.stride, size, out.data() + i * size);
  for (size_t i = 0; swapped_ && i < out.size(); i += 8) std::reverse(out.data() + i, out.data() + i + 8);
  return {};
}

}  // namespace

Result<std::unique_ptr<MeshSource>> open_gmsh_source(const Source& source, const Limits& limits) {
  auto opened = std::make_unique<GmshSource>(source, limits);
  MAILLE_CHECK(opened->open());
  return std::unique_ptr<MeshSource>(std::move(opened));
}

}  // namespace maille
