#include "predict/butterfly.h"

#include <algorithm>
#include <array>
#include <string>

#include "base/result.h"
#include "predict/butterfly_block.h"
#include "predict/subdivision_output.h"

namespace maille {

namespace {

/// Where a new point lies in its triangle: steps from the first corner towards the second and the third.
struct Place {
  uint32_t i;
  uint32_t j;
};

Place middle(Place a, Place b) {
  return {(a.i + b.i) / 2, (a.j + b.j) / 2};
}

/// Every triangle of the surface becomes a lattice of `steps` steps to a side. Numbers of points: those of
/// the surface, then triangle by triangle the new ones on the edges that are this triangle's own, and those
/// inside it, row by row. So the number of any point can be computed, and none has to be kept.
class Numbering {
 public:
  Numbering(const TriangleSurface& surface, unsigned levels)
      : surface_(surface), levels_(levels), steps_(1u << levels) {
    next_ = surface.points.size();
    for (uint32_t t = 0; t < surface.triangles(); ++t) {
      first_.push_back(static_cast<uint32_t>(next_));  // checked as a whole by point_count()
      for (uint32_t h = 3 * t; h < 3 * t + 3; ++h) next_ += surface.is_first(h) ? steps_ - 1 : 0;
      next_ += inside();
    }
  }
  uint64_t point_count() const { return next_; }
  uint32_t steps() const { return steps_; }
  uint32_t triangles_each() const { return 1u << (2 * levels_); }

  uint32_t number(uint32_t t, Place p) const {
    const uint32_t h = 3 * t;
    if (p.j == 0) return on_edge(h, p.i);
    if (p.i == 0) return on_edge(h + 2, steps_ - p.j);
    if (p.i + p.j == steps_) return on_edge(h + 1, p.j);
    return first_[t] + own_edges_before(h + 3) * (steps_ - 1) + row(p.j) + p.i - 1;
  }
  /// Calls visit(place) for the new points of a triangle, in the order of their numbers.
  template <class Visit>
  Result<> for_each_point(uint32_t t, Visit visit) const {
    for (uint32_t side = 0; side < 3; ++side) {
      if (!surface_.is_first(3 * t + side)) continue;
      for (uint32_t k = 1; k < steps_; ++k) MAILLE_CHECK(visit(on_side(side, k)));
    }
    for (uint32_t j = 1; j + 1 < steps_; ++j) {
      for (uint32_t i = 1; i + j < steps_; ++i) MAILLE_CHECK(visit(Place{i, j}));
    }
    return {};
  }
  /// Corners of one of a triangle's small triangles; two bits of `path` for each level, as refined() orders
  /// them.
  std::array<Place, 3> corners_of(uint32_t path) const {
    Place a{0, 0}, b{steps_, 0}, c{0, steps_};
    for (unsigned level = levels_; level-- > 0;) {
      const Place ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      switch (path >> 2 * level & 3) {
        case 0:
          b = ab, c = ca;
          break;
        case 1:
          a = b, b = bc, c = ab;
          break;
        case 2:
          a = c, b = ca, c = bc;
          break;
        default:
          a = ab, b = bc, c = ca;
      }
    }
    return {a, b, c};
  }

 private:
  uint32_t inside() const { return static_cast<uint32_t>(uint64_t{steps_ - 1} * (steps_ - 2) / 2); }
  Place on_side(uint32_t side, uint32_t k) const {
    if (side == 0) return {k, 0};
    return side == 1 ? Place{steps_ - k, k} : Place{0, steps_ - k};
  }
  /// Points inside the triangle in rows before this one.
  uint32_t row(uint32_t j) const {
    return static_cast<uint32_t>(uint64_t{j - 1} * (steps_ - 1) - uint64_t{j - 1} * j / 2);
  }
  uint32_t own_edges_before(uint32_t h) const {
    uint32_t count = 0;
    for (uint32_t e = (h - 1) / 3 * 3; e < h; ++e) count += surface_.is_first(e);
    return count;
  }
  uint32_t on_edge(uint32_t h, uint32_t k) const {
    if (k == 0) return surface_.origin(h);
    if (k == steps_) return surface_.target(h);
    if (!surface_.is_first(h)) {
      h = surface_.opposite[h];
      k = steps_ - k;
    }
    const uint32_t before = h % 3 == 0 ? 0 : own_edges_before(h);
    return first_[h / 3] + before * (steps_ - 1) + k - 1;
  }

  const TriangleSurface& surface_;
  unsigned levels_;
  uint32_t steps_;
  std::vector<uint32_t> first_;  // by triangle: its first new point
  uint64_t next_;
};

/// Subdivides triangles `first` to `end` and writes the new points that are theirs.
class BlockWriter {
 public:
  BlockWriter(const TriangleSurface& surface, const Numbering& numbering, unsigned levels)
      : numbering_(numbering), levels_(levels), cutter_(surface), weights_(butterfly_ring_weights) {}

  Result<> write(uint32_t first, uint32_t end, BufferedOutput& out) {
    ButterflyBlock block = cutter_.cut(first, end, 2);
    for (unsigned level = 1; level <= levels_; ++level)
      block = refined(block, weights_, level < levels_ ? 2 : 0);
    for (uint32_t t = first; t < end; ++t) {
      find_places(block.surface, t - first);
      MAILLE_CHECK(numbering_.for_each_point(
          t, [&](Place p) { return out.point(block.surface.points[points_[index(p)]]); }));
    }
    return {};
  }

 private:
  size_t index(Place p) const { return size_t{p.j} * (numbering_.steps() + 1) + p.i; }

  /// Which point of the block lies where in its triangle number t.
  void find_places(const TriangleSurface& fine, uint32_t t) {
    points_.resize(index({numbering_.steps(), numbering_.steps()}) + 1);
    for (uint32_t path = 0; path < numbering_.triangles_each(); ++path) {
      const std::array<Place, 3> places = numbering_.corners_of(path);
      const size_t corner = size_t{3} * (size_t{t} * numbering_.triangles_each() + path);
      for (size_t k = 0; k < 3; ++k) points_[index(places[k])] = fine.corners[corner + k];
    }
  }

  const Numbering& numbering_;
  unsigned levels_;
  BlockCutter cutter_;
  RingWeights weights_;
  std::vector<uint32_t> points_;  // by index(place)
};

// 4^12 small triangles take a gigabyte; whoever wants more can subdivide the result again.
constexpr unsigned most_levels = 12;
constexpr unsigned triangles_per_block = 1u << 20;

Result<> write_points(const TriangleSurface& surface, const Numbering& numbering, unsigned levels,
                      BufferedOutput& out) {
  for (const Position& point : surface.points) MAILLE_CHECK(out.point(point));
  BlockWriter writer(surface, numbering, levels);
  const uint32_t step = std::max(triangles_per_block / numbering.triangles_each(), 1u);
  for (uint32_t first = 0; first < surface.triangles();
       first += std::min(step, surface.triangles() - first)) {
    MAILLE_CHECK(writer.write(first, first + std::min(step, surface.triangles() - first), out));
  }
  return out.flush();
}

Result<> write_triangles(const TriangleSurface& surface, const Numbering& numbering, BufferedOutput& out) {
  for (uint32_t t = 0; t < surface.triangles(); ++t) {
    for (uint32_t path = 0; path < numbering.triangles_each(); ++path) {
      const std::array<Place, 3> places = numbering.corners_of(path);
      MAILLE_CHECK(out.triangle(numbering.number(t, places[0]), numbering.number(t, places[1]),
                                numbering.number(t, places[2])));
    }
  }
  return out.flush();
}

}  // namespace

Result<> subdivide_by_butterfly(const TriangleSurface& surface, unsigned levels, SubdivisionOutput& output) {
  if (levels > most_levels) {
    return failure(ErrorCode::usage, std::to_string(levels) + " levels are more than " +
                                         std::to_string(most_levels) +
                                         ", the most for the butterfly; take fewer");
  }
  const Numbering numbering(surface, levels);
  MAILLE_CHECK(check_point_count(numbering.point_count()));
  MAILLE_CHECK(output.begin(numbering.point_count(), uint64_t{surface.triangles()} << (2 * levels)));
  BufferedOutput out(output);
  MAILLE_CHECK(write_points(surface, numbering, levels, out));
  return write_triangles(surface, numbering, out);
}

}  // namespace maille
