#include "support/random_file.h"

#include "random/random_file.h"
#include "support/codec.h"

namespace maille::testing {

RandomFile random_file(const Mesh& mesh, const EncodeOptions& options, uint32_t chart_faces) {
  RandomFile file;
  const auto sink = memory_sink(file.bytes);
  EncodeOptions random = options;
  random.mode = Mode::random;
  HierarchyOptions hierarchy;
  hierarchy.sizes = {chart_faces, chart_faces};
  const auto report = encode_random(mesh, *sink, random, hierarchy);
  if (report) return file;
  file.error = report.error().message;
  file.unsupported = report.error().code == ErrorCode::unsupported;
  return file;
}

std::string round_trip(const Mesh& mesh, const EncodeOptions& options) {
  const RandomFile file = random_file(mesh, options);
  if (file.unsupported) return "";
  if (!file.error.empty()) return file.error;
  const auto decoded = decode_bytes(file.bytes);
  if (!decoded) return decoded.error().message;
  return differences_between(mesh, *decoded, options.order == Order::keep);
}

}  // namespace maille::testing
