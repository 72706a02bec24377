#include "generate/transfinite_grading.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <cmath>

namespace maille {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Grading sections(std::initializer_list<double> cells) {
  Grading grading;
  for (const double share : cells) grading.push_back({1, share, 1});
  return grading;
}

// Measured: steps of meshes made by OpenFOAM 1912.
TEST(SectionCells, AreThoseOfBlockMesh) {
  EXPECT_THAT(section_cells(sections({1, 3, 6}), 5), ElementsAre(1, 2, 2));
  EXPECT_THAT(section_cells(sections({3, 3, 4}), 5), ElementsAre(2, 2, 1));
  EXPECT_THAT(section_cells(sections({4, 3, 3}), 5), ElementsAre(1, 2, 2));
  EXPECT_THAT(section_cells(sections({2, 2, 1}), 4), ElementsAre(1, 2, 1));
  EXPECT_THAT(section_cells(sections({2, 2, 1, 1}), 9), ElementsAre(2, 3, 2, 2));
  EXPECT_THAT(section_cells(sections({1, 1, 1}), 4), ElementsAre(2, 1, 1));
  EXPECT_THAT(section_cells(sections({1, 1, 1}), 7), ElementsAre(3, 2, 2));
  EXPECT_THAT(section_cells(sections({9, 1, 1, 1}), 4), ElementsAre(4, 0, 0, 0));
  EXPECT_THAT(section_cells(sections({9, 1, 1, 1}), 3), IsEmpty());
}

RC_GTEST_PROP(SectionCells, AddUpToTheCellsOfTheEdge, ()) {
  Grading grading;
  for (int n = *rc::gen::inRange(1, 6); n > 0; --n) {
    grading.push_back({1, *rc::gen::inRange(1, 100) * 0.1, 1});
  }
  const auto cells = *rc::gen::inRange<uint32_t>(1, 200);
  const auto counts = section_cells(grading, cells);
  uint64_t sum = 0;
  for (const uint32_t count : counts) sum += count;
  RC_ASSERT(counts.empty() || sum == cells);
}

RC_GTEST_PROP(EdgeParameters, LastCellIsTheExpansionTimesTheFirst, ()) {
  const auto cells = *rc::gen::inRange<uint32_t>(2, 200);
  const double expansion = std::exp(*rc::gen::inRange(-50, 50) * 0.1);
  const auto t = edge_parameters({{1, 1, expansion}}, cells);
  RC_ASSERT(t.size() == cells + 1);
  RC_ASSERT(t.front() == 0 && t.back() == 1);
  const double ratio = (t[cells] - t[cells - 1]) / (t[1] - t[0]);
  RC_ASSERT(std::fabs(ratio / expansion - 1) < 1e-6);
  for (uint32_t i = 1; i + 1 < cells; ++i) {
    RC_ASSERT(std::fabs((t[i + 1] - t[i]) / (t[i] - t[i - 1]) - std::pow(expansion, 1.0 / (cells - 1))) <
              1e-6);
  }
}

TEST(EdgeParameters, SectionsWithoutCellsLeaveTheirLengthToTheNext) {
  const Grading grading{{0.3, 0.47, 4}, {0.2, 0.06, 1}, {0.3, 0.47, 0.25}};
  const std::vector<double> measured{0,
                                     0.041176017127380074,
                                     0.10653887003124378,
                                     0.21029593149047973,
                                     0.37499999999999994,
                                     0.5892857142857142,
                                     0.6964285714285713,
                                     1.0};
  const auto t = edge_parameters(grading, 7);
  ASSERT_EQ(t.size(), measured.size());
  for (size_t i = 0; i < t.size(); ++i) EXPECT_NEAR(t[i], measured[i], 1e-15);
}

TEST(EdgeParameters, AreEvenWithMoreSectionsThanCells) {
  EXPECT_THAT(edge_parameters(sections({9, 1, 1}), 2), ElementsAre(0, 0.5, 1));
}

}  // namespace
}  // namespace maille
