#include "generate/transfinite_grading.h"

#include <cmath>
#include <numeric>

namespace maille {

std::vector<uint32_t> section_cells(const Grading& grading, uint32_t cells) {
  if (grading.size() > cells) return {};
  double sum = 0;
  for (const GradingSection& section : grading) sum += section.cells;
  std::vector<int64_t> counts;
  size_t largest = 0;
  for (size_t i = 0; i < grading.size(); ++i) {
    counts.push_back(static_cast<int64_t>(grading[i].cells / sum * cells + 0.5));
    if (grading[i].cells > grading[largest].cells) largest = i;
  }
  // What rounding added or took is settled with the section of the largest share.
  counts[largest] += cells - std::accumulate(counts.begin(), counts.end(), int64_t{0});
  if (counts[largest] < 0) return {};
  return {counts.begin(), counts.end()};
}

namespace {

// Appends a geometric progression of sizes; the last over the first is `expansion`. With ratio q the point i
// of n is at (1 - q^i) / (1 - q^n).
void append_section(double length, double expansion, uint32_t cells, std::vector<double>& parameters) {
  const double start = parameters.back();
  const double ratio = cells > 1 ? std::pow(expansion, 1.0 / (cells - 1)) : 1;
  // Near 1 the quotient would be of rounding errors only.
  const bool uniform = std::fabs(ratio - 1) < 1e-14;
  const double whole = uniform ? cells : 1 - std::pow(ratio, cells);
  for (uint32_t i = 1; i <= cells; ++i) {
    const double part = uniform ? i : 1 - std::pow(ratio, i);
    parameters.push_back(start + length * part / whole);
  }
}

}  // namespace

std::vector<double> edge_parameters(const Grading& grading, uint32_t cells) {
  std::vector<double> parameters{0};
  const std::vector<uint32_t> counts = section_cells(grading, cells);
  if (counts.empty()) {
    append_section(1, 1, cells, parameters);
  } else {
    double sum = 0;
    for (const GradingSection& section : grading) sum += section.length;
    for (size_t i = 0; i < counts.size(); ++i) {
      append_section(grading[i].length / sum, grading[i].expansion, counts[i], parameters);
    }
  }
  // The end of an edge is its vertex, exactly.
  parameters.back() = 1;
  return parameters;
}

}  // namespace maille
