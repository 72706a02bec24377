#include "random/read/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "random/mesh_geometry.h"

namespace maille {

TriangleTree::TriangleTree(std::span<const uint32_t> triangles, std::span<const float> positions)
    : triangles_(triangles), positions_(positions) {
  std::vector<Placed> placed(triangles.size() / 3);
  for (uint32_t i = 0; i < placed.size(); ++i) {
    for (unsigned c = 0; c < 3; ++c) {
      const Vector3 corner = position(triangles_[size_t{3} * i + c]);
      enclose(placed[i].box, corner, c == 0);
      placed[i].corners = c == 0 ? corner : placed[i].corners + corner;
    }
  }
  nodes_.reserve(placed.size() / 2);
  order_.resize(placed.size());
  std::iota(order_.begin(), order_.end(), 0u);
  if (!placed.empty()) build(placed, 0, static_cast<uint32_t>(placed.size()));
}

/// In two at the middle of the longest side, or where that leaves less than a fourth on a side, in halves.
// The recursion is as deep as the tree: each side keeps a fourth at least, so 77 levels are enough for 2^32
// triangles (see search()).
uint32_t TriangleTree::build(const std::vector<Placed>& placed, uint32_t begin, uint32_t end) {
  const auto at = static_cast<uint32_t>(nodes_.size());
  Box box = placed[order_[begin]].box;
  for (uint32_t i = begin + 1; i < end; ++i) {
    const Box& one = placed[order_[i]].box;
    for (unsigned k = 0; k < 3; ++k) {
      box.low[k] = std::min(box.low[k], one.low[k]);
      box.high[k] = std::max(box.high[k], one.high[k]);
    }
  }
  nodes_.push_back({box, begin, end, 0});
  if (end - begin <= leaf_size) return at;
  const Vector3 size = box.high - box.low;
  const unsigned axis = size[0] >= size[1] && size[0] >= size[2] ? 0 : size[1] >= size[2] ? 1 : 2;
  const double middle = 1.5 * (box.low[axis] + box.high[axis]);  // of the sums of three
  const auto first = order_.begin() + begin, last = order_.begin() + end;
  const auto low_end =
      std::partition(first, last, [&](uint32_t i) { return placed[i].corners[axis] < middle; });
  auto half = begin + static_cast<uint32_t>(low_end - first);
  if (std::min(half - begin, end - half) < (end - begin) / 4) {
    half = begin + (end - begin) / 2;
    std::nth_element(first, order_.begin() + half, last, [&placed, axis](uint32_t a, uint32_t b) {
      const double x = placed[a].corners[axis], y = placed[b].corners[axis];
      return x != y ? x < y : a < b;
    });
  }
  build(placed, begin, half);
  const uint32_t right = build(placed, half, end);
  nodes_[at].right = right;
  return at;
}

double TriangleTree::to_triangle(const Vector3& p, uint32_t triangle) const {
  const uint32_t* v = &triangles_[size_t{3} * triangle];
  return maille::squared_distance(p, position(v[0]), position(v[1]), position(v[2]));
}

template <class See>
/// Looks at triangles whose boxes are nearer than `bound`, a squared distance that `see` may lower meanwhile,
/// until it is at most `enough`, or `most` boxes were opened.
void TriangleTree::search(const Vector3& from, const double& bound, double enough, unsigned most,
                          See see) const {
  if (nodes_.empty()) return;
  std::array<uint32_t, 96> stack;  // one for each level: 3/4 to the power of 77 is 2 to the power of -32
  unsigned size = 0;
  stack[size++] = 0;
  while (size > 0 && bound > enough) {
    const uint32_t at = stack[--size];
    const Node& node = nodes_[at];
    if (maille::squared_distance(from, node.box) >= bound) continue;
    if (most-- == 0) return;
    if (node.right == 0) {
      for (uint32_t i = node.begin; i < node.end; ++i) see(order_[i]);
      continue;
    }
    const Node &left = nodes_[at + 1], &right = nodes_[node.right];
    // The nearer child goes first, so that the bound shrinks before the other one is looked at.
    const bool left_first =
        maille::squared_distance(from, left.box) <= maille::squared_distance(from, right.box);
    stack[size++] = left_first ? node.right : at + 1;
    stack[size++] = left_first ? at + 1 : node.right;
  }
}

double TriangleTree::squared_distance(const Vector3& from, double bound, double enough, unsigned most) const {
  search(from, bound, enough, most, [&](uint32_t i) { bound = std::min(bound, to_triangle(from, i)); });
  return bound;
}

uint32_t TriangleTree::nearest(const Vector3& from) const {
  double bound = std::numeric_limits<double>::infinity();
  uint32_t found = 0;
  search(from, bound, -1, ~0u, [&](uint32_t i) {
    const double distance = to_triangle(from, i);
    // Not "distance >= bound": a distance that is no number is never the nearest.
    if (!(distance < bound)) return;
    bound = distance;
    found = i;
  });
  return found;
}

}  // namespace maille
