#include "check.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace maille::bench {
namespace {

uint64_t mix(uint64_t a, uint64_t b) {
  uint64_t h = (a ^ (b + 0x9e3779b97f4a7c15U + (a << 6) + (a >> 2))) * 0xff51afd7ed558ccdU;
  h = (h ^ (h >> 33)) * 0xc4ceb9fe1a85ec53U;
  return h ^ (h >> 29);
}

std::vector<uint64_t> hash_points(const std::vector<float>& xyz) {
  std::vector<uint64_t> hashes(xyz.size() / 3);
  for (size_t i = 0; i < hashes.size(); ++i) {
    uint64_t h = 1;
    for (size_t axis = 0; axis < 3; ++axis) {
      uint32_t bits;
      std::memcpy(&bits, &xyz[3 * i + axis], sizeof(bits));
      h = mix(h, bits);
    }
    hashes[i] = h;
  }
  return hashes;
}

// Sums do not depend on the order of what is summed.
struct Sums {
  size_t vertices = 0, referenced = 0, faces = 0, degenerate = 0;
  uint64_t points = 0;  ///< over all points
  uint64_t proper = 0;  ///< over faces with distinct corners
  uint64_t all_faces = 0;
};

// A face is a cycle: the sum over its corners of (corner, next, next but one) does not depend on where it
// starts, but on the way round.
uint64_t hash_face(const uint32_t* corners, size_t degree, const std::vector<uint64_t>& points) {
  uint64_t sum = degree;
  for (size_t i = 0; i < degree; ++i) {
    sum += mix(mix(points[corners[i]], points[corners[(i + 1) % degree]]), points[corners[(i + 2) % degree]]);
  }
  return mix(sum, degree);
}

bool has_distinct_corners(const uint32_t* corners, size_t degree) {
  std::vector<uint32_t> sorted(corners, corners + degree);
  std::sort(sorted.begin(), sorted.end());
  return degree >= 3 && std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
}

Sums sum_up(const Surface& surface) {
  const std::vector<uint64_t> points = hash_points(surface.xyz);
  Sums sums;
  sums.vertices = surface.vertices();
  for (const uint64_t h : points) sums.points += mix(h, 7);
  std::vector<bool> used(points.size());
  for (const uint32_t corner : surface.corners) used[corner] = true;
  sums.referenced = static_cast<size_t>(std::count(used.begin(), used.end(), true));
  size_t first = 0;
  for (size_t face = 0; face < surface.faces(); ++face) {
    const size_t degree = surface.degrees.empty() ? 3 : surface.degrees[face];
    const uint64_t h = hash_face(&surface.corners[first], degree, points);
    sums.all_faces += h;
    if (has_distinct_corners(&surface.corners[first], degree)) {
      sums.proper += h;
    } else {
      ++sums.degenerate;
    }
    first += degree;
  }
  sums.faces = surface.faces();
  return sums;
}

bool indices_hold(const Surface& surface) {
  return std::all_of(surface.corners.begin(), surface.corners.end(),
                     [&](uint32_t corner) { return corner < surface.vertices(); });
}

std::vector<float> sorted_corners(const Surface& surface, size_t axis) {
  std::vector<float> values;
  values.reserve(surface.corners.size());
  for (const uint32_t corner : surface.corners) values.push_back(surface.xyz[3 * size_t{corner} + axis]);
  std::sort(values.begin(), values.end());
  return values;
}

void remark(std::string& verdict, const std::string& text) {
  verdict += (verdict.empty() ? "" : ", ") + text;
}

}  // namespace

Check check_round_trip(const Surface& original, const Surface& decoded) {
  if (!indices_hold(decoded)) return {false, "an index has no vertex"};
  const Sums a = sum_up(original), b = sum_up(decoded);
  Check check;
  check.ok = a.proper == b.proper && a.faces - a.degenerate == b.faces - b.degenerate;
  if (!check.ok) remark(check.verdict, "faces differ");
  if (b.degenerate < a.degenerate) {
    remark(check.verdict, std::to_string(a.degenerate - b.degenerate) + " degenerate faces dropped");
  } else if (check.ok && a.all_faces != b.all_faces) {
    remark(check.verdict, "degenerate faces differ");
  }
  const size_t unreferenced = a.vertices - a.referenced;
  const bool dropped = b.vertices == b.referenced && unreferenced > 0;
  if (dropped) remark(check.verdict, std::to_string(unreferenced) + " unreferenced vertices dropped");
  if (b.referenced > a.referenced) {
    remark(check.verdict, std::to_string(b.referenced - a.referenced) + " vertices split");
  } else if (b.referenced < a.referenced) {
    remark(check.verdict, std::to_string(a.referenced - b.referenced) + " vertices lost");
  }
  if (check.ok && check.verdict.empty() && a.points != b.points) {
    check = {false, "vertices differ"};
  }
  if (check.verdict.empty()) check.verdict = "exact";
  return check;
}

Check check_within(const Surface& original, const Surface& decoded, double tolerance) {
  if (!indices_hold(decoded)) return {false, "an index has no vertex"};
  if (original.vertices() != decoded.vertices()) return {false, "number of vertices differs"};
  if (original.corners.size() != decoded.corners.size()) return {false, "number of corners differs"};
  double worst = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    const std::vector<float> a = sorted_corners(original, axis), b = sorted_corners(decoded, axis);
    for (size_t i = 0; i < a.size(); ++i) worst = std::max<double>(worst, std::abs(a[i] - b[i]));
  }
  if (worst > tolerance) return {false, "vertices differ by more than half a step"};
  return {true, "within half a step"};
}

Surface as_triangles(const Surface& polygons, const std::vector<uint32_t>& triangles) {
  return {polygons.xyz, {}, triangles};
}

}  // namespace maille::bench
