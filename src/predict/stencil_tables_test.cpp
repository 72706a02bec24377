#include "predict/stencil_tables.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <numeric>

#include "predict/table_text.h"
#include "predict/testing.h"

namespace maille::testing {
namespace {

constexpr int32_t one = 1 << tables::table_bits;
// Rounding, and what it leaves for the first weight of a long row.
constexpr double tolerance = 10.0 / one;

void expect_row(const int32_t* row, const std::vector<double>& weights) {
  int32_t sum = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    sum += row[i];
    EXPECT_NEAR(double(row[i]) / one, weights[i], tolerance) << "sample " << i;
  }
  EXPECT_EQ(sum, one);
}

PredictionRule rule_at(unsigned noise_level) {
  const double noise = tables::noise_of_level[noise_level];
  return noise > 0 ? noise_rule(Covariance::gaussian, noise) : taylor_rule(Covariance::gaussian);
}

TEST(StencilTables, AreWhatTheTheoryGivesToday) {
  std::ifstream file(MAILLE_TESTS_DIR "/../src/predict/stencil_tables.h");
  const std::string checked_in{std::istreambuf_iterator<char>(file), {}};
  EXPECT_TRUE(checked_in == stencil_tables_text()) << "run maille_tables > src/predict/stencil_tables.h";
}

TEST(StencilTables, HavePolygonsWhereTheirFunctionSays) {
  for (unsigned level = 0; level < tables::noise_levels; ++level) {
    for (const auto& [degree, known] :
         {std::pair{3u, 1u}, {3u, 2u}, {4u, 3u}, {6u, 4u}, {9u, 8u}, {16u, 15u}}) {
      expect_row(
          tables::polygon_weights(level, degree, known),
          weights_of("polygon:" + std::to_string(degree) + ":" + std::to_string(known), rule_at(level)));
    }
  }
  EXPECT_EQ(tables::polygon_weights(0, 16, 15) + 15, std::end(tables::polygon[0]));
}

TEST(StencilTables, HavePolygonsBesideOthersWhereTheirFunctionSays) {
  for (unsigned level = 0; level < tables::noise_levels; ++level) {
    for (const auto& [m, n, known] :
         {std::tuple{3u, 3u, 0u}, {3u, 6u, 3u}, {4u, 4u, 0u}, {4u, 4u, 1u}, {6u, 5u, 2u}}) {
      const std::string name =
          "polygon-beside:" + std::to_string(m) + ":" + std::to_string(n) + ":" + std::to_string(known);
      expect_row(tables::polygon_beside_weights(level, m, n, known), weights_of(name, rule_at(level)));
    }
  }
  EXPECT_EQ(tables::polygon_beside_weights(0, 6, 6, 3) + 9, std::end(tables::polygon_beside[0]));
}

TEST(StencilTables, HaveDualParallelogramsThatSumToOne) {
  for (unsigned level = 0; level < tables::noise_levels; ++level) {
    for (unsigned valence = 5; valence <= tables::most_degree; ++valence) {
      const int32_t* row = tables::dual_parallelogram[level][valence - 3];
      const int32_t five[] = {row[0], row[1], row[1], row[2], row[2]};
      expect_row(five, weights_of("dual-parallelogram:" + std::to_string(valence), rule_at(level)));
    }
  }
  const int32_t* four = tables::dual_parallelogram[0][1];
  const int32_t row[] = {four[0], four[1], four[1], 2 * four[2]};
  expect_row(row, weights_of("dual-parallelogram:4", rule_at(0)));
}

TEST(StencilTables, HaveKStarsBetweenTaylorAndTheMean) {
  EXPECT_EQ(tables::k_star[0][6 - 3][0], one * 3 / 2);
  EXPECT_EQ(tables::k_star[0][4 - 3][0], one * 2);
  for (unsigned level = 1; level < tables::noise_levels; ++level) {
    for (unsigned i = 1; i < 14; ++i) {
      EXPECT_LE(tables::k_star[level][i][0], tables::k_star[level - 1][i][0]);
      EXPECT_GE(tables::k_star[level][i][0], one / 2);
    }
  }
}

TEST(StencilTables, HaveCubesByTheMaskOfKnownCorners) {
  for (unsigned mask = 0; mask < 256; mask += 2) {
    std::vector<double> weights(7);
    const std::vector<double> known = weights_of("cube:" + std::to_string(mask));
    for (unsigned corner = 1, next = 0; corner < 8; ++corner) {
      if ((mask >> corner & 1) != 0) weights[corner - 1] = known[next++];
    }
    for (unsigned i = 0; i < 7; ++i)
      EXPECT_NEAR(double(tables::cube[mask >> 1][i]) / one, weights[i], tolerance);
  }
}

TEST(StencilTables, HaveTheButterfliesAndHexahedra) {
  expect_row(tables::butterfly, weights_of("butterfly"));
  for (unsigned k = 3; k <= tables::most_degree; ++k) {
    expect_row(tables::modified_butterfly[k - 3], weights_of("modified-butterfly:" + std::to_string(k)));
  }
  for (unsigned known = 0; known < 4; ++known) {
    expect_row(tables::hexahedron[known], weights_of("hexahedron:" + std::to_string(known)));
  }
}

}  // namespace
}  // namespace maille::testing
