// A blockMeshDict of any bytes: an error, or a mesh that keeps its rules and is the same in both orders.

#include <maille/compare.h>
#include <maille/generate.h>

#include "fuzzing.h"
#include "io/foam/block_mesh.h"

namespace maille::fuzzing {
namespace {

const std::initializer_list<ErrorCode> fitting{ErrorCode::malformed_input, ErrorCode::unsupported,
                                               ErrorCode::memory_bound, ErrorCode::cannot_read};

void run(std::string_view text) {
  const auto file = parse_foam_text(text, "/nowhere/dict");
  if (!file) return require_kind(file.error(), fitting);
  const auto blocks = blocks_of(*file);
  if (!blocks) return require_kind(blocks.error(), fitting);
  const Limits small{uint64_t{1} << 18};
  const auto mesh = generate_mesh(blocks->description, {}, small);
  if (!mesh) return require_kind(mesh.error(), fitting);
  require(validate(*mesh).has_value(), "a mesh that was generated is valid");
  GenerateOptions streaming;
  streaming.streaming_order = true;
  const auto other = generate_mesh(blocks->description, streaming, small);
  require(other.has_value(), "both orders make a mesh");
  require(other->point_count() == mesh->point_count() && other->cell_count() == mesh->cell_count(),
          "both orders make the same mesh");
}

}  // namespace
}  // namespace maille::fuzzing

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  maille::fuzzing::run({reinterpret_cast<const char*>(data), size});
  return 0;
}
