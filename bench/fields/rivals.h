#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace maille::bench {

/// A field as rivals take it: one row for each component, in the order of the file.
struct Rows {
  std::vector<std::vector<double>> rows;
  bool wide = false;  ///< doubles, else floats
};

/// What a rival makes of a field.
struct Packed {
  size_t bytes = 0;
  double largest_error = 0;
};

struct Rival {
  std::string name;
  Packed (*pack)(const Rows& field, double bound);
};

/// zfp with its accuracy; prediction along the row and zstd, as SZ has it; a lattice with zstd and with xz.
const std::vector<Rival>& rivals();

}  // namespace maille::bench
