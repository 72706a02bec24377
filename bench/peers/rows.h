#pragma once

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

/// How often a codec is timed.
struct Runs {
  size_t encode = 3, decode = 7;
  double seconds = 3;  ///< what has taken that long, in each direction, is not timed again
};

enum class Peaks : uint8_t { measured, unknown };

/// Both ways once in a child (memory, crashes), unless peaks may stay unknown; then once here for the bytes,
/// the check and the first times.
Row first_run(const Codec& codec, const Workload& workload, Peaks peaks = Peaks::measured);

/// Times each codec once more, round by round, so that a busy minute of the machine touches each of them.
void time_round(std::vector<Row>& rows, const Workload& workload, const Runs& runs);

/// By the fastest run, which other work on the machine touched least; 0 where nothing was timed.
double million_triangles_per_second(const Workload& workload, const std::vector<double>& seconds);

}  // namespace maille::bench
