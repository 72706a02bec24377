#pragma once

#include <maille/generate.h>
#include <memory>
#include <span>
#include <vector>

namespace maille {

/// The surfaces of a description, ready for nearest points.
class Surfaces {
 public:
  Surfaces();
  Surfaces(Surfaces&&) noexcept;
  ~Surfaces();

  /// Checks all that is said of surfaces and of what lies on them. Error (malformed_input): a radius that is
  /// not positive, an axis or a normal without direction, numbers that are not finite, no triangles, a
  /// surface, vertex or corner that does not exist.
  static Result<Surfaces> make(const BlockDescription& description);

  /// The nearest point of the surface; the point itself, if that is farther away than the surface is large
  /// (the diagonal of its box). Of several: where the way from one to the next and round again ends,
  /// or is after many rounds; for surfaces that meet, a point of all of them.
  Position project(Position at, std::span<const uint32_t> surfaces) const;

 private:
  class Surface;
  std::vector<std::unique_ptr<Surface>> surfaces_;
};

}  // namespace maille
