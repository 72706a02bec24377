#include "io/format.h"

namespace maille {
namespace {

Result<ReadResult> read(const Source& source, const ReadOptions&) {
  return failure(ErrorCode::unsupported, source.name() + ": reading glTF is not built yet");
}

Result<std::vector<std::string>> write(const Mesh&, Sink& sink, const WriteOptions&) {
  return failure(ErrorCode::unsupported, sink.name() + ": writing glTF is not built yet");
}

}  // namespace

const Format& gltf_format() {
  static const Format format{
      {"gltf", {".glb", ".gltf"}, "glTF 2.0, binary (.glb) or text (.gltf)", false}, nullptr, read, write};
  return format;
}

}  // namespace maille
