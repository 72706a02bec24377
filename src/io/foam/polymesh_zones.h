#pragma once

#include <maille/mesh.h>

#include <span>
#include <string>
#include <vector>

#include "base/scratch_file.h"
#include "io/budget.h"
#include "io/cell_store.h"
#include "io/foam/foam_file.h"
#include "io/foam/polymesh_groups.h"
#include "io/list_sorter.h"

namespace maille {

/// The zones of cells, faces or points in a folder, sorted out of core by element, so that they can be met
/// along the mesh in one pass.
class FoamZones {
 public:
  /// `memory`: bytes, about; `folder`: of temporary files.
  FoamZones(const FoamZoneKind& kind, uint64_t memory, std::string folder)
      : kind_(kind), sorted_(memory, std::move(folder)) {}

  /// Reads the file of zones; `elements`: how many the mesh has. Errors: malformed_input, memory_bound.
  Result<> read(FoamReader& file, uint64_t elements, Budget& budget);
  /// The same of zones that are known: elements in the order of their zones' lists.
  struct Element {
    uint64_t element = 0, zone = 0;
    bool flipped = false;
  };
  Result<> take(std::vector<std::string> names, std::span<const Element> elements);
  const std::vector<std::string>& names() const { return names_; }

  struct Use {
    uint64_t zone = 0, place = 0;  ///< place: in its list
    bool flipped = false;
  };
  /// The zones of an element, ascending, each once; elements in ascending order. Valid until the next call.
  Result<std::span<const Use>> of(uint64_t element);
  /// Begins at the first element again.
  Result<> rewind() { return sorted_.rewind(); }

  /// How many zones have an element in common, at most.
  uint64_t layers() const { return layers_; }
  /// Whether blocks can be named by these zones: none overlap, and they change but seldom along the mesh.
  bool are_runs() const { return layers_ == 1 && runs_ <= most_runs; }

 private:
  // Beyond this blocks would be too many, and zones are arrays of labels. Chosen, not swept.
  static constexpr uint64_t most_runs = 1024;
  Result<> read_zone(FoamReader& file, uint64_t elements, Budget& budget);
  Result<> read_flips(FoamReader& file, Budget& budget, std::vector<bool>& flips);
  Result<> read_labels(FoamReader& file, uint64_t elements, Budget& budget, const std::vector<bool>& flips);
  Result<> skip_labels(FoamReader& file);
  Result<> count();

  const FoamZoneKind& kind_;
  std::vector<std::string> names_;
  ListSorter<4> sorted_;  ///< element, zone, place, whether it is flipped
  std::vector<Use> uses_;
  uint64_t layers_ = 0, runs_ = 0;
};

/// The faces of zones: met face by face, in the order of the file, given zone by zone.
class FoamZoneFaces {
 public:
  FoamZoneFaces(uint64_t memory, std::string folder) : sorted_(memory, std::move(folder)) {}
  /// A face as it stands in the file; a zone that has it flipped sees it from the other side.
  Result<> add(std::span<const FoamZones::Use> uses, std::span<const uint32_t> corners);
  /// Call this behind the last one: adds a block of faces for each zone that has some, and calls
  /// add_cell(type, corners) for each face.
  template <class F>
  Result<> add_blocks(const FoamZones& names, BlockShapes& shapes, F add_cell) {
    MAILLE_CHECK(sorted_.sort());
    for (size_t zone = 0; zone < zones_.size(); ++zone) {
      const uint64_t faces = zones_[zone].faces;
      if (faces == 0) continue;
      const CellType type = zones_[zone].types.type();
      for (uint64_t i = 0; i < faces; ++i) {
        MAILLE_CHECK(add_cell(type, std::span<const uint32_t>(sorted_.front()->list)));
        MAILLE_CHECK(sorted_.take());
      }
      shapes.add(faces, type, foam_face_zone_prefix + names.names()[zone]);
    }
    return {};
  }

 private:
  struct Zone {
    FoamPatchType types;
    uint64_t faces = 0;
  };
  ListSorter<2> sorted_;  ///< zone, place
  std::vector<Zone> zones_;
  std::vector<uint32_t> turned_;
};

/// The zones of elements as arrays of labels: the k-th zone of an element in the k-th array, nothing for
/// none.
std::vector<Array> foam_zone_arrays(const FoamZones& zones, const FoamZoneKind& kind, Domain domain);
/// Puts an element of such an array: 0 for no zone, else the zone's number plus one.
void put_foam_label(Scalar type, uint64_t value, std::byte* to);
void add_foam_zone_metadata(const FoamZones& zones, const FoamZoneKind& kind,
                            std::vector<std::pair<std::string, std::string>>& metadata);

/// Whether the folder has a file of these zones, packed or not.
bool has_foam_zones(const std::string& folder, const FoamZoneKind& kind);

}  // namespace maille
