#include "volume/cells/hull.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace maille
