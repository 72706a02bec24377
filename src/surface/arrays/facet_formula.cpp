#include "surface/arrays/facet_formula.h"

#include <cmath>
#include <utility>

namespace maille {
namespace {

template <class T>
using Three = std::array<T, 3>;

template <class T, class From>
Three<T> rounded(const From& v) {
  return {static_cast<T>(v[0]), static_cast<T>(v[1]), static_cast<T>(v[2])};
}

template <class T>
Three<T> edge(const Three<T>& from, const Three<T>& to) {
  return {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
}

/// Each order of subtraction and multiplication is spelled out, and none may be contracted, or the last bits
/// differ.
template <class T>
Three<T> cross_product(const FacetFormula& formula, const Vector3& a, const Vector3& b, const Vector3& c) {
  const Three<T> origin = rounded<T>(a);
  Three<T> u = formula.first_reversed() ? edge(rounded<T>(b), origin) : edge(origin, rounded<T>(b));
  Three<T> v = formula.second_reversed() ? edge(rounded<T>(c), origin) : edge(origin, rounded<T>(c));
  if (formula.swapped()) std::swap(u, v);
  return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}

template <class T>
Vector3 over_its_length(const FacetFormula& formula, Three<T> n) {
  // Without scaling, as the programs do whose normals these are. sqrt is rounded exactly by IEEE.
  const T length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  if (!(length > 0) || std::isinf(length)) return {};
  const T factor = 1 / length;
  for (T& x : n) {
    x = formula.reciprocal() ? x * factor : x / length;
    if (formula.negated()) x = -x;
  }
  return {{n[0], n[1], n[2]}};
}

template <class T>
Vector3 over_its_length_in(const FacetFormula& formula, const Three<T>& n) {
  return formula.length_in_float() ? over_its_length(formula, rounded<float>(n))
                                   : over_its_length(formula, rounded<double>(n));
}

}  // namespace

Vector3 FacetFormula::normal(const Vector3& a, const Vector3& b, const Vector3& c) const {
  return cross_in_float() ? over_its_length_in(*this, cross_product<float>(*this, a, b, c))
                          : over_its_length_in(*this, cross_product<double>(*this, a, b, c));
}

}  // namespace maille
