#include "mesh/compare/compare_order.h"

#include <maille/with_type.h>

#include "base/bytes.h"
#include "base/result.h"
#include "mesh/compare/compare_elements.h"

#include <algorithm>
#include <cmath>

namespace maille {

namespace {

double number_at(const Array& array, uint64_t number) {
  const std::byte* at = array.bytes.data() + number * size_of(array.type);
  return with_type(array.type, [&](auto zero) { return static_cast<double>(load<decltype(zero)>(at)); });
}

/// |x - y|, both finite. 64-bit integers are subtracted as such: as doubles they may look equal.
double distance(const Array& a, uint64_t i, const Array& b, uint64_t j) {
  if (a.type == b.type && (a.type == Scalar::i64 || a.type == Scalar::u64)) {
    const auto x = load<uint64_t>(a.bytes.data() + i * 8), y = load<uint64_t>(b.bytes.data() + j * 8);
    const bool less = a.type == Scalar::u64 ? x < y : static_cast<int64_t>(x) < static_cast<int64_t>(y);
    return static_cast<double>(less ? y - x : x - y);
  }
  return std::abs(number_at(a, i) - number_at(b, j));
}

/// Infinities and NaN are within no tolerance of anything but themselves.
bool within(const Array& a, const Array& b, uint64_t number, double tolerance) {
  const double x = number_at(a, number), y = number_at(b, number);
  if (std::isfinite(x) && std::isfinite(y)) return distance(a, number, b, number) <= tolerance;
  return bits_as<uint64_t>(x) == bits_as<uint64_t>(y);
}

/// "3 of 100 ELEMENTs differ; first: ELEMENT 17, X in A, Y in B".
std::string describe_first(uint64_t unequal, uint64_t count, const char* element, uint64_t first,
                           const std::string& in_a, const std::string& in_b) {
  return std::to_string(unequal) + " of " + std::to_string(count) + " " + element +
         "s differ; first: " + element + " " + std::to_string(first) + ", " + in_a + " in A, " + in_b +
         " in B";
}

template <class Equal>
/// Counts all that differ and describes the first: a user wants to know whether it is one number or all of
/// them.
std::string compare_array(const Array& a, const Array& b, const char* element, Equal equal) {
  uint64_t unequal = 0, first = 0;
  for (uint64_t i = 0; i < a.count(); ++i) {
    if (equal(i)) continue;
    if (unequal++ == 0) first = i;
  }
  if (unequal == 0) return {};
  return describe_first(unequal, a.count(), element, first, describe_tuple(a, first),
                        describe_tuple(b, first));
}

std::string compare_positions(const Array& a, const Array& b, double tolerance) {
  if (a.type == b.type && a.bytes == b.bytes) return {};
  return compare_array(a, b, "point", [&](uint64_t i) {
    if (tolerance == 0) return equal_tuples(a, i, b, i);
    return within(a, b, 3 * i, tolerance) && within(a, b, 3 * i + 1, tolerance) &&
           within(a, b, 3 * i + 2, tolerance);
  });
}

std::string compare_cells(const Elements& a, const Elements& b) {
  uint64_t unequal = 0, first = 0;
  for (uint64_t i = 0; i < a.cells().size(); ++i) {
    const Elements::Cell& x = a.cells()[i];
    const Elements::Cell& y = b.cells()[i];
    if (equal_kinds(a, x, b, y) && std::equal(x.nodes, x.nodes + x.degree, y.nodes, y.nodes + y.degree))
      continue;
    if (unequal++ == 0) first = i;
  }
  if (unequal == 0) return {};
  return describe_first(unequal, a.cells().size(), "cell", first, a.describe_cell(first),
                        b.describe_cell(first));
}

/// One pass over both arrays: the largest errors of a number, relative to A and of a tuple as a vector, and
/// the root of the mean square over finite numbers. Numbers that are not finite in both count as unequal
/// only.
Result<ArrayDifference> difference_of(const Array& a, const Array& b) {
  ArrayDifference difference;
  difference.name = a.name;
  difference.domain = a.domain;
  if (a.count() != b.count() || a.components != b.components) {
    return failure(ErrorCode::differs, describe_array(a) + " has " + std::to_string(a.count()) +
                                           " tuples of " + std::to_string(a.components) + " in A, " +
                                           std::to_string(b.count()) + " of " + std::to_string(b.components) +
                                           " in B");
  }
  // Numbers that stand for texts have no distance; only their texts are compared.
  const bool texts = has_labels(a) && has_labels(b);
  double squares = 0;
  uint64_t finite = 0;
  for (uint64_t i = 0; i < a.count(); ++i) {
    bool equal = true;
    double length = 0;  // squared
    for (uint64_t k = i * a.components; k < (i + 1) * a.components && !texts; ++k) {
      const double x = number_at(a, k), y = number_at(b, k);
      if (a.type != b.type && bits_as<uint64_t>(x) != bits_as<uint64_t>(y)) equal = false;
      if (!std::isfinite(x) || !std::isfinite(y)) continue;
      const double d = distance(a, k, b, k);
      difference.maximum = std::max(difference.maximum, d);
      // Division by zero is meant: a value that was 0 and is not any more has an infinite relative error.
      if (d > 0) difference.maximum_relative = std::max(difference.maximum_relative, d / std::fabs(x));
      length += d * d;
      ++finite;
    }
    squares += length;
    difference.maximum_norm = std::max(difference.maximum_norm, std::sqrt(length));
    if (a.type == b.type || texts) equal = equal_tuples(a, i, b, i);
    if (!equal) ++difference.unequal;
  }
  if (finite > 0) difference.root_mean_square = std::sqrt(squares / static_cast<double>(finite));
  return difference;
}

}  // namespace

std::string describe_array(const Array& array) {
  return std::string(name_of(array.domain)) + " array \"" + array.name + "\"";
}

std::string compare_tuples(const Array& a, const Array& b) {
  if (!has_labels(a) && a.bytes == b.bytes) return {};
  return compare_array(a, b, "tuple", [&](uint64_t i) { return equal_tuples(a, i, b, i); });
}

std::vector<std::string> compare_in_order(const Mesh& a, const Mesh& b, const std::vector<ArrayPair>& arrays,
                                          double tolerance) {
  std::vector<std::string> differences;
  if (const auto text = compare_positions(a.points, b.points, tolerance); !text.empty()) {
    differences.push_back("positions: " + text);
  }
  const Elements in_a(a, {}, true, 0), in_b(b, {}, true, 0);
  if (const auto text = compare_cells(in_a, in_b); !text.empty()) differences.push_back("cells: " + text);
  for (const ArrayPair& pair : arrays) {
    if (const auto text = compare_tuples(*pair.a, *pair.b); !text.empty()) {
      differences.push_back(describe_array(*pair.a) + ": " + text);
    }
  }
  return differences;
}

Result<std::vector<ArrayDifference>> differences_by_order(const Mesh& a, const Mesh& b) {
  std::vector<ArrayDifference> differences;
  differences.push_back(MAILLE_TRY(difference_of(a.points, b.points)));
  for (const Array& array : a.arrays) {
    const Array* other = b.find(array.name, array.domain);
    if (!other) return failure(ErrorCode::differs, describe_array(array) + " is only in A");
    differences.push_back(MAILLE_TRY(difference_of(array, *other)));
  }
  for (const Array& array : b.arrays) {
    if (!a.find(array.name, array.domain))
      return failure(ErrorCode::differs, describe_array(array) + " is only in B");
  }
  return differences;
}

}  // namespace maille
