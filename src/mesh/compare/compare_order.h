#pragma once

#include <maille/compare.h>

#include <string>
#include <vector>

namespace maille {

/// Two arrays of the same name and domain, one of each mesh.
struct ArrayPair {
  const Array* a;
  const Array* b;
};

/// Element by element. `arrays` have the same description in both meshes; positions are not among them.
/// Returns what differs.
std::vector<std::string> compare_in_order(const Mesh& a, const Mesh& b, const std::vector<ArrayPair>& arrays,
                                          double tolerance);

/// The tuples of two arrays of the same description in order, bit for bit, labels by text. Empty when equal.
std::string compare_tuples(const Array& a, const Array& b);

/// "point array "uv"".
std::string describe_array(const Array& array);

}  // namespace maille
