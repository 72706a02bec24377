#include "volume/cells/hull.h"

#include <gtest/gtest.h>

#include <vector>

namespace maille {
namespace {

// Else n triangles over sqrt(n) points take n^1.5 steps to decode.
TEST(Hull, LooksAtNoMoreThan64CellsAroundAPoint) {
  const unsigned triangle_kind = kind_of(CellType::triangle);
  Hull hull;
  const uint32_t hub = hull.add_point(0), first = hull.add_point(1);
  uint32_t before = first;
  for (uint32_t i = 2; i < 1000; ++i) {
    const uint32_t next = hull.add_point(i);
    const std::array<uint32_t, 3> corners = {hub, before, next};
    hull.add_cell(triangle_kind, corners.data(), 0, i);
    before = next;
  }
  unsigned seen = 0;
  EXPECT_FALSE(hull.around(hub, [&](uint32_t, uint32_t) { return ++seen > 64; }));
  EXPECT_EQ(seen, 64u);
  const std::array<uint32_t, 2> oldest = {hub, first}, newest = {hub, before};
  EXPECT_EQ(hull.find_face(2, oldest.data(), 2).cell, no_slot);
  EXPECT_NE(hull.find_face(2, newest.data(), 2).cell, no_slot);
}

// Lists go on in further blocks after eight cells, and blocks of points that left are used again.
TEST(Hull, ListsTheCellsAroundAPointNewestFirstAlsoWhereListsWereBefore) {
  const unsigned line_kind = kind_of(CellType::line);
  Hull hull;
  for (unsigned round = 0; round < 3; ++round) {
    const uint32_t hub = hull.add_point(100 * round);
    std::vector<uint32_t> cells, ends;
    for (uint32_t i = 1; i < 40; ++i) {
      ends.push_back(hull.add_point(100 * round + i));
      const std::array<uint32_t, 2> corners = {ends.back(), hub};
      cells.push_back(hull.add_cell(line_kind, corners.data(), 0, i));
      std::vector<uint32_t> listed;
      hull.around(hub, [&](uint32_t cell, uint32_t corner) {
        EXPECT_EQ(corner, 1u);
        listed.push_back(cell);
        return false;
      });
      EXPECT_EQ(listed, std::vector<uint32_t>(cells.rbegin(), cells.rend()));
    }
    hull.remove_point(hub);
    for (const uint32_t end : ends) hull.remove_point(end);
    hull.free_points();
    EXPECT_EQ(hull.live_cells(), 0u);
    EXPECT_EQ(hull.live_points(), 0u);
  }
}

}  // namespace
}  // namespace maille
