#include "rows.h"

#include <fmt/format.h>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace maille::bench {
namespace {

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

template <class Work>
void time_once(std::vector<double>& seconds, size_t runs, double budget, const Work& work) {
  double spent = 0;
  for (const double s : seconds) spent += s;
  if (seconds.size() >= runs || (!seconds.empty() && spent > budget)) return;
  const double start = thread_seconds();
  const auto result = work();
  seconds.push_back(thread_seconds() - start);
}

std::string precision_name(int bits) {
  return bits > 0 ? std::to_string(bits) : "lossless";
}

double million_per_second(size_t triangles, const std::vector<double>& seconds) {
  const double time = median(seconds);
  return time > 0 ? 1e-6 * static_cast<double>(triangles) / time : 0;
}

// What sizes are compared with: Draco's best, and where it has nothing, meshoptimizer.
std::string yardstick(const Workload& workload) {
  return workload.bits > 0 ? "draco -cl 10" : "meshopt + zstd -19";
}

double bytes_of_yardstick(const std::vector<Row>& rows, const Workload& workload) {
  for (const Row& row : rows) {
    if (row.problem.empty() && row.codec->name() == yardstick(workload)) {
      return static_cast<double>(row.encoded.bytes.size());
    }
  }
  return 0;
}

}  // namespace

Row first_run(const Codec& codec, const Workload& workload) {
  Row row;
  row.codec = &codec;
  row.encode_trial = try_in_child([&] {
    const auto encoded = codec.encode(workload);
    return encoded ? "" : encoded.error().message;
  });
  if (!row.encode_trial.ok) {
    row.problem = "encode: " + row.encode_trial.problem;
    return row;
  }
  row.encoded = *codec.encode(workload);
  row.encoded.bytes.shrink_to_fit();
  row.decode_trial = try_in_child([&] {
    const auto decoded = codec.decode(row.encoded.bytes, workload);
    return decoded ? "" : decoded.error().message;
  });
  if (!row.decode_trial.ok) {
    row.problem = "decode: " + row.decode_trial.problem;
    return row;
  }
  const Surface decoded = (*codec.decode(row.encoded.bytes, workload))();
  const Surface original =
      codec.needs_triangles() ? as_triangles(workload.surface, workload.triangles) : workload.surface;
  // A thousandth for what float32 adds to half a step.
  row.check = codec.keeps_lattice() || workload.bits == 0 ? check_round_trip(original, decoded)
                                                          : check_within(original, decoded, 0.501);
  if (!row.encoded.connectivity) row.encoded.connectivity = codec.estimate_connectivity(workload);
  if (row.encoded.connectivity && !row.encoded.geometry) {
    row.encoded.geometry =
        row.encoded.bytes.size() - std::min<uint64_t>(*row.encoded.connectivity, row.encoded.bytes.size());
  }
  return row;
}

void time_rows(std::vector<Row>& rows, const Workload& workload, bool quick) {
  const size_t encode_runs = quick ? 1 : 3, decode_runs = quick ? 3 : 7;
  const double budget = quick ? 0.5 : 3;  // seconds for each codec, each way
  for (size_t round = 0; round < decode_runs; ++round) {
    for (Row& row : rows) {
      if (!row.problem.empty()) continue;
      time_once(row.encode_seconds, encode_runs, budget, [&] { return row.codec->encode(workload); });
      time_once(row.decode_seconds, decode_runs, budget,
                [&] { return row.codec->decode(row.encoded.bytes, workload); });
    }
  }
}

nlohmann::json to_json(const Row& row, const Workload& workload) {
  const auto vertices = static_cast<double>(workload.surface.vertices());
  nlohmann::json json = {{"folder", workload.folder},
                         {"mesh", workload.mesh},
                         {"vertices", workload.surface.vertices()},
                         {"faces", workload.surface.faces()},
                         {"triangles", workload.triangles.size() / 3},
                         {"bits", precision_name(workload.bits)},
                         {"codec", row.codec->name()}};
  if (!row.problem.empty()) {
    json["failed"] = row.problem;
    return json;
  }
  json["bytes"] = row.encoded.bytes.size();
  json["bits_per_vertex"] = 8 * static_cast<double>(row.encoded.bytes.size()) / vertices;
  if (row.encoded.connectivity) json["connectivity_bytes"] = *row.encoded.connectivity;
  if (row.encoded.geometry) json["geometry_bytes"] = *row.encoded.geometry;
  json["encode_mtps"] = million_per_second(workload.triangles.size() / 3, row.encode_seconds);
  json["decode_mtps"] = million_per_second(workload.triangles.size() / 3, row.decode_seconds);
  json["encode_peak_per_vertex"] = static_cast<double>(row.encode_trial.peak_bytes) / vertices;
  json["decode_peak_per_vertex"] = static_cast<double>(row.decode_trial.peak_bytes) / vertices;
  json["ok"] = row.check.ok;
  json["round_trip"] = row.check.verdict;
  return json;
}

void print_rows(const std::vector<Row>& rows, const Workload& workload) {
  const double reference = bytes_of_yardstick(rows, workload);
  fmt::print("\n{}/{}: {} vertices, {} faces, {}\n", workload.folder, workload.mesh,
             workload.surface.vertices(), workload.surface.faces(),
             workload.bits > 0 ? fmt::format("{} bits", workload.bits) : "lossless float32");
  fmt::print("{:20} {:>9} {:>15} {:>12} {:>15} {:>15}\n", "", "", "bits/vertex", "size by", "M triangles/s",
             "peak bytes/v");
  fmt::print("{:20} {:>9} {:>7} {:>7} {:>12} {:>7} {:>7} {:>7} {:>7}  {}\n", "codec", "bytes", "all",
             "connect", workload.bits > 0 ? "draco10" : "meshopt", "encode", "decode", "encode", "decode",
             "round trip");
  for (const Row& row : rows) {
    if (!row.problem.empty()) {
      fmt::print("{:20} failed: {}\n", row.codec->name(), row.problem);
      continue;
    }
    const auto vertices = static_cast<double>(workload.surface.vertices());
    const auto json = to_json(row, workload);
    const auto number = [&json](const char* key) { return json[key].get<double>(); };
    fmt::print(
        "{:20} {:>9} {:>7.2f} {:>7} {:>12} {:>7.2f} {:>7.2f} {:>7.0f} {:>7.0f}  {}\n", row.codec->name(),
        row.encoded.bytes.size(), number("bits_per_vertex"),
        row.encoded.connectivity
            ? fmt::format("{:.2f}", 8 * static_cast<double>(*row.encoded.connectivity) / vertices)
            : "",
        reference > 0 ? fmt::format("{:.3f}", static_cast<double>(row.encoded.bytes.size()) / reference) : "",
        number("encode_mtps"), number("decode_mtps"), number("encode_peak_per_vertex"),
        number("decode_peak_per_vertex"), row.check.verdict);
  }
  std::fflush(stdout);
}

}  // namespace maille::bench
