#pragma once

#include <maille/error.h>
#include <maille/limits.h>
#include <maille/source.h>

#include <vector>

#include "container/stream_source.h"
#include "random/chart_index.h"

namespace maille {

// What files of mode `random` have beside the description: docs/format.md, 17.

inline constexpr StreamKey random_description_key{"DESC"};
inline constexpr StreamKey directory_key{"CDIR"};
inline constexpr StreamKey random_order_key{"ORDR"};
/// Of the charts of level 0, and of all others; none where they have tables of their own.
inline StreamKey tables_key(uint32_t set) {
  return {"CTAB", set};
}
/// One for each page of the index.
inline StreamKey index_page_key(uint32_t page) {
  return {"CIDX", page};
}
/// One for each group: the charts that appear when it is refined.
inline StreamKey charts_key(uint32_t group) {
  return {"CHRT", group};
}
/// Arrays of the mesh as a whole.
inline StreamKey mesh_array_key(uint32_t array) {
  return {"ARRY", 0, array};
}

/// Where the content of a stream of one chunk stands. Size 0: it has several, which are found by their key.
struct StreamPlace {
  uint64_t offset = 0;
  uint32_t size = 0;
};

/// Sums over level 0, and over all coarser levels: what `info` says without reading charts.
struct ChartTotals {
  uint64_t topology = 0;
  std::vector<uint64_t> arrays;  ///< positions first
  uint64_t other = 0;
};

/// Where everything is.
struct ChartDirectory {
  uint32_t groups = 0;
  uint32_t levels = 0;
  std::vector<uint64_t> faces;  ///< by level
  std::vector<uint32_t> charts;
  IndexFrame frame;
  std::vector<StreamPlace> index_pages;
  ChartTotals finest, coarser;
};

std::vector<std::byte> encode_directory(const ChartDirectory& directory);
/// Inverse. Safe on any bytes. Errors: corrupt, memory_bound.
Result<ChartDirectory> decode_directory(Bytes bytes, const Limits& limits);

/// What stands before the charts of a page, so that an index that is lost can be made anew.
struct PageHead {
  uint32_t level = 0, replaces = 0;
  double view_error = 0, bound = 0;
  struct Chart {
    uint32_t producer = no_group;
    uint32_t faces = 0, bytes = 0;
  };
  std::vector<Chart> charts;
};

std::vector<std::byte> encode_page_head(const PageHead& head);
struct ParsedPageHead {
  PageHead head;
  size_t bytes = 0;
};
Result<ParsedPageHead> decode_page_head(Bytes page);

}  // namespace maille
