#pragma once

#include <string>
#include <utility>
#include <vector>

#include "io/vtk/vtk_data.h"

// What the readers of VTK's XML formats have in common.

namespace maille {

/// An integer of any type; negative ones come out above every count.
uint64_t integer_at(const Array& array, size_t i);

/// What an array of PointData or CellData (`data`) means: our own mark, else the active attributes, else the
/// type says colour.
Role vtk_role_of(const Array& array, pugi::xml_node data, pugi::xml_node node);

/// Calls act(array, place) for every array of numbers in an element; text is named in the notes.
template <class Act>
Result<> for_each_vtk_array(const VtkXml& xml, pugi::xml_node data, const std::string& where, Budget& budget,
                            std::vector<std::string>& notes, Act act) {
  for (const pugi::xml_node node : data.children()) {
    const std::string_view tag = node.name();
    if (tag != "DataArray" && tag != "Array") continue;
    const std::string name = node.attribute("Name").as_string();
    const std::string place = where + ", array \"" + name + "\"";
    if (std::string_view(node.attribute("type").as_string()) == "String") {
      notes.push_back(place + " holds text and was left out");
      continue;
    }
    Array array = MAILLE_TRY(read_data_array(xml, node, place, budget));
    array.role = vtk_role_of(array, data, node);
    MAILLE_CHECK(act(std::move(array), place));
  }
  return {};
}

/// What FieldData hold.
struct VtkFieldData {
  std::vector<Array> arrays;  ///< on the mesh, or where our own mark says so, on corners
  std::vector<std::pair<std::string, std::vector<std::string>>> strings;

  /// Gives an array of role label its labels.
  void give_labels(Array& array);
  /// The strings that were not given or taken.
  std::vector<std::pair<std::string, std::string>> metadata() const;
  /// Takes the array or strings of that name out.
  std::optional<Array> take_array(const std::string& name);
  std::vector<std::string> take_strings(const std::string& name);
};

/// FieldData of the data set and of the file.
Result<VtkFieldData> read_vtk_field_data(const VtkXml& xml, pugi::xml_node data_set, Budget& budget);

/// Arrays that say they are on corners but have another size are kept on the mesh.
void check_vtk_corner_arrays(Mesh& mesh, std::vector<std::string>& notes);

}  // namespace maille
