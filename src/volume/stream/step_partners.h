#pragma once

#include <maille/source.h>
#include <maille/stream.h>

#include <cstdint>
#include <vector>

#include "numbers/number_map.h"
#include "volume/stream/stream_layout.h"

namespace maille {

/// How an array of the new step goes with one of an earlier step while that is read. All that can make it
/// cheaper is tried in one pass over the earlier step: its values as they are, differences on its lattice, or
/// expectations from it.
struct Partner {
  size_t array = 0;         ///< of the step, in the new one
  uint32_t of = 0;          ///< in the earlier one
  bool keeps = true;        ///< its values are within the bound so far
  double error = 0;         ///< the largest
  bool on_lattice = false;  ///< all values of the new array are within the bound on `maps`
  double lattice_error = 0;
  std::vector<NumberMap> maps;  ///< of differences
  bool follows = false;         ///< numbers of the new array may be expected from those of the earlier one
  std::vector<std::byte> before = {};  ///< all tuples of the earlier array, as they are read
};

/// Marks arrays that values of the mesh, or of the step before, serve within the bound. What is returned may
/// be coded as differences, or as what follows. Every 16th step stands alone, so that no reader needs more
/// than 15 others.
Result<std::vector<Partner>> compare_with_earlier(const Source& source, const StreamHeader& mesh,
                                                  uint64_t number, StepHeader& step, StepSource& values,
                                                  const StepOptions& options);

}  // namespace maille
