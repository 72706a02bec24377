#include <maille/decode.h>
#include <maille/encode.h>
#include "codec.h"

namespace maille::bench {
namespace {

Surface surface_of(const Mesh& mesh) {
  Surface surface;
  if (mesh.points.type == Scalar::i32) {
    for (const int32_t value : mesh.points.values<int32_t>())
      surface.xyz.push_back(static_cast<float>(value));
  } else {
    surface.xyz.assign(mesh.points.values<float>().begin(), mesh.points.values<float>().end());
  }
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      surface.degrees.push_back(static_cast<uint32_t>(block.cell(i).size()));
    }
    surface.corners.insert(surface.corners.end(), block.connectivity.begin(), block.connectivity.end());
  }
  return surface;
}

class MailleCodec final : public Codec {
 public:
  explicit MailleCodec(int effort) : effort_(effort) {}

  std::string name() const override { return "maille -" + std::to_string(effort_); }
  bool takes(int) const override { return true; }
  bool needs_triangles() const override { return false; }

  Result<Encoded> encode(const Workload& workload) const override {
    EncodeOptions options;
    options.effort = effort_;
    Encoded encoded;
    const auto report = maille::encode(workload.mesh_for_maille, *memory_sink(encoded.bytes), options);
    if (!report) return tl::unexpected(report.error());
    encoded.connectivity = report->connectivity.coded_bytes;
    encoded.geometry = report->positions.coded_bytes;
    return encoded;
  }

  Result<Decoded> decode(Bytes bytes, const Workload&) const override {
    auto mesh = maille::decode(*memory_source(bytes));
    if (!mesh) return tl::unexpected(mesh.error());
    const auto shared = std::make_shared<Mesh>(std::move(*mesh));
    return [shared] { return surface_of(*shared); };
  }

 private:
  int effort_;
};

}  // namespace

std::unique_ptr<Codec> maille_codec(int effort) {
  return std::make_unique<MailleCodec>(effort);
}

}  // namespace maille::bench
