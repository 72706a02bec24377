#pragma once

#include <maille/mesh_source.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

// Which arrays of a mesh are compressed: --arrays and --drop.
namespace maille::tool {

/// Names as of arrays_called(): of an array, or what programs call its role.
struct ArraySelection {
  std::optional<std::vector<std::string>> wanted;  ///< besides positions and cells; none: all
  std::vector<std::string> dropped;
  /// Names that no array has are no mistake: of a series whose arrays may come later, and of settings for any
  /// mesh.
  bool lenient = false;

  bool takes_all() const { return !wanted && dropped.empty(); }
};

/// For each of the arrays whether it is taken. Errors (usage): a name that no array has; a wanted array that
/// is dropped.
Result<std::vector<bool>> taken_arrays(const ArraySelection& selection, const std::vector<Array>& arrays,
                                       const std::string& input);

/// Leaves out the arrays that are not taken. Errors as above.
Result<> select_arrays(const ArraySelection& selection, Mesh& mesh, const std::string& input);
/// The same of a mesh that is read in parts.
Result<std::unique_ptr<MeshSource>> select_arrays(const ArraySelection& selection,
                                                  std::unique_ptr<MeshSource> mesh, const std::string& input);

}  // namespace maille::tool
