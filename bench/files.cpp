#include "files.h"

#include <fmt/format.h>
#include <maille/compare.h>
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/io.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include "paths.h"
#include "peers/measure.h"

namespace maille::bench {
namespace {

// A level may be this much larger than a lower one: a header that says more.
constexpr double most_growth = 1.001;

// What Draco's users and gltf-transform give the other arrays.
int bits_of(Role role) {
  switch (role) {
    case Role::normal:
      return 10;
    case Role::colour:
      return 8;
    case Role::none:
    case Role::texture_coordinate:
    case Role::tangent:
      return 12;
    case Role::label:
      break;
  }
  return 0;
}

Tolerance bits(int number) {
  return {Tolerance::Kind::bits, static_cast<double>(number)};
}

bool has_solids(const Mesh& mesh) {
  const auto solid = [](uint8_t type) { return dimension_of(static_cast<CellType>(type)) == 3; };
  return std::any_of(mesh.blocks.begin(), mesh.blocks.end(), [&](const CellBlock& block) {
    return dimension_of(block.type) == 3 || std::any_of(block.types.begin(), block.types.end(), solid);
  });
}

EncodeOptions options_of(const Mesh& mesh, const std::string& setting, int level) {
  EncodeOptions options;
  options.effort = level;
  options.mode = has_solids(mesh) ? Mode::stream : Mode::single;
  if (setting == "order kept") options.order = Order::keep;
  if (setting == "order kept" || setting == "lossless") return options;
  options.positions = bits(std::stoi(setting));
  for (const Array& array : mesh.arrays) {
    if (is_float(array.type) && bits_of(array.role) > 0)
      options.arrays[array.name] = bits(bits_of(array.role));
  }
  return options;
}

struct Level {
  uint64_t bytes = 0;
  EncodeReport report;
  double encode_seconds = 0, decode_seconds = 0;
  std::string problem;
};

Level run_level(const Mesh& mesh, const EncodeOptions& options, bool back) {
  Level level;
  std::vector<std::byte> bytes;
  double start = thread_seconds();
  const auto report = encode(mesh, *memory_sink(bytes), options);
  level.encode_seconds = thread_seconds() - start;
  if (!report) return {.report = {}, .problem = report.error().message};
  level.bytes = bytes.size();
  level.report = *report;
  if (!back) return level;
  start = thread_seconds();
  const auto decoded = decode(*memory_source(bytes));
  level.decode_seconds = thread_seconds() - start;
  if (!decoded) level.problem = decoded.error().message;
  const bool lossless = options.positions.kind == Tolerance::Kind::lossless;
  if (!decoded || !lossless) return level;
  const Comparison same = compare(mesh, *decoded, {.same_order = options.order == Order::keep});
  if (!same.equal) level.problem = "came back changed: " + same.differences.front();
  return level;
}

/// A level that is larger than a lower one.
struct Inversion {
  std::string file, setting;
  int lower = 0, higher = 0;
  double growth = 0;
};

class Files {
 public:
  explicit Files(const FilesOptions& options) : options_(options) {
    if (!options.json.empty()) json_.open(options.json);
    settings_ = options.settings;
    if (settings_.empty()) settings_ = {"order kept", "lossless", "14", "12"};
  }

  bool run() {
    if (!options_.only_inversions) print_header();
    for (const std::string& path : meshes_in(options_.paths)) run_file(path);
    if (!options_.only_inversions) print_means();
    print_inversions();
    return ok_ && inversions_.empty();
  }

 private:
  void run_file(const std::string& path) {
    const auto read = read_mesh(path);
    if (!read) {
      fmt::print("{}: skipped: {}\n", path, read.error().message);
      return;
    }
    if (options_.most_cells > 0 && read->mesh.cell_count() > options_.most_cells) return;
    for (const std::string& setting : settings_) run_setting(path, read->mesh, setting);
  }

  void run_setting(const std::string& path, const Mesh& mesh, const std::string& setting) {
    std::map<int, Level> levels;
    for (const int level : options_.levels) {
      Level& row = levels[level] =
          run_level(mesh, options_of(mesh, setting, level), !options_.only_inversions);
      if (!row.problem.empty()) {
        fmt::print("{}, {}, -{}: {}\n", path, setting, level, row.problem);
        ok_ = false;
      }
      if (json_.is_open()) write_json(path, mesh, setting, level, row);
    }
    find_inversions(folder_of(path) + "/" + mesh_name(path), setting, levels);
    if (!options_.only_inversions) print_row(path, mesh, setting, levels);
    ++rows_;
  }

  void write_json(const std::string& path, const Mesh& mesh, const std::string& setting, int level,
                  const Level& row) {
    nlohmann::json json = {{"folder", folder_of(path)},
                           {"mesh", mesh_name(path)},
                           {"setting", setting},
                           {"level", level},
                           {"points", mesh.point_count()},
                           {"cells", mesh.cell_count()},
                           {"position_type", name_of(mesh.points.type)},
                           {"bytes", row.bytes},
                           {"connectivity", row.report.connectivity.coded_bytes},
                           {"positions", row.report.positions.coded_bytes},
                           {"order", row.report.order_bytes},
                           {"encode_seconds", row.encode_seconds},
                           {"decode_seconds", row.decode_seconds},
                           {"problem", row.problem}};
    for (const ArrayReport& array : row.report.arrays) json["arrays"][array.name] = array.coded_bytes;
    json_ << json.dump() << std::endl;
  }

  // For each level the lower one that it is worst beside.
  void find_inversions(const std::string& file, const std::string& setting,
                       const std::map<int, Level>& levels) {
    int smallest = 0;
    for (const auto& [level, row] : levels) {
      if (row.bytes == 0) continue;
      if (smallest > 0) {
        const double growth = static_cast<double>(row.bytes) / static_cast<double>(levels.at(smallest).bytes);
        if (growth > most_growth) inversions_.push_back({file, setting, smallest, level, growth});
      }
      if (smallest == 0 || row.bytes < levels.at(smallest).bytes) smallest = level;
    }
  }

  void print_header() const {
    fmt::print("{:40} {:4} {:10} {:>9}", "file", "type", "setting", "on disk");
    for (const int level : options_.levels) fmt::print(" {:>9}", fmt::format("-{}", level));
    fmt::print("\n");
  }

  void print_row(const std::string& path, const Mesh& mesh, const std::string& setting,
                 const std::map<int, Level>& levels) {
    fmt::print("{:40} {:4} {:10} {:>9}", folder_of(path) + "/" + mesh_name(path), name_of(mesh.points.type),
               setting, std::filesystem::file_size(path));
    for (const auto& [level, row] : levels) {
      fmt::print(" {:>9}", row.bytes);
      if (row.bytes == 0) continue;
      const double per_cell = static_cast<double>(row.bytes) / static_cast<double>(mesh.cell_count());
      logs_[setting][level].push_back(std::log(per_cell));
    }
    fmt::print("\n");
    std::fflush(stdout);
  }

  void print_means() const {
    for (const auto& [setting, by_level] : logs_) {
      fmt::print("{:40} {:4} {:10} {:>9}", "bytes a cell, geometric mean", "", setting, "");
      for (const auto& [level, logs] : by_level) {
        double sum = 0;
        for (const double log : logs) sum += log;
        fmt::print(" {:>9.4f}", std::exp(sum / static_cast<double>(logs.size())));
      }
      fmt::print("\n");
    }
  }

  void print_inversions() {
    std::stable_sort(inversions_.begin(), inversions_.end(),
                     [](const Inversion& a, const Inversion& b) { return a.growth > b.growth; });
    fmt::print("{} inversions above 0.1 %, of {} files and settings\n", inversions_.size(), rows_);
    for (const Inversion& found : inversions_) {
      fmt::print("{:40} {:10} -{} is {:.2f} % larger than -{}\n", found.file, found.setting, found.higher,
                 100 * (found.growth - 1), found.lower);
    }
  }

  const FilesOptions& options_;
  std::vector<std::string> settings_;
  std::ofstream json_;
  std::vector<Inversion> inversions_;
  std::map<std::string, std::map<int, std::vector<double>>> logs_;
  size_t rows_ = 0;
  bool ok_ = true;
};

}  // namespace

bool measure_files(const FilesOptions& options) {
  return Files(options).run();
}

}  // namespace maille::bench
