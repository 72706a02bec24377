#include "theory/sqrt3_block.h"

namespace maille {

namespace {

/// By half-edge, the triangle of the next level that lies along it at its origin; at the border, along all of
/// it. An inner edge gives two triangles, a border edge one.
///
///     a ------- b     the edge a - b turned: m - m', and two triangles, (a, m', m) and (b, m, m')
///      \   m   /
std::vector<uint32_t> triangles_along(const TriangleSurface& surface) {
  std::vector<uint32_t> along(surface.half_edges());
  uint32_t count = 0;
  for (uint32_t h = 0; h < surface.half_edges(); ++h) {
    const uint32_t other = surface.opposite[h];
    if (other != none && other < h) continue;
    along[h] = count++;
    if (other != none) along[other] = count++;
  }
  return along;
}

void pair_up(TriangleSurface& surface, uint32_t a, uint32_t b) {
  surface.opposite[a] = b;
  surface.opposite[b] = a;
}

/// Nine triangles for each of some.
///
///     c
///     7 6            where points lie: corners a, b, c, two on each side in the order of the triangle's
///     half-edges, 8 9 5          and 9 in its middle a 3 4 b
class Trisector {
 public:
  Trisector(const SurfaceBlock& block, RingWeights& weights, bool first_ring)
      : surface_(block.surface),
        along_(triangles_along(surface_)),
        turned_(turned(surface_, weights)),
        predictor_(turned_, weights),
        thirds_(surface_.half_edges(), none),
        order_(split_order(block, first_ring)) {
    result_.points = turned_.points;
  }

  TriangleSurface split() {
    result_.corners.resize(size_t{27} * order_.count);
    result_.opposite.resize(size_t{27} * order_.count, none);
    for (uint32_t t = 0; t < surface_.triangles(); ++t) {
      if (order_.numbers[t] == none) continue;
      write_corners(t);
      write_opposites(t);
    }
    return std::move(result_);
  }

 private:
  uint32_t add(const Position& point) {
    result_.points.push_back(point);
    return static_cast<uint32_t>(result_.points.size() - 1);
  }
  /// The point a third of the way along h.
  uint32_t third(uint32_t h) {
    if (thirds_[h] != none) return thirds_[h];
    if (surface_.opposite[h] != none) return thirds_[h] = add(predictor_.triangle_middle(along_[h]));
    thirds_[h] = add(predictor_.border_third(3 * along_[h]));
    // Follows the first third at once, so that two_thirds() is the next number.
    add(predictor_.border_two_thirds(3 * along_[h]));
    return thirds_[h];
  }
  uint32_t two_thirds(uint32_t h) {
    return surface_.opposite[h] != none ? third(surface_.opposite[h]) : third(h) + 1;
  }

  void write_corners(uint32_t t) {
    static constexpr uint8_t parts[27] = {0, 3, 8, 3, 4, 9, 4, 1, 5, 8, 9, 7, 9, 5,
                                          6, 7, 6, 2, 3, 9, 8, 4, 5, 9, 9, 6, 7};
    const uint32_t h = 3 * t;
    const uint32_t middle = static_cast<uint32_t>(surface_.points.size()) + t;
    const uint32_t lattice[10] = {surface_.corners[h],     surface_.corners[h + 1],
                                  surface_.corners[h + 2], third(h),
                                  two_thirds(h),           third(h + 1),
                                  two_thirds(h + 1),       third(h + 2),
                                  two_thirds(h + 2),       middle};
    uint32_t* out = result_.corners.data() + size_t{27} * order_.numbers[t];
    for (const uint8_t part : parts) *out++ = lattice[part];
  }

  /// Half-edge of the new triangles that is the k-th third of an old one.
  uint32_t part_of(uint32_t h, unsigned k) const {
    // Half-edges of the nine triangles in the order of `parts` above, counted along each side of the old one.
    static constexpr uint8_t sides[3][3] = {{0, 3, 6}, {7, 13, 16}, {17, 11, 2}};
    return 27 * order_.numbers[h / 3] + sides[h % 3][k];
  }
  void write_opposites(uint32_t t) {
    // Of the three triangles that stand on their tips, with those around them.
    static constexpr uint8_t inside[9][2] = {{18, 5}, {19, 9},  {20, 1},  {21, 8}, {22, 12},
                                             {23, 4}, {24, 14}, {25, 15}, {26, 10}};
    for (const auto& pair : inside)
      pair_up(result_, 27 * order_.numbers[t] + pair[0], 27 * order_.numbers[t] + pair[1]);
    for (uint32_t h = 3 * t; h < 3 * t + 3; ++h) {
      const uint32_t other = surface_.opposite[h];
      if (other == none || order_.numbers[other / 3] == none) continue;
      for (unsigned k = 0; k < 3; ++k) pair_up(result_, part_of(h, k), part_of(other, 2 - k));
    }
  }

  const TriangleSurface& surface_;
  std::vector<uint32_t> along_;
  TriangleSurface turned_;
  PointPredictor predictor_;      // of points in triangles of turned_
  std::vector<uint32_t> thirds_;  // by half-edge: the new point closer to its origin
  SplitOrder order_;
  TriangleSurface result_;
};

}  // namespace

/// The corners of each new triangle begin at an old point, and at a border with the border's edge, on which
/// Trisector relies.
TriangleSurface turned(const TriangleSurface& surface, RingWeights& weights) {
  PointPredictor predictor(surface, weights);
  TriangleSurface result;
  result.points = surface.points;
  const auto first_new = static_cast<uint32_t>(surface.points.size());
  for (uint32_t t = 0; t < surface.triangles(); ++t) result.points.push_back(predictor.triangle_middle(t));

  const std::vector<uint32_t> along = triangles_along(surface);
  result.corners.resize(size_t{3} * surface.half_edges());
  result.opposite.resize(result.corners.size(), none);
  for (uint32_t h = 0; h < surface.half_edges(); ++h) {
    const uint32_t other = surface.opposite[h];
    uint32_t* corner = result.corners.data() + size_t{3} * along[h];
    corner[0] = surface.origin(h);
    corner[1] = other == none ? surface.target(h) : first_new + other / 3;
    corner[2] = first_new + h / 3;
    if (other != none) pair_up(result, 3 * along[h] + 1, 3 * along[other] + 1);
    // From the middle to the origin of h; across lies what is along the half-edge that ends there.
    const uint32_t before = TriangleSurface::previous(h);
    const uint32_t across = surface.opposite[before];
    pair_up(result, 3 * along[h] + 2, across == none ? 3 * along[before] + 1 : 3 * along[across]);
  }
  return result;
}

SurfaceBlock trisected(const SurfaceBlock& block, RingWeights& weights, unsigned rings) {
  TriangleSurface fine = Trisector(block, weights, rings > 0).split();
  if (rings == 0) return {std::move(fine), 9 * block.inner};
  return BlockCutter(fine).cut(0, 9 * block.inner, rings);
}

}  // namespace maille
