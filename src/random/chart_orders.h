#pragma once

#include <maille/error.h>

#include <span>
#include <string>
#include <vector>

#include "base/scratch_file.h"
#include "description/element_order.h"

namespace maille {

/// Which elements of the mesh the charts of level 0 have, in a temporary file until it is known in which
/// order charts stand in the file. Memory: 16 bytes a chart.
class ChartOrders {
 public:
  static Result<ChartOrders> create(const std::string& folder);

  /// Of the next chart: `order` has its points and cells as they are coded, with their numbers in the mesh.
  Result<> add(const ElementOrder& order);
  /// encode_order() of the whole mesh, as decode_random() will have it: `charts` in the order of the file,
  /// each point in the first one that has it. Memory: a bit for each of `points`.
  Result<> encode(std::span<const uint32_t> charts, uint64_t points, ScratchFile& out);

 private:
  struct Place {
    uint64_t offset;
    uint32_t points, cells;
  };
  explicit ChartOrders(ScratchFile file) : file_(std::move(file)) {}
  Result<std::vector<uint32_t>> read(uint64_t offset, uint32_t count);

  ScratchFile file_;
  std::vector<Place> places_;  ///< by chart
};

}  // namespace maille
