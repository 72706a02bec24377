#include <maille/subdivide.h>

#include "base/result.h"
#include "theory/butterfly.h"
#include "theory/sqrt3.h"

namespace maille {

Result<> subdivide(const Mesh& mesh, const SubdivisionOptions& options, SubdivisionOutput& output) {
  if (options.levels < 1) return failure(ErrorCode::usage, "there is nothing to subdivide in 0 levels");
  TriangleSurface surface = MAILLE_TRY(triangle_surface(mesh));
  if (options.scheme == SubdivisionScheme::sqrt3)
    return subdivide_by_sqrt3(std::move(surface), options.levels, output);
  return subdivide_by_butterfly(surface, options.levels, output);
}

}  // namespace maille
