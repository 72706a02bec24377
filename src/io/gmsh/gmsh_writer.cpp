// Gmsh's files written from a mesh that is read in parts, in several passes over its cells: what holds for
// all of them stands in front of them.
#include <algorithm>
#include <map>
#include <optional>

#include "base/bytes.h"
#include "io/buffered_writer.h"
#include "io/gmsh/gmsh.h"
#include "io/notes.h"
#include "io/reading.h"
#include "mesh/mesh_as_source.h"

namespace maille {
namespace {

// Points, cells or values that are read from the mesh at once; the number was chosen, not swept.
constexpr uint64_t at_once = 4096;
/// Elements of version 4 stand in blocks of one type and entity, no longer than this: so many are held.
constexpr size_t most_in_block = size_t{1} << 16;

using Group = std::pair<int, int64_t>;  // dimension and tag

// Arrays that are written as tags and numbers of elements, not as data.
bool is_tag(const Array& array) {
  return array.name == gmsh_physical_name || array.name == gmsh_geometrical_name ||
         array.name == gmsh_node_name || array.name == gmsh_element_name;
}

// Gmsh has values of at most nine numbers, on nodes and elements.
bool has_place(const Array& array) {
  return (array.domain == Domain::point || array.domain == Domain::cell) && array.components <= 9;
}

/// A cell as it is written.
struct Element {
  const GmshType* type = nullptr;
  std::span<const uint64_t> nodes;
  uint64_t cell = 0;
  int64_t number = 0;
  int32_t physical = 0, geometrical = 0;

  int dimension() const { return static_cast<int>(dimension_of(type->type)); }
};

class GmshWriter {
 public:
  GmshWriter(MeshSource& mesh, Sink& sink, const WriteOptions& options)
      : mesh_(mesh), description_(mesh.description()), out_(sink), binary_(!options.ascii) {}

  Result<std::vector<std::string>> write();

 private:
  /// A column of numbers of cells, some at once.
  struct Column {
    std::optional<size_t> array;
    std::vector<int64_t> values;
    int64_t of(uint64_t i) const { return values.empty() ? 0 : values[i]; }
  };
  /// Elements that follow each other with the same type and entity.
  struct Block {
    const GmshType* type;
    int32_t entity;
    uint64_t elements;
  };

  void choose_version();
  Result<> find_columns();
  Result<std::vector<int64_t>> numbers(const char* name, Domain domain);
  Result<> load_column(Column& column, uint64_t first, uint64_t count) const;
  template <class Visit>
  Result<> visit_elements(Visit visit);
  int32_t physical_of(const Element& element) const;
  Result<> choose_groups();
  Result<> choose_entities();
  void put_names();
  Result<> put_points(bool numbered);
  Result<> put_nodes_2();
  Result<> put_elements_2();
  void put_entities();
  Result<> put_nodes_4();
  Result<> put_elements_4();
  Result<> put_data(size_t array);
  void put_value(const Array& array, const std::byte* from, uint32_t components);
  void put_int(int64_t value, char behind = ' ') { put_as<int32_t>(value, behind); }
  void put_size(int64_t value, char behind = ' ') { put_as<int64_t>(value, behind); }
  template <class T>
  void put_as(int64_t value, char behind) {
    if (binary_) {
      out_.put_raw(static_cast<T>(value));
    } else {
      out_.put_number(value);
      out_.put(behind);
    }
  }
  void put_nodes_of(const Element& element);
  void end(const char* section) { out_.put((binary_ ? "\n$End" : "$End") + std::string(section) + "\n"); }
  /// The index of an array in the description; integers() wants it to be one whole number for each element as
  /// well.
  std::optional<size_t> find(const char* name, Domain domain) const;
  std::optional<size_t> integers(const char* name, Domain domain) const;
  int64_t node_number(uint64_t point) const {
    return node_numbers_.empty() ? static_cast<int64_t>(point) + 1 : node_numbers_[point];
  }

  MeshSource& mesh_;
  const MeshDescription& description_;
  BufferedWriter out_;
  bool binary_;
  int version_ = 4;
  std::string periodic_;
  std::vector<int64_t> node_numbers_, element_numbers_;
  Column physical_, geometrical_;
  std::vector<uint64_t> block_ends_;  ///< in cells
  uint64_t elements_ = 0, dropped_ = 0;
  std::map<Group, std::string> names_;
  std::map<std::pair<int, std::string>, int64_t> tags_;  ///< of names
  /// The largest tag of an entity in use, for each dimension.
  std::map<int, int32_t> last_entity_;
  std::map<std::pair<int, std::pair<int32_t, int32_t>>, int32_t> entity_of_;  ///< of group and entity
  std::map<Group, int64_t> entities_;                                         ///< their physical groups
  std::vector<Block> blocks_;
  int64_t lowest_ = 0, highest_ = 0;
  std::vector<std::string> notes_;
};

std::optional<size_t> GmshWriter::find(const char* name, Domain domain) const {
  for (size_t i = 0; i < description_.arrays.size(); ++i) {
    const Array& array = description_.arrays[i];
    if (array.name == name && array.domain == domain) return i;
  }
  return std::nullopt;
}

std::optional<size_t> GmshWriter::integers(const char* name, Domain domain) const {
  const auto found = find(name, domain);
  if (!found) return found;
  const Array& array = description_.arrays[*found];
  return array.components == 1 && !is_float(array.type) ? found : std::nullopt;
}

Result<> GmshWriter::load_column(Column& column, uint64_t first, uint64_t count) const {
  if (!column.array) return {};
  const Scalar type = description_.arrays[*column.array].type;
  std::vector<std::byte> bytes(count * size_of(type));
  MAILLE_CHECK(mesh_.read_array(*column.array, first, count, bytes));
  column.values.resize(count);
  with_type(type, [&](auto zero) {
    for (uint64_t i = 0; i < count; ++i)
      column.values[i] = static_cast<int64_t>(load<decltype(zero)>(bytes.data() + i * sizeof zero));
  });
  return {};
}

/// Numbers of nodes or elements, if they are the numbers of a file: positive, each once.
Result<std::vector<int64_t>> GmshWriter::numbers(const char* name, Domain domain) {
  Column column{integers(name, domain), {}};
  if (!column.array) return column.values;
  MAILLE_CHECK(load_column(column, 0, description_.count_of(description_.arrays[*column.array])));
  std::vector<int64_t> sorted = column.values;
  std::sort(sorted.begin(), sorted.end());
  // 31 bits, as numbers are 32-bit integers in version 2 and in the sections of data.
  const bool positive = sorted.empty() || (sorted.front() > 0 && sorted.back() <= INT32_MAX);
  if (positive && std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end()) return column.values;
  notes_.push_back(std::string("array \"") + name +
                   "\" left out: it is not one positive number of 31 bits each");
  return std::vector<int64_t>();
}

/// Calls visit(element) -> Result<> for each cell that Gmsh has a type for, in the order of the mesh. Reads
/// the mesh anew each time, with the tags of the same stretch of cells.
template <class Visit>
Result<> GmshWriter::visit_elements(Visit visit) {
  CellPiece piece;
  uint64_t next = 0;
  for (uint64_t first = 0; first < description_.cells; first += at_once) {
    const uint64_t count = std::min(at_once, description_.cells - first);
    MAILLE_CHECK(mesh_.read_cells(first, count, piece));
    MAILLE_CHECK(load_column(physical_, first, count));
    MAILLE_CHECK(load_column(geometrical_, first, count));
    for (uint64_t i = 0; i < count; ++i) {
      Element element;
      element.nodes =
          std::span(piece.connectivity).subspan(piece.offsets[i], piece.offsets[i + 1] - piece.offsets[i]);
      element.type = gmsh_type(static_cast<CellType>(piece.types[i]), element.nodes.size());
      if (element.type == nullptr) continue;
      element.cell = first + i;
      ++next;
      // Cells left out get no number, so that numbers without an array of their own run from 1 to n.
      element.number = static_cast<int64_t>(element_numbers_.empty() ? static_cast<int64_t>(next)
                                                                     : element_numbers_[element.cell]);
      element.physical = static_cast<int32_t>(physical_.of(i));
      element.geometrical = static_cast<int32_t>(geometrical_.of(i));
      MAILLE_CHECK(visit(element));
    }
  }
  return {};
}

Result<> GmshWriter::find_columns() {
  element_numbers_ = MAILLE_TRY(numbers(gmsh_element_name, Domain::cell));
  node_numbers_ = MAILLE_TRY(numbers(gmsh_node_name, Domain::point));
  geometrical_.array = integers(gmsh_geometrical_name, Domain::cell);
  for (const auto& [key, name] : description_.metadata) {
    if (!key.starts_with(gmsh_names_prefix)) continue;
    const std::string rest = key.substr(std::string_view(gmsh_names_prefix).size());
    const size_t dot = rest.find('.');
    if (dot == std::string::npos) continue;
    // Anything may stand in metadata; text that is no number gives tag 0, which no element has.
    names_[{std::atoi(rest.c_str()), std::atoll(rest.c_str() + dot + 1)}] = name;
  }
  physical_.array = integers(gmsh_physical_name, Domain::cell);
  // A reference of MEDIT is what a physical group is in Gmsh; it is taken where the mesh has no groups
  // otherwise.
  if (!physical_.array && names_.empty()) physical_.array = integers("medit:ref", Domain::cell);
  for (const auto& [group, name] : names_) tags_.emplace(std::pair(group.first, name), group.second);
  return {};
}

/// Takes physical groups from their array, or makes a group for each name of a block and dimension. This is
/// also the pass that counts elements and finds the largest tag of entities.
Result<> GmshWriter::choose_groups() {
  for (const auto& block : description_.blocks)
    block_ends_.push_back((block_ends_.empty() ? 0 : block_ends_.back()) + block.cells);
  int64_t last = 0;
  for (const auto& [group, name] : names_) last = std::max(last, group.second);
  size_t b = 0;
  MAILLE_CHECK(visit_elements([&](const Element& element) -> Result<> {
    // Cells come in the order of blocks, so the block is followed instead of looked up. Empty blocks are
    // passed over.
    while (element.cell >= block_ends_[b]) ++b;
    const std::string& name = description_.blocks[b].name;
    const int dimension = element.dimension();
    int32_t& largest = last_entity_[dimension];
    largest = std::max(largest, element.geometrical);
    ++elements_;
    if (physical_.array) {
      // A negative tag stands for the same group, turned over. A group of the array that has no name yet gets
      // that of the block its cells are in.
      const int64_t tag = std::abs(int64_t{element.physical});
      if (tag != 0 && !name.empty()) names_.try_emplace({dimension, tag}, name);
      return {};
    }
    if (name.empty()) return {};
    if (tags_.try_emplace({dimension, name}, last + 1).second) names_[{dimension, ++last}] = name;
    return {};
  }));
  dropped_ = description_.cells - elements_;
  if (dropped_ != 0) notes_.push_back(counted(dropped_, "cell") + " left out: Gmsh has no such types");
  return {};
}

/// That of its array, or of the name of its block.
int32_t GmshWriter::physical_of(const Element& element) const {
  if (physical_.array) return element.physical;
  const auto block = std::upper_bound(block_ends_.begin(), block_ends_.end(), element.cell);
  const std::string& name = description_.blocks[static_cast<size_t>(block - block_ends_.begin())].name;
  const auto found = name.empty() ? tags_.end() : tags_.find({element.dimension(), name});
  return found == tags_.end() ? 0 : static_cast<int32_t>(found->second);
}

/// Version 4 gives groups to entities, not to elements: an entity for each pair of a group and an entity of
/// the mesh. The first pair keeps the entity's tag, the others get new ones above the largest.
Result<> GmshWriter::choose_entities() {
  lowest_ = elements_ == 0 ? 0 : INT64_MAX;
  return visit_elements([&](const Element& element) -> Result<> {
    const int dimension = element.dimension();
    const int32_t physical = physical_of(element);
    const auto [found, added] =
        entity_of_.try_emplace({dimension, {physical, element.geometrical}}, element.geometrical);
    if (added && (element.geometrical == 0 || entities_.contains({dimension, element.geometrical})))
      found->second = ++last_entity_[dimension];
    if (added) entities_[{dimension, found->second}] = physical;
    // A block ends where the type or the entity changes. The list of blocks is what has to be known before
    // the elements are written: the section begins with their number.
    const bool goes_on = !blocks_.empty() && blocks_.back().type == element.type &&
                         blocks_.back().entity == found->second && blocks_.back().elements < most_in_block;
    if (!goes_on) blocks_.push_back({element.type, found->second, 0});
    ++blocks_.back().elements;
    lowest_ = std::min(lowest_, element.number);
    highest_ = std::max(highest_, element.number);
    return {};
  });
}

void GmshWriter::put_names() {
  if (names_.empty()) return;
  out_.put("$PhysicalNames\n" + std::to_string(names_.size()) + "\n");
  for (const auto& [group, name] : names_) {
    const std::string plain = gmsh_name(name);
    out_.put(std::to_string(group.first) + " " + std::to_string(group.second) + " \"" + plain + "\"\n");
  }
  out_.put("$EndPhysicalNames\n");
}

/// Writes positions, in version 2 each behind its number; version 4 has the numbers of a block before its
/// positions.
Result<> GmshWriter::put_points(bool numbered) {
  const Scalar type = description_.point_type;
  const size_t size = 3 * size_of(type);
  std::vector<std::byte> bytes(at_once * size);
  for (uint64_t first = 0; first < description_.points; first += at_once) {
    const uint64_t count = std::min(at_once, description_.points - first);
    MAILLE_CHECK(mesh_.read_points(first, count, std::span(bytes).first(count * size)));
    for (uint64_t i = 0; i < count; ++i) {
      if (numbered) put_int(node_number(first + i));
      const std::byte* const from = bytes.data() + i * size;
      if (!binary_) {
        put_scalars(out_, from, type, 3);
        out_.put('\n');
        continue;
      }
      with_type(type, [&](auto zero) {
        for (size_t k = 0; k < 3; ++k)
          out_.put_raw(static_cast<double>(load<decltype(zero)>(from + k * sizeof zero)));
      });
    }
  }
  return {};
}

Result<> GmshWriter::put_nodes_2() {
  out_.put("$Nodes\n" + std::to_string(description_.points) + "\n");
  MAILLE_CHECK(put_points(true));
  end("Nodes");
  return {};
}

// The reverse of reading: node k of the cell stands where `order` says it is read from.
void GmshWriter::put_nodes_of(const Element& element) {
  uint64_t nodes[27];
  for (unsigned k = 0; k < element.type->nodes; ++k) {
    nodes[element.type->order.empty() ? k : element.type->order[k]] = element.nodes[k];
  }
  for (unsigned k = 0; k < element.type->nodes; ++k) {
    const char behind = k + 1 == element.type->nodes ? '\n' : ' ';
    version_ == 2 ? put_int(node_number(nodes[k]), behind) : put_size(node_number(nodes[k]), behind);
  }
}

Result<> GmshWriter::put_elements_2() {
  out_.put("$Elements\n" + std::to_string(elements_) + "\n");
  MAILLE_CHECK(visit_elements([&](const Element& element) -> Result<> {
    // In binary each element is a group of its own: groups of one type save 12 bytes an element, but order
    // counts.
    if (binary_) {
      for (const int64_t value : {int64_t{element.type->number}, int64_t{1}, int64_t{2}, element.number})
        put_int(value);
    } else {
      for (const int64_t value : {element.number, int64_t{element.type->number}, int64_t{2}}) put_int(value);
    }
    put_int(physical_of(element));
    put_int(element.geometrical);
    put_nodes_of(element);
    return {};
  }));
  end("Elements");
  return {};
}

void GmshWriter::put_entities() {
  int64_t counts[4] = {};
  for (const auto& [entity, physical] : entities_) ++counts[entity.first];
  out_.put("$Entities\n");
  for (int k = 0; k < 4; ++k) put_size(counts[k], k == 3 ? '\n' : ' ');
  for (const auto& [entity, physical] : entities_) {
    put_int(entity.second);
    // The box is not known without another pass over the mesh; readers do not use it.
    for (int k = 0; k < (entity.first == 0 ? 3 : 6); ++k) {
      if (binary_) {
        out_.put_raw(0.0);
      } else {
        out_.put("0 ");
      }
    }
    put_size(physical == 0 ? 0 : 1);
    if (physical != 0) put_int(physical);
    // No entities at its border are named.
    if (entity.first != 0) put_size(0);
    if (!binary_) out_.put('\n');
  }
  end("Entities");
}

// All nodes stand in one block, which belongs to the last entity, one of the highest dimension: the mesh does
// not say which entity a node is on.
Result<> GmshWriter::put_nodes_4() {
  const auto points = static_cast<int64_t>(description_.points);
  int64_t low = points == 0 ? 0 : 1, high = points;
  if (!node_numbers_.empty()) {
    const auto [least, largest] = std::minmax_element(node_numbers_.begin(), node_numbers_.end());
    low = *least;
    high = *largest;
  }
  out_.put("$Nodes\n");
  put_size(points == 0 ? 0 : 1);
  put_size(points);
  put_size(low);
  put_size(high, '\n');
  if (points != 0) {
    const Group entity = entities_.empty() ? Group(3, 1) : entities_.rbegin()->first;
    put_int(entity.first);
    put_int(entity.second);
    put_int(0);
    put_size(points, '\n');
    for (uint64_t i = 0; i < description_.points; ++i) put_size(node_number(i), '\n');
    MAILLE_CHECK(put_points(false));
  }
  end("Nodes");
  return {};
}

Result<> GmshWriter::put_elements_4() {
  out_.put("$Elements\n");
  put_size(static_cast<int64_t>(blocks_.size()));
  put_size(static_cast<int64_t>(elements_));
  put_size(lowest_);
  put_size(highest_, '\n');
  size_t block = 0;
  uint64_t left = 0;
  // The same pass over the same cells as in choose_entities(), so the blocks come in the same order.
  MAILLE_CHECK(visit_elements([&](const Element& element) -> Result<> {
    if (left == 0) {
      const Block& begun = blocks_[block++];
      put_int(element.dimension());
      put_int(begun.entity);
      put_int(begun.type->number);
      put_size(static_cast<int64_t>(left = begun.elements), '\n');
    }
    --left;
    put_size(element.number);
    put_nodes_of(element);
    return {};
  }));
  end("Elements");
  return {};
}

void GmshWriter::put_value(const Array& array, const std::byte* from, uint32_t components) {
  for (uint32_t k = 0; k < components; ++k) {
    const double value = k >= array.components ? 0 : with_type(array.type, [&](auto zero) {
      return static_cast<double>(load<decltype(zero)>(from + k * sizeof zero));
    });
    if (binary_) {
      out_.put_raw(value);
    } else {
      out_.put_number(value);
      out_.put(k + 1 == components ? '\n' : ' ');
    }
  }
}

Result<> GmshWriter::put_data(size_t number) {
  const Array& array = description_.arrays[number];
  const bool on_points = array.domain == Domain::point;
  // Gmsh knows values of 1, 3 and 9 numbers; what is missing is zero.
  const uint32_t components = array.components == 1 ? 1 : array.components <= 3 ? 3 : 9;
  const std::string section = on_points ? "NodeData" : "ElementData";
  out_.put("$" + section + "\n1\n\"" + gmsh_name(array.name) + "\"\n1\n0\n3\n0\n" +
           std::to_string(components) + "\n" + std::to_string(on_points ? description_.points : elements_) +
           "\n");
  const size_t size = array.tuple_size();
  std::vector<std::byte> bytes(at_once * size);
  // No stretch begins here, so the first value loads one.
  uint64_t loaded = ~uint64_t{0};
  // Values of cells are asked for in rising order with gaps, where cells are left out; each stretch is read
  // once.
  const auto value_of = [&](uint64_t i) -> Result<const std::byte*> {
    const uint64_t first = i / at_once * at_once;
    if (first != loaded) {
      const uint64_t count = std::min(at_once, description_.count_of(array) - first);
      MAILLE_CHECK(mesh_.read_array(number, first, count, std::span(bytes).first(count * size)));
      loaded = first;
    }
    return bytes.data() + (i - first) * size;
  };
  for (uint64_t i = 0; on_points && i < description_.points; ++i) {
    put_int(node_number(i));
    put_value(array, MAILLE_TRY(value_of(i)), components);
  }
  if (!on_points) {
    MAILLE_CHECK(visit_elements([&](const Element& element) -> Result<> {
      put_int(element.number);
      put_value(array, MAILLE_TRY(value_of(element.cell)), components);
      return {};
    }));
  }
  end(section.c_str());
  return {};
}

void GmshWriter::choose_version() {
  for (const auto& [key, value] : description_.metadata) {
    if (key == gmsh_version_key && value.starts_with("2")) version_ = 2;
    // Text that holds a "$" might be a section of its own and is left out: metadata may come from a hostile
    // file.
    if (key == gmsh_periodic_key && value.find('$') == std::string::npos) periodic_ = value;
  }
  // Version 2 numbers nodes and elements in 31 bits, whatever the file was that the mesh came from.
  if (description_.points > INT32_MAX || description_.cells > INT32_MAX) version_ = 4;
}

Result<std::vector<std::string>> GmshWriter::write() {
  choose_version();
  MAILLE_CHECK(find_columns());
  MAILLE_CHECK(choose_groups());
  if (version_ == 4) MAILLE_CHECK(choose_entities());
  out_.put(std::string("$MeshFormat\n") + (version_ == 2 ? "2.2 " : "4.1 ") + (binary_ ? "1" : "0") + " 8\n");
  if (binary_) {
    out_.put_raw(int32_t{1});
    out_.put('\n');
  }
  out_.put("$EndMeshFormat\n");
  put_names();
  if (version_ == 4) put_entities();
  MAILLE_CHECK(version_ == 2 ? put_nodes_2() : put_nodes_4());
  MAILLE_CHECK(version_ == 2 ? put_elements_2() : put_elements_4());
  if (!periodic_.empty() && !binary_) out_.put("$Periodic\n" + periodic_ + "\n$EndPeriodic\n");
  if (!periodic_.empty() && binary_)
    notes_.push_back("section Periodic left out: it is written as text only");
  for (size_t i = 0; i < description_.arrays.size(); ++i) {
    if (has_place(description_.arrays[i]) && !is_tag(description_.arrays[i])) MAILLE_CHECK(put_data(i));
  }
  MAILLE_CHECK(out_.finish());
  return std::move(notes_);
}

void note_arrays(const std::vector<Array>& arrays, std::vector<std::string>& notes) {
  for (const Array& array : arrays) {
    if (is_tag(array)) continue;
    const bool fits = has_place(array);
    if (!fits) {
      note_array(array, notes);
    } else if (array.type != Scalar::f64) {
      notes.push_back("array \"" + array.name + "\" is written as doubles");
    }
    if (fits && array.components != 1 && array.components != 3 && array.components != 9) {
      notes.push_back("array \"" + array.name + "\" is filled up with zeros: Gmsh has 1, 3 or 9 components");
    }
  }
}

void note_rest(const std::vector<std::pair<std::string, std::string>>& metadata, Scalar point_type,
               const WriteOptions& options, std::vector<std::string>& notes) {
  for (const auto& [key, value] : metadata) note_metadata(key, value, notes);
  if (!options.ascii && point_type != Scalar::f64) notes.push_back("positions are written as doubles");
}

}  // namespace

Result<std::vector<std::string>> write_gmsh(MeshSource& mesh, Sink& sink, const WriteOptions& options) {
  std::vector<std::string> notes = MAILLE_TRY(GmshWriter(mesh, sink, options).write());
  note_arrays(mesh.description().arrays, notes);
  note_arrays(mesh.description().mesh_arrays, notes);
  note_rest(mesh.description().metadata, mesh.description().point_type, options, notes);
  return notes;
}

Result<std::vector<std::string>> write_gmsh(const Mesh& mesh, Sink& sink, const WriteOptions& options) {
  const auto source = mesh_as_source(mesh);
  std::vector<std::string> notes = MAILLE_TRY(GmshWriter(*source, sink, options).write());
  note_arrays(mesh.arrays, notes);
  note_rest(mesh.metadata, mesh.points.type, options, notes);
  if (options.ascii) note_nan_payloads(mesh, notes);
  return notes;
}

}  // namespace maille
