#include "code/symmetric_solver.h"

#include <gtest/gtest.h>

#include <array>

#include "support/random.h"

namespace maille {
namespace {

using testing::Random;

/// The solution of A^T A x = A^T b is the x that b was made with.
TEST(SymmetricSolver, GivesBackWhatTheRightSidesWereMadeOf) {
  constexpr unsigned n = 7, equations = 20;
  Random random(1);
  std::array<double, n> expected;
  for (double& each : expected) each = random.unit() * 10 - 5;
  std::array<double, n * n> rows{};
  std::array<double, n> x{};
  for (unsigned e = 0; e < equations; ++e) {
    std::array<double, n> a;
    double b = 0;
    for (unsigned i = 0; i < n; ++i) {
      a[i] = random.unit();
      b += a[i] * expected[i];
    }
    for (unsigned i = 0; i < n; ++i) {
      for (unsigned j = 0; j <= i; ++j) rows[i * n + j] += a[i] * a[j];
      x[i] += a[i] * b;
    }
  }
  bool solved = false;
  solve_symmetric(rows.data(), n, x.data(), 1e-12, solved);
  EXPECT_TRUE(solved);
  for (unsigned i = 0; i < n; ++i) EXPECT_NEAR(x[i], expected[i], 1e-6);
}

TEST(SymmetricSolver, TellsWhereThereIsNoSolution) {
  std::array<double, 4> rows = {1, 0, 1, 1};  // twice the same equation
  std::array<double, 2> x = {1, 2};
  bool solved = true;
  solve_symmetric(rows.data(), 2, x.data(), 1e-12, solved);
  EXPECT_FALSE(solved);
}

}  // namespace
}  // namespace maille
