#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <array>
#include "codec.h"

namespace maille::bench {
namespace {

// The integers go in as an int32 attribute: Draco then quantises nothing itself. Points are not merged, as
// the number of vertices must come back.
void build(const Workload& workload, bool with_positions, draco::Mesh& mesh) {
  const size_t vertices = workload.surface.vertices();
  mesh.set_num_points(static_cast<uint32_t>(vertices));
  draco::GeometryAttribute position;
  position.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_INT32, false, 3 * sizeof(int32_t),
                0);
  const int id = mesh.AddAttribute(position, true, static_cast<uint32_t>(vertices));
  for (uint32_t i = 0; i < vertices; ++i) {
    std::array<int32_t, 3> xyz{};
    if (with_positions) {
      for (size_t axis = 0; axis < 3; ++axis)
        xyz[axis] = static_cast<int32_t>(workload.surface.xyz[3 * i + axis]);
    }
    mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), xyz.data());
  }
  mesh.SetNumFaces(workload.triangles.size() / 3);
  for (uint32_t i = 0; i < workload.triangles.size() / 3; ++i) {
    const uint32_t* corner = &workload.triangles[3 * size_t{i}];
    mesh.SetFace(draco::FaceIndex(i),
                 {draco::PointIndex(corner[0]), draco::PointIndex(corner[1]), draco::PointIndex(corner[2])});
  }
}

struct Output {
  std::vector<int32_t> xyz;
  std::vector<uint32_t> triangles;
};

Output read_out(const draco::Mesh& mesh) {
  const draco::PointAttribute* position = mesh.GetNamedAttribute(draco::GeometryAttribute::POSITION);
  Output out;
  out.xyz.resize(3 * size_t{mesh.num_points()});
  for (uint32_t i = 0; i < mesh.num_points(); ++i) {
    position->GetMappedValue(draco::PointIndex(i), &out.xyz[3 * size_t{i}]);
  }
  out.triangles.resize(3 * size_t{mesh.num_faces()});
  for (uint32_t i = 0; i < mesh.num_faces(); ++i) {
    const draco::Mesh::Face& face = mesh.face(draco::FaceIndex(i));
    for (size_t k = 0; k < 3; ++k) out.triangles[3 * size_t{i} + k] = face[k].value();
  }
  return out;
}

class DracoCodec final : public Codec {
 public:
  explicit DracoCodec(int speed) : speed_(speed) {}

  std::string name() const override { return "draco -cl " + std::to_string(10 - speed_); }
  bool takes(int bits) const override { return bits > 0; }

  Result<Encoded> encode(const Workload& workload) const override { return encode_mesh(workload, true); }

  Result<Decoded> decode(Bytes bytes, const Workload&) const override {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    draco::Decoder decoder;
    auto mesh = decoder.DecodeMeshFromBuffer(&buffer);
    if (!mesh.ok()) return failure(ErrorCode::corrupt, mesh.status().error_msg_string());
    const auto out = std::make_shared<Output>(read_out(*mesh.value()));
    return [out] { return Surface{{out->xyz.begin(), out->xyz.end()}, {}, out->triangles}; };
  }

  // With all positions equal almost nothing but the connectivity is left.
  std::optional<uint64_t> estimate_connectivity(const Workload& workload) const override {
    const auto encoded = encode_mesh(workload, false);
    if (!encoded) return {};
    return encoded->bytes.size();
  }

 private:
  Result<Encoded> encode_mesh(const Workload& workload, bool with_positions) const {
    draco::Mesh mesh;
    build(workload, with_positions, mesh);
    draco::Encoder encoder;
    encoder.SetSpeedOptions(speed_, speed_);
    draco::EncoderBuffer buffer;
    const draco::Status status = encoder.EncodeMeshToBuffer(mesh, &buffer);
    if (!status.ok()) return failure(ErrorCode::unsupported, status.error_msg_string());
    const auto* data = reinterpret_cast<const std::byte*>(buffer.data());
    return Encoded{{data, data + buffer.size()}, {}, {}};
  }

  int speed_;
};

}  // namespace

std::unique_ptr<Codec> draco_codec(int speed) {
  return std::make_unique<DracoCodec>(speed);
}

}  // namespace maille::bench
