#pragma once

#include <maille/mesh.h>

#include <string>
#include <vector>

namespace maille {

/// What is left of a damaged mesh, and what is lost, each of it named and counted: "2 of 12 parts".
struct Remains {
  Mesh mesh;
  std::vector<std::string> lost;
};

/// "; lost: 2 of 12 parts, the array \"speed\""; empty where nothing is.
std::string sentence_of(const Remains& remains);

}  // namespace maille
