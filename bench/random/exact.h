#pragma once

#include <maille/error.h>

#include <string>
#include <vector>

namespace maille {

struct ExactOptions {
  int effort = 5;
  bool windows = true;  ///< also built out of core
};

/// Compresses meshes in mode random, and holds against the original: all of it decoded, once more with its
/// order kept, a box of it extracted, all of it after its index was lost, all of it built in windows. Prints
/// a row of a table for each file. Returns how many are not exact; files that are no surfaces are left out.
Result<uint64_t> check_exact(const std::vector<std::string>& paths, const ExactOptions& options);

/// Compresses meshes in mode random without loss, and holds so many boxes of each against the original: of
/// all sizes, around random points of it, with all arrays. Prints a row for each file. Returns how many boxes
/// differ.
Result<uint64_t> check_boxes(const std::vector<std::string>& paths, unsigned boxes);

}  // namespace maille
