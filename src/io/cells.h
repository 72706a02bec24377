#pragma once

#include <maille/mesh.h>
#include <span>
#include <vector>

namespace maille {

/// The lengths of consecutive lists. Takes no memory per list as long as all have the same length, and eight
/// bytes for each from the first other length on.
class Lengths {
 public:
  void add(uint64_t length) { add_run(1, length); }
  /// `count` lists of the same length.
  void add_run(uint64_t count, uint64_t length) {
    if (count == 0) return;
    if (offsets_.empty() && length != length_) {
      if (count_ == 0) {
        length_ = length;
      } else {
        make_offsets();
      }
    }
    if (!offsets_.empty()) {
      for (uint64_t i = 1; i <= count; ++i) offsets_.push_back(total_ + i * length);
    }
    total_ += count * length;
    count_ += count;
  }

  uint64_t count() const { return count_; }
  uint64_t total() const { return total_; }
  bool uniform() const { return offsets_.empty(); }
  uint64_t length(uint64_t list) const { return uniform() ? length_ : offsets_[list + 1] - offsets_[list]; }
  /// Where a list's values begin.
  uint64_t begin(uint64_t list) const { return uniform() ? list * length_ : offsets_[list]; }
  uint64_t bytes() const { return offsets_.size() * sizeof(uint64_t); }
  /// count() + 1 positions.
  std::vector<uint64_t> take_offsets() {
    if (uniform()) make_offsets();
    return std::move(offsets_);
  }

 private:
  void make_offsets() {
    offsets_.reserve(count_ + 1);
    for (uint64_t i = 0; i <= count_; ++i) offsets_.push_back(i * length_);
  }

  // Empty while all lists have length_, else count_ + 1 places, as blocks have them.
  std::vector<uint64_t> offsets_;  // empty while all lists have length_
  uint64_t length_ = 0;
  uint64_t total_ = 0;
  uint64_t count_ = 0;
};

/// Collects cells of a surface and makes the most compact block of them: one without offsets where all have
/// the same number of corners.
class CellCollector {
 public:
  /// Point numbers of the cells, one cell after the other. Append a cell's nodes, then call end_cell().
  std::vector<uint32_t> nodes;
  Lengths lengths;

  void end_cell() { lengths.add(nodes.size() - lengths.total()); }
  uint64_t count() const { return lengths.count(); }
  uint64_t bytes() const { return nodes.size() * sizeof(uint32_t) + lengths.bytes(); }

  /// A block of triangles, quads or polygons. The collector is empty afterwards, also after take().
  CellBlock take_faces() {
    return take(lengths.length(0) == 3 ? CellType::triangle : CellType::quad, CellType::polygon);
  }
  /// `uniform` when all cells have its number of nodes, `varying` otherwise. `varying` must be a type of any
  /// length.
  CellBlock take(CellType uniform, CellType varying) {
    CellBlock block;
    const bool fits = lengths.uniform() && lengths.length(0) == nodes_of(uniform);
    block.type = fits ? uniform : varying;
    if (!fits) block.offsets = lengths.take_offsets();
    block.connectivity = std::move(nodes);
    return block;
  }
};

/// Calls f(type, cell, first_corner, nodes) for every cell of the mesh, in order. `cell` and `first_corner`
/// count through all blocks, as arrays on cells and on corners do.
template <class F>
void for_each_cell(const Mesh& mesh, F f) {
  uint64_t cell = 0;
  uint64_t corner = 0;
  for (const CellBlock& block : mesh.blocks) {
    const uint64_t size = block.size();
    for (uint64_t i = 0; i < size; ++i, ++cell) {
      const std::span<const uint32_t> nodes = block.cell(i);
      f(block.type == CellType::mixed ? static_cast<CellType>(block.types[i]) : block.type, cell, corner,
        nodes);
      corner += nodes.size();
    }
  }
}

}  // namespace maille
