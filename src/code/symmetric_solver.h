#pragma once

namespace maille {

/// Solves the n equations of a symmetric matrix by L D L^T, with + - * / in a fixed order: the one solver of
/// normal equations. `Number` is double, or doubles in lanes, each with equations of its own. No square
/// roots, unlike Cholesky's method; n^3 / 6 products. Equal on all machines as long as compilers do not fuse
/// products and sums (-ffp-contract=off).
///
/// `rows`: the matrix up to its diagonal, n numbers a row; they are written over. `x`: the right sides, then
/// the solution. `solved`: whether all pivots were above `least`; if not, x is anything. (Not returned, as
/// ABIs differ in how lanes are.)
template <class Number, class Truth>
[[gnu::always_inline]] inline void solve_symmetric(Number* rows, unsigned n, Number* x, double least,
                                                   Truth& solved) {
  solved = rows[0] > least;
  for (unsigned i = 0; i < n; ++i) {
    Number* row = rows + i * n;
    for (unsigned j = 0; j < i; ++j) {
      for (unsigned k = 0; k < j; ++k) row[j] -= row[k] * rows[j * n + k];
    }
    for (unsigned j = 0; j < i; ++j) {
      const Number pivoted = row[j];
      row[j] *= rows[j * n + j];
      row[i] -= pivoted * row[j];
      x[i] -= row[j] * x[j];
    }
    solved &= row[i] > least;
    row[i] = 1.0 / row[i];
  }
  for (unsigned i = n; i-- > 0;) {
    x[i] *= rows[i * n + i];
    for (unsigned k = i + 1; k < n; ++k) x[i] -= rows[k * n + i] * x[k];
  }
}

}  // namespace maille
