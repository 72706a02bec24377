#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>
#include "check.h"
#include "codec.h"
#include "measure.h"

namespace maille::bench {

/// What one codec did with one workload.
struct Row {
  const Codec* codec = nullptr;
  Encoded encoded;
  Trial encode_trial, decode_trial;
  Check check;
  std::string problem;
  std::vector<double> encode_seconds, decode_seconds;
};

/// Both ways once in a child (memory, crashes), then once here for the bytes and the check.
Row first_run(const Codec& codec, const Workload& workload);

/// Fills in the times, round by round over all rows, so that a busy minute of the machine touches each codec.
void time_rows(std::vector<Row>& rows, const Workload& workload, bool quick);

nlohmann::json to_json(const Row& row, const Workload& workload);

/// A table for people, sizes against Draco's best (without a lattice: against meshoptimizer).
void print_rows(const std::vector<Row>& rows, const Workload& workload);

}  // namespace maille::bench
