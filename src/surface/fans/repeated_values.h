#pragma once

#include <span>
#include <utility>
#include <vector>

#include "surface/fans/dictionary.h"

namespace maille {

/// The values of one coordinate, ascending, and how often each is there.
using ValueCounts = std::vector<std::pair<int64_t, uint32_t>>;
/// Counts equal values. May sort `values`.
ValueCounts count_values(std::vector<int64_t>& values);

/// How often values are in a dictionary at least, and how many times as often as those near them. On a coarse
/// lattice all values come again, in a mesh of many points more often than any number says; those of a voxel
/// lattice are seen among them.
struct Often {
  uint64_t least;
  uint64_t times;
};
/// Puts the values that are there so often into the dictionary, at most Dictionary::most of them. Returns how
/// many numbers they are; 0, and the dictionary as it was, where they span more than a dictionary can.
uint64_t fill_dictionary(const ValueCounts& counts, const Often& often, Dictionary& dictionary);

}  // namespace maille
