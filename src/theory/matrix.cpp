#include "theory/matrix.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace maille {

namespace {

// Jacobi's method converges quadratically; ten sweeps are rare. The bound only ends what rounding might keep
// going.
constexpr unsigned most_sweeps = 60;
constexpr double precision = 1e-16;

/// Cosine and sine of the rotation that makes the off-diagonal entry c of [[a, c], [c, b]] zero: the smaller
/// root of t^2 + 2 zeta t - 1 = 0, in the form that does not cancel (Golub and Van Loan).
struct Rotation {
  Rotation(double a, double b, double c) {
    const double zeta = (b - a) / (2 * c);
    const double tangent = (zeta < 0 ? -1 : 1) / (std::fabs(zeta) + std::sqrt(1 + zeta * zeta));
    cosine = 1 / std::sqrt(1 + tangent * tangent);
    sine = cosine * tangent;
  }
  void turn(double& x, double& y) const {
    const double before = x;
    x = cosine * before - sine * y;
    y = sine * before + cosine * y;
  }
  double cosine;
  double sine;
};

void turn_columns(Matrix& a, size_t p, size_t q, const Rotation& rotation) {
  for (size_t i = 0; i < a.rows(); ++i) rotation.turn(a(i, p), a(i, q));
}

double dot_of_columns(const Matrix& a, size_t p, const Matrix& b, size_t q) {
  double sum = 0;
  for (size_t i = 0; i < a.rows(); ++i) sum += a(i, p) * b(i, q);
  return sum;
}

/// Turns the columns of `a` until they are orthogonal (one-sided Jacobi, Hestenes 1958); returns the product
/// of the turns. The result is the singular value decomposition: columns are left vectors times singular
/// values, the turns right vectors. Small singular values, by which a null space is told, come out more
/// exactly than by way of a^T a.
Matrix orthogonalise_columns(Matrix& a) {
  Matrix turns = Matrix::identity(a.columns());
  const double nothing = precision * precision * norm(a) * norm(a);
  bool turned = true;
  for (unsigned sweep = 0; turned && sweep < most_sweeps; ++sweep) {
    turned = false;
    for (size_t p = 0; p + 1 < a.columns(); ++p) {
      for (size_t q = p + 1; q < a.columns(); ++q) {
        const double pp = dot_of_columns(a, p, a, p);
        const double qq = dot_of_columns(a, q, a, q);
        const double pq = dot_of_columns(a, p, a, q);
        // Columns that are nothing but rounding are never orthogonal to a relative bound.
        if (std::fabs(pq) <= precision * std::sqrt(pp * qq) || std::fabs(pq) <= nothing) continue;
        const Rotation rotation(pp, qq, pq);
        turn_columns(a, p, q, rotation);
        turn_columns(turns, p, q, rotation);
        turned = true;
      }
    }
  }
  return turns;
}

double off_diagonal(const Matrix& a) {
  double largest = 0;
  for (size_t p = 0; p < a.rows(); ++p) {
    for (size_t q = p + 1; q < a.rows(); ++q) largest = std::max(largest, std::fabs(a(p, q)));
  }
  return largest;
}

}  // namespace

Matrix Matrix::identity(size_t size) {
  Matrix result(size, size);
  for (size_t i = 0; i < size; ++i) result(i, i) = 1;
  return result;
}

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix result(a.rows(), b.columns());
  for (size_t i = 0; i < a.rows(); ++i) {
    for (size_t k = 0; k < a.columns(); ++k) {
      for (size_t j = 0; j < b.columns(); ++j) result(i, j) += a(i, k) * b(k, j);
    }
  }
  return result;
}

Matrix transposed(const Matrix& a) {
  Matrix result(a.columns(), a.rows());
  for (size_t i = 0; i < a.rows(); ++i) {
    for (size_t j = 0; j < a.columns(); ++j) result(j, i) = a(i, j);
  }
  return result;
}

Matrix sum(const Matrix& a, const Matrix& b) {
  Matrix result = a;
  for (size_t i = 0; i < a.rows(); ++i) {
    for (size_t j = 0; j < a.columns(); ++j) result(i, j) += b(i, j);
  }
  return result;
}

Matrix difference(const Matrix& a, const Matrix& b) {
  Matrix result = a;
  for (size_t i = 0; i < a.rows(); ++i) {
    for (size_t j = 0; j < a.columns(); ++j) result(i, j) -= b(i, j);
  }
  return result;
}

double norm(const Matrix& a) {
  double sum = 0;
  for (size_t i = 0; i < a.rows(); ++i) {
    for (size_t j = 0; j < a.columns(); ++j) sum += a(i, j) * a(i, j);
  }
  return std::sqrt(sum);
}

Matrix cholesky(const Matrix& a) {
  Matrix lower(a.rows(), a.rows());
  for (size_t i = 0; i < a.rows(); ++i) {
    for (size_t j = 0; j <= i; ++j) {
      double rest = a(i, j);
      for (size_t k = 0; k < j; ++k) rest -= lower(i, k) * lower(j, k);
      lower(i, j) = i == j ? std::sqrt(rest) : rest / lower(j, j);
    }
  }
  return lower;
}

LeastSquares least_squares(const Matrix& a, const Matrix& b, double cutoff) {
  Matrix scaled = a;  // left singular vectors times singular values, once the columns are orthogonal
  const Matrix right = orthogonalise_columns(scaled);
  const size_t unknowns = a.columns();
  LeastSquares result{Matrix(unknowns, b.columns()), Matrix()};
  std::vector<size_t> free;
  for (size_t k = 0; k < unknowns; ++k) {
    const double square = dot_of_columns(scaled, k, scaled, k);
    if (std::sqrt(square) <= cutoff) {
      free.push_back(k);
      continue;
    }
    for (size_t j = 0; j < b.columns(); ++j) {
      const double coordinate = dot_of_columns(scaled, k, b, j) / square;
      for (size_t i = 0; i < unknowns; ++i) result.shortest(i, j) += coordinate * right(i, k);
    }
  }
  result.null_space = Matrix(unknowns, free.size());
  for (size_t j = 0; j < free.size(); ++j) {
    for (size_t i = 0; i < unknowns; ++i) result.null_space(i, j) = right(i, free[j]);
  }
  return result;
}

Eigenvectors eigenvectors(Matrix a) {
  const size_t size = a.rows();
  Matrix turns = Matrix::identity(size);
  const double nothing = precision * norm(a);
  for (unsigned sweep = 0; off_diagonal(a) > nothing && sweep < most_sweeps; ++sweep) {
    for (size_t p = 0; p + 1 < size; ++p) {
      for (size_t q = p + 1; q < size; ++q) {
        if (std::fabs(a(p, q)) <= nothing) continue;
        const Rotation rotation(a(p, p), a(q, q), a(p, q));
        turn_columns(a, p, q, rotation);
        for (size_t j = 0; j < size; ++j) rotation.turn(a(p, j), a(q, j));
        turn_columns(turns, p, q, rotation);
      }
    }
  }
  std::vector<size_t> order(size);
  std::iota(order.begin(), order.end(), size_t{0});
  // Stable, so that equal eigenvalues keep the order that the sweeps left them in.
  std::stable_sort(order.begin(), order.end(), [&a](size_t i, size_t j) { return a(i, i) > a(j, j); });
  Eigenvectors result{{}, Matrix(size, size)};
  for (size_t k = 0; k < size; ++k) {
    result.values.push_back(a(order[k], order[k]));
    for (size_t i = 0; i < size; ++i) result.rows(k, i) = turns(i, order[k]);
  }
  return result;
}

}  // namespace maille
