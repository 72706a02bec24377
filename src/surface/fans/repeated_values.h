#pragma once

#include <span>
#include <utility>
#include <vector>

#include "surface/fans/dictionary.h"

namespace maille {

/// The values of one coordinate, ascending, and how often each is there.
using ValueCounts = std::vector<std::pair<int64_t, uint32_t>>;
/// Changes the order of `values`.
ValueCounts count_values(std::vector<int64_t>& values);

/// How often values are in a dictionary at least, and how many times as often as those near them. On a coarse
/// lattice all values come again, in a mesh of many points more often than any number says; those of a voxel
/// lattice are seen among them.
struct Often {
  uint64_t least;
  uint64_t times;
};
/// Those that are there so often. Returns how many numbers they are.
uint64_t fill_dictionary(const ValueCounts& counts, const Often& often, Dictionary& dictionary);

}  // namespace maille
