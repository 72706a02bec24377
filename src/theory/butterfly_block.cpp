#include "theory/butterfly_block.h"

namespace maille {

namespace {

/// Makes four triangles of each of some triangles; points in the middle of their edges are predicted from the
/// whole block. New triangles come in the order of SplitOrder, those of one at its corners first, then in its
/// middle.
class Splitter {
 public:
  Splitter(const SurfaceBlock& block, RingWeights& weights, bool first_ring)
      : surface_(block.surface),
        predictor_(surface_, weights),
        middles_(surface_.half_edges(), none),
        order_(split_order(block, first_ring)) {
    result_.points = surface_.points;
  }
  TriangleSurface split() {
    result_.corners.resize(size_t{12} * order_.count);
    result_.opposite.resize(size_t{12} * order_.count, none);
    for (uint32_t t = 0; t < surface_.triangles(); ++t) {
      if (order_.numbers[t] == none) continue;
      for (uint32_t h = 3 * t; h < 3 * t + 3; ++h) find_middle(h);
      write_corners(t);
      write_opposites(t);
    }
    return std::move(result_);
  }

 private:
  /// Both half-edges of an edge share one middle, made by the triangle that comes first.
  void find_middle(uint32_t h) {
    if (middles_[h] != none) return;
    middles_[h] = static_cast<uint32_t>(result_.points.size());
    if (surface_.opposite[h] != none) middles_[surface_.opposite[h]] = middles_[h];
    result_.points.push_back(predictor_.edge_middle(h));
  }
  void write_corners(uint32_t t) {
    const uint32_t* corner = surface_.corners.data() + 3 * t;
    const uint32_t* middle = middles_.data() + 3 * t;
    uint32_t* out = result_.corners.data() + 12 * order_.numbers[t];
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
      const uint32_t inner = 12 * order_.numbers[t] + 9 + i;
      const uint32_t outer = 12 * order_.numbers[t] + (i + 1) % 3 * 3 + 1;
      result_.opposite[inner] = outer;
      result_.opposite[outer] = inner;
      const uint32_t other = surface_.opposite[3 * t + i];
      // A neighbour that is not split stays apart: it lies beyond the rings that are wanted.
      if (other == none || order_.numbers[other / 3] == none) continue;
      result_.opposite[first_half(3 * t + i)] = second_half(other);
      result_.opposite[second_half(3 * t + i)] = first_half(other);
    }
  }
  uint32_t first_half(uint32_t h) const { return 12 * order_.numbers[h / 3] + h % 3 * 3; }
  uint32_t second_half(uint32_t h) const { return 12 * order_.numbers[h / 3] + (h + 1) % 3 * 3 + 2; }

  const TriangleSurface& surface_;
  PointPredictor predictor_;
  std::vector<uint32_t> middles_;  // by half-edge
  SplitOrder order_;
  TriangleSurface result_;
};

}  // namespace

SurfaceBlock refined(const SurfaceBlock& block, RingWeights& weights, unsigned rings) {
  TriangleSurface fine = Splitter(block, weights, rings > 0).split();
  if (rings == 0) return {std::move(fine), 4 * block.inner};
  return BlockCutter(fine).cut(0, 4 * block.inner, rings);
}

}  // namespace maille
