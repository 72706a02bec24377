#pragma once

#include "mesh/compare/compare_partition.h"

#include <string>

namespace maille {

enum class Verdict {
  equal,      ///< by a renaming that was checked value by value
  different,  ///< proven
  collided,   ///< two hashes were equal by chance: try another seed
  given_up,   ///< too symmetric to be searched
};

struct Decision {
  Verdict verdict = Verdict::equal;
  std::string difference;  ///< one sentence, unless equal
};

/// Whether some renaming of points, order of cells, rotation of faces and turn of solids makes the two meshes
/// equal.
Decision find_renaming(const Elements& a, const Elements& b);

}  // namespace maille
