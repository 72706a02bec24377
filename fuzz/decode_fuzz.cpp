// decode() on any bytes: the first byte says whether the others are a file or the streams of one.

#include <maille/file.h>

#include "fuzzing.h"
#include "packed_streams.h"

namespace maille::fuzzing {
namespace {

constexpr uint64_t mesh_bytes = uint64_t{16} << 20;

void decode_file(Bytes file) {
  const auto mesh = decoded(file, mesh_bytes);
  if (!mesh) {
    require_kind(mesh.error(), {ErrorCode::corrupt, ErrorCode::unsupported, ErrorCode::memory_bound});
    return;
  }
  require(validate(*mesh).has_value(), "a decoded mesh is valid");
  const auto source = memory_source(file);
  const auto info = inspect(*source);
  require(info.has_value(), "what decodes can be inspected");
  require(info->points == mesh->point_count() && info->cells == mesh->cell_count(),
          "the description tells the truth");
}

}  // namespace
}  // namespace maille::fuzzing

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace maille;
  if (size == 0) return 0;
  const Bytes input = std::as_bytes(std::span(data, size)).subspan(1);
  if (data[0] % 2 == 0) {
    fuzzing::decode_file(input);
  } else {
    fuzzing::decode_file(fuzzing::file_of_streams(input, Mode::single));
  }
  return 0;
}
