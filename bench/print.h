#pragma once

#include <nlohmann/json_fwd.hpp>
#include "peers/rows.h"

namespace maille::bench {

nlohmann::json to_json(const Row& row, const Workload& workload);

/// A table for people, sizes against Draco's best (without a lattice: against meshoptimizer).
void print_rows(const std::vector<Row>& rows, const Workload& workload);

}  // namespace maille::bench
