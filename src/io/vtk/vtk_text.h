#pragma once

#include <maille/vtk.h>

#include <map>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

// Text arrays of VTK files in a mesh, which has numbers only: labels of an array, or metadata.

namespace maille {

/// Turns text into numbers while a file is read: each text gets one number in all pieces of the file, in the
/// order in which texts come first. So the numbers do not depend on the hash table.
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
