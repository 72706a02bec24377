#pragma once

#include <cstddef>
#include <vector>

// Dense linear algebra for the few dozen numbers of a stencil: doubles, in fixed order. Not for codecs: they
// use tables.
namespace maille {

/// Numbers row after row. Sizes are for the caller to match; nothing is checked, as stencils are checked
/// before.
class Matrix {
 public:
  Matrix() = default;
  Matrix(size_t rows, size_t columns) : rows_(rows), columns_(columns), values_(rows * columns) {}
  static Matrix identity(size_t size);

  size_t rows() const { return rows_; }
  size_t columns() const { return columns_; }
  double& operator()(size_t row, size_t column) { return values_[row * columns_ + column]; }
  double operator()(size_t row, size_t column) const { return values_[row * columns_ + column]; }

 private:
  size_t rows_ = 0;
  size_t columns_ = 0;
  std::vector<double> values_;
};

/// Sums go over the inner index in rising order, so results are the same everywhere.
Matrix product(const Matrix& a, const Matrix& b);
Matrix transposed(const Matrix& a);
Matrix sum(const Matrix& a, const Matrix& b);
Matrix difference(const Matrix& a, const Matrix& b);
/// Square root of the sum of squares.
double norm(const Matrix& a);

/// The lower triangle L of a positive definite matrix L L^T (Cholesky). NaN for others: covariances of
/// covariance.h are positive definite.
Matrix cholesky(const Matrix& a);

/// All x that minimise |a x - b|, column by column: the shortest one, plus anything in the null space.
struct LeastSquares {
  Matrix shortest;
  Matrix null_space;  ///< orthonormal columns
};
/// By the singular value decomposition of `a`. Singular values up to `cutoff` count as 0: the null space are
/// the directions in which |a x - b| does not change.
LeastSquares least_squares(const Matrix& a, const Matrix& b, double cutoff);

/// Eigenvalues of a symmetric matrix, largest first, and their unit vectors as rows. Which vectors stand for
/// a multiple eigenvalue, and all signs, are chance.
struct Eigenvectors {
  std::vector<double> values;
  Matrix rows;
};
Eigenvectors eigenvectors(Matrix symmetric);

}  // namespace maille
