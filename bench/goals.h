#pragma once

#include <string>
#include <vector>

namespace maille::bench {

struct GoalsOptions {
  std::vector<std::string> paths;
  std::string json;
  uint64_t most_faces = 0;  ///< larger meshes are left out; 0: none is
};

/// Figures that rows of codecs do not have: doubles that hold floats, parts and threads, facet normals,
/// texture coordinates, all levels of detail. One line of JSON each; bench/report_goals.py makes a table.
bool measure_goals(const GoalsOptions& options);

}  // namespace maille::bench
