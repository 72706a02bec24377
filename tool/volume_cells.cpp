#include "volume_cells.h"

#include <maille/file.h>

#include <algorithm>
#include <cmath>

#include "result.h"

namespace maille::tool {

Result<> allow(const VolumeFile& file, const VolumeQuery& query, const Input& input) {
  if (input.remote == nullptr) return {};
  uint64_t bytes = 0;
  for (const uint32_t piece : TOOL_TRY(file.select(query))) bytes += TOOL_TRY(file.info(piece)).bytes;
  input.remote->allow(bytes);
  return {};
}

Result<Region::Plane> plane_of(const std::vector<double>& numbers) {
  const Vector3 point = {{numbers[0], numbers[1], numbers[2]}},
                normal = {{numbers[3], numbers[4], numbers[5]}};
  const double length = std::sqrt(dot(normal, normal));
  if (!(length > 0) || !std::isfinite(length))
    return failure(ErrorCode::usage, "--plane: the last three numbers are its normal, which must not be 0");
  const Vector3 unit = normal * (1 / length);
  return Region::Plane{unit, -dot(unit, point)};
}

Result<Mesh> read_cells(const VolumeRequest& request, const VolumeQuery& query, const CommonOptions& common) {
  const Input input = TOOL_TRY(open_input(request.input, request.input_format, request.fetch_limit));
  const Threads threads(common.threads);
  if (input.is_maille && TOOL_TRY(mode_of(*input.source)) == Mode::stream) {
    DecodeOptions decoding;
    decoding.limits.mesh_bytes = common.memory;
    decoding.arrays = request.arrays;
    decoding.step = request.step;
    decoding.executor = threads.executor();
    const VolumeFile file = TOOL_TRY(VolumeFile::open(*input.source, decoding));
    TOOL_CHECK(allow(file, query, input));
    ExtractedVolume found = TOOL_TRY(file.extract(query));
    if (!found.problems.empty()) return failure(ErrorCode::corrupt, found.problems.front());
    return std::move(found.mesh);
  }
  if (request.step != 0)
    return failure(ErrorCode::usage,
                   input_name(request.input) + ": has no steps; files of mode stream have them");
  ProgressDisplay progress(common.progress, common.quiet);
  Mesh mesh = TOOL_TRY(load(input, common, progress)).mesh;
  progress.clear();
  if (!request.arrays) return mesh;
  const auto is_unwanted = [&](const Array& array) {
    return std::find(request.arrays->begin(), request.arrays->end(), array.name) == request.arrays->end();
  };
  mesh.arrays.erase(std::remove_if(mesh.arrays.begin(), mesh.arrays.end(), is_unwanted), mesh.arrays.end());
  return mesh;
}

}  // namespace maille::tool
