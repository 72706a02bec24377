#include "io/vtk/vtk_xml_writer.h"

#include <maille/xml.h>

#include <algorithm>
#include <utility>

#include "base/bytes.h"
#include "io/base64.h"
#include "io/byte_order.h"
#include "io/vtk/vtk_field_data.h"

namespace maille {
std::optional<std::string> vtk_xml_note(std::initializer_list<std::span<const Array>> arrays,
                                        const std::vector<std::pair<std::string, std::string>>& metadata) {
  uint64_t changed = 0;
  const auto look = [&](std::string_view name) { changed += is_xml_text(name) ? 0 : 1; };
  for (const std::span<const Array> list : arrays) {
    for (const Array& array : list) look(array.name);
  }
  for (const auto& entry : metadata) look(entry.first);
  if (changed == 0) return std::nullopt;
  return counted(changed, "name") +
         " with control characters, which XML does not have: written as their pictures, U+2400 and on";
}

namespace {

// Numbers of points and ends of cells: 32 bits where they are enough, as they are for most meshes, otherwise
// 64.
template <class T>
VtkXmlData numbers_of(const char* name, std::span<const T> values) {
  const bool wide =
      !values.empty() && std::cmp_greater(*std::max_element(values.begin(), values.end()), INT32_MAX);
  VtkXmlData data;
  data.type = wide ? Scalar::i64 : Scalar::i32;
  data.attributes = std::string("type=\"") + vtk_name_of(data.type) + "\" Name=\"" + name + "\"";
  const size_t size = size_of(data.type);
  data.owned.resize(values.size() * size);
  for (size_t i = 0; i < values.size(); ++i) {
    const auto value = static_cast<uint64_t>(values[i]);
    std::memcpy(data.owned.data() + i * size, &value, size);  // little-endian: the low bytes come first
  }
  return data;
}

}  // namespace

VtkXmlData vtk_xml_numbers(const char* name, std::span<const uint32_t> values) {
  return numbers_of(name, values);
}
VtkXmlData vtk_xml_numbers(const char* name, std::span<const uint64_t> values) {
  return numbers_of(name, values);
}
VtkXmlData vtk_xml_numbers(const char* name, std::span<const int64_t> values) {
  return numbers_of(name, values);
}

/// Tuples in the order in which the cells are written.
std::vector<std::byte> VtkXmlWriter::permuted(const Array& array, const std::vector<uint64_t>& order) const {
  const size_t size = array.tuple_size();
  std::vector<std::byte> bytes(order.size() * size);
  std::byte* to = bytes.data();
  for (const uint64_t i : order) {
    std::copy_n(array.bytes.data() + i * size, size, to);
    to += size;
  }
  return bytes;
}

// Arrays that keep their order are borrowed, so writing takes no second copy of the mesh.
VtkXmlData VtkXmlWriter::describe(const Array& array, const std::string& more) const {
  VtkXmlData data;
  data.type = array.type;
  data.components = array.components;
  data.attributes = "type=\"" + std::string(vtk_name_of(array.type)) + "\" Name=\"" +
                    xml_escaped(array.name) + "\" NumberOfComponents=\"" + std::to_string(array.components) +
                    "\"" + more;
  const auto* const order = array.domain == Domain::cell     ? cell_order_
                            : array.domain == Domain::corner ? corner_order_
                                                             : nullptr;
  if (order != nullptr) {
    data.owned = permuted(array, *order);
  } else {
    data.borrowed = array.bytes;
  }
  return data;
}

// Texts as VTK stores them: their bytes, each text ended by a zero.
VtkXmlData VtkXmlWriter::strings(const std::string& name, std::span<const std::string> values,
                                 uint32_t components, const char* type) const {
  VtkXmlData data;
  data.attributes = std::string("type=\"") + type + "\" Name=\"" + xml_escaped(name) + "\"";
  if (components != 1) data.attributes += " NumberOfComponents=\"" + std::to_string(components) + "\"";
  for (const std::string& value : values) {
    const Bytes bytes = std::as_bytes(std::span(value.data(), value.size()));
    data.owned.insert(data.owned.end(), bytes.begin(), bytes.end());
    data.owned.push_back(std::byte{0});
  }
  // As bytes the tuples are the bytes themselves, otherwise the texts.
  const bool bytes = std::string_view(type) != "String";
  data.attributes +=
      " NumberOfTuples=\"" + std::to_string(bytes ? data.owned.size() : values.size() / components) + "\"";
  return data;
}

// Texts of maille's own, with a mark by which the reader tells them from texts of the data.
VtkXmlData VtkXmlWriter::own_texts(const std::string& name, std::span<const std::string> values) const {
  VtkXmlData data = strings(name, values, 1, own_texts_as_bytes_ ? "UInt8" : "String");
  data.attributes += std::string(" ") + vtk_own_text_mark + "=\"1\"";
  return data;
}

VtkXmlData VtkXmlWriter::describe_texts(const Array& array) const {
  if (array.domain != Domain::cell || cell_order_ == nullptr)
    return strings(array.name, vtk_texts_of(array), array.components);
  // The values of the copy are put in order before they become texts.
  Array ordered = array;
  ordered.bytes = permuted(array, *cell_order_);
  return strings(array.name, vtk_texts_of(ordered), array.components);
}

/// The array that becomes the active attribute of this meaning, if VTK takes one of its shape.
const Array* VtkXmlWriter::first_of(Domain domain, Role role) const {
  for (const Array& array : mesh_.arrays) {
    const uint32_t n = array.components;
    const bool suits = role == Role::colour               ? array.type == Scalar::u8 && (n == 3 || n == 4)
                       : role == Role::texture_coordinate ? n <= 3
                                                          : n == 3;
    if (array.domain == domain && array.role == role && suits && !array.name.empty()) return &array;
  }
  return nullptr;
}

// The attributes of <PointData> and <CellData> that tell VTK which array has which meaning.
std::string VtkXmlWriter::active_attributes(Domain domain) const {
  std::string text;
  const std::pair<const char*, Role> attributes[] = {{"Scalars", Role::colour},
                                                     {"Normals", Role::normal},
                                                     {"Tangents", Role::tangent},
                                                     {"TCoords", Role::texture_coordinate}};
  for (const auto& [attribute, role] : attributes) {
    if (const Array* array = first_of(domain, role)) {
      text += std::string(" ") + attribute + "=\"" + xml_escaped(array->name) + "\"";
    }
  }
  return text;
}

/// The mark for meanings that the active attributes do not tell.
std::string VtkXmlWriter::role_mark(const Array& array) const {
  if (array.role == Role::none) return "";
  const bool attributes = array.domain == Domain::point || array.domain == Domain::cell;
  if (attributes && first_of(array.domain, array.role) == &array) return "";
  return std::string(" maille_role=\"") + name_of(array.role) + "\"";
}

void VtkXmlWriter::add_block_names(const std::string& mark) {
  std::optional<Array> array = vtk_block_array(mesh_);
  if (!array) return;
  VtkXmlData data = describe(*array, role_mark(*array) + mark);
  // The array ends with this function, so what was borrowed of it must be owned.
  if (data.owned.empty()) data.owned = std::move(array->bytes).vector();
  data.borrowed = {};
  piece_.back().arrays.push_back(std::move(data));
  field_.back().arrays.push_back(own_texts("block_labels", array->labels));
  notes.push_back(format_ + " has no named blocks: their names are in the cell array \"block\"");
}

// Everything that VTK has no better place for goes into FieldData: metadata, names of labels, arrays of the
// mesh and of corners.
void VtkXmlWriter::add_field_data() {
  if (auto note = vtk_xml_note({mesh_.arrays}, mesh_.metadata)) notes.push_back(std::move(*note));
  VtkXmlSection section{"<FieldData>", "</FieldData>", {}};
  for (const auto& [key, value] : mesh_.metadata) {
    if (key == vtk_text_key) continue;
    const bool text = was_vtk_text(mesh_.metadata, Domain::mesh, key);
    const std::span<const std::string> values(&value, 1);
    section.arrays.push_back(text ? strings(key, values) : own_texts(key, values));
  }
  bool corners = false;
  for (const Array& array : mesh_.arrays) {
    const bool text = is_vtk_text(mesh_.metadata, array);
    if (array.role == Role::label && !text)
      section.arrays.push_back(own_texts(array.name + "_labels", array.labels));
    if (array.domain != Domain::mesh && array.domain != Domain::corner) continue;
    if (text) {
      section.arrays.push_back(describe_texts(array));
      continue;
    }
    corners = corners || array.domain == Domain::corner;
    const std::string tuples = " NumberOfTuples=\"" + std::to_string(array.count()) + "\"";
    const std::string mark = array.domain == Domain::corner ? " maille_domain=\"corner\"" : "";
    section.arrays.push_back(describe(array, tuples + mark + role_mark(array)));
  }
  if (corners) {
    notes.push_back(format_ +
                    " has no arrays on corners: they are in FieldData, where only maille knows them");
  }
  field_.push_back(std::move(section));
}

// The array is made for its name only; the values are those of the mesh, borrowed.
void VtkXmlWriter::add_points() {
  Array points = make_array("Points", Domain::point, mesh_.points.type, 3);
  VtkXmlData data = describe(points, "");
  data.borrowed = mesh_.points.bytes;
  VtkXmlSection section{"<Points>", "</Points>", {}};
  section.arrays.push_back(std::move(data));
  piece_.push_back(std::move(section));
}

void VtkXmlWriter::add_arrays(Domain domain, const char* element) {
  VtkXmlSection section{
      std::string("<") + element + active_attributes(domain) + ">", std::string("</") + element + ">", {}};
  for (const Array& array : mesh_.arrays) {
    if (array.domain != domain) continue;
    section.arrays.push_back(is_vtk_text(mesh_.metadata, array) ? describe_texts(array)
                                                                : describe(array, role_mark(array)));
  }
  piece_.push_back(std::move(section));
}

void VtkXmlWriter::put_ascii(const VtkXmlData& data) {
  const size_t size = size_of(data.type);
  const Bytes bytes = data.bytes();
  const size_t per_line = data.components > 1 ? data.components : 12;
  for (size_t i = 0; i * size < bytes.size(); ++i) {
    out_.put(i % per_line == 0 ? '\n' : ' ');
    put_scalar(out_, bytes.data() + i * size, data.type);
  }
  out_.put('\n');
}

std::string vtk_xml_inline(Bytes values, size_t number_size, bool big_endian) {
  const uint64_t size = values.size();
  std::vector<std::byte> bytes(sizeof size);
  store(bytes.data(), size);
  bytes.insert(bytes.end(), values.begin(), values.end());
  if (big_endian) {
    swap_numbers(std::span(bytes).first(sizeof size), sizeof size);
    swap_numbers(std::span(bytes).subspan(sizeof size), number_size);
  }
  return " format=\"binary\">\n" + to_base64(bytes) + "\n</DataArray>\n";
}

bool VtkXmlWriter::is_inline(const std::vector<VtkXmlSection>& of, const VtkXmlData& data) const {
  return &of == &field_ && data.bytes().size() <= most_inline_bytes;
}

void VtkXmlWriter::put_array(const VtkXmlData& data, bool in_tag, uint64_t& offset) {
  out_.put("<DataArray " + data.attributes);
  if (options_.ascii) {
    out_.put(" format=\"ascii\">");
    put_ascii(data);
    out_.put("</DataArray>\n");
    return;
  }
  if (in_tag) {
    out_.put(vtk_xml_inline(data.bytes(), size_of(data.type), options_.big_endian));
    return;
  }
  out_.put(" format=\"appended\" offset=\"" + std::to_string(offset) + "\"/>\n");
  // Each array is led by its size in 8 bytes (header_type UInt64).
  offset += sizeof(uint64_t) + data.bytes().size();
}

void VtkXmlWriter::put_appended(const VtkXmlData& data) {
  const Bytes bytes = data.bytes();
  const uint64_t size = bytes.size();
  if (!options_.big_endian) {
    out_.put_raw(size);
    out_.put_bytes(bytes);
    return;
  }
  // Reversed byte by byte while writing, so no second copy of the array is made.
  const auto put_reversed = [&](const std::byte* from, size_t count) {
    for (size_t k = count; k-- > 0;) out_.put(static_cast<char>(from[k]));
  };
  put_reversed(reinterpret_cast<const std::byte*>(&size), sizeof size);
  for (size_t i = 0; i < bytes.size(); i += size_of(data.type)) {
    put_reversed(bytes.data() + i, size_of(data.type));
  }
}

// The order of the appended data is that in which put_sections() gave out offsets.
void VtkXmlWriter::for_each_data(const std::function<void(const VtkXmlData&)>& act) const {
  for (const auto* sections : {&field_, &piece_}) {
    for (const VtkXmlSection& section : *sections) {
      for (const VtkXmlData& data : section.arrays) {
        if (!is_inline(*sections, data)) act(data);
      }
    }
  }
}

void VtkXmlWriter::put_sections(const std::vector<VtkXmlSection>& sections, uint64_t& offset) {
  for (const VtkXmlSection& section : sections) {
    out_.put(section.open + "\n");
    for (const VtkXmlData& data : section.arrays) put_array(data, is_inline(sections, data), offset);
    out_.put(section.close + "\n");
  }
}

// Offsets are given out while the elements are written; the data follow behind the last element in the same
// order.
Result<> VtkXmlWriter::write(const char* data_set, const std::string& counts) {
  const std::string name = data_set;
  uint64_t offset = 0;
  out_.put("<?xml version=\"1.0\"?>\n<VTKFile type=\"" + name + "\" version=\"1.0\" byte_order=\"");
  out_.put(options_.big_endian ? "BigEndian" : "LittleEndian");
  out_.put("\" header_type=\"UInt64\">\n<" + name + ">\n");
  put_sections(field_, offset);
  out_.put("<Piece NumberOfPoints=\"" + std::to_string(mesh_.point_count()) + "\"" + counts + ">\n");
  put_sections(piece_, offset);
  out_.put("</Piece>\n</" + name + ">\n");
  if (!options_.ascii) {
    out_.put("<AppendedData encoding=\"raw\">\n_");
    for_each_data([&](const VtkXmlData& data) { put_appended(data); });
    out_.put("\n</AppendedData>\n");
  }
  out_.put("</VTKFile>\n");
  return out_.finish();
}

}  // namespace maille
