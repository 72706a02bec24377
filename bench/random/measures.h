#pragma once

#include <maille/error.h>

#include <cstddef>
#include <vector>

#include "random/chart_codec.h"
#include "random/read/random_reader.h"

namespace maille {

struct ChartBytes {
  uint32_t level;
  uint64_t faces;
  std::vector<std::byte> bytes;
};

/// CPU time of this process.
double cpu_seconds();

/// All charts, as they are in the file.
Result<std::vector<ChartBytes>> read_all(RandomReader& reader);

/// M faces per second of the best of some runs over the charts of `level`, in CPU time of one thread.
Result<double> decode_speed(const std::vector<ChartBytes>& charts, const ChartSet& set, uint32_t level,
                            ChartUse use);

/// What charts that meet a box have, over the faces that are in it.
struct ReadForBox {
  double faces = 0;
  double bits = 0;
};
/// For a box of `part` of all faces: the mean over some boxes, each around a face, grown until it holds so
/// many.
Result<ReadForBox> read_for_boxes(RandomReader& reader, const ChartSet& set,
                                  const std::vector<ChartBytes>& charts, double part);

}  // namespace maille
