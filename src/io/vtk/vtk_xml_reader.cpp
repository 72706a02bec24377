#include "io/vtk/vtk_xml_reader.h"

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

// A mark of our own says exactly what an array was; of other programs' files the active attributes of VTK
// tell as much as they can.
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

bool is_own_text(const pugi::xml_node& node) {
  return node.attribute(vtk_own_text_mark) && std::string_view(node.attribute("type").as_string()) == "UInt8";
}

Result<Array> read_text_array(const VtkXml& xml, pugi::xml_node node, Domain domain, const std::string& where,
                              Budget& budget, VtkTexts& texts) {
  const auto strings = MAILLE_TRY(read_string_array(xml, node, where, budget));
  const uint32_t components = std::max(node.attribute("NumberOfComponents").as_uint(1), 1u);
  if (components > 0xffff || strings.size() % components != 0) {
    return failure(ErrorCode::malformed_input, where + ": it has " + std::to_string(strings.size()) +
                                                   " texts in tuples of " + std::to_string(components));
  }
  MAILLE_CHECK(budget.take(strings.size(), sizeof(uint32_t)));
  return texts.numbers(node.attribute("Name").as_string(), domain, components, strings);
}

Result<> append_vtk_arrays(const VtkXml& xml, pugi::xml_node data, Domain domain, uint64_t count,
                           const std::string& where, bool first, Budget& budget, VtkTexts& texts,
                           std::vector<Array>& arrays) {
  const auto malformed = [](const std::string& place, const std::string& what) {
    return failure(ErrorCode::malformed_input, place + ": " + what);
  };
  size_t index = 0;
  // Arrays of points and cells may share one list.
  const auto next = [&] {
    while (index < arrays.size() && arrays[index].domain != domain) ++index;
    return index;
  };
  MAILLE_CHECK(for_each_vtk_array(
      xml, data, domain, where, budget, texts, [&](Array array, const std::string& place) -> Result<> {
        if (array.count() != count) {
          return malformed(place, "it has " + std::to_string(array.count()) + " tuples for " +
                                      std::to_string(count) + " " + name_of(domain) + "s");
        }
        if (first) {
          arrays.push_back(std::move(array));
          return {};
        }
        if (next() == arrays.size() || arrays[index].name != array.name || arrays[index].type != array.type ||
            arrays[index].components != array.components)
          return malformed(place, "pieces must have the same arrays in the same order");
        Buffer<std::byte>& bytes = arrays[index++].bytes;
        bytes.insert(bytes.end(), array.bytes.begin(), array.bytes.end());
        return {};
      }));
  if (!first && next() != arrays.size()) return malformed(where, "an array of the first piece is missing");
  return {};
}

Result<VtkFieldData> read_vtk_field_data(const VtkXml& xml, pugi::xml_node data_set, Budget& budget) {
  VtkFieldData field;
  // VTK writes FieldData into the data set; other programs put it beside it.
  for (const pugi::xml_node data : {data_set.child("FieldData"), data_set.parent().child("FieldData")}) {
    for (const pugi::xml_node node : data.children()) {
      const std::string name = node.attribute("Name").as_string();
      const std::string where = xml.file + ": FieldData, array \"" + name + "\"";
      if (std::string_view(node.attribute("type").as_string()) == "String" || is_own_text(node)) {
        auto strings = MAILLE_TRY(read_string_array(xml, node, where, budget));
        field.strings.push_back({name, std::move(strings), bool(node.attribute(vtk_own_text_mark))});
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

}  // namespace maille
