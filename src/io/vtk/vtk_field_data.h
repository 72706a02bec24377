#pragma once

#include <maille/mesh.h>
#include <maille/source.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/vtk/vtk_text.h"

// What readers and writers of VTK's formats share with those that parse no XML.

namespace maille {

/// The Scalar for VTK's name of it ("Float32"); none for a name that is no type of numbers.
std::optional<Scalar> scalar_of_vtk(std::string_view name);
const char* vtk_name_of(Scalar type);

/// Texts of bytes, each ended by a zero.
std::vector<std::string> split_texts(Bytes bytes);

/// An integer of any type; negative ones come out above every count, so that one comparison finds them.
uint64_t integer_at(const Array& array, size_t i);

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

/// Arrays that say they are on corners but have another size are kept on the mesh.
void check_vtk_corner_arrays(Mesh& mesh, std::vector<std::string>& notes);

}  // namespace maille
