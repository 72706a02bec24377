#pragma once

#include <maille/mesh_source.h>
#include <maille/stream.h>

#include <vector>

namespace maille {

/// Values of points of a source, read when they are asked for: pages of some hundred points, those used last
/// are kept. A cache of sets of four pages, the page that was used longest ago goes; memory is fixed from the
/// start.
class SourcePoints final : public PointSource {
 public:
  /// `arrays`: with the arrays on points, else positions only.
  SourcePoints(MeshSource& mesh, uint64_t memory, bool arrays);
  Result<> read(uint64_t number, std::byte* out) override;

 private:
  static constexpr unsigned ways = 4;
  static constexpr uint64_t none = ~uint64_t{0};
  struct Column {
    size_t array;  ///< of the description; `positions`: none
    size_t size;   ///< of a tuple
  };
  struct Page {
    uint64_t number = none;
    uint64_t used = 0;
    std::vector<std::byte> bytes;  ///< column after column
  };
  Result<const Page*> find(uint64_t number);
  Result<> load(Page& page, uint64_t number);

  MeshSource& mesh_;
  std::vector<Column> columns_;
  size_t stride_ = 0;
  uint64_t points_per_page_;
  unsigned page_shift_;
  std::vector<Page> pages_;  ///< sets of `ways`
  uint64_t sets_;
  uint64_t time_ = 0;
  const Page* last_ = nullptr;
};

}  // namespace maille
