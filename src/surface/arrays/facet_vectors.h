#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "entropy/bit_model.h"
#include "numbers/number_map.h"
#include "surface/arrays/array_coder.h"
#include "surface/arrays/facet_formula.h"
#include "surface/front/element_walk.h"

namespace maille {

// What the normals of faces (facet_normal_coder.h) are made of: corners, normals computed from them, codes,
// and the normals that were met.

/// The corners of a face as its mesh has them, from the one at the lowest vertex on, and faces that came
/// before at its edges. Half-edges are numbered differently on the two sides; the lowest vertex is the same.
class FaceCorners {
 public:
  struct Neighbour {
    unsigned edge;  ///< from this corner to the next
    uint32_t face;
    uint32_t opposite;  ///< the half-edge on its side
  };

  FaceCorners(const PatchElements& elements, const std::vector<uint32_t>& face_of)
      : elements_(elements), surface_(*elements.surface), face_of_(face_of) {}

  /// Finds the corners of a cell, and its neighbours; none for cells that are not on the surface. What it had
  /// of the cell before goes.
  void find(uint32_t cell) {
    points_.clear();
    half_edges_.clear();
    neighbours_.clear();
    if (cell >= surface_.face_count) return;
    const HalfEdges& edges = surface_.half_edges;
    const uint32_t first = lowest_corner_of(surface_, cell);
    for (uint32_t h = first;;) {
      half_edges_.push_back(h);
      h = edges.next(h);
      if (h == first) break;
    }
    const bool flipped =
        elements_.flipped != nullptr && !elements_.flipped->empty() && (*elements_.flipped)[cell];
    if (flipped) std::reverse(half_edges_.begin() + 1, half_edges_.end());
    for (const uint32_t h : half_edges_) points_.push_back(surface_.point(edges.origin[h]));
    for (unsigned i = 0; i < half_edges_.size(); ++i) {
      // Of a flipped face, the edge between two corners starts at the second.
      const uint32_t h = half_edges_[flipped ? (i + 1) % half_edges_.size() : i];
      const uint32_t other = face_of_[edges.opposite[h]];
      if (other < cell) neighbours_.push_back({i, other, edges.opposite[h]});
    }
  }

  std::span<const uint32_t> points() const { return points_; }
  std::span<const Neighbour> neighbours() const { return neighbours_; }
  const Vector3& position(size_t corner) const { return elements_.positions[points_[corner]]; }
  uint32_t half_edge(size_t corner) const { return half_edges_[corner]; }
  uint32_t after(uint32_t half_edge) const { return surface_.half_edges.next(half_edge); }

 private:
  const PatchElements& elements_;
  const PatchSurface& surface_;
  const std::vector<uint32_t>& face_of_;
  std::vector<uint32_t> points_;
  std::vector<uint32_t> half_edges_;
  std::vector<Neighbour> neighbours_;
};

/// Normals as a formula gives them for the corners of a face, by the corner that edges start from: one for
/// each of a triangle, which its mesh may begin with, one for other faces.
inline unsigned computed_normals(const FaceCorners& face, const FacetFormula& formula,
                                 std::array<Vector3, 3>& normals) {
  // A triangle may have been begun at any corner by the program that computed its normal. Of larger faces
  // nobody knows how, so they have the sum of their triangles' normals, without a formula.
  const size_t corners = face.points().size();
  if (corners == 3) {
    for (size_t i = 0; i < 3; ++i)
      normals[i] = formula.normal(face.position(i), face.position((i + 1) % 3), face.position((i + 2) % 3));
    return 3;
  }
  if (corners < 3) return 0;
  Vector3 sum;
  for (size_t i = 2; i < corners; ++i) {
    sum = sum + cross(face.position(i - 1) - face.position(0), face.position(i) - face.position(0));
  }
  const double length = std::sqrt(dot(sum, sum));
  if (!(length > 0) || std::isinf(length)) return 0;
  normals[0] = sum * ((formula.inward() ? -1 : 1) / length);
  return 1;
}

/// Codes and numbers of an array of vectors. Zeros of both signs are one tuple to the coder, as a sign is
/// coded apart: programs compute -0 and +0 by the order of their operations.
template <class Code>
class VectorCodes {
 public:
  using Tuple = std::array<Code, 3>;

  VectorCodes(Scalar type, const ArrayMaps& maps, std::span<Code> codes)
      : type_(type), maps_(maps.maps), codes_(codes) {
    for (unsigned k = 0; k < 3; ++k) zeros_[k] = {zero(k, false), zero(k, true)};
  }

  /// The tuple of an element, with positive zeros for negative ones.
  Tuple at(uint32_t element) const {
    const Code* codes = &codes_[size_t{3} * element];
    return plain({codes[0], codes[1], codes[2]});
  }
  /// A bit for each component that is a negative zero.
  unsigned zero_signs(uint32_t element) const {
    unsigned signs = 0;
    for (unsigned k = 0; k < 3; ++k) {
      const bool negative = zeros_[k][0] != zeros_[k][1] && codes_[size_t{3} * element + k] == zeros_[k][1];
      signs |= unsigned{negative} << k;
    }
    return signs;
  }
  void put(uint32_t element, const Tuple& tuple, unsigned zero_signs) {
    for (unsigned k = 0; k < 3; ++k)
      codes_[size_t{3} * element + k] = (zero_signs >> k & 1) != 0 ? zeros_[k][1] : tuple[k];
  }
  bool is_zero(unsigned k, const Tuple& tuple) const { return tuple[k] == zeros_[k][0]; }
  Code zero(unsigned k) const { return zeros_[k][0]; }
  double number(unsigned k, Code code) const { return maps_[k].number_near(type_, code); }
  Vector3 numbers(const Tuple& tuple) const {
    return {{number(0, tuple[0]), number(1, tuple[1]), number(2, tuple[2])}};
  }
  Code nearest(unsigned k, double value) const {
    return static_cast<Code>(maps_[k].nearest_code(type_, value));
  }
  Tuple nearest(const Vector3& v) const {
    return plain({nearest(0, v[0]), nearest(1, v[1]), nearest(2, v[2])});
  }
  /// The tuple with numbers of the other sign where bits are set.
  Tuple turned(Tuple tuple, unsigned bits) const {
    for (unsigned k = 0; k < 3; ++k) {
      if ((bits >> k & 1) != 0) tuple[k] = negated(k, tuple[k]);
    }
    return plain(tuple);
  }
  /// The distance from the number nearest to a value to the next one.
  double unit(unsigned k, double value) const {
    const Code code = nearest(k, value);
    // Unsigned, as the next code may wrap; the result is bounded whatever its number is.
    const auto next = static_cast<Code>(static_cast<std::make_unsigned_t<Code>>(code) + 1);
    const double unit = std::fabs(number(k, next) - number(k, code));
    return unit > 1e-60 && unit < 1e60 ? unit : 1e-60;
  }

 private:
  Code zero(unsigned k, bool negative) const {
    std::byte bytes[8] = {};
    if (type_ == Scalar::f32) {
      store(bytes, negative ? -0.0F : 0.0F);
    } else {
      store(bytes, negative ? -0.0 : 0.0);
    }
    return static_cast<Code>(maps_[k].code_of(type_, bytes));
  }
  Tuple plain(Tuple tuple) const {
    for (unsigned k = 0; k < 3; ++k) {
      if (tuple[k] == zeros_[k][1]) tuple[k] = zeros_[k][0];
    }
    return tuple;
  }
  /// Codes of ordered bits and digits count from both sides of zero, so that ~code is the number of the other
  /// sign; others are looked up.
  Code negated(unsigned k, Code code) const {
    const NumberMap& map = maps_[k];
    if (map.table.empty() && map.is_curved()) return static_cast<Code>(~code);
    return nearest(k, -number(k, code));
  }

  Scalar type_;
  std::span<const NumberMap> maps_;
  std::span<Code> codes_;
  std::array<std::array<Code, 2>, 3> zeros_;  ///< of both signs
};

/// Normals that were met, by the directions that faces have: in machine parts the same shape comes again,
/// also as a mirror image along the axes. Elements are stored; their signs are those of their faces. A place
/// in the table forgets when another direction comes, so it needs no clearing and no search.
class NormalMemory {
 public:
  static constexpr unsigned ways = 3;
  struct Bucket {
    uint64_t key = 0;
    std::array<uint32_t, ways> elements = {none, none, none};
  };

  /// Room for as many directions as cells, up to 2^18 (6 MB).
  explicit NormalMemory(uint32_t cells) : buckets_(size_t{1} << std::clamp(bit_length(cells), 4u, 18u)) {}

  /// The bucket for a direction, empty if there was none.
  Bucket& at(const Vector3& direction) {
    // Rounded to 1/16384: 1/4096 to 1/65536 are the same within 1 %, coarser ones mix up what is finely cut.
    uint64_t key = 1;
    for (const double x : direction.x)
      key = key << 20 | static_cast<uint64_t>(std::floor(std::fabs(x) * 16384 + 0.5));
    Bucket& bucket = buckets_[static_cast<size_t>(key * 0x9e3779b97f4a7c15 >> 40) & (buckets_.size() - 1)];
    if (bucket.key != key) bucket = {key, {none, none, none}};
    return bucket;
  }

 private:
  std::vector<Bucket> buckets_;
};

}  // namespace maille
