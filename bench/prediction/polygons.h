#pragma once

#include <array>
#include <string>
#include <vector>

#include "triangles.h"

// The third experiment: corners of a face beside a known one.
namespace maille::bench {

/// A face with the corners of a polygon mesh.
using Face = std::vector<uint32_t>;

/// A new corner of a face, and what is known before it.
struct CornerSample {
  unsigned known_degree;  ///< of the face beside
  unsigned degree;        ///< of the face itself
  unsigned known;         ///< new corners before this one
  Point target;
  std::vector<Point> points;  ///< of the face beside from the common edge on, then the new corners
};

/// One sample for each corner of each face that is not on the edge by which the face is entered: the walk is
/// breadth first, and every corner counts as new. Degrees 3 to 6.
std::vector<CornerSample> find_corners(const std::vector<Face>& faces, const std::vector<Point>& points);

enum class CornerRule {
  parallelogram,  ///< across the edge for the first corner, within the face for others (Isenburg and Alliez
                  ///< 2002)
  alone,          ///< continue the face's own corners, the two of the common edge among them
  beside,         ///< the same with the face beside, at a level of noise in the codecs' tables
};
std::vector<Point> residuals(const std::vector<CornerSample>& samples, CornerRule rule, unsigned level);

/// By least squares for each combination of degrees and known corners.
std::vector<Point> fitted_residuals(const std::vector<CornerSample>& samples);

}  // namespace maille::bench
