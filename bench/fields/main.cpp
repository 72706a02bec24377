// Fields of volume meshes within bounds of 1e-2 to 1e-6 of their range: maille beside other codecs, all
// decoded and held against the bound. The tables are those of docs/fields.md.
#include <fmt/format.h>
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/io.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "rivals.h"

namespace maille::bench {
namespace {

namespace fs = std::filesystem;

constexpr double parts[] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6};
constexpr uint64_t fewest = 1000;  // values: below, heads and models are what is measured

struct Result {
  std::string field;
  double part = 0;
  uint64_t numbers = 0;
  std::vector<double> bits;  ///< a value: maille, then the rivals
  double worst = 0;          ///< largest error of maille over the bound
};

template <class Function>
auto with_numbers(const Array& array, Function with) {
  return array.type == Scalar::f32 ? with(array.values<float>()) : with(array.values<double>());
}

Rows rows_of(const Array& array) {
  Rows field;
  field.wide = array.type == Scalar::f64;
  field.rows.resize(array.components);
  with_numbers(array, [&](auto numbers) {
    for (size_t i = 0; i < numbers.size(); ++i)
      field.rows[i % array.components].push_back(static_cast<double>(numbers[i]));
  });
  return field;
}

/// The widest of all components; 0 where not all are numbers.
double range_of(const Rows& field) {
  double range = 0;
  for (const auto& row : field.rows) {
    const auto [low, high] = std::minmax_element(row.begin(), row.end());
    for (const double value : row) {
      if (!std::isfinite(value)) return 0;
    }
    range = std::max(range, *high - *low);
  }
  return range;
}

double largest_difference(const Rows& a, const Rows& b) {
  double largest = 0;
  for (size_t k = 0; k < a.rows.size(); ++k) {
    for (size_t i = 0; i < a.rows[k].size(); ++i)
      largest = std::max(largest, std::fabs(a.rows[k][i] - b.rows[k][i]));
  }
  return largest;
}

bool measure_mesh(const std::string& name, Mesh mesh, int effort, std::vector<Result>& results) {
  std::erase_if(mesh.arrays, [](const Array& array) {
    return !is_float(array.type) || array.domain == Domain::mesh ||
           array.count() * array.components < fewest || range_of(rows_of(array)) == 0;
  });
  bool good = true;
  for (const double part : parts) {
    EncodeOptions options;
    options.mode = Mode::stream;
    options.order = Order::keep;
    options.effort = effort;
    for (const Array& array : mesh.arrays) options.arrays[array.name] = {Tolerance::Kind::relative, part};
    std::vector<std::byte> bytes;
    const auto report = encode(mesh, *memory_sink(bytes), options);
    const auto back = report ? decode(*memory_source(bytes)) : tl::unexpected(report.error());
    if (!back) {
      fmt::print(stderr, "{}: {}\n", name, back.error().message);
      return false;
    }
    for (size_t i = 0; i < mesh.arrays.size(); ++i) {
      const Rows field = rows_of(mesh.arrays[i]);
      const double bound = part * range_of(field);
      const auto numbers = static_cast<double>(mesh.arrays[i].count() * mesh.arrays[i].components);
      const auto bits = [&](uint64_t size) { return 8 * static_cast<double>(size) / numbers; };
      Result result{name + " " + mesh.arrays[i].name, part, static_cast<uint64_t>(numbers), {}, 0};
      result.bits.push_back(bits(report->arrays[i].coded_bytes));
      const double error = largest_difference(field, rows_of(back->arrays[i]));
      result.worst = error / bound;
      good = good && error <= bound && error == report->arrays[i].maximum_error;
      for (const Rival& rival : rivals()) result.bits.push_back(bits(rival.pack(field, bound).bytes));
      results.push_back(std::move(result));
    }
  }
  return good;
}

double best_rival(const Result& result) {
  return *std::min_element(result.bits.begin() + 1, result.bits.end());
}

void print_tables(const std::vector<Result>& results) {
  std::string head = "| bound / range | maille |", line = "|---|--:|";
  for (const Rival& rival : rivals()) head += " " + rival.name + " |", line += "--:|";
  fmt::print(
      "{} maille / best of them | worst field | a rival is smaller | largest error / bound |\n"
      "{}--:|---|--:|--:|\n",
      head, line);
  for (const double part : parts) {
    std::vector<double> sums(rivals().size() + 1);
    double ratio = 0, worst_ratio = 0, worst_error = 0;
    size_t count = 0, lost = 0;
    std::string worst;
    for (const Result& result : results) {
      if (result.part != part) continue;
      ++count;
      for (size_t k = 0; k < sums.size(); ++k) sums[k] += std::log(std::max(result.bits[k], 1e-6));
      const double to_best = result.bits[0] / best_rival(result);
      ratio += std::log(std::max(to_best, 1e-6));
      lost += to_best > 1;
      worst_error = std::max(worst_error, result.worst);
      if (to_best > worst_ratio) worst_ratio = to_best, worst = result.field;
    }
    if (count == 0) continue;
    const auto n = static_cast<double>(count);
    std::string row = fmt::format("| {:.0e} |", part);
    for (const double sum : sums) row += fmt::format(" {:.2f} |", std::exp(sum / n));
    fmt::print("{} {:.2f} | {} ({:.2f}) | {} of {} | {:.4f} |\n", row, std::exp(ratio / n), worst,
               worst_ratio, lost, count, worst_error);
  }
}

void print_fields(const std::vector<Result>& results) {
  for (const Result& result : results) {
    fmt::print("{} | {} | {:.0e}", result.field, result.numbers, result.part);
    for (const double bits : result.bits) fmt::print(" | {:.3f}", bits);
    fmt::print(" | {:.4f}\n", result.worst);
  }
}

int run(std::vector<std::string> arguments) {
  bool all = false;
  int effort = EncodeOptions{}.effort;
  std::vector<std::string> files;
  for (const std::string& argument : arguments) {
    if (argument == "--fields") {
      all = true;
    } else if (argument.size() == 2 && argument[0] == '-') {
      effort = argument[1] - '0';
    } else if (fs::is_directory(argument)) {
      for (const auto& entry : fs::directory_iterator(argument)) files.push_back(entry.path().string());
    } else {
      files.push_back(argument);
    }
  }
  std::sort(files.begin(), files.end());
  std::vector<Result> results;
  bool good = true;
  for (const std::string& file : files) {
    auto read = read_mesh(file);
    if (!read) continue;  // such as notes beside meshes
    good = measure_mesh(fs::path(file).filename().string(), std::move(read->mesh), effort, results) && good;
  }
  if (all) print_fields(results);
  print_tables(results);
  if (!good) fmt::print(stderr, "a bound was not kept, or another error was told\n");
  return good ? 0 : 1;
}

}  // namespace
}  // namespace maille::bench

int main(int count, char** arguments) {
  return maille::bench::run({arguments + 1, arguments + count});
}
