#include <algorithm>
#include <map>

#include "base/bytes.h"
#include "io/buffered_writer.h"
#include "io/cells.h"
#include "io/gmsh.h"
#include "io/notes.h"
#include "io/reading.h"

namespace maille {
namespace {

using Group = std::pair<int, int64_t>;  // dimension and tag

/// A cell as it is written.
struct Element {
  const GmshType* type;
  std::span<const uint32_t> nodes;
  uint64_t cell;
  int64_t number;
  int32_t physical, geometrical;
};

const GmshType* type_of(CellType type, size_t nodes) {
  if (type == CellType::polygon && nodes == 3) type = CellType::triangle;
  if (type == CellType::polygon && nodes == 4) type = CellType::quad;
  for (const GmshType& known : gmsh_types()) {
    if (known.type == type && known.nodes == nodes) return &known;
  }
  return nullptr;
}

std::string in_one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

class GmshWriter {
 public:
  GmshWriter(const Mesh& mesh, Sink& sink, const WriteOptions& options)
      : mesh_(mesh), out_(sink), binary_(!options.ascii) {}

  Result<std::vector<std::string>> write();

 private:
  void collect();
  void choose_groups();
  void choose_entities();
  void put_names();
  void put_nodes_2();
  void put_elements_2();
  void put_entities();
  void put_nodes_4();
  void put_elements_4();
  void put_data(const Array& array);
  void note_rest();
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
  void put_point(uint64_t point);
  void put_nodes_of(const Element& element);
  void end(const char* section) { out_.put((binary_ ? "\n$End" : "$End") + std::string(section) + "\n"); }
  const Array* integers(const char* name, Domain domain) const;
  const Array* numbers(const char* name, Domain domain);
  int64_t node_number(uint64_t point) const {
    return node_numbers_ ? value_at(*node_numbers_, point) : static_cast<int64_t>(point) + 1;
  }
  static int64_t value_at(const Array& array, uint64_t i) {
    return with_type(array.type,
                     [&](auto zero) { return static_cast<int64_t>(array.values<decltype(zero)>()[i]); });
  }

  const Mesh& mesh_;
  BufferedWriter out_;
  bool binary_;
  int version_ = 4;
  const Array* node_numbers_ = nullptr;
  std::vector<Element> elements_;
  std::map<Group, std::string> names_;
  std::map<Group, int64_t> entities_;  ///< their physical groups
  std::vector<std::string> notes_;
};

const Array* GmshWriter::integers(const char* name, Domain domain) const {
  const Array* array = mesh_.find(name, domain);
  return array != nullptr && array->components == 1 && !is_float(array->type) ? array : nullptr;
}

/// Numbers of nodes or elements, if they are the numbers of a file: positive, each once.
const Array* GmshWriter::numbers(const char* name, Domain domain) {
  const Array* array = integers(name, domain);
  if (array == nullptr) return nullptr;
  std::vector<int64_t> sorted;
  for (uint64_t i = 0; i < array->count(); ++i) sorted.push_back(value_at(*array, i));
  std::sort(sorted.begin(), sorted.end());
  const bool positive = sorted.empty() || (sorted.front() > 0 && sorted.back() <= INT32_MAX);
  if (positive && std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end()) return array;
  notes_.push_back(std::string("array \"") + name +
                   "\" left out: it is not one positive number of 31 bits each");
  return nullptr;
}

void GmshWriter::collect() {
  const Array* const numbers = this->numbers(gmsh_element_name, Domain::cell);
  const Array* const geometrical = integers(gmsh_geometrical_name, Domain::cell);
  node_numbers_ = this->numbers(gmsh_node_name, Domain::point);
  uint64_t dropped = 0;
  for_each_cell(mesh_, [&](CellType type, uint64_t cell, uint64_t, std::span<const uint32_t> nodes) {
    const GmshType* const known = type_of(type, nodes.size());
    if (known == nullptr) {
      ++dropped;
      return;
    }
    const int64_t number =
        numbers != nullptr ? value_at(*numbers, cell) : static_cast<int64_t>(elements_.size()) + 1;
    const auto entity = static_cast<int32_t>(geometrical != nullptr ? value_at(*geometrical, cell) : 0);
    elements_.push_back({known, nodes, cell, number, 0, entity});
  });
  if (dropped != 0) notes_.push_back(counted(dropped, "cell") + " left out: Gmsh has no such types");
}

/// Physical groups from their array, or a group for each name of a block and dimension.
void GmshWriter::choose_groups() {
  for (const auto& [key, name] : mesh_.metadata) {
    if (!key.starts_with(gmsh_names_prefix)) continue;
    const std::string rest = key.substr(std::string_view(gmsh_names_prefix).size());
    const size_t dot = rest.find('.');
    if (dot == std::string::npos) continue;
    names_[{std::atoi(rest.c_str()), std::atoll(rest.c_str() + dot + 1)}] = name;
  }
  std::vector<uint64_t> ends;
  uint64_t end = 0;
  for (const CellBlock& block : mesh_.blocks) ends.push_back(end += block.size());
  const Array* physical = integers(gmsh_physical_name, Domain::cell);
  if (physical == nullptr && names_.empty()) physical = integers("medit:ref", Domain::cell);
  std::map<std::pair<int, std::string>, int64_t> tags;
  for (const auto& [group, name] : names_) tags.emplace(std::pair(group.first, name), group.second);
  int64_t last = 0;
  for (const auto& [group, name] : names_) last = std::max(last, group.second);
  size_t b = 0;
  for (Element& element : elements_) {
    while (element.cell >= ends[b]) ++b;
    const std::string& name = mesh_.blocks[b].name;
    const int dimension = dimension_of(element.type->type);
    if (physical != nullptr) {
      element.physical = static_cast<int32_t>(value_at(*physical, element.cell));
      const int64_t tag = std::abs(int64_t{element.physical});
      if (tag != 0 && !name.empty()) names_.try_emplace({dimension, tag}, name);
      continue;
    }
    if (name.empty()) continue;
    const auto [found, added] = tags.try_emplace({dimension, name}, last + 1);
    if (added) names_[{dimension, ++last}] = name;
    element.physical = static_cast<int32_t>(found->second);
  }
}

/// Version 4 gives groups to entities, not to elements: an entity for each group of each entity.
void GmshWriter::choose_entities() {
  std::map<std::pair<int, std::pair<int32_t, int32_t>>, int32_t> known;
  std::map<int, int32_t> last;
  for (const Element& element : elements_) {
    int32_t& largest = last[dimension_of(element.type->type)];
    largest = std::max(largest, element.geometrical);
  }
  for (Element& element : elements_) {
    const int dimension = dimension_of(element.type->type);
    const auto [found, added] =
        known.try_emplace({dimension, {element.physical, element.geometrical}}, element.geometrical);
    if (added && (element.geometrical == 0 || entities_.contains({dimension, element.geometrical})))
      found->second = ++last[dimension];
    if (added) entities_[{dimension, found->second}] = element.physical;
    element.geometrical = found->second;
  }
}

void GmshWriter::put_names() {
  if (names_.empty()) return;
  out_.put("$PhysicalNames\n" + std::to_string(names_.size()) + "\n");
  for (const auto& [group, name] : names_) {
    const std::string plain = in_one_line(name);
    out_.put(std::to_string(group.first) + " " + std::to_string(group.second) + " \"" + plain + "\"\n");
  }
  out_.put("$EndPhysicalNames\n");
}

void GmshWriter::put_point(uint64_t point) {
  const std::byte* const from = mesh_.points.bytes.data() + point * mesh_.points.tuple_size();
  if (!binary_) {
    put_scalars(out_, from, mesh_.points.type, 3);
    out_.put('\n');
    return;
  }
  with_type(mesh_.points.type, [&](auto zero) {
    using T = decltype(zero);
    for (size_t k = 0; k < 3; ++k) out_.put_raw(static_cast<double>(load<T>(from + k * sizeof(T))));
  });
}

void GmshWriter::put_nodes_2() {
  out_.put("$Nodes\n" + std::to_string(mesh_.point_count()) + "\n");
  for (uint64_t i = 0; i < mesh_.point_count(); ++i) {
    put_int(node_number(i));
    put_point(i);
  }
  end("Nodes");
}

void GmshWriter::put_nodes_of(const Element& element) {
  uint32_t nodes[27];
  for (unsigned k = 0; k < element.type->nodes; ++k) {
    nodes[element.type->order.empty() ? k : element.type->order[k]] = element.nodes[k];
  }
  for (unsigned k = 0; k < element.type->nodes; ++k) {
    const char behind = k + 1 == element.type->nodes ? '\n' : ' ';
    version_ == 2 ? put_int(node_number(nodes[k]), behind) : put_size(node_number(nodes[k]), behind);
  }
}

void GmshWriter::put_elements_2() {
  out_.put("$Elements\n" + std::to_string(elements_.size()) + "\n");
  for (const Element& element : elements_) {
    // In binary each element is a group of its own: groups of one type save 12 bytes an element, but order
    // counts.
    if (binary_) {
      for (const int64_t value : {int64_t{element.type->number}, int64_t{1}, int64_t{2}, element.number})
        put_int(value);
    } else {
      for (const int64_t value : {element.number, int64_t{element.type->number}, int64_t{2}}) put_int(value);
    }
    put_int(element.physical);
    put_int(element.geometrical);
    put_nodes_of(element);
  }
  end("Elements");
}

void GmshWriter::put_entities() {
  int64_t counts[4] = {};
  for (const auto& [entity, physical] : entities_) ++counts[entity.first];
  out_.put("$Entities\n");
  for (int k = 0; k < 4; ++k) put_size(counts[k], k == 3 ? '\n' : ' ');
  for (const auto& [entity, physical] : entities_) {
    put_int(entity.second);
    // The box is not known; readers do not use it.
    for (int k = 0; k < (entity.first == 0 ? 3 : 6); ++k) {
      if (binary_) {
        out_.put_raw(0.0);
      } else {
        out_.put("0 ");
      }
    }
    put_size(physical == 0 ? 0 : 1);
    if (physical != 0) put_int(physical);
    if (entity.first != 0) put_size(0);
    if (!binary_) out_.put('\n');
  }
  end("Entities");
}

void GmshWriter::put_nodes_4() {
  const auto points = static_cast<int64_t>(mesh_.point_count());
  int64_t low = points == 0 ? 0 : INT64_MAX, high = 0;
  for (uint64_t i = 0; i < mesh_.point_count(); ++i) {
    low = std::min(low, node_number(i));
    high = std::max(high, node_number(i));
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
    for (uint64_t i = 0; i < mesh_.point_count(); ++i) put_size(node_number(i), '\n');
    for (uint64_t i = 0; i < mesh_.point_count(); ++i) put_point(i);
  }
  end("Nodes");
}

void GmshWriter::put_elements_4() {
  const auto together = [](const Element& a, const Element& b) {
    return a.type == b.type && a.geometrical == b.geometrical;
  };
  int64_t blocks = 0, low = elements_.empty() ? 0 : INT64_MAX, high = 0;
  for (size_t i = 0; i < elements_.size(); ++i) {
    if (i == 0 || !together(elements_[i - 1], elements_[i])) ++blocks;
    low = std::min(low, elements_[i].number);
    high = std::max(high, elements_[i].number);
  }
  out_.put("$Elements\n");
  put_size(blocks);
  put_size(static_cast<int64_t>(elements_.size()));
  put_size(low);
  put_size(high, '\n');
  for (size_t first = 0; first < elements_.size();) {
    size_t last = first;
    while (last < elements_.size() && together(elements_[first], elements_[last])) ++last;
    put_int(dimension_of(elements_[first].type->type));
    put_int(elements_[first].geometrical);
    put_int(elements_[first].type->number);
    put_size(static_cast<int64_t>(last - first), '\n');
    for (; first < last; ++first) {
      put_size(elements_[first].number);
      put_nodes_of(elements_[first]);
    }
  }
  end("Elements");
}

void GmshWriter::put_data(const Array& array) {
  const bool on_points = array.domain == Domain::point;
  const uint64_t count = on_points ? mesh_.point_count() : elements_.size();
  // Gmsh knows values of 1, 3 and 9 numbers; what is missing is zero.
  const uint32_t components = array.components == 1 ? 1 : array.components <= 3 ? 3 : 9;
  const std::string section = on_points ? "NodeData" : "ElementData";
  out_.put("$" + section + "\n1\n\"" + in_one_line(array.name) + "\"\n1\n0\n3\n0\n" +
           std::to_string(components) + "\n" + std::to_string(count) + "\n");
  for (uint64_t i = 0; i < count; ++i) {
    put_int(on_points ? node_number(i) : elements_[i].number);
    const std::byte* from = array.bytes.data() + (on_points ? i : elements_[i].cell) * array.tuple_size();
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
  end(section.c_str());
}

bool is_tag(const Array& array) {
  return array.name == gmsh_physical_name || array.name == gmsh_geometrical_name ||
         array.name == gmsh_node_name || array.name == gmsh_element_name;
}

void GmshWriter::note_rest() {
  for (const Array& array : mesh_.arrays) {
    if (is_tag(array)) continue;
    const bool fits =
        (array.domain == Domain::point || array.domain == Domain::cell) && array.components <= 9;
    if (!fits) {
      note_array(array, notes_);
    } else if (array.type != Scalar::f64) {
      notes_.push_back("array \"" + array.name + "\" is written as doubles");
    }
    if (fits && array.components != 1 && array.components != 3 && array.components != 9) {
      notes_.push_back("array \"" + array.name + "\" is filled up with zeros: Gmsh has 1, 3 or 9 components");
    }
  }
  for (const auto& [key, value] : mesh_.metadata) note_metadata(key, notes_);
  if (binary_ && mesh_.points.type != Scalar::f64) notes_.push_back("positions are written as doubles");
  if (!binary_) note_nan_payloads(mesh_, notes_);
}

Result<std::vector<std::string>> GmshWriter::write() {
  std::string periodic;
  for (const auto& [key, value] : mesh_.metadata) {
    if (key == gmsh_version_key && value.starts_with("2")) version_ = 2;
    // Text that is none of a file's sections is left out.
    if (key == gmsh_periodic_key && value.find('$') == std::string::npos) periodic = value;
  }
  if (mesh_.point_count() > INT32_MAX || mesh_.cell_count() > INT32_MAX) version_ = 4;
  collect();
  choose_groups();
  if (version_ == 4) choose_entities();
  out_.put(std::string("$MeshFormat\n") + (version_ == 2 ? "2.2 " : "4.1 ") + (binary_ ? "1" : "0") + " 8\n");
  if (binary_) {
    out_.put_raw(int32_t{1});
    out_.put('\n');
  }
  out_.put("$EndMeshFormat\n");
  put_names();
  if (version_ == 2) {
    put_nodes_2();
    put_elements_2();
  } else {
    put_entities();
    put_nodes_4();
    put_elements_4();
  }
  if (!periodic.empty() && !binary_) out_.put("$Periodic\n" + periodic + "\n$EndPeriodic\n");
  if (!periodic.empty() && binary_) notes_.push_back("section Periodic left out: it is written as text only");
  for (const Array& array : mesh_.arrays) {
    const bool fits =
        (array.domain == Domain::point || array.domain == Domain::cell) && array.components <= 9;
    if (fits && !is_tag(array)) put_data(array);
  }
  note_rest();
  MAILLE_CHECK(out_.finish());
  return std::move(notes_);
}

}  // namespace

Result<std::vector<std::string>> write_gmsh(const Mesh& mesh, Sink& sink, const WriteOptions& options) {
  return GmshWriter(mesh, sink, options).write();
}

}  // namespace maille
