#include <openctm.h>
#include <cstring>
#include "codec.h"

namespace maille::bench {
namespace {

constexpr CTMuint lzma_level = 9;

using Context = std::unique_ptr<void, decltype(&ctmFreeContext)>;

CTMuint CTMCALL append(const void* data, CTMuint count, void* user) {
  auto& out = *static_cast<std::vector<std::byte>*>(user);
  const auto* bytes = static_cast<const std::byte*>(data);
  out.insert(out.end(), bytes, bytes + count);
  return count;
}

CTMuint CTMCALL take(void* data, CTMuint count, void* user) {
  auto& left = *static_cast<Bytes*>(user);
  const auto taken = std::min<size_t>(count, left.size());
  std::memcpy(data, left.data(), taken);
  left = left.subspan(taken);
  return static_cast<CTMuint>(taken);
}

struct Output {
  std::vector<float> xyz;
  std::vector<uint32_t> triangles;
};

class OpenctmCodec final : public Codec {
 public:
  std::string name() const override { return "openctm"; }
  bool takes(int) const override { return true; }
  // MG2 counts steps from the corners of boxes of its own, somewhere between the points of our lattice.
  bool keeps_lattice() const override { return false; }

  Result<Encoded> encode(const Workload& workload) const override {
    const Context context(ctmNewContext(CTM_EXPORT), ctmFreeContext);
    ctmDefineMesh(context.get(), workload.surface.xyz.data(),
                  static_cast<CTMuint>(workload.surface.vertices()), workload.triangles.data(),
                  static_cast<CTMuint>(workload.triangles.size() / 3), nullptr);
    ctmCompressionMethod(context.get(), workload.bits > 0 ? CTM_METHOD_MG2 : CTM_METHOD_MG1);
    ctmCompressionLevel(context.get(), lzma_level);
    if (workload.bits > 0) ctmVertexPrecision(context.get(), 1.0F);
    Encoded encoded;
    ctmSaveCustom(context.get(), append, &encoded.bytes);
    const CTMenum error = ctmGetError(context.get());
    if (error != CTM_NONE) return failure(ErrorCode::unsupported, ctmErrorString(error));
    return encoded;
  }

  Result<Decoded> decode(Bytes bytes, const Workload&) const override {
    const Context context(ctmNewContext(CTM_IMPORT), ctmFreeContext);
    ctmLoadCustom(context.get(), take, &bytes);
    const CTMenum error = ctmGetError(context.get());
    if (error != CTM_NONE) return failure(ErrorCode::corrupt, ctmErrorString(error));
    const size_t vertices = ctmGetInteger(context.get(), CTM_VERTEX_COUNT);
    const size_t triangles = ctmGetInteger(context.get(), CTM_TRIANGLE_COUNT);
    const CTMfloat* xyz = ctmGetFloatArray(context.get(), CTM_VERTICES);
    const CTMuint* corners = ctmGetIntegerArray(context.get(), CTM_INDICES);
    const auto out = std::make_shared<Output>();
    out->xyz.assign(xyz, xyz + 3 * vertices);
    out->triangles.assign(corners, corners + 3 * triangles);
    return [out] { return Surface{out->xyz, {}, out->triangles}; };
  }
};

}  // namespace

std::unique_ptr<Codec> openctm_codec() {
  return std::make_unique<OpenctmCodec>();
}

}  // namespace maille::bench
