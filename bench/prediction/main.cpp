// Predictors beside one another: of a vertex from its ring and the tips across it, and of the last vertex of
// a fan: docs/prediction.md.
#include <fmt/format.h>
#include <maille/io.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "fans.h"
#include "polygons.h"
#include "rate.h"
#include "stars.h"
#include "stencil_tables.h"

namespace maille::bench {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Options {
  std::vector<std::string> paths;
  std::vector<unsigned> bits = {12, 14};
  bool apart = false;
  bool fans = false;
  bool polygons = false;
  bool covariance = false;
  bool json = false;
  bool histograms = false;
};

struct Rate {
  std::string predictor;
  double bits;  ///< per vertex
  std::vector<Point> residuals;
  size_t table = 0;  ///< which of several was best
};

std::vector<std::string> files_of(const std::vector<std::string>& paths) {
  std::vector<std::string> files;
  for (const std::string& path : paths) {
    if (!fs::is_directory(path)) files.push_back(path);
    if (!fs::is_directory(path)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(path)) {
      if (entry.is_regular_file() && format_of(entry.path().string())) files.push_back(entry.path().string());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

template <class Sample, class Predictor>
Rate rate_of(const std::vector<Sample>& samples, const Predictor& predictor) {
  auto found = residuals(samples, predictor);
  const double bits = bits_per_vertex(found);
  return {predictor.name, bits, std::move(found)};
}

/// Rates of the fixed predictors, the fitted one (whose parameters are not counted), and the best of the
/// codecs' tables, whose number takes a byte.
template <class Sample, class Predictor>
std::vector<Rate> measure(const std::vector<Sample>& samples, std::vector<Predictor> predictors,
                          const Predictor& fitted, const std::vector<Predictor>& tables) {
  std::vector<Rate> rates;
  predictors.push_back(fitted);
  for (const Predictor& predictor : predictors) rates.push_back(rate_of(samples, predictor));
  Rate best = rate_of(samples, tables[0]);
  for (size_t i = 1; i < tables.size(); ++i) {
    Rate rate = rate_of(samples, tables[i]);
    rate.table = i;
    if (rate.bits < best.bits) best = std::move(rate);
  }
  best.bits += 8.0 / static_cast<double>(samples.size());
  rates.push_back(std::move(best));
  return rates;
}

double mean_size(const std::vector<Point>& residuals) {
  double sum = 0;
  for (const Point& r : residuals) sum += std::abs(r[0]) + std::abs(r[1]) + std::abs(r[2]);
  return sum / (3.0 * static_cast<double>(residuals.size()));
}

/// How many coordinates have residuals -32 to 32.
std::vector<uint64_t> histogram(const std::vector<Point>& residuals) {
  std::vector<uint64_t> counts(65);
  for (const Point& r : residuals) {
    for (const int32_t x : r) {
      if (std::abs(x) <= 32) ++counts[static_cast<size_t>(x + 32)];
    }
  }
  return counts;
}

class Report {
 public:
  explicit Report(const Options& options) : options_(options) {}

  void add(const Triangles& mesh, unsigned bits, size_t stars, const std::vector<Rate>& rates) {
    if (options_.json) {
      for (const Rate& rate : rates) fmt::print("{}\n", row(mesh, bits, stars, rate).dump());
      return;
    }
    if (names_.empty()) print_header(rates);
    std::string line = fmt::format("| {} | {} | {} |", mesh.name, stars, bits);
    for (const Rate& rate : rates) line += fmt::format(" {:.2f} |", rate.bits);
    fmt::print("{}\n", line);
    std::fflush(stdout);
    std::vector<double>& gains = gains_[bits];
    gains.resize(rates.size());
    for (size_t i = 0; i < rates.size(); ++i) gains[i] += 1 - rates[i].bits / rates[0].bits;
    ++meshes_[bits];
  }

  void print_means() const {
    for (const auto& [bits, gains] : gains_) {
      std::string line =
          fmt::format("| smaller than {}, mean of {} meshes | | {} |", names_[0], meshes_.at(bits), bits);
      for (const double gain : gains) line += fmt::format(" {:.1f} % |", 100 * gain / meshes_.at(bits));
      fmt::print("{}\n", line);
    }
  }

 private:
  void print_header(const std::vector<Rate>& rates) {
    std::string line = "| mesh | vertices | bits |", rule = "| --- | --: | --: |";
    for (const Rate& rate : rates) {
      names_.push_back(rate.predictor);
      line += fmt::format(" {} |", rate.predictor);
      rule += " --: |";
    }
    fmt::print("{}\n{}\n", line, rule);
  }
  Json row(const Triangles& mesh, unsigned bits, size_t stars, const Rate& rate) const {
    Json json = {{"mesh", mesh.name},
                 {"bits", bits},
                 {"vertices", stars},
                 {"predictor", rate.predictor},
                 {"bits_per_vertex", rate.bits},
                 {"mean_residual", mean_size(rate.residuals)},
                 {"table", rate.table}};
    if (options_.histograms) json["histogram"] = histogram(rate.residuals);
    return json;
  }

  const Options& options_;
  std::vector<std::string> names_;
  std::map<unsigned, std::vector<double>> gains_;
  std::map<unsigned, int> meshes_;
};

/// Fewer vertices say more about the start of the models than about predictions.
constexpr size_t fewest = 100;

void skip(const Triangles& mesh, size_t found) {
  fmt::print(stderr, "{}: skipped: has only {} such vertices\n", mesh.name, found);
}

void run_stars(const Triangles& mesh, const Options& options, Report& report) {
  const std::vector<Star> stars = find_stars(mesh, options.apart);
  if (stars.size() < fewest) return skip(mesh, stars.size());
  for (const unsigned bits : options.bits) {
    const auto samples = sample(stars, mesh.on_lattice(bits));
    report.add(
        mesh, bits, stars.size(),
        measure(samples, fixed_star_predictors(), fitted_star_predictor(samples), table_star_predictors()));
  }
}

void run_fans(const Triangles& mesh, const Options& options, Report& report) {
  for (const unsigned bits : options.bits) {
    size_t reached = 0;
    const auto samples = find_fans(mesh, mesh.on_lattice(bits), reached);
    if (samples.size() < fewest) return skip(mesh, samples.size());
    report.add(
        mesh, bits, samples.size(),
        measure(samples, fixed_fan_predictors(), fitted_fan_predictor(samples), table_fan_predictors()));
  }
}

void run_polygons(const Triangles& mesh, const Options& options, Report& report) {
  for (const unsigned bits : options.bits) {
    const auto samples = find_corners(mesh.polygons, mesh.on_lattice(bits));
    if (samples.size() < fewest) return skip(mesh, samples.size());
    std::vector<Rate> rates;
    const auto add = [&](const char* name, std::vector<Point> found) {
      const double rate = bits_per_vertex(found);
      rates.push_back({name, rate, std::move(found)});
    };
    add("parallelograms", residuals(samples, CornerRule::parallelogram, 0));
    add("Taylor, the face alone", residuals(samples, CornerRule::alone, 0));
    add("Taylor with the face beside", residuals(samples, CornerRule::beside, 0));
    add("least squares", fitted_residuals(samples));
    Rate best{"Taylor, noise", 1e9, {}};
    for (unsigned level = 0; level < tables::noise_levels; ++level) {
      auto found = residuals(samples, CornerRule::beside, level);
      const double rate = bits_per_vertex(found) + 8.0 / static_cast<double>(samples.size());
      if (rate < best.bits) best = {best.predictor, rate, std::move(found), level};
    }
    rates.push_back(std::move(best));
    report.add(mesh, bits, samples.size(), rates);
  }
}

void print_covariance(const Triangles& mesh, const Options& options) {
  const SecondDerivatives found = second_derivatives(find_stars(mesh, options.apart), mesh.positions);
  if (found.stars < fewest) return skip(mesh, found.stars);
  const double ratio = found.laplacian / found.saddle;
  if (options.json) {
    fmt::print("{}\n", Json{{"mesh", mesh.name}, {"vertices", found.stars}, {"ratio", ratio}}.dump());
  } else {
    fmt::print("{}: {} rings of six, var(f_uu + f_vv) / var(f_uv) = {:.2f}\n", mesh.name, found.stars, ratio);
  }
}

void run(const Options& options) {
  Report report(options);
  for (const std::string& path : files_of(options.paths)) {
    const auto mesh = load_triangles(path);
    if (!mesh) {
      fmt::print(stderr, "{}: skipped: {}\n", path, mesh.error().message);
    } else if (options.covariance) {
      print_covariance(*mesh, options);
    } else if (options.polygons) {
      run_polygons(*mesh, options, report);
    } else if (options.fans) {
      run_fans(*mesh, options, report);
    } else {
      run_stars(*mesh, options, report);
    }
  }
  report.print_means();
}

}  // namespace
}  // namespace maille::bench

int main(int argc, char** argv) {
  maille::bench::Options options;
  CLI::App app{
      "Predictors of vertices beside one another, in bits per vertex of the codec's own coder of residuals."};
  app.add_option("PATH", options.paths, "Triangle meshes, or folders of them")->required();
  app.add_option("--bits", options.bits, "Lattices: 2^N values along the longest side");
  app.add_flag("--apart", options.apart, "Only vertices that could be decoded together from all others");
  app.add_flag("--fans", options.fans,
               "Last vertices of fans, as a region-growing coder meets them, instead of K-stars");
  app.add_flag("--polygons", options.polygons, "Corners of faces beside known faces, degrees 3 to 6");
  app.add_flag("--covariance", options.covariance,
               "Variances of second derivatives, as rings of six show them");
  app.add_flag("--json", options.json, "One JSON object per mesh, lattice and predictor");
  app.add_flag("--histograms", options.histograms, "With --json: counts of residuals -32 to 32");
  CLI11_PARSE(app, argc, argv);
  maille::bench::run(options);
  return 0;
}
