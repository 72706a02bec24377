// Volume meshes: maille beside what packs their arrays today, in one process and thread. Every row is decoded
// and compared. Tables go to stdout, with --json one line a row to a file for report.py.
#include <fmt/format.h>
#include <maille/compare.h>
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/io.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include "array_codec.h"
#include "peers/measure.h"
#include "whole_coder.h"
#include "workload.h"

namespace maille::bench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct Options {
  std::vector<std::string> paths;
  std::vector<std::string> codecs;
  std::vector<int> efforts = {2, 5, 9};
  std::string json_path;
  bool no_pipe = false;
  bool as_read = false;
  unsigned rounds = 7;
};

struct Row {
  std::string codec;
  uint64_t total = 0, connectivity = 0, numbering = 0, geometry = 0;
  std::vector<std::pair<std::string, uint64_t>> fields;
  double encode_seconds = 0, decode_seconds = 0;
  std::string verdict = "exact";
  bool whole = true;  ///< false: not for all arrays
};

struct Workload {
  std::string folder, name;
  Mesh mesh;
  bool as_read = false;
};

Row run_maille(const Mesh& mesh, int effort, Order order) {
  Row row{.codec = fmt::format("maille -{}{}", effort, order == Order::keep ? "" : " --any-order"),
          .fields = {}};
  EncodeOptions options;
  options.mode = Mode::stream;
  options.effort = effort;
  options.order = order;
  std::vector<std::byte> bytes;
  double start = thread_seconds();
  const auto report = encode(mesh, *memory_sink(bytes), options);
  row.encode_seconds = thread_seconds() - start;
  if (!report) {
    row.verdict = "failed: " + report.error().message;
    return row;
  }
  start = thread_seconds();
  const auto decoded = decode(*memory_source(bytes));
  row.decode_seconds = thread_seconds() - start;
  row.total = bytes.size();
  row.connectivity = report->connectivity.coded_bytes;
  row.numbering = report->order_bytes;
  row.geometry = report->positions.coded_bytes;
  for (const ArrayReport& array : report->arrays) row.fields.emplace_back(array.name, array.coded_bytes);
  if (!decoded) {
    row.verdict = "failed: " + decoded.error().message;
    return row;
  }
  const Comparison same =
      compare(mesh, *decoded, {.same_order = order == Order::keep, .compare_metadata = true});
  if (!same.equal) row.verdict = "differs: " + (same.differences.empty() ? "" : same.differences[0]);
  return row;
}

Row run_peer(const ArrayCodec& codec, const Mesh& mesh) {
  Row row{.codec = codec.name(), .fields = {}};
  for (const Part& part : codec.as_vtk() ? parts_as_vtk(mesh) : parts_by_type(mesh)) {
    if (!codec.takes(part)) {
      row.whole = false;
      continue;
    }
    double start = thread_seconds();
    const auto packed = codec.pack(part);
    row.encode_seconds += thread_seconds() - start;
    if (!packed) {
      row.verdict = "failed: " + part.name + ": " + packed.error().message;
      continue;
    }
    start = thread_seconds();
    const auto unpacked = codec.unpack(*packed, part);
    row.decode_seconds += thread_seconds() - start;
    if (!unpacked || *unpacked != part.bytes) row.verdict = "differs: " + part.name;
    row.total += packed->size();
    if (part.holds == Part::Holds::connectivity) row.connectivity += packed->size();
    if (part.holds == Part::Holds::geometry) row.geometry += packed->size();
    if (part.holds == Part::Holds::field) row.fields.emplace_back(part.name, packed->size());
  }
  return row;
}

json to_json(const Row& row, const Workload& work) {
  const auto cells = static_cast<double>(work.mesh.cell_count());
  json fields = json::object();
  for (const auto& [name, bytes] : row.fields) fields[name] = bytes;
  return {{"folder", work.folder},
          {"mesh", work.name},
          {"precision", work.as_read ? "as read" : "f32"},
          {"points", work.mesh.point_count()},
          {"cells", work.mesh.cell_count()},
          {"solids", solid_cells(work.mesh)},
          {"codec", row.codec},
          {"whole", row.whole},
          {"bytes", row.total},
          {"connectivity_bytes", row.connectivity},
          {"numbering_bytes", row.numbering},
          {"geometry_bytes", row.geometry},
          {"field_bytes", fields},
          {"encode_mcps", cells / 1e6 / std::max(row.encode_seconds, 1e-9)},
          {"decode_mcps", cells / 1e6 / std::max(row.decode_seconds, 1e-9)},
          {"round_trip", row.verdict}};
}

json to_json(const WholeCoder& row, const Workload& work) {
  const auto rate = [&](double seconds) {
    return static_cast<double>(work.mesh.cell_count()) / 1e6 / std::max(seconds, 1e-9);
  };
  return {{"whole_coder", row.from},
          {"mesh", work.name},
          {"cells", work.mesh.cell_count()},
          {"threads", row.threads},
          {"encode_mcps", rate(row.encode_seconds)},
          {"decode_mcps", rate(row.decode_seconds)},
          {"encode_mcps_cpu", rate(row.encode_cpu_seconds)},
          {"decode_mcps_cpu", rate(row.decode_cpu_seconds)},
          {"round_trip", row.verdict}};
}

void print_row(const Row& row, const Workload& work) {
  const auto solids = static_cast<double>(solid_cells(work.mesh)),
             cells = static_cast<double>(work.mesh.cell_count());
  const auto bits = [&](uint64_t bytes) { return 8 * static_cast<double>(bytes) / solids; };
  uint64_t fields = 0;
  for (const auto& [name, bytes] : row.fields) fields += bytes;
  fmt::print("{:26} {:>10} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.3f} {:>7.3f} {:>7.3f}  {}\n", row.codec, row.total,
             bits(row.connectivity), bits(row.numbering), bits(row.geometry), bits(fields),
             cells / 1e6 / std::max(row.encode_seconds, 1e-9),
             cells / 1e6 / std::max(row.decode_seconds, 1e-9), row.verdict);
  std::fflush(stdout);
}

class Bench {
 public:
  explicit Bench(const Options& options) : options_(options) {
    add_general_codecs(peers_);
    add_float_codecs(peers_);
    add_file_codecs(peers_);
    add_index_codec(peers_);
    if (!options.json_path.empty()) json_.open(options.json_path);
  }

  bool run() {
    if (!options_.no_pipe) {
      auto pipe = generate_pipe();
      if (!pipe) {
        fmt::print("pipe: {}\n", pipe.error().message);
        return false;
      }
      const Workload work{"generated", "pipe 1M", std::move(*pipe)};
      if (options_.rounds > 0 && is_chosen("maille")) measure_speed(work);
      measure(work);
    }
    for (const std::string& path : files()) {
      auto read = read_mesh(path);
      if (!read) {
        fmt::print("\n{}: skipped: {}\n", path, read.error().message);
        all_ok_ = false;
        continue;
      }
      const std::string folder = fs::absolute(path).parent_path().filename().string();
      const std::string name = fs::path(path).filename().string();
      // What is to be exact is the file as it was read; what is compared are 32-bit floats.
      measure({folder, name, read->mesh, true});
      if (!options_.as_read) measure({folder, name, as_f32(std::move(read->mesh)), false});
    }
    return all_ok_;
  }

 private:
  std::vector<std::string> files() const {
    std::vector<std::string> found;
    for (const std::string& path : options_.paths) {
      if (!fs::is_directory(path)) {
        found.push_back(path);
        continue;
      }
      std::vector<std::string> folder;
      for (const auto& entry : fs::recursive_directory_iterator(path)) {
        if (entry.is_regular_file() && format_of(entry.path().string()))
          folder.push_back(entry.path().string());
      }
      std::sort(folder.begin(), folder.end());
      found.insert(found.end(), folder.begin(), folder.end());
    }
    return found;
  }
  bool is_chosen(const std::string& codec) const {
    return options_.codecs.empty() ||
           std::any_of(options_.codecs.begin(), options_.codecs.end(),
                       [&](const std::string& part) { return codec.find(part) != std::string::npos; });
  }
  void add(const Row& row, const Workload& work) {
    print_row(row, work);
    if (json_.is_open()) json_ << to_json(row, work).dump() << std::endl;
    all_ok_ = all_ok_ && row.verdict == "exact";
  }
  void measure_speed(const Workload& work) {
    fmt::print("\nWhole coder, {}, effort 5, order kept: M cells/s of wall time, the best of {}\n", work.name,
               options_.rounds);
    fmt::print("{:14} {:>7} {:>8} {:>8} {:>16}\n", "from, to", "threads", "encode", "decode",
               "M cells/CPU s");
    for (const WholeCoder& row : measure_whole_coder(work.mesh, options_.rounds)) {
      const json line = to_json(row, work);
      fmt::print("{:14} {:>7} {:>8.2f} {:>8.2f} {:>8.2f} {:>7.2f}  {}\n", row.from, row.threads,
                 line["encode_mcps"].get<double>(), line["decode_mcps"].get<double>(),
                 line["encode_mcps_cpu"].get<double>(), line["decode_mcps_cpu"].get<double>(), row.verdict);
      std::fflush(stdout);
      if (json_.is_open()) json_ << line.dump() << std::endl;
      all_ok_ = all_ok_ && row.verdict == "exact";
    }
  }
  void measure(const Workload& work) {
    fmt::print("\n{}/{}: {} points, {} cells, {} of them solid, {}\n", work.folder, work.name,
               work.mesh.point_count(), work.mesh.cell_count(), solid_cells(work.mesh),
               work.as_read ? "as read" : "32-bit floats");
    fmt::print("{:26} {:>10} {:>35} {:>15}\n", "", "", "bits/solid cell", "M cells/CPU s");
    fmt::print("{:26} {:>10} {:>8} {:>8} {:>8} {:>8} {:>7} {:>7}  {}\n", "codec", "bytes", "connect.",
               "numbers", "geometry", "fields", "encode", "decode", "round trip");
    for (const int effort : work.as_read ? std::vector<int>{5} : options_.efforts) {
      for (const Order order : {Order::keep, Order::canonical}) {
        if (is_chosen("maille")) add(run_maille(work.mesh, effort, order), work);
      }
    }
    for (const auto& peer : peers_) {
      if ((!work.as_read || peer->name() == "xz -9") && is_chosen(peer->name()))
        add(run_peer(*peer, work.mesh), work);
    }
  }

  const Options& options_;
  ArrayCodecs peers_;
  std::ofstream json_;
  bool all_ok_ = true;
};

}  // namespace
}  // namespace maille::bench

int main(int argc, char** argv) {
  maille::bench::Options options;
  CLI::App app(
      "Measures maille on volume meshes beside what packs their arrays. Exit code 1 when a round trip "
      "failed.");
  app.add_option("paths", options.paths, "meshes, or folders of them");
  app.add_option("--codec", options.codecs, "only codecs with this in their name")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_option("--efforts", options.efforts, "effort levels of maille")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_option("--json", options.json_path, "write one line of JSON per row to this file");
  app.add_option("--rounds", options.rounds,
                 "of the whole coder with one and two threads, on an idle machine; 0: not at all");
  app.add_flag("--no-pipe", options.no_pipe, "without the generated pipe of a million cells");
  app.add_flag("--as-read", options.as_read, "only the round trip of files as they are");
  CLI11_PARSE(app, argc, argv);
  return maille::bench::Bench(options).run() ? 0 : 1;
}
