// Gmsh's .msh files, versions 2.x and 4.1, text and binary: sections "$Name ... $EndName".
#include "io/gmsh/gmsh_reader.h"

#include <limits>

#include "io/format.h"

namespace maille {

// The header's line "VERSION KIND SIZE". In a binary file the int 1 stands behind it, which tells the byte
// order.
Result<> GmshReader::read_format() {
  Number version;
  int64_t binary = 0, size = 0;
  if (!in_.number(version) || !in_.integer(binary) || !in_.integer(size))
    return in_.expected("version, kind and size of numbers");
  version_ = gmsh_version(version.value);
  if (version_ == 0) {
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

// The rest of the line, without the quotes around it. A name may hold quotes itself: only the outermost are
// taken off.
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
  // This is checked before anything is kept, as elements already read point into the first section.
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
  // 27 is the number of nodes of the largest element in gmsh_types.cpp.
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
  // Nodes are gathered first, because the reordering looks both ahead and back.
  for (unsigned k = 0; k < type.nodes; ++k)
    cells_.nodes.push_back(found[type.order.empty() ? k : type.order[k]]);
  elements_.add(number);
  // Tags have 32 bits in binary files, which is what all of them are kept in.
  physical_.push_back(static_cast<int32_t>(physical));
  geometrical_.push_back(static_cast<int32_t>(geometrical));
  cells_.end_cells(1, type.type, type.nodes);
  shapes_.add(1, type.type, name_of_group(type.type, physical));
  return {};
}

// In text each element has a head of its own. In binary a head stands before any number of elements of the
// same type and the same number of tags, and each element repeats its number only.
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
    const GmshType* const type = gmsh_type(type_number);
    if (type == nullptr)
      return malformed("element type " + std::to_string(type_number) +
                       " cannot be read; types up to second order can");
    // A head of no elements would make this loop endless, so it counts as malformed.
    if (follow < 1 || static_cast<uint64_t>(follow) > count - i || tags < 0)
      return malformed("the number of elements or tags is out of range");
    for (int64_t k = 0; k < follow; ++k, ++i) {
      MAILLE_CHECK(pace_.step(i, count, (type->nodes + 6) * sizeof(uint32_t), in_.scanner.position()));
      if (binary_ && !integer(number)) return expected("the number of an element");
      // By convention the first tag is the physical group and the second the entity of the geometry; the
      // others are partitions.
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

/// Kept as text, up to its end, and written back unchanged: a mesh has no place for periodicity. Binary
/// sections are left out, as their bytes would not survive as metadata.
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

// The head is three lists, each behind its length: texts (the name), numbers (the time), and whole numbers
// (step, components, entries).
Result<GmshReader::DataHead> GmshReader::read_data_head() {
  DataHead head;
  const uint64_t texts = MAILLE_TRY(in_.count("texts"));
  in_.scanner.skip_line();
  for (uint64_t i = 0; i < texts; ++i) {
    if (in_.scanner.at_end()) return in_.malformed("the file ends inside the name of data");
    std::string text = MAILLE_TRY(quoted());
    if (i == 0) head.name = std::move(text);
    in_.scanner.skip_line_end();
  }
  const uint64_t reals = MAILLE_TRY(in_.count("numbers"));
  for (uint64_t i = 0; i < reals; ++i) {
    Number number;
    if (!in_.number(number)) return in_.expected("a number of data \"" + head.name + "\"");
    if (i == 0 && number.value != 0) head.time = std::to_string(number.value);
  }
  const uint64_t integers = MAILLE_TRY(in_.count("whole numbers"));
  int64_t more = 0;
  for (uint64_t i = 0; i < integers; ++i) {
    if (!in_.integer(i == 0 ? head.step : i == 1 ? head.components : i == 2 ? head.entries : more))
      return in_.expected("a whole number of data \"" + head.name + "\"");
  }
  // Gmsh writes 1, 3 or 9 components; 100 bounds what one entry can claim. Chosen, not swept.
  if (head.components < 1 || head.components > 100 || head.entries < 0)
    return in_.malformed("data \"" + head.name + "\" should have 1 to 100 components");
  // No more than the entries can fill, so that a small file does not make many large arrays.
  if (static_cast<uint64_t>(head.entries) > text_.size())
    return in_.malformed("data \"" + head.name + "\" has more entries than the file can hold");
  return head;
}

/// The values of the entries, each at the place of its node or element.
Result<> GmshReader::read_values(const DataHead& head, const NumberIndex& index, std::span<double> values) {
  const auto components = static_cast<size_t>(head.components);
  if (binary_) in_.scanner.skip_line();
  for (int64_t i = 0; i < head.entries; ++i) {
    int64_t element = 0;
    if (!integer(element)) return expected("the element of a value of data \"" + head.name + "\"");
    const uint64_t place = index.find(element);
    if (place == UINT64_MAX)
      return malformed("data \"" + head.name + "\" names element " + std::to_string(element) +
                       ", which is not there");
    for (double& value : values.subspan(static_cast<size_t>(place) * components, components)) {
      if (!real(value)) return expected("a value of data \"" + head.name + "\"");
    }
  }
  return {};
}

Result<> GmshReader::read_data(Domain domain) {
  DataHead head = MAILLE_TRY(read_data_head());
  // Gmsh writes one section for each step of time under the same name; a mesh wants names that differ.
  const auto same = [&](const Array& array) { return array.domain == domain && array.name == head.name; };
  if (std::any_of(arrays_.begin(), arrays_.end(), same))
    head.name += " (step " + std::to_string(head.step) + ")";
  if (!head.time.empty()) metadata_.emplace_back("gmsh.time." + head.name, head.time);
  const NumberIndex& index = domain == Domain::point ? nodes_ : elements_;
  const uint64_t count = index.size();
  MAILLE_CHECK(budget_.take(count * static_cast<uint64_t>(head.components), sizeof(double)));
  Array array = make_array(head.name, domain, Scalar::f64, static_cast<uint32_t>(head.components));
  array.resize(count);
  const std::span<double> values = array.values<double>();
  // A file may have data for some elements only; the others have no value, and zero would be one.
  std::fill(values.begin(), values.end(), std::numeric_limits<double>::quiet_NaN());
  MAILLE_CHECK(read_values(head, index, values));
  if (static_cast<uint64_t>(head.entries) < count) {
    notes_.push_back("data \"" + head.name + "\" has values for " + std::to_string(head.entries) + " of " +
                     std::to_string(count) + " elements; the others are NaN");
  }
  arrays_.push_back(std::move(array));
  return {};
}

// Finds the end by its name. In text it moves by lines, so that the line numbers of later errors stay right;
// binary data would be broken into lines for nothing.
Result<> GmshReader::skip_section(const std::string& name) {
  const size_t at = static_cast<size_t>(in_.scanner.here() - text_.data());
  const size_t end = text_.find("$End" + name, at);
  if (end == std::string_view::npos) return malformed("$End" + name.substr(0, 40) + " is missing");
  while (in_.scanner.here() < text_.data() + end && !binary_) in_.scanner.skip_line();
  in_.scanner.jump(text_.data() + end);
  return {};
}

// "$NOD" is how files of version 1 begin, which have no $MeshFormat.
Result<> GmshReader::read_section(const std::string& name) {
  if (name == "NOD" && version_ == 0) {
    return failure(ErrorCode::unsupported,
                   in_.name() +
                       ": it has version 1 of Gmsh's format; versions 2 and 4.1 can be read: save it "
                       "again with gmsh -format msh41");
  }
  // Everything else depends on the version: sizes of numbers, heads of blocks.
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

// Adds only those arrays that say something: numbers from 1 on and tags that are all zero are not kept.
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
    // Fluent's meshes are called .msh too, and begin with a bracket.
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
    // A section that is longer than its count says would otherwise be read as the next one's name.
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

namespace {

bool recognise_gmsh(Bytes first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()), first_bytes.size());
  return text.starts_with("$MeshFormat") || text.starts_with("$Comments");
}

}  // namespace

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
