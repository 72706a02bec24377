#pragma once

#include <maille/mesh.h>

namespace maille {

/// An array without tuples that is what another one, or the description of one, says.
template <class Described>
Array empty_like(const Described& described) {
  Array array =
      make_array(described.name, described.domain, described.type, described.components, described.role);
  array.labels = described.labels;
  return array;
}

}  // namespace maille
