#include "generate/transfinite_cell.h"

#include <vector>

#include "generate/transfinite_topology.h"

namespace maille {

namespace {

using Corners = std::array<uint8_t, 8>;

// The 24 ways a hexahedron can be turned: the corner that comes first, and which edge goes where from it.
// Orders o < 3 of axes are even, as are mirrors at an even number of axes.
std::vector<Corners> turns() {
  constexpr unsigned order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  std::vector<Corners> all;
  for (unsigned o = 0; o < 6; ++o) {
    for (unsigned mirrored = 0; mirrored < 8; ++mirrored) {
      const bool even = ((mirrored ^ mirrored >> 1 ^ mirrored >> 2) & 1) == 0;
      if (even != (o < 3)) continue;  // a mirror image would be inside out
      Corners corners{};
      for (unsigned xyz = 0; xyz < 8; ++xyz) {
        std::array<unsigned, 3> at{};
        for (unsigned a = 0; a < 3; ++a) at[order[o][a]] = (xyz >> a ^ mirrored >> a) & 1;
        corners[corner_at(xyz & 1, xyz >> 1 & 1, xyz >> 2)] =
            static_cast<uint8_t>(corner_at(at[0], at[1], at[2]));
      }
      all.push_back(corners);
    }
  }
  return all;
}

unsigned distinct(const uint64_t* nodes) {
  unsigned count = 0;
  for (unsigned i = 0; i < 8; ++i) {
    bool known = false;
    for (unsigned j = 0; j < i; ++j) known = known || nodes[i] == nodes[j];
    count += known ? 0 : 1;
  }
  return count;
}

ReducedCell reduced(CellType type, const Corners& turn, std::initializer_list<uint8_t> corners) {
  ReducedCell cell;
  cell.type = type;
  cell.count = static_cast<uint8_t>(corners.size());
  unsigned i = 0;
  for (const uint8_t corner : corners) cell.corner[i++] = turn[corner];
  return cell;
}

}  // namespace

ReducedCell reduce_hexahedron(const uint64_t* nodes) {
  static const std::vector<Corners> all = turns();
  const unsigned count = distinct(nodes);
  if (count == 8) return {};
  // Each shape is looked for in one position only, in all turns of the cell; the first that fits counts.
  for (const Corners& turn : all) {
    const auto one = [&](unsigned a, unsigned b) { return nodes[turn[a]] == nodes[turn[b]]; };
    const bool apex = one(4, 5) && one(5, 6) && one(6, 7);
    if (count == 6 && one(0, 3) && one(4, 7)) return reduced(CellType::wedge, turn, {0, 2, 1, 4, 6, 5});
    if (count == 5 && apex) return reduced(CellType::pyramid, turn, {0, 1, 2, 3, 4});
    if (count == 4 && apex && one(0, 3)) return reduced(CellType::tetrahedron, turn, {0, 1, 2, 4});
  }
  return {};
}

}  // namespace maille
