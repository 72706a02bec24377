#include <maille/subdivide.h>

#include <string>

#include "base/result.h"
#include "predict/subdivision_point.h"
#include "predict/triangle_surface.h"

namespace maille {

namespace {

constexpr uint32_t border = TriangleSurface::border;

/// Gathers numbers for an output, so that it is not called for each triangle.
class Buffered {
 public:
  explicit Buffered(SubdivisionOutput& output) : output_(output) {}

  Result<> point(const Position& p) {
    coordinates_.insert(coordinates_.end(), p.begin(), p.end());
    if (coordinates_.size() < enough) return {};
    return flush();
  }
  Result<> triangle(uint32_t a, uint32_t b, uint32_t c) {
    corners_.insert(corners_.end(), {a, b, c});
    if (corners_.size() < enough) return {};
    return flush();
  }
  Result<> flush() {
    if (!coordinates_.empty()) MAILLE_CHECK(output_.points(coordinates_));
    if (!corners_.empty()) MAILLE_CHECK(output_.triangles(corners_));
    coordinates_.clear();
    corners_.clear();
    return {};
  }

 private:
  static constexpr size_t enough = 3 << 14;
  SubdivisionOutput& output_;
  std::vector<double> coordinates_;
  std::vector<uint32_t> corners_;
};

/// Writes one level of the modified butterfly: new points are numbered by edges.
class ButterflyLevel {
 public:
  explicit ButterflyLevel(const TriangleSurface& surface)
      : surface_(surface), predictor_(surface), middles_(surface.half_edges()) {
    new_points_ = 0;
    for (uint32_t h = 0; h < surface.half_edges(); ++h) {
      if (!surface.is_first(h)) continue;
      middles_[h] = static_cast<uint32_t>(surface.points.size() + new_points_++);
      if (surface.opposite[h] != border) middles_[surface.opposite[h]] = middles_[h];
    }
  }
  uint64_t new_points() const { return new_points_; }
  uint64_t triangles() const { return uint64_t{4} * surface_.triangles(); }

  Result<> write_new_points(Buffered& out) {
    for (uint32_t h = 0; h < surface_.half_edges(); ++h) {
      if (surface_.is_first(h)) MAILLE_CHECK(out.point(predictor_.edge_middle(h)));
    }
    return {};
  }
  Result<> write_triangles(Buffered& out) {
    for (uint32_t h = 0; h < surface_.half_edges(); h += 3) {
      const uint32_t* middle = middles_.data() + h;
      MAILLE_CHECK(out.triangle(surface_.origin(h), middle[0], middle[2]));
      MAILLE_CHECK(out.triangle(surface_.origin(h + 1), middle[1], middle[0]));
      MAILLE_CHECK(out.triangle(surface_.origin(h + 2), middle[2], middle[1]));
      MAILLE_CHECK(out.triangle(middle[0], middle[1], middle[2]));
    }
    return {};
  }

 private:
  const TriangleSurface& surface_;
  PointPredictor predictor_;
  std::vector<uint32_t> middles_;  // by half-edge
  uint64_t new_points_;
};

/// Neighbours of the triangles that ButterflyLevel wrote: half-edges 12 t + 0, 3, 6 are the first halves of
/// those of triangle t, 5, 8, 2 the second ones, 9, 10, 11 those of its middle, across from 4, 7, 1.
std::vector<uint32_t> butterfly_opposites(const TriangleSurface& surface) {
  const auto first_half = [](uint32_t h) { return h / 3 * 12 + h % 3 * 3; };
  const auto second_half = [](uint32_t h) { return h / 3 * 12 + (h + 1) % 3 * 3 + 2; };
  std::vector<uint32_t> opposite(4 * surface.corners.size(), border);
  for (uint32_t h = 0; h < surface.half_edges(); ++h) {
    const uint32_t inner = h / 3 * 12 + 9 + h % 3;
    const uint32_t outer = h / 3 * 12 + (h + 1) % 3 * 3 + 1;
    opposite[inner] = outer;
    opposite[outer] = inner;
    if (surface.opposite[h] == border) continue;
    opposite[first_half(h)] = second_half(surface.opposite[h]);
    opposite[second_half(h)] = first_half(surface.opposite[h]);
  }
  return opposite;
}

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
  Sqrt3Level(const TriangleSurface& surface, bool cuts_border) : surface_(surface), predictor_(surface) {
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

  Result<> write_new_points(Buffered& out) {
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
  Result<> write_triangles(Buffered& out) {
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

template <class Level>
Result<> write_level(const TriangleSurface& surface, Level level, SubdivisionOutput& output) {
  const uint64_t points = surface.points.size() + level.new_points();
  if (points > max_points) {
    return failure(ErrorCode::usage, "the result would have " + std::to_string(points) +
                                         " points, more than a mesh can; take fewer levels");
  }
  MAILLE_CHECK(output.begin(points, level.triangles()));
  Buffered out(output);
  for (const Position& point : surface.points) MAILLE_CHECK(out.point(point));
  MAILLE_CHECK(level.write_new_points(out));
  MAILLE_CHECK(out.flush());
  MAILLE_CHECK(level.write_triangles(out));
  return out.flush();
}

Result<> write_level(const TriangleSurface& surface, SubdivisionScheme scheme, unsigned level,
                     SubdivisionOutput& output) {
  if (scheme == SubdivisionScheme::butterfly) return write_level(surface, ButterflyLevel(surface), output);
  return write_level(surface, Sqrt3Level(surface, level % 2 == 1), output);
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

uint64_t growth(SubdivisionScheme scheme) {
  return scheme == SubdivisionScheme::butterfly ? 4 : 3;
}

/// Before anything is made: every level has the same number of times as many triangles.
Result<> check_size(const TriangleSurface& surface, const SubdivisionOptions& options) {
  uint64_t half_edges = surface.half_edges();
  for (unsigned level = 1; level < options.levels && half_edges < border; ++level) {
    half_edges *= growth(options.scheme);
  }
  if (half_edges < border) return {};
  return failure(ErrorCode::usage, std::to_string(options.levels) + " levels of " +
                                       std::to_string(surface.triangles()) +
                                       " triangles are more than can be done; take fewer");
}

}  // namespace

Result<> subdivide(const Mesh& mesh, const SubdivisionOptions& options, SubdivisionOutput& output) {
  if (options.levels < 1) return failure(ErrorCode::usage, "there is nothing to subdivide in 0 levels");
  TriangleSurface surface = MAILLE_TRY(triangle_surface(mesh));
  MAILLE_CHECK(check_size(surface, options));
  for (unsigned level = 0; level + 1 < options.levels; ++level) {
    NextSurface next;
    MAILLE_CHECK(write_level(surface, options.scheme, level, next));
    if (options.scheme == SubdivisionScheme::butterfly) next.surface.opposite = butterfly_opposites(surface);
    surface = std::move(next.surface);
    if (options.scheme == SubdivisionScheme::sqrt3) MAILLE_CHECK(find_opposites(surface));
  }
  return write_level(surface, options.scheme, options.levels - 1, output);
}

}  // namespace maille
