#include "surface/lost_arrays.h"

#include <algorithm>

#include "base/result.h"
#include "surface/patch_streams.h"

namespace maille {
namespace {

bool is_among(const std::string& name, std::span<const std::string> names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

std::vector<std::string> lost_arrays(const StreamSource& streams, const Description& description,
                                     uint32_t patch, const DecodeOptions& options) {
  const bool twins_lost = lost_twins(streams, description);
  std::vector<std::string> names;
  for (size_t i = 0; i < description.arrays.size(); ++i) {
    const ArrayDescription& array = description.arrays[i];
    const bool elsewhere = patch > 0 && array.domain == Domain::mesh;
    if (elsewhere || !is_wanted(options, array.name)) continue;
    if ((array.by_twin && twins_lost) || !streams.read_stream(array_key(patch, i)))
      names.push_back(array.name);
  }
  return names;
}

bool lost_twins(const StreamSource& streams, const Description& description) {
  return description.welded && !streams.read_stream(twins_key(0));
}

DecodeOptions without_arrays(const DecodeOptions& options, const Description& description,
                             std::span<const std::string> names) {
  DecodeOptions others = options;
  others.arrays.emplace();
  for (const ArrayDescription& array : description.arrays) {
    if (!is_among(array.name, names) && is_wanted(options, array.name)) others.arrays->push_back(array.name);
  }
  return others;
}

Result<> read_mesh_array(const StreamSource& streams, const Description& description, Array& array) {
  const auto is_this = [&](const ArrayDescription& described) {
    return described.domain == Domain::mesh && described.name == array.name;
  };
  const auto found = std::find_if(description.arrays.begin(), description.arrays.end(), is_this);
  const auto number = static_cast<size_t>(found - description.arrays.begin());
  const std::vector<std::byte> bytes = MAILLE_TRY(streams.read_stream(array_key(0, number)));
  return decode_mesh_array(bytes, found->mesh_tuples, array);
}

void drop_arrays(Mesh& mesh, std::span<const std::string> names) {
  std::erase_if(mesh.arrays, [&](const Array& array) { return is_among(array.name, names); });
}

void tell_lost_arrays(std::vector<std::string> names, Remains& remains) {
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  for (const std::string& name : names) remains.lost.push_back("the array \"" + name + "\"");
}

}  // namespace maille
