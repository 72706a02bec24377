#pragma once

#include <maille/generate.h>

#include <string>
#include <utility>
#include <vector>

#include "summary.h"

namespace maille::tool {

/// Counts the elements of a mesh while it is generated, and how many points are in use at a time, without
/// storing any.
class GeneratedCounts : public GeneratedOutput {
 public:
  /// The same of a mesh in memory. The order of patches is that of the metadata.
  static GeneratedCounts of(const Mesh& mesh);

  Result<> begin(const GeneratedSize& size) override;
  Result<> points(uint64_t first, std::span<const double> coordinates) override;
  Result<> faces(uint32_t patch, CellType type, std::span<const uint64_t> nodes) override;
  Result<> cells(uint32_t block, CellType type, std::span<const uint64_t> nodes,
                 std::span<const uint8_t> last_use) override;

  Json json() const;
  std::string text() const;

  struct Patch {
    std::string name;
    std::string type;
    uint64_t faces = 0;
  };
  uint64_t point_count = 0;
  uint64_t cell_count = 0;
  uint64_t most_alive = 0;  ///< points that are still needed, at any time
  /// Where more are needed, counting a mesh that takes long ends with memory_bound.
  uint64_t most_allowed = ~uint64_t{0};
  std::vector<std::pair<CellType, uint64_t>> types;  ///< of volume cells, as they come
  std::vector<Patch> patches;

 private:
  static constexpr uint64_t most_counted = 1'000'000'000;  ///< cells: about a minute
  void add(CellType type, uint64_t count);

  uint64_t alive_ = 0;
  bool too_long_ = false;
};

}  // namespace maille::tool
