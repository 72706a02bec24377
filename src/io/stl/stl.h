#pragma once

#include <maille/io.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

// What reader and writer of STL share. STL has no vertices, only the three positions of each facet: equal
// ones (bit for bit, so -0 and 0 differ) become one point, in the order of their first use.
//
// normals          left out when all facets have, bit for bit, the one facet_normal() gives, which is the
//                  same in any order of facets and of their corners; when all are zero metadata "stl.normals"
//                  says "zero"; otherwise "normal" on cells
// attribute bytes  "attribute" on cells, u16, when one is not zero (binary)
// header           metadata "stl.header", as a word (binary)
// solid            the name: metadata "stl.solid"; of several solids: labels "solid" on cells (text)

namespace maille {

/// The unit normal of a facet as the writer computes it: in double from the positions, then rounded; zero
/// when the facet has no area. The bits depend on the corner that edges start from, so it is the one with the
/// least position: a mesh in another order, whose facets begin with other corners, has the same normals.
template <class T>
std::array<T, 3> facet_normal(const std::array<std::array<T, 3>, 3>& corners) {
  const auto least = static_cast<size_t>(std::min_element(corners.begin(), corners.end()) - corners.begin());
  const auto [a, b, c] = std::tie(corners[least], corners[(least + 1) % 3], corners[(least + 2) % 3]);
  double u[3];
  double v[3];
  for (size_t i = 0; i < 3; ++i) {
    u[i] = static_cast<double>(b[i]) - static_cast<double>(a[i]);
    v[i] = static_cast<double>(c[i]) - static_cast<double>(a[i]);
  }
  const double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  // NaN fails the comparison too, so positions that are not finite give a zero normal.
  if (!(length > 0) || std::isinf(length)) return {};
  return {static_cast<T>(n[0] / length), static_cast<T>(n[1] / length), static_cast<T>(n[2] / length)};
}

/// Bytes of a binary file before its facets, and for each facet: 80 of header and 4 of count, then twelve
/// floats and two attribute bytes.
inline constexpr size_t stl_header_size = 84;
inline constexpr size_t stl_facet_size = 50;

/// Format::read and Format::write of STL.
Result<ReadResult> read_stl(const Source& source, const ReadOptions& options);
Result<std::vector<std::string>> write_stl(const Mesh& mesh, Sink& sink, const WriteOptions& options);

}  // namespace maille
