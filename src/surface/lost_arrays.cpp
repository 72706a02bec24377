#include "surface/lost_arrays.h"

#include <algorithm>

#include "base/result.h"

namespace maille {

size_t place_of(const Description& description, const Array& array) {
  const auto is_this = [&](const ArrayDescription& described) {
    return described.domain == array.domain && described.name == array.name;
  };
  const auto found = std::find_if(description.arrays.begin(), description.arrays.end(), is_this);
  return static_cast<size_t>(found - description.arrays.begin());
}

Result<> read_mesh_array(const StreamSource& streams, const Description& description, Array& array) {
  const size_t place = place_of(description, array);
  const std::vector<std::byte> bytes = MAILLE_TRY(streams.read_stream(array_key(0, place)));
  return decode_mesh_array(bytes, description.arrays[place].mesh_tuples, array);
}

void drop_arrays(Mesh& mesh, const Description& description, const LostArrays& lost) {
  std::erase_if(mesh.arrays,
                [&](const Array& array) { return lost.count(place_of(description, array)) > 0; });
}

void tell_lost_arrays(const Description& description, const LostArrays& lost, Remains& remains) {
  for (const size_t place : lost) {
    const ArrayDescription& array = description.arrays[place];
    remains.lost.push_back(array_named(array.name, array.by_twin ? Domain::point : array.domain));
  }
}

}  // namespace maille
