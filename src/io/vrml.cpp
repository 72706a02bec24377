#include "io/format.h"

namespace maille {
namespace {

Result<ReadResult> read(const Source& source, const ReadOptions&) {
  return failure(ErrorCode::unsupported, source.name() + ": reading VRML97 is not built yet");
}

Result<std::vector<std::string>> write(const Mesh&, Sink& sink, const WriteOptions&) {
  return failure(ErrorCode::unsupported, sink.name() + ": writing VRML97 is not built yet");
}

}  // namespace

const Format& vrml_format() {
  static const Format format{{"wrl", {".wrl", ".vrml"}, "VRML97 IndexedFaceSet", true}, nullptr, read, write};
  return format;
}

}  // namespace maille
