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
const Format& off_format() {
  static const Format format{{"off", {".off"}, "", true}, nullptr, read, write};
  return format;
}
}  // namespace maille
