#pragma once

#include <optional>

#include "surface/arrays/array_coder.h"
#include "surface/arrays/corner_faces.h"

namespace maille {

/// What is around the elements of a patch, found when an array first asks for it.
class ArrayAround {
 public:
  explicit ArrayAround(const PatchElements& elements) : elements_(elements) {}

  const CornerFaces& faces();
  /// The same, once half-edges are there, for arrays of corners.
  const CornerFaces& numbered_faces();
  /// References of points.
  FanDecoder& points();
  FanDecoder& cells();

 private:
  PatchElements elements_;
  std::optional<CornerFaces> faces_;
  std::optional<FanDecoder> points_, cells_;
};

}  // namespace maille
