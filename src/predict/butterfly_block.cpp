#include "predict/butterfly_block.h"

namespace maille {

namespace {

constexpr uint32_t none = TriangleSurface::border;

/// Makes four triangles of each of some triangles; points in the middle of their edges are predicted from the
/// whole surface.
class Splitter {
 public:
  Splitter(const TriangleSurface& surface, uint32_t inner, RingWeights& weights)
      : surface_(surface),
        predictor_(surface, weights),
        middles_(surface.half_edges(), none),
        order_(surface.triangles(), none) {
    result_.points = surface.points;
    for (uint32_t t = 0; t < inner; ++t) order_[t] = split_++;
  }
  void add_first_ring(uint32_t inner) {
    std::vector<bool> touched(surface_.points.size());
    for (uint32_t h = 0; h < 3 * inner; ++h) touched[surface_.corners[h]] = true;
    for (uint32_t h = 3 * inner; h < surface_.half_edges(); ++h) {
      if (touched[surface_.corners[h]] && order_[h / 3] == none) order_[h / 3] = split_++;
    }
  }
  TriangleSurface split() {
    result_.corners.resize(size_t{12} * split_);
    result_.opposite.resize(size_t{12} * split_, none);
    for (uint32_t t = 0; t < surface_.triangles(); ++t) {
      if (order_[t] == none) continue;
      for (uint32_t h = 3 * t; h < 3 * t + 3; ++h) find_middle(h);
      write_corners(t);
      write_opposites(t);
    }
    return std::move(result_);
  }

 private:
  void find_middle(uint32_t h) {
    if (middles_[h] != none) return;
    middles_[h] = static_cast<uint32_t>(result_.points.size());
    if (surface_.opposite[h] != none) middles_[surface_.opposite[h]] = middles_[h];
    result_.points.push_back(predictor_.edge_middle(h));
  }
  void write_corners(uint32_t t) {
    const uint32_t* corner = surface_.corners.data() + 3 * t;
    const uint32_t* middle = middles_.data() + 3 * t;
    uint32_t* out = result_.corners.data() + 12 * order_[t];
    for (unsigned i = 0; i < 3; ++i) {
      *out++ = corner[i];
      *out++ = middle[i];
      *out++ = middle[(i + 2) % 3];
    }
    for (unsigned i = 0; i < 3; ++i) *out++ = middle[i];
  }
  /// Of the twelve half-edges of the new triangles, 0, 3, 6 are the first halves of the old ones, 5, 8, 2 the
  /// second ones, and 9, 10, 11 those of the middle, across from 4, 7, 1.
  void write_opposites(uint32_t t) {
    for (unsigned i = 0; i < 3; ++i) {
      const uint32_t inner = 12 * order_[t] + 9 + i;
      const uint32_t outer = 12 * order_[t] + (i + 1) % 3 * 3 + 1;
      result_.opposite[inner] = outer;
      result_.opposite[outer] = inner;
      const uint32_t other = surface_.opposite[3 * t + i];
      if (other == none || order_[other / 3] == none) continue;
      result_.opposite[first_half(3 * t + i)] = second_half(other);
      result_.opposite[second_half(3 * t + i)] = first_half(other);
    }
  }
  uint32_t first_half(uint32_t h) const { return 12 * order_[h / 3] + h % 3 * 3; }
  uint32_t second_half(uint32_t h) const { return 12 * order_[h / 3] + (h + 1) % 3 * 3 + 2; }

  const TriangleSurface& surface_;
  PointPredictor predictor_;
  std::vector<uint32_t> middles_;  // by half-edge
  std::vector<uint32_t> order_;    // by triangle; none: is not split
  uint32_t split_ = 0;
  TriangleSurface result_;
};

}  // namespace

BlockCutter::BlockCutter(const TriangleSurface& surface)
    : surface_(surface),
      first_(surface.points.size() + 1),
      triangles_(surface.half_edges()),
      triangle_names_(surface.triangles(), none),
      point_names_(surface.points.size(), none) {
  for (const uint32_t corner : surface.corners) ++first_[corner + 1];
  for (size_t v = 1; v < first_.size(); ++v) first_[v] += first_[v - 1];
  std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
  for (uint32_t h = 0; h < surface.half_edges(); ++h) triangles_[next[surface.corners[h]]++] = h / 3;
}

void BlockCutter::choose(uint32_t triangle) {
  if (triangle_names_[triangle] != none) return;
  triangle_names_[triangle] = static_cast<uint32_t>(chosen_.size());
  chosen_.push_back(triangle);
}

void BlockCutter::choose_ring() {
  const size_t before = chosen_.size();
  for (size_t i = 0; i < before; ++i) {
    for (uint32_t h = 3 * chosen_[i]; h < 3 * chosen_[i] + 3; ++h) {
      const uint32_t v = surface_.corners[h];
      for (uint32_t k = first_[v]; k < first_[v + 1]; ++k) choose(triangles_[k]);
    }
  }
}

uint32_t BlockCutter::point(uint32_t old, std::vector<Position>& points) {
  if (point_names_[old] == none) {
    point_names_[old] = static_cast<uint32_t>(points.size());
    points.push_back(surface_.points[old]);
  }
  return point_names_[old];
}

TriangleSurface BlockCutter::chosen_surface() {
  TriangleSurface result;
  for (const uint32_t triangle : chosen_) {
    for (uint32_t h = 3 * triangle; h < 3 * triangle + 3; ++h) {
      result.corners.push_back(point(surface_.corners[h], result.points));
      const uint32_t other = surface_.opposite[h];
      const uint32_t name = other == none ? none : triangle_names_[other / 3];
      result.opposite.push_back(name == none ? none : 3 * name + other % 3);
    }
  }
  return result;
}

ButterflyBlock BlockCutter::cut(uint32_t first, uint32_t end, unsigned rings) {
  for (uint32_t t = first; t < end; ++t) choose(t);
  for (unsigned ring = 0; ring < rings; ++ring) choose_ring();
  ButterflyBlock block{chosen_surface(), end - first};
  for (const uint32_t triangle : chosen_) {
    triangle_names_[triangle] = none;
    for (uint32_t h = 3 * triangle; h < 3 * triangle + 3; ++h) point_names_[surface_.corners[h]] = none;
  }
  chosen_.clear();
  return block;
}

ButterflyBlock refined(const ButterflyBlock& block, RingWeights& weights, unsigned rings) {
  Splitter splitter(block.surface, block.inner, weights);
  if (rings > 0) splitter.add_first_ring(block.inner);
  TriangleSurface fine = splitter.split();
  if (rings == 0) return {std::move(fine), 4 * block.inner};
  return BlockCutter(fine).cut(0, 4 * block.inner, rings);
}

}  // namespace maille
