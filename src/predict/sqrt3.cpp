#include "predict/sqrt3.h"

#include <string>

#include "base/result.h"
#include "predict/subdivision_output.h"
#include "predict/subdivision_point.h"

namespace maille {

namespace {

constexpr uint32_t border = TriangleSurface::border;

/// Writes one level of sqrt(3): a point in each triangle, and every inner edge turned. In every second level
/// a triangle at the border gets no point, but two on its border edge, so that two levels cut each edge in
/// three.
///
///   every other level     a ---- b      in between     a -- p -- q -- b     (c: the triangle's third corner,
///   a
///                          \ m  /                        \  |  |  /          middle of the level before)
///                            c                               c
class Sqrt3Level {
 public:
  Sqrt3Level(const TriangleSurface& surface, RingWeights& weights, bool cuts_border)
      : surface_(surface), predictor_(surface, weights) {
    uint32_t next = static_cast<uint32_t>(surface.points.size());
    for (uint32_t t = 0; t < surface.triangles(); ++t) {
      first_new_.push_back(next);
      cut_.push_back(cuts_border ? border_edge(t) : border);
      next += cut_.back() == border ? 1 : 2;
    }
    new_points_ = next - surface.points.size();
  }
  uint64_t new_points() const { return new_points_; }
  uint64_t triangles() const { return uint64_t{3} * surface_.triangles(); }

  Result<> write_new_points(BufferedOutput& out) {
    for (uint32_t t = 0; t < surface_.triangles(); ++t) {
      if (cut_[t] == border) {
        MAILLE_CHECK(out.point(predictor_.triangle_middle(t)));
      } else {
        MAILLE_CHECK(out.point(predictor_.border_third(cut_[t])));
        MAILLE_CHECK(out.point(predictor_.border_two_thirds(cut_[t])));
      }
    }
    return {};
  }
  Result<> write_triangles(BufferedOutput& out) {
    for (uint32_t h = 0; h < surface_.half_edges(); ++h) {
      const uint32_t a = surface_.origin(h);
      const uint32_t b = surface_.target(h);
      const uint32_t other = surface_.opposite[h];
      if (h == cut_[h / 3]) {
        MAILLE_CHECK(out.triangle(first_new_[h / 3], first_new_[h / 3] + 1, surface_.tip(h)));
      } else if (other == border) {
        MAILLE_CHECK(out.triangle(a, b, new_tip(h)));
      } else if (h < other) {
        MAILLE_CHECK(out.triangle(a, new_tip(other), new_tip(h)));
        MAILLE_CHECK(out.triangle(b, new_tip(h), new_tip(other)));
      }
    }
    return {};
  }

 private:
  uint32_t border_edge(uint32_t triangle) const {
    for (uint32_t h = 3 * triangle; h < 3 * triangle + 3; ++h) {
      if (surface_.opposite[h] == border) return h;
    }
    return border;
  }
  /// The new point that makes a triangle with the edge of h.
  uint32_t new_tip(uint32_t h) const {
    const uint32_t t = h / 3;
    const bool far_end = cut_[t] != border && h == TriangleSurface::next(cut_[t]);
    return first_new_[t] + (far_end ? 1 : 0);
  }

  const TriangleSurface& surface_;
  PointPredictor predictor_;
  std::vector<uint32_t> first_new_;  // by triangle
  std::vector<uint32_t> cut_;  // by triangle: its border half-edge if that is cut in three, else `border`
  uint64_t new_points_;
};

/// Points, then triangles. Every second level cuts the border.
Result<> write_level(const TriangleSurface& surface, RingWeights& weights, unsigned number,
                     SubdivisionOutput& output) {
  Sqrt3Level level(surface, weights, number % 2 == 1);
  const uint64_t points = surface.points.size() + level.new_points();
  MAILLE_CHECK(check_point_count(points));
  MAILLE_CHECK(output.begin(points, level.triangles()));
  BufferedOutput out(output);
  for (const Position& point : surface.points) MAILLE_CHECK(out.point(point));
  MAILLE_CHECK(level.write_new_points(out));
  MAILLE_CHECK(out.flush());
  MAILLE_CHECK(level.write_triangles(out));
  return out.flush();
}

/// A level that is subdivided again.
class NextSurface final : public SubdivisionOutput {
 public:
  Result<> begin(uint64_t points, uint64_t triangles) override {
    surface.points.reserve(points);
    surface.corners.reserve(3 * triangles);
    return {};
  }
  Result<> points(std::span<const double> coordinates) override {
    for (size_t i = 0; i < coordinates.size(); i += 3) {
      surface.points.push_back({coordinates[i], coordinates[i + 1], coordinates[i + 2]});
    }
    return {};
  }
  Result<> triangles(std::span<const uint32_t> corners) override {
    surface.corners.insert(surface.corners.end(), corners.begin(), corners.end());
    return {};
  }
  TriangleSurface surface;
};

/// Before anything is made: half-edges of the last level in memory must have numbers.
Result<> check_size(const TriangleSurface& surface, unsigned levels) {
  uint64_t half_edges = surface.half_edges();
  for (unsigned level = 1; level < levels && half_edges < border; ++level) half_edges *= 3;
  if (half_edges < border) return {};
  return failure(ErrorCode::usage, std::to_string(levels) + " levels of " +
                                       std::to_string(surface.triangles()) +
                                       " triangles are more than can be done; take fewer");
}

}  // namespace

Result<> subdivide_by_sqrt3(TriangleSurface surface, unsigned levels, SubdivisionOutput& output) {
  MAILLE_CHECK(check_size(surface, levels));
  RingWeights weights(sqrt3_ring_weights);
  for (unsigned level = 0; level + 1 < levels; ++level) {
    NextSurface next;
    MAILLE_CHECK(write_level(surface, weights, level, next));
    surface = std::move(next.surface);
    MAILLE_CHECK(find_opposites(surface));
  }
  return write_level(surface, weights, levels - 1, output);
}

}  // namespace maille
