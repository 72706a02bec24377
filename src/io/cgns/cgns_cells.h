#pragma once

#include <optional>

#include "io/cell_store.h"
#include "io/cgns/cgns_tree.h"
#include "io/zone_fields.h"

namespace maille {

/// Makes cells of one zone after the other. Elements have numbers in their zone, from 1 on; sections of them
/// come by these numbers, whatever the order of nodes in the file.
class CgnsCells {
 public:
  CgnsCells(const std::string& file, const CgnsTree& tree, Budget& budget)
      : file_(file), tree_(tree), budget_(budget) {}

  /// Those of a structured zone of so many points in one, two or three directions, whose product the caller
  /// has checked.
  Result<> add_grid(std::span<const uint64_t> points, uint64_t first_point, const std::string& name);
  /// Those of the nodes Elements_t among the children of a zone. Where there are polyhedra, polygons (NGON_n)
  /// are their faces and no cells. `prefix`: of the names of blocks; `zone`: the name where there is one
  /// section.
  Result<> add_sections(const std::vector<CgnsNode>& children, uint64_t first_point, uint64_t points,
                        const std::string& prefix, const std::string& zone);
  /// The cells of this dimension of the zone that was added last.
  std::vector<ElementRun> cells_of(int dimension) const;
  /// The cell of an element of that zone. None: it was a face of polyhedra, for which a polygon of this name
  /// was added. Error: malformed_input, there is no such element.
  Result<std::optional<uint64_t>> cell_of(int64_t element, const std::string& face_name);
  /// Whether these are all elements of the section of this name, which tells nothing new.
  bool is_section(const std::string& name, int64_t first, int64_t last) const;

  /// Polygons of all zones that are faces of polyhedra which nothing but ParentElements names: cells here.
  uint64_t faces_of_unread() const { return faces_of_unread_; }
  uint64_t count() const { return cells_.count(); }
  CellType type(uint64_t cell) const { return cells_.type(cell); }
  std::vector<CellBlock> take() { return shapes_.take(cells_); }

 private:
  /// Elements of one node, whose numbers follow each other.
  struct Section {
    CgnsNode node;
    std::vector<CgnsNode> children;
    int64_t type = 0;
    uint64_t first = 0, count = 0;  ///< numbers of elements
    std::optional<uint64_t> first_cell;
    std::vector<int64_t> values;
    std::vector<uint64_t> starts;  ///< in the values; of NGON_n and NFACE_n
  };

  Result<Section> read_section(const CgnsNode& node) const;
  Result<> read_starts(Section& section) const;
  Result<> add_cells(Section& section, const std::string& name);
  Result<> add_mixed(const Section& section, const std::string& name);
  Result<> add_polyhedra(const Section& section, const std::string& name);
  Result<> add_nodes(const Section& section, std::span<const int64_t> values, std::span<const uint8_t> order);
  Result<> add_face(const Section& polyhedra, int64_t face);
  const Section* section_of(int64_t element) const;
  tl::unexpected<Error> malformed(const Section& section, const std::string& what) const {
    return failure(ErrorCode::malformed_input, file_ + ": \"" + section.node.path + "\": " + what);
  }
  tl::unexpected<Error> unknown_type(const Section& section, int64_t type) const;

  const std::string& file_;
  const CgnsTree& tree_;
  Budget& budget_;
  CellStore cells_;
  BlockShapes shapes_;
  std::vector<Section> sections_;  ///< of the zone
  uint64_t zone_cells_ = 0;        ///< the first of the zone
  uint64_t first_point_ = 0, points_ = 0;
  uint64_t faces_of_unread_ = 0;
};

}  // namespace maille
