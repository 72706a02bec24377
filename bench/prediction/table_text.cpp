#include "table_text.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "theory/named_stencils.h"
#include "theory/spectral.h"
#include "theory/taylor.h"

namespace maille {

namespace {

constexpr unsigned bits = 14;
constexpr unsigned least_degree = 3;
constexpr unsigned most_degree = 16;
constexpr unsigned most_degree_beside = 6;
// From smooth surfaces to coarse lattices and noisy scans, in factors of four.
constexpr std::array<const char*, 6> noise_levels = {"0", "1.0 / 16", "1.0 / 4", "1", "4", "16"};
constexpr std::array<double, 6> noises = {0, 1.0 / 16, 1.0 / 4, 1, 4, 16};

using Weights = std::vector<double>;
using Row = std::vector<int32_t>;

int32_t rounded(double weight) {
  // Ties must not depend on the last digit of a cosine.
  return static_cast<int32_t>(std::floor(weight * (1 << bits) + 0.5 + 1e-6));
}

/// Constants must come back exactly: the first weight takes what rounding leaves.
Row rounded(const Weights& weights) {
  Row row;
  int32_t rest = 1 << bits;
  for (const double weight : weights) row.push_back(rounded(weight));
  for (const int32_t weight : row) rest -= weight;
  if (!row.empty()) row[0] += rest;
  return row;
}

/// Second derivatives as measured on real meshes are closest to those of a Gaussian field.
Weights weights_at(const Stencil& stencil, double noise) {
  PredictionRule rule;
  rule.covariance = Covariance::gaussian;
  rule.noise = noise;
  if (noise > 0) rule.order = 2;
  return taylor_weights(stencil, rule);
}

std::string braced(const Row& row) {
  std::string text = "{";
  for (size_t i = 0; i < row.size(); ++i) text += (i == 0 ? "" : ", ") + std::to_string(row[i]);
  return text + "}";
}

std::string list(const std::vector<Row>& rows, const std::string& indent) {
  std::string text;
  for (const Row& row : rows) text += indent + braced(row) + ",\n";
  return text;
}

/// One list of rows for each level of noise.
template <class RowsAt>
std::string by_noise(RowsAt rows_at) {
  std::string text;
  for (const double noise : noises) text += "    {\n" + list(rows_at(noise), "        ") + "    },\n";
  return text;
}

std::vector<Row> k_star_rows(double noise) {
  std::vector<Row> rows;
  for (unsigned k = least_degree; k <= most_degree; ++k) {
    Row row;
    for (const Tips tips : {Tips::reflected, Tips::equilateral}) {
      const Weights weights = weights_at(k_star_stencil(k, tip_distance(k, tips)), noise);
      double ring = 0;
      for (unsigned i = 0; i < k; ++i) ring += weights[i];
      row.push_back(rounded(ring));
    }
    rows.push_back(row);
  }
  return rows;
}

std::vector<Row> dual_rows(double noise) {
  std::vector<Row> rows;
  for (unsigned k = least_degree; k <= most_degree; ++k) {
    const Weights weights = weights_at(dual_parallelogram_stencil(k), noise);
    const int32_t near = rounded(weights[1]);
    // With valence 4 there is only one; it stands for both.
    const double far_weight = k == 3 ? 0 : k == 4 ? weights[3] / 2 : weights[3];
    const int32_t far = rounded(far_weight);
    rows.push_back({(1 << bits) - 2 * near - 2 * far, near, far});
  }
  return rows;
}

std::vector<Row> polygon_rows(double noise) {
  std::vector<Row> rows;
  for (unsigned n = least_degree; n <= most_degree; ++n) {
    for (unsigned known = 1; known < n; ++known) {
      rows.push_back(rounded(weights_at(polygon_stencil(n, known), noise)));
    }
  }
  return rows;
}

std::vector<Row> beside_rows(double noise) {
  std::vector<Row> rows;
  for (unsigned m = least_degree; m <= most_degree_beside; ++m) {
    for (unsigned n = least_degree; n <= most_degree_beside; ++n) {
      for (unsigned known = 0; known + 2 < n; ++known) {
        rows.push_back(rounded(weights_at(polygon_beside_stencil(m, n, known), noise)));
      }
    }
  }
  return rows;
}

/// All rows of each level as one list of numbers; a function beside the table finds the place.
template <class RowsAt>
std::string flat_by_noise(RowsAt rows_at) {
  std::string text;
  for (const double noise : noises) {
    text += "    {\n";
    for (const Row& row : rows_at(noise)) {
      std::string line = braced(row);
      text += "        " + line.substr(1, line.size() - 2) + ",\n";
    }
    text += "    },\n";
  }
  return text;
}

size_t size_of(const std::vector<Row>& rows) {
  size_t size = 0;
  for (const Row& row : rows) size += row.size();
  return size;
}

std::vector<Row> cube_rows() {
  std::vector<Row> rows;
  for (unsigned mask = 0; mask < 256; mask += 2) {
    const Row known = rounded(spectral_weights(cube_stencil(mask)));
    Row row;
    size_t next = 0;
    for (unsigned corner = 1; corner < 8; ++corner) {
      row.push_back((mask >> corner & 1) != 0 ? known[next++] : 0);
    }
    rows.push_back(row);
  }
  return rows;
}

std::vector<Row> hexahedron_rows() {
  std::vector<Row> rows;
  for (unsigned known = 0; known < 4; ++known)
    rows.push_back(rounded(weights_at(hexahedron_stencil(known), 0)));
  return rows;
}

std::vector<Row> modified_butterfly_rows() {
  std::vector<Row> rows;
  for (unsigned k = least_degree; k <= most_degree; ++k) {
    PredictionRule rule;
    rule.order = 2;
    rows.push_back(rounded(taylor_weights(modified_butterfly_stencil(k), rule)));
  }
  return rows;
}

std::string noise_text() {
  std::string text;
  for (size_t i = 0; i < noise_levels.size(); ++i)
    text += (i == 0 ? "" : ", ") + std::string(noise_levels[i]);
  return text;
}

constexpr const char* head = R"(#pragma once

// Written by maille_tables (src/predict/tables); a test derives it again. Do not edit.
// clang-format off

#include <cstdint>

/// Weights of predictions in parts of 2^table_bits, derived from the smoothness of surfaces: docs/prediction.md.
/// The weights of a stencil sum to exactly 2^table_bits.
namespace maille::tables {

)";

}  // namespace

std::string stencil_tables_text() {
  const std::string degrees = std::to_string(most_degree - least_degree + 1);
  const std::string levels = std::to_string(noises.size());
  std::string text = head;
  text += "inline constexpr unsigned table_bits = " + std::to_string(bits) + ";\n";
  text += "inline constexpr unsigned least_degree = " + std::to_string(least_degree) + ";\n";
  text += "inline constexpr unsigned most_degree = " + std::to_string(most_degree) + ";\n";
  text += "inline constexpr unsigned noise_levels = " + levels + ";\n";
  text +=
      "/// Variance of the noise of known values, that of a mixed second derivative (times the fourth power "
      "of the\n"
      "/// edge length) being 1.\n";
  text += "inline constexpr double noise_of_level[noise_levels] = {" + noise_text() + "};\n\n";
  text +=
      "/// A vertex from its ring: the share of the mean of the ring; that of the mean of the tips is the "
      "rest.\n"
      "/// By noise, valence - 3, kind of tips (reflected, equilateral).\n";
  text += "inline constexpr int32_t k_star[noise_levels][" + degrees + "][2] = {\n" + by_noise(k_star_rows) +
          "};\n\n";
  text +=
      "/// A vertex of a fan from its centre, each of its two neighbours, each of the two next to them.\n"
      "/// By noise, valence - 3. Valence 4: the two farther ones are the same vertex. Valence 3: there are "
      "none.\n";
  text += "inline constexpr int32_t dual_parallelogram[noise_levels][" + degrees + "][3] = {\n" +
          by_noise(dual_rows) + "};\n\n";
  text += "/// A corner of a polygon from those before it: see polygon_weights().\n";
  text += "inline constexpr int32_t polygon[noise_levels][" + std::to_string(size_of(polygon_rows(0))) +
          "] = {\n" + flat_by_noise(polygon_rows) + "};\n";
  text += R"(/// Weights of `known` corners (1 to degree - 1) of a polygon (3 to 16) for the next one.
inline constexpr const int32_t* polygon_weights(unsigned noise, unsigned degree, unsigned known) {
  const unsigned smaller = degree * (degree - 1) * (degree - 2) / 6 - 1;
  return polygon[noise] + smaller + known * (known - 1) / 2;
}

)";
  text += "/// A corner of a polygon beside a known one: see polygon_beside_weights().\n";
  text += "inline constexpr unsigned most_degree_beside = " + std::to_string(most_degree_beside) + ";\n";
  text += "inline constexpr int32_t polygon_beside[noise_levels][" + std::to_string(size_of(beside_rows(0))) +
          "] = {\n" + flat_by_noise(beside_rows) + "};\n";
  text +=
      R"(/// Weights of the corners of a known polygon, beginning with the edge in common, then of `known` new corners (0 to
/// degree - 3), for the next new one, counted from the known polygon's first corner. Degrees 3 to most_degree_beside.
inline constexpr const int32_t* polygon_beside_weights(unsigned noise, unsigned known_degree, unsigned degree,
                                                       unsigned known) {
  const int32_t* place = polygon_beside[noise];
  for (unsigned m = least_degree; m <= known_degree; ++m) {
    for (unsigned n = least_degree; n <= (m < known_degree ? most_degree_beside : degree); ++n) {
      const bool there = m == known_degree && n == degree;
      for (unsigned k = 0; k < (there ? known : n - 2); ++k) place += m + k;
    }
  }
  return place;
}

)";
  text += "/// Corner 0 of a cube from corners 1 to 7, by which of them are known: bit i - 1 for corner i.\n";
  text += "inline constexpr int32_t cube[128][7] = {\n" + list(cube_rows(), "    ") + "};\n\n";
  text +=
      "/// A corner of a hexahedron on a known one, by the number of new corners known, in the order 001 101 "
      "111 011:\n"
      "/// from four corners of the far face (00 10 11 01), four of the face in common, and the new ones.\n";
  text += "inline constexpr int32_t hexahedron[4][11] = {\n" + list(hexahedron_rows(), "    ") + "};\n\n";
  text +=
      "/// The middle of an edge from 8 vertices: its ends, the tips of its two triangles, the four beside "
      "those.\n";
  text += "inline constexpr int32_t butterfly[8] = " + braced(rounded(weights_at(butterfly_stencil(8), 0))) +
          ";\n";
  text +=
      "/// The middle of an edge from one end and its ring, beginning with the other end. By valence - 3.\n";
  text += "inline constexpr int32_t modified_butterfly[" + degrees + "][" + std::to_string(most_degree + 1) +
          "] = {\n" + list(modified_butterfly_rows(), "    ") + "};\n\n";
  return text + "}  // namespace maille::tables\n";
}

}  // namespace maille
