#pragma once

#include <string>
#include <utility>
#include <vector>

#include "io/vtk/vtk_data.h"
#include "io/vtk/vtk_text.h"

// What the readers of VTK's XML formats have in common.

namespace maille {

/// An integer of any type; negative ones come out above every count, so that one comparison finds them.
uint64_t integer_at(const Array& array, size_t i);

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

/// What FieldData hold, until readers have taken out what they know.
struct VtkFieldData {
  struct Strings {
    std::string name;
    std::vector<std::string> values;
    bool own = false;  ///< by our own mark: names and metadata that were no text arrays of a VTK file
  };
  std::vector<Array> arrays;  ///< on the mesh, or where our own mark says so, on corners
  std::vector<Strings> strings;

  /// Gives an array of role label its labels.
  void give_labels(Array& array);
  /// The arrays and the strings that were not given or taken to the mesh: a single string as metadata,
  /// several as an array.
  void move_to(Mesh& mesh, VtkTexts& texts);
  /// Takes the array or strings of that name out.
  std::optional<Array> take_array(const std::string& name);
  std::vector<std::string> take_strings(const std::string& name);
};

/// The mark of texts that were no text in a VTK file. Where they are bytes, as split_texts() takes them,
/// programs that know no text read the file, too (meshio).
inline constexpr char vtk_own_text_mark[] = "maille_text";
bool is_own_text(const pugi::xml_node& node);

/// Reads FieldData of the data set and of the file. Errors: malformed_input, memory_bound.
Result<VtkFieldData> read_vtk_field_data(const VtkXml& xml, pugi::xml_node data_set, Budget& budget);

/// Arrays that say they are on corners but have another size are kept on the mesh.
void check_vtk_corner_arrays(Mesh& mesh, std::vector<std::string>& notes);

}  // namespace maille
