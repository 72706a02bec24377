#include "doubles.h"

#include <fmt/format.h>
#include <maille/compare.h>
#include <maille/decode.h>
#include <maille/encode.h>
#include <maille/io.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include "peers/packers.h"

namespace maille::bench {
namespace {

/// Changes the positions, all numbers of them at once.
struct Variant {
  std::string name;
  std::function<void(std::span<double>)> change;
};

std::function<void(std::span<double>)> printed(const char* format) {
  return [format](std::span<double> numbers) {
    char text[64];
    for (double& number : numbers) {
      std::snprintf(text, sizeof text, format, number);
      number = std::strtod(text, nullptr);
    }
  };
}

void turn(std::span<double> numbers) {
  const double c = std::cos(0.7), s = std::sin(0.7), d = std::cos(0.4), t = std::sin(0.4);
  for (size_t i = 0; i + 2 < numbers.size(); i += 3) {
    const double x = numbers[i] * c - numbers[i + 1] * s;
    const double y = numbers[i] * s + numbers[i + 1] * c;
    const double z = numbers[i + 2];
    numbers[i] = x;
    numbers[i + 1] = y * d - z * t;
    numbers[i + 2] = y * t + z * d;
  }
}

void move_far(std::span<double> numbers) {
  const double offset[3] = {448262.0, 5411932.0, 130.5};
  for (size_t i = 0; i < numbers.size(); ++i) numbers[i] += offset[i % 3];
}

std::vector<Variant> all_variants() {
  return {{"as it is", [](std::span<double>) {}},
          {"times 0.001",
           [](std::span<double> numbers) {
             for (double& number : numbers) number *= 0.001;
           }},
          {"in inches",
           [](std::span<double> numbers) {
             for (double& number : numbers) number /= 25.4;
           }},
          {"turned", turn},
          {"%.6g", printed("%.6g")},
          {"%.9g", printed("%.9g")},
          {"%.17g", printed("%.17g")},
          {"far off", move_far}};
}

Result<uint64_t> xz_size(Bytes bytes) {
  for (const Packer& packer : packers()) {
    if (packer.name == "xz -9") return packer.packed_size(bytes);
  }
  return failure(ErrorCode::unsupported, "liblzma is missing");
}

/// The positions as doubles.
Array doubles_of(const Array& points) {
  Array array = make_array(points.name, Domain::point, Scalar::f64, 3);
  array.resize(points.count());
  const auto numbers = array.values<double>();
  if (points.type == Scalar::f64) {
    std::copy_n(points.values<double>().begin(), numbers.size(), numbers.begin());
  } else {
    std::copy_n(points.values<float>().begin(), numbers.size(), numbers.begin());
  }
  return array;
}

class Measure {
 public:
  explicit Measure(const std::vector<int>& efforts) : efforts_(efforts) {}

  void row(const std::string& name, const std::string& variant, const Mesh& mesh) {
    const auto xz = xz_size(mesh.points.bytes);
    if (!xz) return fail(name, xz.error().message);
    fmt::print("{:<26} {:<12} {:>11} {:>11}", name, variant, mesh.points.bytes.size(), *xz);
    for (const int effort : efforts_) {
      const auto size = coded_size(mesh, effort);
      if (!size) return fail(name, size.error().message);
      const double ratio = static_cast<double>(*size) / static_cast<double>(*xz);
      fmt::print(" {:>10} {:.3f}", *size, ratio);
      ratios_[variant][effort].push_back(ratio);
    }
    fmt::print("\n");
    std::fflush(stdout);
  }
  void means() const {
    for (const auto& [variant, by_effort] : ratios_) {
      fmt::print("{:<26} {:<12} {:>11} {:>11}", "geometric mean", variant, "", "");
      for (const auto& [effort, ratios] : by_effort) {
        double sum = 0;
        for (const double ratio : ratios) sum += std::log(ratio);
        fmt::print(" {:>10} {:.3f}", "", std::exp(sum / static_cast<double>(ratios.size())));
      }
      fmt::print("\n");
    }
  }
  bool ok() const { return ok_; }

 private:
  void fail(const std::string& name, const std::string& message) {
    fmt::print("{}: {}\n", name, message);
    ok_ = false;
  }
  static Result<uint64_t> coded_size(const Mesh& mesh, int effort) {
    EncodeOptions options;
    options.effort = effort;
    std::vector<std::byte> file;
    const auto report = maille::encode(mesh, *memory_sink(file), options);
    if (!report) return tl::unexpected(report.error());
    const auto decoded = maille::decode(*memory_source(file));
    if (!decoded) return tl::unexpected(decoded.error());
    const Comparison same = compare(mesh, *decoded);
    if (!same.equal) return failure(ErrorCode::corrupt, "came back changed: " + same.differences.front());
    return report->positions.coded_bytes;
  }

  const std::vector<int>& efforts_;
  std::map<std::string, std::map<int, std::vector<double>>> ratios_;
  bool ok_ = true;
};

}  // namespace

bool measure_doubles(const std::vector<std::string>& paths, const std::vector<int>& efforts, bool variants) {
  fmt::print("positions without loss, relative to xz -9 of the raw doubles\n");
  fmt::print("{:<26} {:<12} {:>11} {:>11}", "mesh", "", "raw", "xz -9");
  for (const int effort : efforts) fmt::print(" {:>16}", fmt::format("maille -{}", effort));
  fmt::print("\n");
  Measure measure(efforts);
  for (const std::string& path : paths) {
    auto read = read_mesh(path);
    if (!read || !is_float(read->mesh.points.type) || read->mesh.points.components != 3) continue;
    if (!variants && read->mesh.points.type != Scalar::f64) continue;
    Mesh mesh;
    mesh.blocks = read->mesh.blocks;
    const Array points = doubles_of(read->mesh.points);
    for (const Variant& variant : all_variants()) {
      mesh.points = points;
      variant.change(mesh.points.values<double>());
      measure.row(std::filesystem::path(path).stem().string(), variant.name, mesh);
      if (!variants) break;
    }
  }
  measure.means();
  return measure.ok();
}

}  // namespace maille::bench
