// What the small decoder for the web has instead of the files that define the same:
// bindings/wasm/CMakeLists.txt.
#ifdef MAILLE_SMALL_DECODER

#include "surface/front/connectivity.h"
#include "surface/front/mixed_array.h"
#include "surface/left_out.h"
#include "volume/pieces/pieces_file.h"
#include "volume/stream/stream_file.h"

namespace maille {

Result<Mesh> decode_stream(const Source&, const DecodeOptions&) {
  return left_out();
}
Result<Salvaged> salvage_stream(const Source&, const DecodeOptions&) {
  return left_out();
}
Result<FileInfo> inspect_stream(const Source&, const Limits&) {
  return left_out();
}

Result<Mesh> decode_pieces(const Source&, const DecodeOptions&) {
  return left_out();
}
Result<Salvaged> salvage_pieces(const Source&, const DecodeOptions&) {
  return left_out();
}
Result<FileInfo> inspect_pieces(const Source&, const Limits&) {
  return left_out();
}

CodedConnectivity encode_connectivity(HalfEdges&, uint32_t, uint32_t) {
  return {};
}
Result<DecodedConnectivity> decode_connectivity(const ConnectivityHeader&, Bytes, uint32_t, uint32_t) {
  return left_out();
}

template <class Code>
bool can_mix(Scalar, std::span<const NumberMap>, std::span<const Code>) {
  return false;
}
template <class Code>
std::vector<std::byte> encode_mixed(const PatchElements&, Scalar, std::span<const NumberMap>, std::span<Code>,
                                    Pace*) {
  return {};
}
template <class Code>
Result<> decode_mixed(const PatchElements&, Scalar, std::span<const NumberMap>, Bytes, std::span<Code>,
                      Pace*) {
  return left_out();
}

#define MAILLE_LEFT_OUT(Code)                                                                             \
  template bool can_mix<Code>(Scalar, std::span<const NumberMap>, std::span<const Code>);                 \
  template std::vector<std::byte> encode_mixed<Code>(const PatchElements&, Scalar,                        \
                                                     std::span<const NumberMap>, std::span<Code>, Pace*); \
  template Result<> decode_mixed<Code>(const PatchElements&, Scalar, std::span<const NumberMap>, Bytes,   \
                                       std::span<Code>, Pace*)
MAILLE_LEFT_OUT(int32_t);
MAILLE_LEFT_OUT(int64_t);

}  // namespace maille

#endif
