#include "theory/matrix.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

namespace maille {
namespace {

Matrix arbitrary(size_t rows, size_t columns) {
  Matrix result(rows, columns);
  for (size_t i = 0; i < rows; ++i) {
    for (size_t j = 0; j < columns; ++j) result(i, j) = *rc::gen::inRange(-100, 101) / 10.0;
  }
  return result;
}

RC_GTEST_PROP(Matrix, LeastSquaresLeaveAResidualOrthogonalToTheColumns, ()) {
  const auto rows = *rc::gen::inRange<size_t>(1, 9);
  const auto columns = *rc::gen::inRange<size_t>(1, 9);
  const Matrix a = arbitrary(rows, columns);
  const Matrix b = arbitrary(rows, 2);
  const LeastSquares solved = least_squares(a, b, 1e-11 * norm(a));
  const Matrix residual = difference(product(a, solved.shortest), b);
  RC_ASSERT(norm(product(transposed(a), residual)) <= 1e-7 * (1 + norm(a)) * (1 + norm(b)));
  // The null space is one, orthonormal, and orthogonal to the shortest solution.
  RC_ASSERT(norm(product(a, solved.null_space)) <= 1e-9 * (1 + norm(a)));
  const size_t free = solved.null_space.columns();
  RC_ASSERT(free + std::min(rows, columns) >= columns);
  const Matrix gram = product(transposed(solved.null_space), solved.null_space);
  RC_ASSERT(norm(difference(gram, Matrix::identity(free))) <= 1e-9);
  RC_ASSERT(norm(product(transposed(solved.null_space), solved.shortest)) <=
            1e-7 * (1 + norm(solved.shortest)));
}

RC_GTEST_PROP(Matrix, CholeskyIsARoot, ()) {
  const auto size = *rc::gen::inRange<size_t>(1, 7);
  const Matrix a = arbitrary(size, size);
  const Matrix positive = sum(product(a, transposed(a)), Matrix::identity(size));
  const Matrix lower = cholesky(positive);
  RC_ASSERT(norm(difference(product(lower, transposed(lower)), positive)) <= 1e-10 * norm(positive));
}

RC_GTEST_PROP(Matrix, EigenvectorsPutASymmetricMatrixTogetherAgain, ()) {
  const auto size = *rc::gen::inRange<size_t>(1, 9);
  const Matrix a = arbitrary(size, size);
  const Matrix symmetric = sum(a, transposed(a));
  const Eigenvectors found = eigenvectors(symmetric);
  Matrix values(size, size);
  for (size_t i = 0; i < size; ++i) {
    values(i, i) = found.values[i];
    if (i > 0) RC_ASSERT(found.values[i - 1] >= found.values[i]);
  }
  const Matrix again = product(transposed(found.rows), product(values, found.rows));
  RC_ASSERT(norm(difference(again, symmetric)) <= 1e-10 * (1 + norm(symmetric)));
}

TEST(Matrix, ARankThatIsMissingBecomesFreedom) {
  Matrix a(2, 3);
  a(0, 0) = a(0, 1) = a(1, 0) = a(1, 1) = 1;  // twice the same equation, and no word on the third unknown
  Matrix b(2, 1);
  b(0, 0) = b(1, 0) = 4;
  const LeastSquares solved = least_squares(a, b, 1e-11);
  EXPECT_NEAR(solved.shortest(0, 0), 2, 1e-14);
  EXPECT_NEAR(solved.shortest(1, 0), 2, 1e-14);
  EXPECT_NEAR(solved.shortest(2, 0), 0, 1e-14);
  EXPECT_EQ(solved.null_space.columns(), 2u);
}

}  // namespace
}  // namespace maille
