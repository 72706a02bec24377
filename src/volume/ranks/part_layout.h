#pragma once

#include <maille/ranks.h>

#include <string>
#include <vector>

#include "base/result.h"

namespace maille {

/// What all parts have in common: the arrays, and the blocks of the whole mesh. The same in all ranks but for
/// `block_of`.
struct PartLayout {
  Mesh empty;  ///< no points, no cells; arrays without tuples, those of the mesh with theirs; metadata
  struct Block {
    std::string name;
    CellType type = CellType::mixed;
    bool has_faces = false;
    uint64_t cells = 0;  ///< of all ranks
    uint64_t first_id = 0, last_id = 0;
    uint64_t first_key = 0;  ///< keys of cells are numbers that rise block by block, with gaps
  };
  std::vector<Block> blocks;       ///< by their least cell
  std::vector<uint32_t> block_of;  ///< by block of this rank's part, its number in `blocks`
  uint64_t keys = 0;               ///< all are below
};

/// Finds it; all ranks together. Errors: malformed_input, for a part that breaks its own rules, or has other
/// arrays than others, or numbers too far apart; unsupported, for arrays on corners.
Result<PartLayout> agree_on_layout(const RankPart& part, Ranks& ranks);

/// The arrays of a domain, positions first, as one tuple for each element: how values travel between ranks.
/// The mesh must outlive it.
class Tuples {
 public:
  Tuples(const Mesh& mesh, Domain domain);
  size_t size() const { return size_; }
  void read(uint64_t element, std::byte* out) const;
  /// The arrays of a mesh that were listed, to be written: same order.
  static std::vector<Array*> of(Mesh& mesh, Domain domain);

 private:
  std::vector<const Array*> arrays_;
  size_t size_ = 0;
};
/// Writes one tuple to the arrays, in the order of Tuples::of().
void put_tuple(const std::vector<Array*>& arrays, uint64_t element, const std::byte* tuple);

}  // namespace maille
