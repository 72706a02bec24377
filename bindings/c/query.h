#pragma once

#include <maille.h>

#include <maille/random_access.h>
#include <maille/volume_file.h>
#include <optional>

struct maille_query {
  maille::VolumeQuery volume;            ///< its region is that of surfaces, too
  std::optional<maille::Detail> detail;  ///< none: the mesh itself
  std::optional<uint64_t> most_faces;
};

namespace maille::c {

inline Vector3 vector(const double x[3]) {
  return {{x[0], x[1], x[2]}};
}
/// A plane whose normal may have any length but 0.
Result<Region::Plane> plane_of(const double normal[3], double offset);

}  // namespace maille::c
