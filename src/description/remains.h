#pragma once

#include <maille/error.h>
#include <maille/mesh.h>

#include <string>
#include <vector>

namespace maille {

/// What is left of a damaged mesh, and what is lost, each of it named and counted: "2 of 12 parts".
struct Remains {
  Mesh mesh;
  std::vector<std::string> lost;
};

/// Damage is a loss. All else ends the work: a disk, memory, or a user who does not want to wait.
inline bool is_loss(const Error& error) {
  return error.code == ErrorCode::corrupt;
}

/// "the array \"speed\" (cell)"
std::string array_named(const std::string& name, Domain domain);

/// Puts a mesh of `points` and `cells` into the input's order, of which `bytes` are the stream; tells what is
/// lost where the order is, and where it says nothing of what is left. Errors: those of the source; corrupt,
/// when the order would take cells out of their blocks.
Result<> put_in_order(const Result<std::vector<std::byte>>& bytes, uint64_t points, uint64_t cells,
                      Remains& remains);

/// "; lost: 2 of 12 parts, the array \"speed\""; empty where nothing is.
std::string sentence_of(const Remains& remains);

}  // namespace maille
