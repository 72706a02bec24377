#pragma once

#include <optional>

#include "surface/arrays/array_coder.h"
#include "surface/arrays/corner_faces.h"

namespace maille {

/// What is around the elements of a patch, found when an array first asks for it and kept for the next ones:
/// arrays of one patch share references of points and of cells. Encoder and decoder find the same. Not for
/// several threads at once.
class ArrayAround {
 public:
  explicit ArrayAround(const PatchElements& elements) : elements_(elements) {}

  const CornerFaces& faces();
  /// The same with the number of each corner in PatchElements, which arrays of corners need: where half-edges
  /// were built, corners are numbered as these are, so those of flipped faces change places.
  const CornerFaces& numbered_faces();
  /// References of points.
  /// References of points, by the faces in which each comes up; of cells, by neighbours before them. They
  /// know everything at once, so the coder of positions never waits for them.
  FanDecoder& points();
  FanDecoder& cells();

 private:
  PatchElements elements_;
  std::optional<CornerFaces> faces_;
  std::optional<FanDecoder> points_, cells_;
};

}  // namespace maille
