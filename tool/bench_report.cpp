#include "bench_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "text.h"

namespace maille::tool {

namespace {

using bench::Row;

/// The peers that are measured take triangles only.
bool is_ours(const Row& row) {
  return !row.codec->needs_triangles();
}

double bits_per_point(const BenchReport& report, const Row& row) {
  return 8 * static_cast<double>(row.encoded.bytes.size()) /
         static_cast<double>(report.workload.surface.vertices());
}

// Relative to the codec of the report; nothing where that one failed.
std::optional<double> ratio(const BenchReport& report, const Row& row) {
  const auto found = std::find_if(report.rows.begin(), report.rows.end(), [&](const Row& other) {
    return other.codec->name() == report.against && other.problem.empty();
  });
  if (found == report.rows.end()) return std::nullopt;
  return static_cast<double>(row.encoded.bytes.size()) / static_cast<double>(found->encoded.bytes.size());
}

std::string precision_text(int bits) {
  return bits > 0 ? fmt::format("rounded to {} bits", bits) : "as float32, bit for bit";
}

std::string speed_text(double million_per_second) {
  return fmt::format("{:.{}f}", million_per_second, million_per_second < 10 ? 2 : 1);
}

void add_row(Table& table, const BenchReport& report, const Row& row) {
  if (!row.problem.empty()) {
    table.row({row.codec->name(), "-", "-", "-", "-", "-", "-", "-", "failed: " + row.problem});
    return;
  }
  const auto relative = ratio(report, row);
  table.row({row.codec->name(), fmt::format("{}", row.encoded.bytes.size()),
             fmt::format("{:.2f}", bits_per_point(report, row)),
             relative ? fmt::format("{:.3f}", *relative) : "-",
             speed_text(million_triangles_per_second(report.workload, row.encode_seconds)),
             speed_text(million_triangles_per_second(report.workload, row.decode_seconds)),
             human_bytes(static_cast<double>(row.encode_trial.peak_bytes)),
             human_bytes(static_cast<double>(row.decode_trial.peak_bytes)), row.check.verdict});
}

std::string packed_text(const BenchReport& report) {
  Table table({"", "bytes", "size", "encode s", "came back"}, 1, true);
  const auto file_bytes = static_cast<double>(report.file_bytes);
  table.row({"as it is", fmt::format("{}", report.file_bytes), "1.000", "", ""});
  for (const PackedFile& packed : report.packed) {
    if (!packed.problem.empty()) {
      table.row({packed.name, "-", "-", "-", "failed: " + packed.problem});
      continue;
    }
    table.row({packed.name, fmt::format("{}", packed.bytes),
               fmt::format("{:.3f}", static_cast<double>(packed.bytes) / std::max(file_bytes, 1.0)),
               fmt::format("{:.2f}", packed.seconds),
               !packed.exact   ? ""
               : *packed.exact ? "exact"
                               : "different"});
  }
  return "the whole file, every array bit for bit; sizes relative to the file:\n" + table.str();
}

Json json_of(const BenchReport& report, const Row& row) {
  Json json = {{"codec", row.codec->name()}};
  if (!row.problem.empty()) {
    json["failed"] = row.problem;
    return json;
  }
  json["bytes"] = row.encoded.bytes.size();
  json["bits_per_point"] = bits_per_point(report, row);
  if (const auto relative = ratio(report, row)) json["ratio"] = *relative;
  if (row.encoded.connectivity) json["connectivity_bytes"] = *row.encoded.connectivity;
  json["encode_million_triangles_per_second"] =
      million_triangles_per_second(report.workload, row.encode_seconds);
  json["decode_million_triangles_per_second"] =
      million_triangles_per_second(report.workload, row.decode_seconds);
  json["encode_peak_bytes"] = row.encode_trial.peak_bytes;
  json["decode_peak_bytes"] = row.decode_trial.peak_bytes;
  json["good"] = row.check.ok;
  json["round_trip"] = row.check.verdict;
  return json;
}

Json json_of(const PackedFile& packed) {
  if (!packed.problem.empty()) return {{"packer", packed.name}, {"failed", packed.problem}};
  Json json = {{"packer", packed.name}, {"bytes", packed.bytes}, {"seconds", packed.seconds}};
  if (packed.exact) json["exact"] = *packed.exact;
  return json;
}

}  // namespace

// A peer may lose points or turn faces over; that is reported in its row, but only our own failures are
// errors.
bool BenchReport::good() const {
  const bool rows_good = std::all_of(rows.begin(), rows.end(), [](const Row& row) {
    return !is_ours(row) || (row.problem.empty() && row.check.verdict == "exact");
  });
  return rows_good && std::all_of(packed.begin(), packed.end(), [](const PackedFile& file) {
           return file.exact.value_or(true) && file.problem.empty();
         });
}

std::string bench_text(const BenchReport& report) {
  std::string text = fmt::format(
      "{}: {}, {}; positions {}\n"
      "size: relative to {}; encode, decode: million triangles per second of one thread\n",
      report.file, counted(report.workload.surface.vertices(), "point"),
      counted(report.workload.surface.faces(), "face"), precision_text(report.workload.bits),
      report.against.empty() ? "-" : report.against);
  Table table(
      {"codec", "bytes", "bits/point", "size", "encode", "decode", "enc. memory", "dec. memory", "came back"},
      1, true);
  for (const Row& row : report.rows) add_row(table, report, row);
  text += table.str();
  for (const std::string& note : report.notes) text += note + "\n";
  for (const bench::Peer* peer : report.missing) {
    text += fmt::format("{}: not built in; install {} and build again\n", peer->name, peer->packages);
  }
  return report.packed.empty() ? text : text + packed_text(report);
}

Json bench_json(const BenchReport& report) {
  const bench::Surface& surface = report.workload.surface;
  Json json = {{"file", report.file},
               {"file_bytes", report.file_bytes},
               {"points", surface.vertices()},
               {"faces", surface.faces()},
               {"triangles", report.workload.triangles.size() / 3},
               {"bits", report.workload.bits > 0 ? Json(report.workload.bits) : Json()},
               {"against", report.against.empty() ? Json() : Json(report.against)}};
  json["codecs"] = Json::array();
  for (const Row& row : report.rows) json["codecs"].push_back(json_of(report, row));
  json["missing"] = Json::array();
  for (const bench::Peer* peer : report.missing) {
    json["missing"].push_back({{"codec", peer->name}, {"packages", peer->packages}});
  }
  json["notes"] = report.notes;
  json["whole_file"] = Json::array();
  for (const PackedFile& packed : report.packed) json["whole_file"].push_back(json_of(packed));
  return json;
}

}  // namespace maille::tool
