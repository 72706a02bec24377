// maille beside its peers: the same integers in, the same check of what comes out, one process, one thread.
// Rows go to stdout for people and, with --json, to a file for report.py and plot.py.
#include <fmt/format.h>
#include <maille/io.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <fstream>
#include <nlohmann/json.hpp>
#include "doubles.h"
#include "files.h"
#include "goals.h"
#include "paths.h"
#include "peers/peers.h"
#include "print.h"

namespace maille::bench {
namespace {

// Efforts whose files differ; grows with the codec.
const std::vector<int> default_efforts = {2, 5, 9};
const std::vector<int> all_levels = {1, 2, 3, 4, 5, 6, 7, 8, 9};
constexpr size_t quick_faces = 100'000;

struct Options {
  std::vector<std::string> paths;
  std::vector<std::string> flipped;
  std::vector<std::string> precisions = {"12", "14", "lossless"};
  std::vector<std::string> codecs;
  std::vector<int> efforts = default_efforts;
  std::string json;
  bool quick = false;
  bool no_peaks = false;
  bool doubles = false;
  bool variants = false;
  bool as_files = false;
  bool inversions = false;
  bool goals = false;
  std::vector<std::string> settings;
};

std::vector<std::unique_ptr<Codec>> chosen_codecs(const Options& options) {
  std::vector<std::unique_ptr<Codec>> all;
  for (const int effort : options.efforts) all.push_back(maille_codec(effort));
  for (Peer& peer : peers()) {
    const bool slow = peer.name == "openctm" || peer.name == "xz -9";
    if (!options.quick || !slow) all.push_back(std::move(peer.codec));
  }
  if (options.codecs.empty()) return all;
  std::erase_if(all, [&](const auto& codec) {
    return std::none_of(options.codecs.begin(), options.codecs.end(), [&](const std::string& part) {
      return codec->name().find(part) != std::string::npos;
    });
  });
  return all;
}

struct Input {
  std::string path;
  bool flip = false;
};

std::vector<Input> inputs(const Options& options) {
  std::vector<Input> found;
  for (const std::string& path : meshes_in(options.paths)) found.push_back({path});
  for (const std::string& path : options.flipped) found.push_back({path, true});
  return found;
}

class Bench {
 public:
  explicit Bench(const Options& options) : options_(options), codecs_(chosen_codecs(options)) {
    if (!options.json.empty()) json_.open(options.json);
  }

  bool run() {
    for (const Input& input : inputs(options_)) run_input(input);
    return all_ok_;
  }

 private:
  void run_input(const Input& input) {
    auto surface = load(input.path);
    if (!surface) {
      fmt::print("\n{}: skipped: {}\n", input.path, surface.error().message);
      return;
    }
    if (options_.quick && surface->faces() > quick_faces) return;
    if (input.flip) surface = flip_every_second(std::move(*surface));
    for (const std::string& precision : options_.precisions) {
      Workload workload = make_workload(*surface, precision == "lossless" ? 0 : std::stoi(precision));
      workload.folder = input.flip ? "special" : folder_of(input.path);
      workload.mesh = mesh_name(input.path) + (input.flip ? ", every second face flipped" : "");
      run_workload(workload);
    }
  }

  void run_workload(const Workload& workload) {
    std::vector<Row> rows;
    const Peaks peaks = options_.no_peaks ? Peaks::unknown : Peaks::measured;
    for (const auto& codec : codecs_) {
      if (codec->takes(workload.bits)) rows.push_back(first_run(*codec, workload, peaks));
    }
    const Runs runs = options_.quick ? Runs{2, 4, 0.5} : Runs{};
    for (size_t round = 1; round < runs.decode; ++round) time_round(rows, workload, runs);
    print_rows(rows, workload);
    for (const Row& row : rows) {
      if (json_.is_open()) json_ << to_json(row, workload).dump() << std::endl;
      const bool ours = !row.codec->needs_triangles();
      all_ok_ = all_ok_ && (!ours || (row.problem.empty() && row.check.verdict == "exact"));
    }
  }

  const Options& options_;
  std::vector<std::unique_ptr<Codec>> codecs_;
  std::ofstream json_;
  bool all_ok_ = true;
};

}  // namespace
}  // namespace maille::bench

int main(int argc, char** argv) {
  maille::bench::Options options;
  CLI::App app(
      "Measures maille beside its peers on the same integers. Exit code 1 when a round trip of maille "
      "failed.");
  app.add_option("paths", options.paths, "meshes, or folders of them");
  app.add_option("--flip", options.flipped, "meshes to measure with every second face turned around")
      ->allow_extra_args(false);
  app.add_option("--bits", options.precisions, "lattices, e.g. 12,14,lossless")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_option("--codec", options.codecs, "only codecs with this in their name")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_option("--efforts", options.efforts, "effort levels of maille")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_option("--json", options.json, "write one line of JSON per row to this file");
  app.add_flag("--quick", options.quick, "meshes up to 100,000 faces, few runs, without OpenCTM and xz");
  app.add_flag("--doubles", options.doubles,
               "only positions in doubles, without loss, against xz -9 of the raw numbers");
  app.add_flag("--variants", options.variants,
               "with --doubles: also the positions in other units, turned, printed and far off");
  app.add_flag("--no-peaks", options.no_peaks, "nothing in processes of their own: faster, but no memory");
  app.add_flag("--as-files", options.as_files,
               "sizes of the files as they are, with all arrays, at all levels; then inversions");
  app.add_flag("--inversions", options.inversions,
               "only levels whose file is more than 0.1 % larger than that of a lower level");
  app.add_option("--settings", options.settings,
                 "for these two: \"order kept\", \"lossless\" or bits of positions (default: these, 14, 12)")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_flag("--goals", options.goals, "figures beside those of codecs, for scripts/bench goals");
  CLI11_PARSE(app, argc, argv);
  const uint64_t most = options.quick ? maille::bench::quick_faces : 0;
  if (options.as_files || options.inversions) {
    const auto& levels = app.count("--efforts") > 0 ? options.efforts : maille::bench::all_levels;
    const bool good = maille::bench::measure_files(
        {options.paths, levels, options.settings, options.json, most, !options.as_files});
    return good ? 0 : 1;
  }
  if (options.goals) return maille::bench::measure_goals({options.paths, options.json, most}) ? 0 : 1;
  if (options.doubles) {
    const auto paths = maille::bench::meshes_in(options.paths);
    return maille::bench::measure_doubles(paths, options.efforts, options.variants) ? 0 : 1;
  }
  const auto bad =
      std::find_if(options.precisions.begin(), options.precisions.end(), [](const std::string& text) {
        return text != "lossless" && (text.empty() || !std::all_of(text.begin(), text.end(), ::isdigit) ||
                                      std::stoi(text) < 1 || std::stoi(text) > maille::bench::max_bits);
      });
  if (bad != options.precisions.end()) {
    fmt::print(stderr, "--bits: {} is neither a number from 1 to {} nor \"lossless\"\n", *bad,
               maille::bench::max_bits);
    return 2;
  }
  return maille::bench::Bench(options).run() ? 0 : 1;
}
