#include "volume_cells.h"

#include <maille/file.h>

#include <algorithm>
#include <cmath>

#include "progress.h"
#include "result.h"
#include "spelling.h"

namespace maille::tool {

namespace {

Result<> keep_arrays(const std::vector<std::string>& names, const std::string& file, Mesh& mesh) {
  std::vector<std::string> known;
  for (const Array& array : mesh.arrays) known.push_back(array.name);
  TOOL_CHECK(check_names(file, names, known));
  std::erase_if(mesh.arrays, [&](const Array& array) {
    return std::find(names.begin(), names.end(), array.name) == names.end();
  });
  return {};
}

DecodeOptions decoding_of(const VolumeOptions& options, const Threads& threads) {
  DecodeOptions decoding;
  decoding.limits.mesh_bytes = options.common.memory;
  decoding.arrays = options.arrays;
  decoding.step = options.step;
  decoding.executor = threads.executor();
  return decoding;
}

}  // namespace

std::vector<std::string> names_of_arrays(const StreamDescription& description) {
  std::vector<std::string> names;
  for (const StreamArray& array : description.arrays) names.push_back(array.name);
  for (const Array& array : description.mesh_arrays) names.push_back(array.name);
  return names;
}

// The index tells how much the query needs, and that much more may be fetched: the limit guards against
// surprises only.
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
  // Divided by the largest component first: squares of very long or short normals would be no numbers, or 0.
  const double largest = std::max({std::abs(normal[0]), std::abs(normal[1]), std::abs(normal[2])});
  const Vector3 scaled = {{normal[0] / largest, normal[1] / largest, normal[2] / largest}};
  const double length = std::sqrt(dot(scaled, scaled));
  if (!std::isfinite(length))
    return failure(ErrorCode::usage,
                   "--plane: the last three numbers are its normal, which must be finite and not 0");
  const Vector3 unit = scaled * (1 / length);
  return Region::Plane{unit, -dot(unit, point)};
}

Result<VolumeInput> VolumeInput::open(const VolumeOptions& options) {
  VolumeInput volume(TOOL_TRY(open_input(options.input, options.input_format, options.fetch_limit)),
                     options.common.threads);
  const Input& input = volume.input_;
  if (input.is_maille && TOOL_TRY(mode_of(*input.source)) == Mode::stream) {
    volume.file_ = TOOL_TRY(VolumeFile::open(*input.source, decoding_of(options, volume.threads_)));
    if (options.arrays) {
      TOOL_CHECK(check_names(input_name(options.input), *options.arrays,
                             names_of_arrays(volume.file_->description())));
    }
    return volume;
  }
  if (options.step != 0)
    return failure(ErrorCode::usage,
                   input_name(options.input) + ": has no steps; files of mode stream have them");
  ProgressDisplay progress(options.common.progress, options.common.quiet);
  volume.mesh_ = TOOL_TRY(load(input, options.common, progress)).mesh;
  progress.clear();
  if (options.arrays) TOOL_CHECK(keep_arrays(*options.arrays, input_name(options.input), volume.mesh_));
  return volume;
}

// A mesh that was read whole is its own answer to all queries: slice() and probe() look at each of its cells.
Result<const Mesh*> VolumeInput::cells(const VolumeQuery& query) {
  if (!file_) return &mesh_;
  TOOL_CHECK(allow(*file_, query, input_));
  ExtractedVolume found = TOOL_TRY(file_->extract(query));
  // A slice with holes, or a value from another cell, would look right; so damage ends the verb.
  if (!found.problems.empty()) return failure(ErrorCode::corrupt, found.problems.front());
  mesh_ = std::move(found.mesh);
  return &mesh_;
}

}  // namespace maille::tool
