#pragma once

#include <maille/mesh.h>

#include <algorithm>
#include <utility>

#include "support/random.h"

// For tests of formats that hold surfaces with a few known arrays: what is added to a random one, and whether
// it all came back.

namespace maille::testing {

/// Random floats that need all their digits.
inline void add_array(Mesh& mesh, Random& random, const char* name, Domain domain, uint32_t components,
                      Role role) {
  Array array = make_array(name, domain, Scalar::f32, components, role);
  array.resize(mesh.count_of(domain));
  for (float& value : array.values<float>()) value = static_cast<float>(random.below(50)) / 7;
  if (array.count() != 0) mesh.arrays.push_back(std::move(array));
}

/// Points, faces and arrays in the same order, bit for bit; roles, names of blocks and metadata do not count.
inline bool same_surface(const Mesh& a, const Mesh& b) {
  if (a.points.bytes != b.points.bytes || a.cell_count() != b.cell_count()) return false;
  for (uint64_t i = 0; i < a.cell_count(); ++i) {
    const auto face = a.blocks[0].cell(i), other = b.blocks[0].cell(i);
    if (!std::equal(face.begin(), face.end(), other.begin(), other.end())) return false;
  }
  return a.arrays.size() == b.arrays.size() &&
         std::all_of(a.arrays.begin(), a.arrays.end(), [&](const Array& array) {
           const Array* const same = b.find(array.name, array.domain);
           return same != nullptr && same->bytes == array.bytes;
         });
}

}  // namespace maille::testing
