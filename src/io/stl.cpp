#include "io/format.h"
namespace maille {
namespace {
Result<ReadResult> read(const Source& source, const ReadOptions&) {
  return failure(ErrorCode::unsupported, source.name() + ": not built yet");
}
Result<std::vector<std::string>> write(const Mesh&, Sink& sink, const WriteOptions&) {
  return failure(ErrorCode::unsupported, sink.name() + ": not built yet");
}
}  // namespace
const Format& stl_format() {
  static const Format format{{"stl", {".stl"}, "", true}, nullptr, read, write};
  return format;
}
}  // namespace maille
