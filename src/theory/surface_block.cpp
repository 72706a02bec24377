#include "theory/surface_block.h"

namespace maille {

namespace {}  // namespace

SplitOrder split_order(const SurfaceBlock& block, bool first_ring) {
  const TriangleSurface& surface = block.surface;
  SplitOrder order{std::vector<uint32_t>(surface.triangles(), none), 0};
  for (uint32_t t = 0; t < block.inner; ++t) order.numbers[t] = order.count++;
  if (!first_ring) return order;
  std::vector<bool> touched(surface.points.size());
  for (uint32_t h = 0; h < 3 * block.inner; ++h) touched[surface.corners[h]] = true;
  for (uint32_t h = 3 * block.inner; h < surface.half_edges(); ++h) {
    if (touched[surface.corners[h]] && order.numbers[h / 3] == none) order.numbers[h / 3] = order.count++;
  }
  return order;
}

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

/// All triangles at a point of those chosen so far, in the order in which these were chosen: the same on
/// every machine.
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

/// Points get names as they come up in the chosen triangles; links to triangles that were not chosen become
/// borders.
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

SurfaceBlock BlockCutter::cut(uint32_t first, uint32_t end, unsigned rings) {
  for (uint32_t t = first; t < end; ++t) choose(t);
  for (unsigned ring = 0; ring < rings; ++ring) choose_ring();
  SurfaceBlock block{chosen_surface(), end - first};
  for (const uint32_t triangle : chosen_) {
    // Names are taken back one by one: clearing whole tables would be linear in the surface for each block.
    triangle_names_[triangle] = none;
    for (uint32_t h = 3 * triangle; h < 3 * triangle + 3; ++h) point_names_[surface_.corners[h]] = none;
  }
  chosen_.clear();
  return block;
}

}  // namespace maille
