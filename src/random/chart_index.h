#pragma once

#include <maille/error.h>
#include <maille/source.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "random/hierarchy.h"

namespace maille {

/// What is known of charts without decoding them: one group is one page of a file, the charts that appear
/// together when it is refined. Group 0 is the root: its charts are the coarsest ones, and it is always
/// refined. A group's number is lower than those of the groups that refine its charts, so there are no loops.
/// docs/format.md, 17.2.

struct IndexedChart {
  Sphere sphere;
  Box box;                       ///< in the file: around the sphere's centre
  uint32_t producer = no_group;  ///< the group that refines it; none at level 0
  uint32_t faces = 0;
  uint32_t bytes = 0;
  uint32_t check = 0;  ///< low 32 bits of XXH3 over its bytes
};

struct IndexedGroup {
  uint32_t level = 0;  ///< of its charts
  /// Of what the charts of this group are replaced by when it is not refined; infinite for the root.
  double view_error = 0, bound = 0;
  Sphere sphere;
  uint32_t replaces = 0;  ///< how many charts of coarser groups it replaces; 0 for the root
  uint64_t offset = 0;    ///< of its page in the file: of the first chart's bytes
  std::vector<IndexedChart> charts;
};

inline constexpr uint32_t groups_per_index_page = 256;

/// The cube that spheres and boxes are written in.
struct IndexFrame {
  Vector3 low;
  double size = 1;
};

/// Errors are written as floats, rounded up.
float float_not_less(double x);

/// The groups of one page, of which `first` is the number of the first. Spheres, boxes and errors are rounded
/// outwards.
std::vector<std::byte> encode_index_page(const IndexFrame& frame, std::span<const IndexedGroup> groups,
                                         uint32_t first);
/// Inverse; `group_count` is that of the file. Memory is bounded by the bytes. Error: corrupt.
Result<std::vector<IndexedGroup>> decode_index_page(const IndexFrame& frame, Bytes bytes, uint32_t first,
                                                    uint32_t group_count);

/// The index of a file, as far as it has been read.
class ChartIndex {
 public:
  ChartIndex() = default;
  explicit ChartIndex(uint32_t groups)
      : group_count_(groups), pages_((groups + groups_per_index_page - 1) / groups_per_index_page) {}

  uint32_t size() const { return group_count_; }
  uint32_t pages() const { return static_cast<uint32_t>(pages_.size()); }
  static uint32_t page_of(uint32_t group) { return group / groups_per_index_page; }
  bool has_page(uint32_t page) const { return !pages_[page].empty(); }
  void set_page(uint32_t page, std::vector<IndexedGroup> groups) { pages_[page] = std::move(groups); }
  /// Its page must be there.
  const IndexedGroup& group(uint32_t number) const {
    return pages_[page_of(number)][number % groups_per_index_page];
  }

 private:
  uint32_t group_count_ = 0;
  std::vector<std::vector<IndexedGroup>> pages_;
};

}  // namespace maille
