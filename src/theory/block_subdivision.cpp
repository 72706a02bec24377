#include "theory/block_subdivision.h"

#include <algorithm>

#include "base/result.h"
#include "theory/subdivision_output.h"

namespace maille {

namespace {

/// Every triangle of the surface becomes a lattice of `steps` steps to a side. Numbers of points: those of
/// the surface, then triangle by triangle the new ones on the edges that are this triangle's own (it has the
/// first half-edge), and those inside it, row by row. So the number of any point can be computed, and none
/// has to be kept: blocks are written one after the other and forgotten.
class Numbering {
 public:
  Numbering(const TriangleSurface& surface, unsigned levels, const BlockScheme& scheme)
      : surface_(surface), scheme_(scheme), levels_(levels) {
    for (unsigned level = 0; level < levels; ++level) steps_ *= scheme.steps;
    next_ = surface.points.size();
    for (uint32_t t = 0; t < surface.triangles(); ++t) {
      first_.push_back(static_cast<uint32_t>(next_));  // checked as a whole by point_count()
      for (uint32_t h = 3 * t; h < 3 * t + 3; ++h) next_ += surface.is_first(h) ? edge() : 0;
      next_ += inside();
    }
  }
  uint64_t point_count() const { return next_; }
  int32_t steps() const { return steps_; }
  uint32_t triangles_each() const { return static_cast<uint32_t>(steps_) * static_cast<uint32_t>(steps_); }

  /// On edges, points are numbered from the first half-edge's origin, so the other triangle counts from the
  /// end.
  uint32_t number(uint32_t t, Place p) const {
    const uint32_t h = 3 * t;
    if (p.j == 0) return on_edge(h, p.i);
    if (p.i == 0) return on_edge(h + 2, steps_ - p.j);
    if (p.i + p.j == steps_) return on_edge(h + 1, p.j);
    return first_[t] + own_edges_before(h + 3) * edge() + row(p.j) + static_cast<uint32_t>(p.i - 1);
  }
  /// Calls visit(place) for the new points of a triangle, in the order of their numbers.
  template <class Visit>
  Result<> for_each_point(uint32_t t, Visit visit) const {
    for (uint32_t side = 0; side < 3; ++side) {
      if (!surface_.is_first(3 * t + side)) continue;
      for (int32_t k = 1; k < steps_; ++k) MAILLE_CHECK(visit(on_side(side, k)));
    }
    for (int32_t j = 1; j + 1 < steps_; ++j) {
      for (int32_t i = 1; i + j < steps_; ++i) MAILLE_CHECK(visit(Place{i, j}));
    }
    return {};
  }
  /// Calls visit(corners) for each small triangle of one, in the order in which blocks have them: that of
  /// splitting level by level, not row by row.
  template <class Visit>
  Result<> for_each_triangle(Visit visit) const {
    return for_each_triangle({Place{0, 0}, Place{steps_, 0}, Place{0, steps_}}, levels_, visit);
  }

 private:
  template <class Visit>
  Result<> for_each_triangle(const std::array<Place, 3>& corners, unsigned levels, Visit& visit) const {
    if (levels == 0) return visit(corners);
    const auto place = [&](Place p) {
      const auto along = [&](int32_t from, int32_t i, int32_t j) {
        // Divides without a rest: sides of a lattice of steps^levels are multiples of steps above the last
        // level.
        return from + ((i - from) * p.i + (j - from) * p.j) / scheme_.steps;
      };
      return Place{along(corners[0].i, corners[1].i, corners[2].i),
                   along(corners[0].j, corners[1].j, corners[2].j)};
    };
    for (const auto& part : scheme_.parts) {
      MAILLE_CHECK(for_each_triangle({place(part[0]), place(part[1]), place(part[2])}, levels - 1, visit));
    }
    return {};
  }
  uint32_t edge() const { return static_cast<uint32_t>(steps_ - 1); }  // points on one
  /// Products of 64 bits: steps are up to 4,096 with twelve levels, the count of points is checked as a
  /// whole.
  uint32_t inside() const { return static_cast<uint32_t>(int64_t{steps_ - 1} * (steps_ - 2) / 2); }
  Place on_side(uint32_t side, int32_t k) const {
    if (side == 0) return {k, 0};
    return side == 1 ? Place{steps_ - k, k} : Place{0, steps_ - k};
  }
  /// Points inside the triangle in rows before this one.
  uint32_t row(int32_t j) const {
    return static_cast<uint32_t>(int64_t{j - 1} * (steps_ - 1) - int64_t{j - 1} * j / 2);
  }
  uint32_t own_edges_before(uint32_t h) const {
    uint32_t count = 0;
    for (uint32_t e = (h - 1) / 3 * 3; e < h; ++e) count += surface_.is_first(e);
    return count;
  }
  uint32_t on_edge(uint32_t h, int32_t k) const {
    if (k == 0) return surface_.origin(h);
    if (k == steps_) return surface_.target(h);
    if (!surface_.is_first(h)) {
      h = surface_.opposite[h];
      k = steps_ - k;
    }
    const uint32_t before = h % 3 == 0 ? 0 : own_edges_before(h);
    return first_[h / 3] + before * edge() + static_cast<uint32_t>(k - 1);
  }

  const TriangleSurface& surface_;
  const BlockScheme& scheme_;
  unsigned levels_;
  int32_t steps_ = 1;
  std::vector<uint32_t> first_;  // by triangle: its first new point
  uint64_t next_;
};

/// Subdivides triangles `first` to `end` and writes the new points that are theirs. Each level needs rings
/// around the block, except behind the last.
class BlockWriter {
 public:
  BlockWriter(const TriangleSurface& surface, const Numbering& numbering, unsigned levels,
              const BlockScheme& scheme)
      : numbering_(numbering),
        scheme_(scheme),
        levels_(levels),
        cutter_(surface),
        weights_(scheme.ring_weights) {}

  Result<> write(uint32_t first, uint32_t end, BufferedOutput& out) {
    SurfaceBlock block = cutter_.cut(first, end, scheme_.rings);
    for (unsigned level = 1; level <= levels_; ++level)
      block = scheme_.refined(block, weights_, level < levels_ ? scheme_.rings : 0);
    for (uint32_t t = first; t < end; ++t) {
      find_places(block.surface, t - first);
      MAILLE_CHECK(numbering_.for_each_point(
          t, [&](Place p) { return out.point(block.surface.points[points_[index(p)]]); }));
    }
    return {};
  }

 private:
  size_t index(Place p) const {
    return static_cast<size_t>(p.j) * (static_cast<size_t>(numbering_.steps()) + 1) +
           static_cast<size_t>(p.i);
  }

  /// Which point of the block lies where in its triangle number t.
  void find_places(const TriangleSurface& fine, uint32_t t) {
    points_.resize(index({numbering_.steps(), numbering_.steps()}) + 1);
    const uint32_t* corner = fine.corners.data() + size_t{3} * t * numbering_.triangles_each();
    (void)numbering_.for_each_triangle([&](const std::array<Place, 3>& places) -> Result<> {
      for (const Place place : places) points_[index(place)] = *corner++;
      return {};
    });
  }

  const Numbering& numbering_;
  const BlockScheme& scheme_;
  unsigned levels_;
  BlockCutter cutter_;
  RingWeights weights_;
  std::vector<uint32_t> points_;  // by index(place)
};

// A million small triangles take tens of megabytes of points and links. Chosen, not swept: smaller blocks
// compute more of what lies around them again, larger ones take more memory.
constexpr unsigned triangles_per_block = 1u << 20;

Result<> write_points(const TriangleSurface& surface, const Numbering& numbering, unsigned levels,
                      const BlockScheme& scheme, BufferedOutput& out) {
  for (const Position& point : surface.points) MAILLE_CHECK(out.point(point));
  BlockWriter writer(surface, numbering, levels, scheme);
  const uint32_t step = std::max(triangles_per_block / numbering.triangles_each(), 1u);
  // The last step is shorter, so that `first` cannot wrap.
  for (uint32_t first = 0; first < surface.triangles();
       first += std::min(step, surface.triangles() - first)) {
    MAILLE_CHECK(writer.write(first, first + std::min(step, surface.triangles() - first), out));
  }
  return out.flush();
}

Result<> write_triangles(const TriangleSurface& surface, const Numbering& numbering, BufferedOutput& out) {
  for (uint32_t t = 0; t < surface.triangles(); ++t) {
    MAILLE_CHECK(numbering.for_each_triangle([&](const std::array<Place, 3>& places) {
      return out.triangle(numbering.number(t, places[0]), numbering.number(t, places[1]),
                          numbering.number(t, places[2]));
    }));
  }
  return out.flush();
}

}  // namespace

Result<> subdivide_in_blocks(const TriangleSurface& surface, unsigned levels, const BlockScheme& scheme,
                             SubdivisionOutput& output) {
  const Numbering numbering(surface, levels, scheme);
  MAILLE_CHECK(check_point_count(numbering.point_count()));
  MAILLE_CHECK(
      output.begin(numbering.point_count(), uint64_t{surface.triangles()} * numbering.triangles_each()));
  BufferedOutput out(output);
  MAILLE_CHECK(write_points(surface, numbering, levels, scheme, out));
  return write_triangles(surface, numbering, out);
}

}  // namespace maille
