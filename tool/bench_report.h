#pragma once

#include <peers/peers.h>
#include <peers/rows.h>

#include <optional>
#include <string>
#include <vector>

#include "summary.h"

// What `maille bench` found, as a table and as JSON.
namespace maille::tool {

/// A whole file packed, everything in it.
struct PackedFile {
  std::string name;
  uint64_t bytes = 0;
  double seconds = 0;
  std::optional<bool> exact;  ///< whether it came back, where that was tried
  std::string problem;        ///< why there is no answer
};

struct BenchReport {
  std::string file;
  uint64_t file_bytes = 0;
  bench::Workload workload;
  std::vector<bench::Row> rows;
  std::string against;             ///< the codec whose size is 1; empty: none
  std::vector<std::string> notes;  ///< what was left out, and why
  std::vector<const bench::Peer*> missing;
  std::vector<PackedFile> packed;

  /// False when a round trip of maille went wrong.
  bool good() const;
};

std::string bench_text(const BenchReport& report);
Json bench_json(const BenchReport& report);

}  // namespace maille::tool
