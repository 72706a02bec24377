#pragma once

#include <maille/source.h>

#include <array>
#include <functional>
#include <vector>

#include "container/file_writer.h"
#include "description/description.h"
#include "random/build/hierarchy_index.h"
#include "random/random_layout.h"

namespace maille {

/// Everything of a file of mode `random` but its order: what stands before the charts, in memory; charts from
/// wherever they are, one group at a time.
struct RandomContents {
  Description description;
  std::vector<std::pair<uint32_t, std::vector<std::byte>>> mesh_arrays;  ///< by their numbers
  std::array<std::vector<std::byte>, 2> tables;                          ///< none: empty
  ChartDirectory directory;                                              ///< without index pages
  std::vector<IndexedGroup> groups;  ///< with sizes and checks of their charts, without places
  /// The bytes of all charts of a group.
  std::function<Result<std::vector<std::byte>>(uint32_t group)> charts;
};

/// Writes header and streams; the caller adds what stands behind them, and finishes. Error: those of the
/// sink, of `charts`.
Result<FileWriter> write_random(Sink& sink, RandomContents& contents, const Progress& progress = {});

}  // namespace maille
