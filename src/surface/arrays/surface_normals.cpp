#include "surface/arrays/surface_normals.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "surface/front/element_walk.h"

namespace maille {
namespace {

double length_of(const Vector3& v) {
  return std::sqrt(dot(v, v));
}

/// 1 / n for odd n.
constexpr auto odd_reciprocals = [] {
  std::array<double, 24> table{};
  for (size_t n = 1; n < table.size(); n += 2) table[n] = 1.0 / static_cast<double>(n);
  return table;
}();

/// atan(x) for 0 <= x: halved three times to at most tan(pi / 16), then its series up to x^23, as libm's
/// functions differ between machines. The first term left out is below 0.2^25 / 25.
double arc_tangent(double x) {
  for (int i = 0; i < 3; ++i) x = x / (1 + std::sqrt(1 + x * x));
  const double square = x * x;
  double sum = 0;
  for (size_t n = 24; n-- > 0; --n) sum = odd_reciprocals[n] - square * sum;
  return 8 * x * sum;
}

/// The angle between two vectors, 0 to pi: half of it has the tangent |u x v| / (|u| |v| + u.v), which is
/// exact for small angles, too, where an arc cosine is not.
double angle_between(const Vector3& u, const Vector3& v) {
  const double sine = length_of(cross(u, v));
  const double cosine = dot(u, v);
  const double below = std::sqrt(dot(u, u) * dot(v, v)) + cosine;
  if (!(below > 0)) return sine > 0 || cosine < 0 ? 3.14159265358979312 : 0;
  return 2 * arc_tangent(sine / below);
}

/// Positions that are not finite count as 0, so that nothing of them spreads.
Vector3 finite(Vector3 v) {
  for (double& x : v.x) {
    if (!std::isfinite(x)) x = 0;
  }
  return v;
}

}  // namespace

SurfaceNormals::SurfaceNormals(const PatchElements& elements, const std::vector<uint32_t>& face_of,
                               NormalWeight weight)
    : surface_(*elements.surface), positions_(elements.positions), face_of_(face_of), weight_(weight) {
  crosses_.resize(surface_.face_count);
  lengths_.resize(surface_.face_count);
  for (uint32_t face = 0; face < surface_.face_count; ++face) {
    crosses_[face] = cross_of_face(face);
    lengths_[face] = length_of(crosses_[face]);
    if (elements.flipped != nullptr && !elements.flipped->empty() && (*elements.flipped)[face]) {
      for (double& x : crosses_[face].x) x = -x;
    }
  }
}

const Vector3& SurfaceNormals::position(uint32_t h) const {
  return positions_[surface_.point(surface_.half_edges.origin[h])];
}

/// A fan of triangles around the corner of the lowest vertex, as first corners differ between the two sides.
/// For plane faces any corner gives twice the area along the normal.
Vector3 SurfaceNormals::cross_of_face(uint32_t face) const {
  const HalfEdges& edges = surface_.half_edges;
  const uint32_t apex = lowest_corner_of(surface_, face);
  Vector3 sum;
  uint32_t h = edges.next(apex);
  Vector3 before = position(h) - position(apex);
  for (h = edges.next(h); h != apex; h = edges.next(h)) {
    const Vector3 side = position(h) - position(apex);
    sum = sum + cross(before, side);
    before = side;
  }
  return sum;
}

/// Where all normals agree, the sum is as long as its parts are together; the spread grows from 0 to 1 as
/// they disagree.
ExpectedNormal SurfaceNormals::Sum::expected() const {
  const double gap = length - length_of(vector);
  const double spread = length > 0 ? std::sqrt(std::max(gap, 0.0) / length) : 0;
  return {vector, spread};
}

/// Positions are rounded to some step, which for floats grows with their distance from the origin; that turns
/// a face by the step times its longest edge over its area.
ExpectedNormal SurfaceNormals::of_face(uint32_t face) const {
  const HalfEdges& edges = surface_.half_edges;
  double longest = 0;
  double farthest = 0;
  uint32_t h = lowest_corner_of(surface_, face);
  const uint32_t first = h;
  do {
    const Vector3 side = position(edges.next(h)) - position(h);
    longest = std::max(longest, dot(side, side));
    farthest = std::max(farthest, dot(position(h), position(h)));
    h = edges.next(h);
  } while (h != first);
  const double twice_area = lengths_[face];
  const double turn = twice_area > 0 ? std::sqrt(longest) * std::sqrt(farthest) / twice_area : 0;
  return {crosses_[face], turn};
}

/// Weights as in docs/format.md, 13.5; faces without area say nothing.
void SurfaceNormals::add(uint32_t corner, uint32_t face, Sum& sum) const {
  const HalfEdges& edges = surface_.half_edges;
  const Vector3& normal = crosses_[face];
  const double twice_area = lengths_[face];
  if (!(twice_area > 0)) return;
  double factor = 1;
  if (weight_ == NormalWeight::equal) factor = 1 / twice_area;
  if (weight_ == NormalWeight::angle || weight_ == NormalWeight::inverse_edges) {
    const Vector3 after = position(edges.next(corner)) - position(corner);
    const Vector3 before = position(edges.previous(corner)) - position(corner);
    if (weight_ == NormalWeight::angle) {
      factor = angle_between(after, before) / twice_area;
    } else {
      const double squares = dot(after, after) * dot(before, before);
      factor = squares > 0 ? 1 / squares : 0;
    }
  }
  sum.vector = sum.vector + normal * factor;
  sum.length += twice_area * factor;
}

/// Points of the same place are added in the order of their numbers.
void SurfaceNormals::weld(const std::vector<Sum>& sums, std::vector<ExpectedNormal>& expected) const {
  std::vector<uint32_t> order(sums.size());
  for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  // By place, then by number: a total order, as positions are finite (-0 and +0 are one place).
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    const auto& at = positions_[a].x;
    const auto& other = positions_[b].x;
    return at != other ? at < other : a < b;
  });
  for (size_t i = 0; i < order.size();) {
    Sum all;
    size_t end = i;
    for (; end < order.size() && positions_[order[end]].x == positions_[order[i]].x; ++end) {
      all.vector = all.vector + sums[order[end]].vector;
      all.length += sums[order[end]].length;
    }
    uint32_t before = none;
    for (; i < end; ++i) {
      expected[order[i]] = all.expected();
      expected[order[i]].twin = before;
      before = order[i];
    }
  }
}

std::vector<ExpectedNormal> SurfaceNormals::of_points(bool welded) const {
  std::vector<Sum> sums(surface_.point_count);
  for (uint32_t face = 0; face < surface_.face_count; ++face) {
    const uint32_t first = surface_.face(face);
    uint32_t h = first;
    do {
      add(h, face, sums[surface_.point(surface_.half_edges.origin[h])]);
      h = surface_.half_edges.next(h);
    } while (h != first);
  }
  std::vector<ExpectedNormal> expected(sums.size());
  for (size_t i = 0; i < sums.size(); ++i) expected[i] = sums[i].expected();
  if (welded) weld(sums, expected);
  return expected;
}

ExpectedNormal SurfaceNormals::of_wedge(std::span<const uint32_t> corners) const {
  Sum sum;
  for (const uint32_t h : corners) add(h, face_of_[h], sum);
  return sum.expected();
}

double SurfaceNormals::cosine(uint32_t corner, uint32_t other) const {
  const uint32_t a = face_of_[corner], b = face_of_[other];
  const double lengths = lengths_[a] * lengths_[b];
  return lengths > 0 ? dot(crosses_[a], crosses_[b]) / lengths : 1;
}

std::vector<Vector3> positions_as_doubles(const Array& positions) {
  std::vector<Vector3> result(positions.count());
  const size_t size = size_of(positions.type);
  for (size_t i = 0; i < result.size(); ++i) {
    Vector3 v;
    for (unsigned k = 0; k < 3; ++k)
      v[k] = number_as_double(positions.type, positions.bytes.data() + (3 * i + k) * size);
    result[i] = finite(v);
  }
  return result;
}

/// The encoder predicts from what the decoder will have, not from the source, wherever there is loss.
std::vector<Vector3> decoded_positions(const Array& positions, const ArrayMaps& maps,
                                       std::span<const uint32_t> source) {
  const size_t size = size_of(positions.type);
  std::vector<Vector3> result(source.size());
  for (size_t i = 0; i < source.size(); ++i) {
    Vector3 v;
    for (unsigned k = 0; k < 3; ++k) {
      const uint64_t place = uint64_t{3} * source[i] + k;
      const std::byte* number = positions.bytes.data() + place * size;
      const bool exact =
          maps.lossless || std::binary_search(maps.exceptions.begin(), maps.exceptions.end(), place);
      std::byte decoded[8];
      if (!exact)
        maps.maps[k].store_number(positions.type, maps.maps[k].code_of(positions.type, number), decoded);
      v[k] = number_as_double(positions.type, exact ? number : decoded);
    }
    result[i] = finite(v);
  }
  return result;
}

}  // namespace maille
