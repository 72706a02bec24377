#include "volume/mesh_stream.h"

#include "base/result.h"

namespace maille {
namespace {

Result<> add_maps(const Array& array, const Tolerance& tolerance, bool are_positions, ArrayMapsList& list) {
  ArrayMaps maps;
  if (array.role == Role::normal && tolerance.kind != Tolerance::Kind::lossless) {
    // Octahedral maps are of whole tuples, streams code numbers one by one.
    Array plain = array;
    plain.role = Role::none;
    maps = MAILLE_TRY(choose_maps(plain, tolerance, are_positions));
  } else {
    maps = MAILLE_TRY(choose_maps(array, tolerance, are_positions));
  }
  list.maps.push_back(std::move(maps.maps));
  list.bounds.push_back(maps.lossless ? 0 : maps.bound);
  return {};
}

}  // namespace

Result<ArrayMapsList> choose_stream_maps(const Mesh& mesh, const StreamOptions& options) {
  ArrayMapsList list;
  MAILLE_CHECK(add_maps(mesh.points, options.positions.tolerance, true, list));
  size_t next = 0;
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::mesh) continue;
    MAILLE_CHECK(add_maps(array, options.arrays[next++].tolerance, false, list));
  }
  return list;
}

}  // namespace maille
