#pragma once

#include <string>
#include <vector>

namespace maille::bench {

struct FilesOptions {
  std::vector<std::string> paths;
  std::vector<int> levels = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  /// "order kept" (without loss), "lossless" (any order), or bits of positions; none: these two, 14 and 12.
  std::vector<std::string> settings;
  std::string json;         ///< one line a file and setting is written there
  uint64_t most_cells = 0;  ///< larger meshes are left out; 0: none is
  bool only_inversions = false;
};

/// Sizes of files as they are read: every array, positions of the type that was read, the mode that the
/// command takes. Prints them, unless only inversions are asked for, and then every level that is more than
/// 0.1 % larger than a lower one. Returns false if there are such levels, or (not asked for inversions only)
/// one does not bring a mesh back.
bool measure_files(const FilesOptions& options);

}  // namespace maille::bench
