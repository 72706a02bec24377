#pragma once

#include <maille/mesh.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/budget.h"
#include "io/foam/polymesh.h"
#include "io/foam/polymesh_zones.h"

namespace maille {

// Cases that decomposePar divided: processor0, processor1, ... have a mesh each, and beside it the numbers
// that its points, faces and cells have in the whole one.

/// What a folder "polyMesh" holds besides zones.
struct FoamLists {
  Array points;
  std::vector<uint32_t> corners;
  std::vector<uint64_t> ends;  ///< by face, where its corners end
  std::vector<uint64_t> owner, neighbour;
  uint64_t cells = 0;
  std::vector<FoamPatch> patches;
};

/// The folders "polyMesh" of the processors of a case that has no mesh itself, by number; none where there
/// are none. Error: malformed_input, if one of them is missing.
Result<std::vector<std::string>> foam_processors_of(const std::string& case_folder);
/// The name of a folder with the files of several processors in one (OpenFOAM's file handler "collated"),
/// which are not read: "processors2"; empty where there is none.
std::string collated_processors_of(const std::string& case_folder);

/// Puts the meshes of processors together to the one that was divided, in its order.
class FoamProcessors {
 public:
  explicit FoamProcessors(const Limits& limits) : limits_(limits) {}
  /// The next one. Errors: malformed_input, cannot_read.
  Result<> add(const std::string& folder, const FoamLists& part, Budget& budget);
  /// Error: malformed_input, for what no processor has.
  Result<FoamLists> finish();

  /// Elements of zones, of cells, faces and points.
  struct ZoneElements {
    std::vector<std::string> names;
    std::vector<FoamZones::Element> elements;
  };
  ZoneElements zones(const FoamZoneKind& kind);

 private:
  /// In the whole mesh, by element of a part.
  struct Numbers {
    std::vector<uint64_t> points, cells;
    std::vector<uint64_t> faces;
    std::vector<bool> turned;  ///< faces that the whole mesh has the other way round
  };
  Result<Numbers> read_numbers(const std::string& folder, const FoamLists& part, Budget& budget) const;
  Result<std::vector<int64_t>> read_list(const std::string& folder, const char* name, uint64_t count,
                                         Budget& budget) const;
  Result<> add_points(const std::string& folder, const FoamLists& part, const Numbers& numbers,
                      Budget& budget);
  Result<> add_faces(const std::string& folder, const FoamLists& part, const Numbers& numbers,
                     Budget& budget);
  void add_patches(const FoamLists& part, const Numbers& numbers);
  Result<> add_zones(const std::string& folder, const FoamZoneKind& kind, size_t place,
                     std::span<const uint64_t> numbers, const std::vector<bool>& turned, Budget& budget);
  Result<> check_patches();

  static constexpr uint64_t nobody = ~uint64_t{0};
  struct Face {
    std::vector<uint32_t> corners;
    uint64_t owner = nobody, neighbour = nobody;
  };
  /// Faces of a patch of the whole mesh.
  struct Patch {
    FoamPatch patch;
    uint64_t first = nobody, last = 0, faces = 0;
  };

  const Limits& limits_;
  std::string first_folder_;
  Array points_;
  std::vector<bool> has_point_;
  std::vector<bool> has_cell_;
  std::vector<Face> faces_;
  std::vector<Patch> patches_;
  std::array<ZoneElements, 3> zones_;
};

}  // namespace maille
