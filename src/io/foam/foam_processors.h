#pragma once

#include <maille/mesh.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/budget.h"
#include "io/foam/foam_case.h"
#include "io/foam/polymesh.h"
#include "io/foam/polymesh_zones.h"

namespace maille {

// Cases that decomposePar divided: processor0, processor1, ... have a mesh each, and beside it the numbers
// that its points, faces and cells have in the whole one. Files of several processors may be one (OpenFOAM's
// file handler "collated"), in a folder processors4, or processors4_0-1 and processors4_2-3.

/// Where the files of a processor are.
struct FoamPart {
  std::string folder;                  ///< "case/processor1"
  std::optional<uint64_t> block = {};  ///< of each file in it, where that is of several processors

  std::string mesh() const { return folder + "/constant/polyMesh"; }
};

/// The times of a case: its own, and those that only its processors have, as far as they can be put together;
/// by value. None where the path says which one is meant.
std::vector<FoamTime> foam_times_of(const std::string& path);
/// Whether processors have fields, but of meshes that are no parts of the case's, as far as files tell.
bool has_other_processors(const std::string& case_folder);
/// The folder of the case that a path names, or of a file in it.
std::string foam_case_folder(const std::string& path);

/// What a folder "polyMesh" holds besides zones, checked as far as one file goes: points exist, cells are
/// below twice the faces.
struct FoamLists {
  Array points;
  std::vector<uint32_t> corners;
  std::vector<uint64_t> ends;  ///< by face, where its corners end
  std::vector<uint64_t> owner, neighbour;
  uint64_t cells = 0;
  std::vector<FoamPatch> patches;
};

/// The processors of a case, by number; none where there are none. Error: malformed_input, if one of them is
/// missing.
Result<std::vector<FoamPart>> foam_processors_of(const std::string& case_folder);

/// Puts the meshes of processors together to the one that was divided, in its order. add() is called for
/// each, by number, then finish(); then zones() and parts(). Memory is that of the whole mesh with a list for
/// each face.
class FoamProcessors {
 public:
  explicit FoamProcessors(const Limits& limits) : limits_(limits) {}
  /// Adds the next processor. Errors: malformed_input, for numbers that contradict those before; cannot_read;
  /// memory_bound.
  Result<> add(const FoamPart& place, const FoamLists& part, Budget& budget);
  /// Error: malformed_input, for what no processor has.
  Result<FoamLists> finish();

  /// Elements of zones, of cells, faces and points.
  struct ZoneElements {
    std::vector<std::string> names;
    std::vector<FoamZones::Element> elements;
  };
  ZoneElements zones(const FoamZoneKind& kind);

  /// The numbers in the whole mesh of a part's elements.
  struct Numbers {
    std::vector<uint64_t> points, cells;
    std::vector<uint64_t> faces;
    std::vector<bool> turned;  ///< faces that the whole mesh has the other way round
  };
  /// What the fields of a part need.
  struct Part {
    FoamPart place;
    Numbers numbers;
    std::vector<FoamPatch> patches;
    uint64_t inner_faces = 0;
  };
  const std::vector<Part>& parts() const { return parts_; }

 private:
  Result<Numbers> read_numbers(const FoamPart& place, const FoamLists& part, Budget& budget) const;
  Result<std::vector<int64_t>> read_list(const FoamPart& place, const char* name, uint64_t count,
                                         Budget& budget) const;
  Result<> add_points(const std::string& folder, const FoamLists& part, const Numbers& numbers,
                      Budget& budget);
  Result<> add_faces(const std::string& folder, const FoamLists& part, const Numbers& numbers,
                     Budget& budget);
  void add_patches(const FoamLists& part, const Numbers& numbers);
  Result<> add_zones(const FoamPart& place, const FoamZoneKind& kind, size_t which,
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
  std::vector<Part> parts_;
  std::vector<bool> has_point_;
  std::vector<bool> has_cell_;
  std::vector<Face> faces_;
  std::vector<Patch> patches_;
  std::array<ZoneElements, 3> zones_;
};

/// Whether a patch has faces between processors, and whole faces of a cyclic one of which processors have a
/// side each.
bool is_between_processors(const FoamPatch& patch);
/// "referPatch left;": the cyclic patch that the faces are of; empty where there is none.
std::string referred_patch(const FoamPatch& patch);

}  // namespace maille
