#pragma once

#include <maille/random_access.h>

#include "random/read/random_reader.h"

namespace maille {

/// What File::component() says; takes no more memory than `most_bytes` for what it remembers of charts.
Result<Component> find_component(RandomReader& reader, const ChartPlace& place, uint32_t point,
                                 uint64_t most_bytes);

}  // namespace maille
