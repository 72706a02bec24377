#include "io/format.h"

namespace maille {
namespace {

Result<ReadResult> read(const Source& source, const ReadOptions&) {
  return failure(ErrorCode::unsupported, source.name() + ": reading VTP is not built yet");
}

Result<std::vector<std::string>> write(const Mesh&, Sink& sink, const WriteOptions&) {
  return failure(ErrorCode::unsupported, sink.name() + ": writing VTP is not built yet");
}

}  // namespace

const Format& vtp_format() {
  static const Format format{{"vtp", {".vtp"}, "VTK XML PolyData", false}, nullptr, read, write};
  return format;
}

}  // namespace maille
