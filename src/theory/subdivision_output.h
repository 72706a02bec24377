#pragma once

#include <maille/subdivide.h>

#include <string>
#include <vector>

#include "base/result.h"
#include "theory/triangle_surface.h"

namespace maille {

/// To be asked before anything is written: numbers of points have 32 bits. Error: usage.
inline Result<> check_point_count(uint64_t points) {
  if (points <= max_points) return {};
  return failure(ErrorCode::usage, "the result would have " + std::to_string(points) +
                                       " points, more than a mesh can; take fewer levels");
}

/// Gathers numbers for an output, so that it is not called for each triangle. flush() must be called behind
/// the last point and at the end.
class BufferedOutput {
 public:
  explicit BufferedOutput(SubdivisionOutput& output) : output_(output) {}

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
  // 16,384 points or triangles, up to 400 kB. Chosen, not swept.
  static constexpr size_t enough = 3 << 14;
  SubdivisionOutput& output_;
  std::vector<double> coordinates_;
  std::vector<uint32_t> corners_;
};

}  // namespace maille
