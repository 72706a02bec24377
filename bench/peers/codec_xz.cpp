#include <lzma.h>
#include <cstring>
#include "codec.h"

namespace maille::bench {
namespace {

constexpr uint32_t xz_preset = 9;

// As a binary PLY lays them out: all positions, then the faces, each led by its number of corners.
std::vector<uint8_t> lay_out(const Workload& workload) {
  std::vector<uint8_t> raw;
  const auto append = [&raw](const auto& value) {
    const size_t start = raw.size();
    raw.resize(start + sizeof(value));
    std::memcpy(&raw[start], &value, sizeof(value));
  };
  for (const float value : workload.surface.xyz) {
    if (workload.bits > 0) {
      append(static_cast<uint16_t>(value));
    } else {
      append(value);
    }
  }
  for (size_t i = 0; i < workload.triangles.size(); ++i) {
    if (i % 3 == 0) append(uint8_t{3});
    append(workload.triangles[i]);
  }
  return raw;
}

template <class T>
T at(const std::vector<uint8_t>& raw, size_t offset) {
  T value;
  std::memcpy(&value, &raw[offset], sizeof(T));
  return value;
}

Surface surface_of(const std::vector<uint8_t>& raw, const Workload& workload) {
  const size_t size = workload.bits > 0 ? sizeof(uint16_t) : sizeof(float);
  const size_t numbers = workload.surface.xyz.size();
  Surface surface;
  for (size_t i = 0; i < numbers; ++i) {
    surface.xyz.push_back(workload.bits > 0 ? at<uint16_t>(raw, i * size) : at<float>(raw, i * size));
  }
  for (size_t offset = numbers * size; offset < raw.size(); offset += 13) {
    for (size_t k = 0; k < 3; ++k) surface.corners.push_back(at<uint32_t>(raw, offset + 1 + 4 * k));
  }
  return surface;
}

class XzCodec final : public Codec {
 public:
  std::string name() const override { return "xz -9"; }
  bool takes(int bits) const override { return bits <= 16; }

  Result<Encoded> encode(const Workload& workload) const override {
    const std::vector<uint8_t> raw = lay_out(workload);
    Encoded encoded;
    encoded.bytes.resize(lzma_stream_buffer_bound(raw.size()));
    size_t size = 0;
    if (lzma_easy_buffer_encode(xz_preset, LZMA_CHECK_CRC32, nullptr, raw.data(), raw.size(),
                                reinterpret_cast<uint8_t*>(encoded.bytes.data()), &size,
                                encoded.bytes.size()) != LZMA_OK) {
      return failure(ErrorCode::unsupported, "liblzma");
    }
    encoded.bytes.resize(size);
    return encoded;
  }

  Result<Decoded> decode(Bytes bytes, const Workload& workload) const override {
    const size_t number = workload.bits > 0 ? sizeof(uint16_t) : sizeof(float);
    const auto raw = std::make_shared<std::vector<uint8_t>>(workload.surface.xyz.size() * number +
                                                            workload.triangles.size() / 3 * 13);
    uint64_t memory = UINT64_MAX;
    size_t in = 0, out = 0;
    if (lzma_stream_buffer_decode(&memory, 0, nullptr, reinterpret_cast<const uint8_t*>(bytes.data()), &in,
                                  bytes.size(), raw->data(), &out, raw->size()) != LZMA_OK) {
      return failure(ErrorCode::corrupt, "liblzma");
    }
    return [raw, &workload] { return surface_of(*raw, workload); };
  }
};

}  // namespace

std::unique_ptr<Codec> xz_codec() {
  return std::make_unique<XzCodec>();
}

}  // namespace maille::bench
