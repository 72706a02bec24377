#pragma once

#include <maille/mesh.h>

#include <map>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

// Text arrays of VTK files in a mesh, which has numbers only: labels of an array, or metadata.

namespace maille {

/// Metadata: what was text in the VTK file the mesh came from, a line for each ("cell NAME"; "mesh NAME" is
/// metadata or an array on the mesh). Writers of VTK's formats make text of it again. Texts that are not in
/// the list have other sources (names of blocks, labels, comments of PLY files).
inline constexpr char vtk_text_key[] = "vtk.text";

/// Whether this was text in a VTK file.
bool was_vtk_text(const std::vector<std::pair<std::string, std::string>>& metadata, Domain domain,
                  const std::string& name);

/// Whether writers of VTK's formats make text of the array again: it was text, and each number has its label.
bool is_vtk_text(const std::vector<std::pair<std::string, std::string>>& metadata, const Array& array);

/// The texts of an array that was text, `components` for each tuple; nothing where a number has no label.
std::vector<std::string> texts_of(const Array& array);

/// Turns text into numbers while a file is read: each text gets one number in all pieces of the file.
class VtkTexts {
 public:
  /// An array with Role::label; finish() gives it its labels.
  Array numbers(const std::string& name, Domain domain, uint32_t components,
                const std::vector<std::string>& texts);
  void add_metadata(const std::string& name) { lines_ += "mesh " + name + "\n"; }
  /// Labels of the arrays that numbers() made, and the list of all texts as metadata.
  void finish(Mesh& mesh);

 private:
  struct Labels {
    std::unordered_map<std::string, uint32_t> numbers;
    std::vector<std::string> texts;
  };
  std::map<std::pair<Domain, std::string>, Labels> arrays_;
  std::string lines_;
};

}  // namespace maille
