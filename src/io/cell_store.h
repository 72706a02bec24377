#pragma once

#include <maille/mesh.h>
#include <span>
#include <string>
#include <vector>
#include "io/cells.h"

namespace maille {

/// One block to be made of cells that follow each other.
struct BlockShape {
  uint64_t cells = 0;
  CellType type = CellType::mixed;
  std::string name;
};

/// Cells of any types in the order of a file. Takes no memory per cell beyond its nodes and a byte for its
/// type as long as all have the same number of nodes.
class CellStore {
 public:
  /// Append a cell's nodes, then call end_cell(). Of a polyhedron: the corners of its faces, and their
  /// numbers to `face_sizes`.
  std::vector<uint32_t> nodes;
  std::vector<uint32_t> face_sizes;

  void end_cell(CellType type) {
    types_.push_back(static_cast<uint8_t>(type));
    lengths_.add(nodes.size() - lengths_.total());
    faces_.add(face_sizes.size() - faces_.total());
  }
  /// `count` cells without faces whose nodes were appended, `length` each.
  void end_cells(uint64_t count, CellType type, uint64_t length) {
    types_.insert(types_.end(), count, static_cast<uint8_t>(type));
    lengths_.add_run(count, length);
    faces_.add_run(count, 0);
  }
  uint64_t count() const { return types_.size(); }
  CellType type(uint64_t cell) const { return static_cast<CellType>(types_[cell]); }
  uint64_t length(uint64_t cell) const { return lengths_.length(cell); }
  uint64_t bytes() const {
    return (nodes.size() + face_sizes.size()) * sizeof(uint32_t) + types_.size() + lengths_.bytes() +
           faces_.bytes();
  }

  /// All cells as one block: of their type when they have one, mixed otherwise. No block when there are no
  /// cells.
  std::vector<CellBlock> take();
  /// These blocks; their cells must add up to count().
  std::vector<CellBlock> take(std::span<const BlockShape> shapes);
  /// Whether the blocks add up to count() and cells of them have their types.
  bool fits(std::span<const BlockShape> shapes) const;

 private:
  bool is_uniform(uint64_t first, uint64_t count, CellType type) const;
  CellType common_type(uint64_t first, uint64_t count) const;
  CellBlock make_block(uint64_t first, const BlockShape& shape);

  std::vector<uint8_t> types_;
  Lengths lengths_, faces_;
};

/// Cells that follow each other and have the same type and name become blocks; where these would be more than
/// `most_blocks`, there are none of them and the cells are to be taken as one.
class BlockShapes {
 public:
  void add(uint64_t cells, CellType type, const std::string& name) {
    if (cells == 0 || too_many()) return;
    if (shapes_.empty() || shapes_.back().type != type || shapes_.back().name != name) {
      shapes_.push_back({0, type, name});
    }
    shapes_.back().cells += cells;
  }
  bool too_many() const { return shapes_.size() > most_blocks; }
  std::vector<CellBlock> take(CellStore& cells) { return too_many() ? cells.take() : cells.take(shapes_); }

 private:
  static constexpr size_t most_blocks = 1024;
  std::vector<BlockShape> shapes_;
};

}  // namespace maille
