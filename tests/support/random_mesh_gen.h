#pragma once

#include "support/random_mesh.h"

#include <rapidcheck.h>
#include <algorithm>
#include <utility>

namespace maille::testing {

/// random_surface() for rapidcheck; failing meshes shrink in size, then to small seeds.
inline rc::Gen<Mesh> arbitrary_surface(RandomMeshOptions options = {}) {
  return rc::gen::map(
      rc::gen::pair(rc::gen::inRange<uint32_t>(1, options.faces + 1), rc::gen::arbitrary<uint64_t>()),
      [options](const std::pair<uint32_t, uint64_t>& choice) {
        RandomMeshOptions chosen = options;
        chosen.faces = choice.first;
        return random_surface(choice.second, chosen);
      });
}

}  // namespace maille::testing
