#include "io/vtk/vtk_xml_reader.h"

#include "base/bytes.h"
#include "io/buffered_writer.h"

namespace maille {
namespace {

Role role_of_name(std::string_view name) {
  for (const Role role : {Role::normal, Role::colour, Role::texture_coordinate, Role::tangent, Role::label}) {
    if (name == name_of(role)) return role;
  }
  return Role::none;
}

}  // namespace

uint64_t integer_at(const Array& array, size_t i) {
  const std::byte* at = array.bytes.data() + i * size_of(array.type);
  return with_type(array.type, [&](auto zero) { return static_cast<uint64_t>(load<decltype(zero)>(at)); });
}

Role vtk_role_of(const Array& array, pugi::xml_node data, pugi::xml_node node) {
  if (const pugi::xml_attribute mark = node.attribute("maille_role")) return role_of_name(mark.as_string());
  const auto active = [&](const char* attribute) {
    return array.name == data.attribute(attribute).as_string();
  };
  if (array.name.empty()) return Role::none;
  if (active("Normals") && array.components == 3) return Role::normal;
  if (active("TCoords")) return Role::texture_coordinate;
  if (active("Tangents")) return Role::tangent;
  const bool colours = array.type == Scalar::u8 && (array.components == 3 || array.components == 4);
  return active("Scalars") && colours ? Role::colour : Role::none;
}

void VtkFieldData::give_labels(Array& array) {
  if (array.role == Role::label) array.labels = take_strings(array.name + "_labels");
}

std::vector<std::string> VtkFieldData::take_strings(const std::string& name) {
  for (auto found = strings.begin(); found != strings.end(); ++found) {
    if (found->first != name) continue;
    std::vector<std::string> values = std::move(found->second);
    strings.erase(found);
    return values;
  }
  return {};
}

std::optional<Array> VtkFieldData::take_array(const std::string& name) {
  for (auto found = arrays.begin(); found != arrays.end(); ++found) {
    if (found->name != name) continue;
    Array array = std::move(*found);
    arrays.erase(found);
    return array;
  }
  return std::nullopt;
}

std::vector<std::pair<std::string, std::string>> VtkFieldData::metadata() const {
  std::vector<std::pair<std::string, std::string>> list;
  for (const auto& [name, values] : strings) {
    std::string joined;
    for (size_t i = 0; i < values.size(); ++i) joined += (i ? "\n" : "") + values[i];
    list.emplace_back(name, std::move(joined));
  }
  return list;
}

Result<VtkFieldData> read_vtk_field_data(const VtkXml& xml, pugi::xml_node data_set, Budget& budget) {
  VtkFieldData field;
  for (const pugi::xml_node data : {data_set.child("FieldData"), data_set.parent().child("FieldData")}) {
    for (const pugi::xml_node node : data.children()) {
      const std::string name = node.attribute("Name").as_string();
      const std::string where = xml.file + ": FieldData, array \"" + name + "\"";
      if (std::string_view(node.attribute("type").as_string()) == "String") {
        auto strings = MAILLE_TRY(read_string_array(xml, node, where, budget));
        field.strings.emplace_back(name, std::move(strings));
        continue;
      }
      Array array = MAILLE_TRY(read_data_array(xml, node, where, budget));
      array.role = vtk_role_of(array, data, node);
      if (std::string_view(node.attribute("maille_domain").as_string()) == "corner") {
        array.domain = Domain::corner;
      }
      field.arrays.push_back(std::move(array));
    }
  }
  return field;
}

void check_vtk_corner_arrays(Mesh& mesh, std::vector<std::string>& notes) {
  for (Array& array : mesh.arrays) {
    if (array.domain == Domain::corner && array.count() != mesh.corner_count()) {
      notes.push_back("array \"" + array.name +
                      "\" says it is on corners, but has another size; it is kept on the mesh");
      array.domain = Domain::mesh;
    }
  }
}

}  // namespace maille
