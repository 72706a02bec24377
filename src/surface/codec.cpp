#include <maille/decode.h>
#include <maille/encode.h>

namespace maille {

Result<EncodeReport> encode(const Mesh&, Sink&, const EncodeOptions&) {
  return failure(ErrorCode::unsupported, "the surface codec is not there yet");
}

Result<Mesh> decode(const Source&, const DecodeOptions&) {
  return failure(ErrorCode::unsupported, "the surface codec is not there yet");
}

}  // namespace maille
