#pragma once

#include "volume/values/point_stencil.h"

namespace maille {

/// What a cell's value may be expected to be, from cells in memory: its neighbours across faces, and, by
/// their own neighbours, those across edges and the corner. The value of the cell in slot s is at s + 1, as
/// `near` and sums have it: 0 is for cells without a slot.
/// Links are kept by slot and never cleared: what a slot held before is the same for both sides.
class CellStencils {
 public:
  /// Of cell i of a block; each cell once, in order.
  void find(const CodedCells& cells, size_t i, PointStencil& stencil);
  uint64_t bytes() const { return bytes_held(links_); }

 private:
  static constexpr unsigned axes = 3;
  using Links = std::array<uint32_t, most_faces>;
  static Links no_links();
  void put_links(uint32_t slot, const Links& links);
  static void find_mean(const Links& neighbours, PointStencil& stencil);
  bool find_others(const std::array<uint32_t, axes>& cell, const std::array<unsigned, axes>& face,
                   PointStencil& stencil) const;
  void add_sums(std::span<const uint32_t> cell, const std::array<unsigned, axes>& face,
                PointStencil& stencil) const;
  uint32_t across(uint32_t slot, unsigned face) const {
    return slot < links_.size() ? links_[slot][face] : no_slot;
  }

  std::vector<Links> links_;  ///< by cell slot: its neighbours when it was coded
};

}  // namespace maille
