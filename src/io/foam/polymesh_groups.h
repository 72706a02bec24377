#pragma once

#include <maille/mesh_source.h>

#include <map>
#include <string>
#include <vector>

#include "io/foam/polymesh.h"

namespace maille {

/// As `maille generate` has them: names of cells, and the type of a patch behind the prefix.
inline constexpr char foam_label_array[] = "patch", foam_type_prefix[] = "patch.";

/// A kind of zones: sets of cells, faces or points with names, and the words by which its files tell them.
struct FoamZoneKind {
  const char* type;      ///< "cellZone": also the name of the array of labels, if it is one
  const char* file;      ///< "cellZones"
  const char* labels;    ///< "cellLabels"
  const char* metadata;  ///< keeps their order, and those that are empty: this and the name
};
inline constexpr FoamZoneKind foam_cell_zones = {"cellZone", "cellZones", "cellLabels", "openfoam.cellZone."};
inline constexpr FoamZoneKind foam_face_zones = {"faceZone", "faceZones", "faceLabels", "openfoam.faceZone."};
inline constexpr FoamZoneKind foam_point_zones = {"pointZone", "pointZones", "pointLabels",
                                                  "openfoam.pointZone."};
/// Blocks of faces of a zone are named so.
inline constexpr char foam_face_zone_prefix[] = "faceZone:";

/// Names in the order in which they came, and what OpenFOAM takes for them, each once.
class FoamNames {
 public:
  /// The number of a name; a new one for a new name.
  uint64_t number(const std::string& name);
  /// The number of a name that is there already; size(): it is not.
  uint64_t find(const std::string& name) const {
    const auto known = numbers_.find(name);
    return known == numbers_.end() ? words_.size() : known->second;
  }
  const std::vector<std::string>& words() const { return words_; }
  uint64_t size() const { return words_.size(); }

 private:
  std::map<std::string, uint64_t> numbers_;
  std::vector<std::string> words_;
};

/// What OpenFOAM takes for a name: no blank, sign or directive, and not what begins like a number.
std::string foam_word(const std::string& name);

/// An array of labels, read along the mesh a stretch at a time.
class FoamLabels {
 public:
  FoamLabels(const Array& array, size_t number) : array_(array), number_(number) {}
  Result<> read(MeshSource& mesh, uint64_t first, uint64_t count);
  /// The label of element `i` of those read; empty where there is none.
  const std::string& name(uint64_t i) const;

 private:
  const Array& array_;
  size_t number_;
  std::vector<std::byte> values_;
};
/// The array that names patches, and zones of cells where blocks have no names.
bool is_foam_label_array(const Array& array);
/// The arrays that tell the zones of a kind: "cellZone", and where zones overlap "cellZone:2" and so on.
bool is_foam_zone_array(const Array& array, const FoamZoneKind& kind, Domain domain);
/// Any of them.
bool is_foam_group_array(const Array& array);

/// The patches and zones of a mesh: those its metadata names, in that order, then those that blocks name,
/// then those of labels, as they come.
class FoamGroups {
 public:
  explicit FoamGroups(const MeshDescription& mesh);

  struct Target {
    bool zone = false;
    uint64_t number = 0;
  };
  /// Of a cell that is a face, by its block's name or else by its label.
  Target of_face(const std::string& block, const std::string& label);
  /// Call this behind the last cell: what labels named has types, too.
  void take_types(const MeshDescription& mesh);
  std::vector<FoamPatch> patches() const;

  FoamNames cell_zones, face_zones, point_zones;

 private:
  uint64_t patch(const std::string& name);

  FoamNames names_;
  std::vector<std::string> types_, entries_;
};

}  // namespace maille
