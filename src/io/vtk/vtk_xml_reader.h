#pragma once

#include <string>
#include <utility>

#include "io/vtk/vtk_data.h"
#include "io/vtk/vtk_field_data.h"

// What the readers of VTK's XML formats have in common.

namespace maille {

/// What an array of PointData or CellData (`data`) means: our own mark decides, else the active attributes,
/// and bytes that are active scalars of three or four components are colours.
Role vtk_role_of(const Array& array, pugi::xml_node data, pugi::xml_node node);

/// Reads an array of text as numbers of labels. Errors: malformed_input, memory_bound.
Result<Array> read_text_array(const VtkXml& xml, pugi::xml_node node, Domain domain, const std::string& where,
                              Budget& budget, VtkTexts& texts);

/// Calls act(array, place) for every array in an element, in their order; `place` names it for messages. The
/// first error, of reading or of act(), ends it.
template <class Act>
Result<> for_each_vtk_array(const VtkXml& xml, pugi::xml_node data, Domain domain, const std::string& where,
                            Budget& budget, VtkTexts& texts, Act act) {
  for (const pugi::xml_node node : data.children()) {
    const std::string_view tag = node.name();
    if (tag != "DataArray" && tag != "Array") continue;
    const std::string name = node.attribute("Name").as_string();
    const std::string place = where + ", array \"" + name + "\"";
    if (std::string_view(node.attribute("type").as_string()) == "String") {
      Array numbers = MAILLE_TRY(read_text_array(xml, node, domain, place, budget, texts));
      MAILLE_CHECK(act(std::move(numbers), place));
      continue;
    }
    Array array = MAILLE_TRY(read_data_array(xml, node, place, budget));
    array.role = vtk_role_of(array, data, node);
    array.domain = domain;
    MAILLE_CHECK(act(std::move(array), place));
  }
  return {};
}

/// Appends the arrays of one piece of a mesh, with `count` tuples each, to those of the pieces before. The
/// first piece says which there are; the others must have those of the domain in the same order. Errors:
/// malformed_input, memory_bound.
Result<> append_vtk_arrays(const VtkXml& xml, pugi::xml_node data, Domain domain, uint64_t count,
                           const std::string& where, bool first, Budget& budget, VtkTexts& texts,
                           std::vector<Array>& arrays);

/// Whether a tag has vtk_own_text_mark, and its text is in bytes.
bool is_own_text(const pugi::xml_node& node);

/// Reads FieldData of the data set and of the file. Errors: malformed_input, memory_bound.
Result<VtkFieldData> read_vtk_field_data(const VtkXml& xml, pugi::xml_node data_set, Budget& budget);

}  // namespace maille
