#include "print.h"

#include <fmt/format.h>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace maille::bench {
namespace {

std::string precision_name(int bits) {
  return bits > 0 ? std::to_string(bits) : "lossless";
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
  json["encode_mtps"] = million_triangles_per_second(workload, row.encode_seconds);
  json["decode_mtps"] = million_triangles_per_second(workload, row.decode_seconds);
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
