#include "theory/spectral.h"

#include "theory/matrix.h"

namespace maille {

namespace {

// Eigenvectors are unit vectors, and eigenvalues of small graphs are small numbers: absolute bounds will do.
constexpr double cutoff = 1e-9;
constexpr double equal_eigenvalues = 1e-9;

/// The degree of each sample on the diagonal, -1 for each edge: x^T L x is the sum of squared differences
/// along edges.
Matrix laplacian(const Stencil& stencil) {
  const size_t size = stencil.known.size() + 1 + stencil.hidden.size();
  Matrix result(size, size);
  for (const auto& [a, b] : stencil.edges) {
    result(a, a) += 1;
    result(b, b) += 1;
    result(a, b) -= 1;
    result(b, a) -= 1;
  }
  return result;
}

/// Part of a matrix: `rows` from `row` on, `columns` from `column` on.
Matrix part(const Matrix& a, size_t row, size_t rows, size_t column, size_t columns) {
  Matrix result(rows, columns);
  for (size_t i = 0; i < rows; ++i) {
    for (size_t j = 0; j < columns; ++j) result(i, j) = a(row + i, column + j);
  }
  return result;
}

}  // namespace

/// docs/prediction.md, "The spectral rule": the loop of taylor_weights(), with eigenvectors as rows.
/// `weights` and `freedom` are of all unknown values together, as these are chosen together; the target is
/// the first of them.
std::vector<double> spectral_weights(const Stencil& stencil) {
  const size_t known = stencil.known.size();
  const size_t unknown = 1 + stencil.hidden.size();
  const Eigenvectors basis = eigenvectors(laplacian(stencil));
  Matrix weights(unknown, known);  // of each unknown value, by known one
  Matrix freedom = Matrix::identity(unknown);
  for (size_t first = 0, end = 0; first < basis.values.size() && freedom.columns() > 0; first = end) {
    // Which eigenvectors of one eigenvalue were found is chance: they are taken together.
    while (end < basis.values.size() && basis.values[first] - basis.values[end] < equal_eigenvalues) ++end;
    const Matrix of_known = part(basis.rows, first, end - first, 0, known);
    const Matrix of_unknown = part(basis.rows, first, end - first, known, unknown);
    // What the known samples and the unknown ones so far have in these waves, by known sample.
    const Matrix energy = sum(product(of_unknown, weights), of_known);
    const Matrix nothing(energy.rows(), energy.columns());
    const LeastSquares solved =
        least_squares(product(of_unknown, freedom), difference(nothing, energy), cutoff);
    weights = sum(weights, product(freedom, solved.shortest));
    freedom = product(freedom, solved.null_space);
  }
  std::vector<double> result(known);
  for (size_t k = 0; k < known; ++k) result[k] = weights(0, k);
  return result;
}

}  // namespace maille
