#pragma once

#include <maille/decode.h>

#include "container/file_reader.h"
#include "random/chart_codec.h"
#include "random/random_layout.h"

namespace maille {

/// Directory and index, made anew from the pages of charts. A group that is lost has one chart, which cannot
/// be read and may be anywhere; one group stands for all those behind the last that was found. What only lost
/// groups refer to hangs on the root.
struct RebuiltIndex {
  ChartDirectory directory;
  std::vector<IndexedGroup> groups;
};

/// Decodes every chart that is intact. Time and memory are bounded by the size of the file and by the limits
/// of `options`. Errors: corrupt, when there is no group; cannot_read.
Result<RebuiltIndex> rebuild_index(const Source& source, const FileReader& file, const ChartSets& sets,
                                   const DecodeOptions& options);

}  // namespace maille
