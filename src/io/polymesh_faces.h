#pragma once

#include <maille/mesh.h>

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

namespace maille {

/// The faces of a mesh as polyMesh has them: each once, with the cells on both sides.
class FoamFaceTable {
 public:
  struct Inner {
    uint64_t owner, neighbour, side;
  };
  struct Outer {
    uint64_t owner, side;
    bool turned;  ///< the side is seen from inside
  };
  /// The patch of a cell that is a face, by its number in the mesh.
  using PatchOf = std::function<uint64_t(const CellBlock& block, uint64_t cell)>;

  /// Error: usage, where polyMesh cannot hold the cells; `name`: the file's.
  static Result<FoamFaceTable> make(const Mesh& mesh, uint64_t patches, const PatchOf& patch_of,
                                    const std::string& name);

  std::span<const uint32_t> corners(uint64_t side) const {
    return std::span(corners_).subspan(sides_[side].begin, sides_[side].size);
  }

  std::vector<Inner> inner;                 ///< by owner, then neighbour
  std::vector<std::vector<Outer>> patches;  ///< in the order of the mesh
  std::vector<Outer> rest;                  ///< at the boundary, but in no patch
  uint64_t cells = 0, corner_count = 0;
  uint64_t left_out = 0;       ///< cells of types that polyMesh does not have
  uint64_t simplified = 0;     ///< cells with a face that had a point twice
  uint64_t same_side = 0;      ///< inner faces that both cells see from the same side
  uint64_t between_cells = 0;  ///< of the cells that are faces, those inside
  uint64_t repeated = 0;       ///< ... in two patches
  uint64_t loose = 0;          ///< ... of no cell
  uint64_t turned = 0;         ///< ... seen from inside

 private:
  static constexpr uint64_t no_cell = ~uint64_t{0};
  /// A face as a cell has it, or as a cell of its own.
  struct Side {
    uint64_t key;    ///< its least corner, and the lesser of the two beside that
    uint64_t begin;  ///< of its corners
    uint64_t cell, patch;
    uint32_t size, least;  ///< corners, and the place of the least
    bool backwards;        ///< the lesser corner beside the least stands before it
  };
  static uint32_t corner(const std::vector<uint32_t>& all, const Side& side, uint32_t i) {
    const uint32_t place = side.least + (side.backwards ? side.size - i : i);
    return all[side.begin + place % side.size];
  }
  /// `anywhere`: the face may begin with any corner; it begins with the least, so that what is written does
  /// not depend on how cells begin. False: fewer than three corners are left.
  bool add(std::span<const uint32_t> face, uint64_t cell, uint64_t patch, bool anywhere, bool& repeats);
  Result<> collect(const Mesh& mesh, const PatchOf& patch_of, const std::string& name);
  Result<> add_cell(const CellBlock& block, uint64_t i, const std::string& name);
  int compare(const Side& a, const Side& b) const;
  Result<> join(std::span<const uint64_t> same, const std::string& name);
  Result<> join_all(const std::string& name);
  void order();

  std::vector<uint32_t> corners_;
  std::vector<Side> sides_;
};

}  // namespace maille
