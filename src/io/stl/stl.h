#pragma once

#include <maille/io.h>
#include <array>
#include <cmath>

// What reader and writer of STL share. STL has no vertices, only the three positions of each facet: equal
// ones (bit for bit, so -0 and 0 differ) become one point, in the order of their first use.
//
// normals          left out when all facets have the one facet_normal() gives; when all are zero metadata
// "stl.normals"
//                  says "zero"; otherwise "normal" on cells
// attribute bytes  "attribute" on cells, u16, when one is not zero (binary)
// header           metadata "stl.header", as a word (binary)
// solid            the name: metadata "stl.solid"; of several solids: labels "solid" on cells (text)

namespace maille {

/// The unit normal of a facet as the writer computes it: in double from the positions, then rounded; zero
/// when the facet has no area.
template <class T>
std::array<T, 3> facet_normal(const std::array<std::array<T, 3>, 3>& corners) {
  double u[3];
  double v[3];
  for (size_t i = 0; i < 3; ++i) {
    u[i] = static_cast<double>(corners[1][i]) - static_cast<double>(corners[0][i]);
    v[i] = static_cast<double>(corners[2][i]) - static_cast<double>(corners[0][i]);
  }
  const double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  if (!(length > 0) || std::isinf(length)) return {};
  return {static_cast<T>(n[0] / length), static_cast<T>(n[1] / length), static_cast<T>(n[2] / length)};
}

/// Bytes of a binary file before its facets, and per facet.
inline constexpr size_t stl_header_size = 84;
inline constexpr size_t stl_facet_size = 50;

/// Format::read and Format::write of STL.
Result<ReadResult> read_stl(const Source& source, const ReadOptions& options);
Result<std::vector<std::string>> write_stl(const Mesh& mesh, Sink& sink, const WriteOptions& options);

}  // namespace maille
