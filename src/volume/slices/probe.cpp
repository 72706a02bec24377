#include <maille/slice.h>

#include <algorithm>
#include <cmath>

#include "mesh/cell_faces.h"
#include "numbers/number_map.h"
#include "numbers/point_position.h"

namespace maille {
namespace {

/// A place in a cell as a mean of its points: numbers of points with their shares, whose sum is 1. A point
/// may come several times.
using Weights = std::vector<std::pair<uint32_t, double>>;

/// A corner of a tetrahedron: a point of the cell, or the mean of several.
struct Corner {
  Vector3 at;
  std::span<const uint32_t> points;  ///< whose mean it is
};

/// Barycentric coordinates of a place in a tetrahedron, by Cramer's rule; none if it is outside or the
/// tetrahedron has no volume. A little outside (1e-9 of the tetrahedron) counts as inside, as roundings would
/// else leave gaps between neighbours.
std::optional<std::array<double, 4>> coordinates(const std::array<Corner, 4>& corners, const Vector3& place) {
  constexpr double slack = 1e-9;
  const Vector3 a = corners[1].at - corners[0].at, b = corners[2].at - corners[0].at,
                c = corners[3].at - corners[0].at, p = place - corners[0].at;
  const double volume = dot(a, cross(b, c));
  if (!(std::abs(volume) > 0)) return std::nullopt;
  std::array<double, 4> found{};
  found[1] = dot(p, cross(b, c)) / volume;
  found[2] = dot(a, cross(p, c)) / volume;
  found[3] = dot(a, cross(b, p)) / volume;
  found[0] = 1 - found[1] - found[2] - found[3];
  for (const double share : found) {
    if (!(share >= -slack)) return std::nullopt;
  }
  return found;
}

// In the order of the points, so that neighbours find the same middle of a face only to rounding: hence the
// slack.
Vector3 mean(const Mesh& mesh, std::span<const uint32_t> points) {
  Vector3 sum;
  for (const uint32_t point : points) sum = sum + point_position(mesh.points, point);
  return sum * (1 / static_cast<double>(points.size()));
}

/// The shares of the cell's points at the place; none: it is not in the cell. Any solid is divided into
/// tetrahedra from its middle over the middles of its faces: neighbours divide a common face alike, so that
/// values are continuous across it.
std::optional<Weights> weights_at(const Mesh& mesh, const CellBlock& block, uint64_t cell,
                                  const Vector3& place) {
  const auto all = block.cell(cell);
  const Corner middle = {mean(mesh, all), all};
  std::optional<Weights> weights;
  for_each_face(block, cell, [&](std::span<const uint32_t> corners) {
    if (weights || corners.size() < 3) return;
    const Corner centre = {mean(mesh, corners), corners};
    for (size_t k = 0; k < corners.size() && !weights; ++k) {
      const auto corner = [&](size_t i) {
        const auto points = corners.subspan(i % corners.size(), 1);
        return Corner{point_position(mesh.points, points[0]), points};
      };
      const std::array<Corner, 4> tetrahedron = {middle, centre, corner(k), corner(k + 1)};
      const auto shares = coordinates(tetrahedron, place);
      if (!shares) continue;
      weights.emplace();
      for (unsigned c = 0; c < 4; ++c) {
        const double share = (*shares)[c] / static_cast<double>(tetrahedron[c].points.size());
        for (const uint32_t point : tetrahedron[c].points) weights->emplace_back(point, share);
      }
    }
  });
  return weights;
}

/// Values on points are interpolated, those on cells taken. Integers become doubles on the way.
void set_values(const Mesh& mesh, const Weights& weights, ProbedValues& probed) {
  for (const Array& array : mesh.arrays) {
    if (array.domain != Domain::point && array.domain != Domain::cell) continue;
    ProbedValues::Value& value = probed.values.emplace_back();
    value.name = array.name;
    value.domain = array.domain;
    const size_t size = size_of(array.type);
    const auto number = [&](uint64_t tuple, uint32_t k) {
      return number_as_double(array.type, array.bytes.data() + (tuple * array.components + k) * size);
    };
    for (uint32_t k = 0; k < array.components; ++k) {
      double sum = 0;
      for (const auto& [point, share] : weights)
        sum += array.domain == Domain::point ? share * number(point, k) : 0;
      value.components.push_back(array.domain == Domain::point ? sum : number(probed.cell, k));
    }
  }
}

/// What is cheap to see rules nearly all cells out. Points whose numbers are NaN are on no side.
bool is_in_box(const Mesh& mesh, std::span<const uint32_t> points, const Vector3& place) {
  std::array<bool, 3> below{}, above{};
  for (const uint32_t point : points) {
    const Vector3 at = point_position(mesh.points, point);
    for (unsigned k = 0; k < 3; ++k) {
      below[k] = below[k] || at[k] <= place[k];
      above[k] = above[k] || at[k] >= place[k];
    }
  }
  return below[0] && below[1] && below[2] && above[0] && above[1] && above[2];
}

}  // namespace

/// The first cell that has the place gives its values. Cells times places steps.
std::vector<ProbedValues> probe(const Mesh& mesh, std::span<const Vector3> places) {
  std::vector<ProbedValues> probed(places.size());
  uint64_t number = 0;
  for (const CellBlock& block : mesh.blocks) {
    const uint64_t cells = block.size();
    for (uint64_t i = 0; i < cells; ++i, ++number) {
      for (size_t k = 0; k < places.size(); ++k) {
        if (probed[k].inside || !is_in_box(mesh, block.cell(i), places[k])) continue;
        const auto weights = weights_at(mesh, block, i, places[k]);
        if (!weights) continue;
        probed[k].inside = true;
        probed[k].cell = number;
        set_values(mesh, *weights, probed[k]);
      }
    }
  }
  return probed;
}

}  // namespace maille
