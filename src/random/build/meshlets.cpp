// Pieces of a chart for renderers: grown from triangle to triangle, by the fewest new points.
#include <maille/random_access.h>

#include <algorithm>
#include <array>
#include <tuple>

#include "mesh/none.h"
#include "random/mesh_geometry.h"

namespace maille {
namespace {

using Corners = std::array<uint32_t, 3>;

/// Greedy: a piece takes the candidate beside it that needs the fewest new points, until it is full. All ties
/// end at the lowest number, so that the same chart always gives the same pieces. Each triangle is a
/// candidate of a piece once at most; best() looks at all of them, which is what the time depends on where
/// many triangles meet at a point.
class MeshletBuilder {
 public:
  explicit MeshletBuilder(const Mesh& mesh) {
    uint32_t face = 0;
    for (const CellBlock& block : mesh.blocks) {
      for (uint64_t i = 0; i < block.size(); ++i, ++face) {
        if (!is_face(block.type_of(i))) continue;
        for_each_fan_triangle(mesh.points, block.cell(i), [&](uint32_t a, uint32_t b, uint32_t c) {
          triangles_.push_back({a, b, c});
          faces_.push_back(face);
        });
      }
    }
    list_triangles(mesh.point_count());
  }

  Meshlets run() {
    uint32_t first = 0;
    for (;;) {
      while (first < triangles_.size() && used_[first]) ++first;
      if (first == triangles_.size()) return std::move(result_);
      begin();
      // Of what does not hang together the next triangle is as good as any.
      for (uint32_t next = first; next < triangles_.size() && grow(next);) {
        while (next < triangles_.size() && used_[next]) ++next;
      }
    }
  }

 private:
  /// The triangles of each point.
  void list_triangles(uint64_t points) {
    first_.assign(points + 1, 0);
    for (const Corners& t : triangles_) {
      for (const uint32_t p : t) ++first_[p + 1];
    }
    for (size_t p = 0; p < points; ++p) first_[p + 1] += first_[p];
    left_.resize(points);
    for (size_t p = 0; p < points; ++p) left_[p] = first_[p + 1] - first_[p];
    at_.resize(3 * triangles_.size());
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for (uint32_t i = 0; i < triangles_.size(); ++i) {
      for (const uint32_t p : triangles_[i]) at_[next[p]++] = i;
    }
    place_.assign(points, none);
    used_.assign(triangles_.size(), false);
    offered_in_.assign(triangles_.size(), none);
  }

  Meshlets::Piece& piece() { return result_.pieces.back(); }
  void begin() {
    for (const uint32_t p : points_) place_[p] = none;
    points_.clear();
    candidates_.clear();
    result_.pieces.push_back(
        {static_cast<uint32_t>(result_.points.size()), 0, static_cast<uint32_t>(result_.faces.size()), 0});
  }

  uint32_t new_points(uint32_t triangle) const {
    uint32_t count = 0;
    for (const uint32_t p : triangles_[triangle]) count += place_[p] == none;
    return count;
  }
  /// Adds a triangle and what grows from it. False: the piece is full.
  bool grow(uint32_t seed) {
    if (!fits(seed)) return false;
    for (uint32_t triangle = seed; triangle != none; triangle = best()) {
      if (!fits(triangle)) return false;
      take(triangle);
    }
    return true;
  }
  bool fits(uint32_t triangle) {
    return piece().triangles < most_meshlet_triangles &&
           points_.size() + new_points(triangle) <= most_meshlet_points;
  }

  /// With the fewest new points; then where the fewest triangles are left, so that none stay behind alone.
  uint32_t best() {
    using Score = std::tuple<uint32_t, uint32_t, uint32_t>;
    Score least{none, none, none};
    size_t kept = 0;
    for (const uint32_t triangle : candidates_) {
      if (used_[triangle]) continue;
      candidates_[kept++] = triangle;
      uint32_t left = 0;
      for (const uint32_t p : triangles_[triangle]) left += left_[p];
      least = std::min(least, Score{new_points(triangle), left, triangle});
    }
    candidates_.resize(kept);
    return std::get<2>(least);
  }

  void take(uint32_t triangle) {
    used_[triangle] = true;
    for (const uint32_t p : triangles_[triangle]) {
      if (place_[p] == none) add_point(p);
      --left_[p];
      // Places are below most_meshlet_points, 64.
      result_.corners.push_back(static_cast<uint8_t>(place_[p]));
    }
    result_.faces.push_back(faces_[triangle]);
    ++piece().triangles;
  }
  void add_point(uint32_t p) {
    place_[p] = piece().points++;
    points_.push_back(p);
    result_.points.push_back(p);
    const auto number = static_cast<uint32_t>(result_.pieces.size());
    for (uint32_t i = first_[p]; i < first_[p + 1]; ++i) {
      const uint32_t triangle = at_[i];
      if (used_[triangle] || offered_in_[triangle] == number) continue;
      offered_in_[triangle] = number;
      candidates_.push_back(triangle);
    }
  }

  std::vector<Corners> triangles_;
  std::vector<uint32_t> faces_, first_, at_;
  std::vector<uint32_t> left_;        ///< by point: triangles that are in no piece
  std::vector<uint32_t> place_;       ///< by point: in the present piece
  std::vector<uint32_t> offered_in_;  ///< by triangle: the piece that it was last a candidate of
  std::vector<bool> used_;
  std::vector<uint32_t> points_, candidates_;
  Meshlets result_;
};

}  // namespace

Meshlets meshlets(const Mesh& mesh) {
  return MeshletBuilder(mesh).run();
}

}  // namespace maille
