#include <meshoptimizer.h>
#include <zstd.h>
#include <array>
#include <cstring>
#include "codec.h"

namespace maille::bench {
namespace {

constexpr int zstd_level = 19;

// Vertices as a GPU would take them: four 16-bit numbers on a lattice, three floats without one.
using Lattice = std::array<uint16_t, 4>;

struct Header {
  uint32_t vertices, indices;
  uint64_t index_bytes;  ///< of the first zstd frame; the vertices follow
};

std::vector<unsigned char> vertex_buffer(const Workload& workload) {
  const std::vector<float>& xyz = workload.surface.xyz;
  const size_t vertices = workload.surface.vertices();
  std::vector<unsigned char> buffer(vertices * (workload.bits > 0 ? sizeof(Lattice) : 3 * sizeof(float)));
  if (workload.bits == 0) {
    std::memcpy(buffer.data(), xyz.data(), buffer.size());
    return buffer;
  }
  for (size_t i = 0; i < vertices; ++i) {
    const Lattice vertex{static_cast<uint16_t>(xyz[3 * i]), static_cast<uint16_t>(xyz[3 * i + 1]),
                         static_cast<uint16_t>(xyz[3 * i + 2]), 0};
    std::memcpy(&buffer[i * sizeof(Lattice)], vertex.data(), sizeof(Lattice));
  }
  return buffer;
}

void append_zstd(std::vector<std::byte>& out, const std::vector<unsigned char>& bytes) {
  const size_t start = out.size();
  out.resize(start + ZSTD_compressBound(bytes.size()));
  out.resize(start + ZSTD_compress(&out[start], out.size() - start, bytes.data(), bytes.size(), zstd_level));
}

Result<std::vector<unsigned char>> from_zstd(Bytes bytes) {
  std::vector<unsigned char> out(ZSTD_getFrameContentSize(bytes.data(), bytes.size()));
  const size_t size = ZSTD_decompress(out.data(), out.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(size)) return failure(ErrorCode::corrupt, ZSTD_getErrorName(size));
  return out;
}

struct Output {
  std::vector<unsigned char> vertices;
  std::vector<uint32_t> triangles;
};

Surface surface_of(const Output& out, int bits) {
  Surface surface;
  surface.corners = out.triangles;
  if (bits == 0) {
    surface.xyz.resize(out.vertices.size() / sizeof(float));
    std::memcpy(surface.xyz.data(), out.vertices.data(), out.vertices.size());
    return surface;
  }
  for (size_t at = 0; at < out.vertices.size(); at += sizeof(Lattice)) {
    Lattice vertex;
    std::memcpy(vertex.data(), &out.vertices[at], sizeof(Lattice));
    surface.xyz.insert(surface.xyz.end(), vertex.begin(), vertex.begin() + 3);
  }
  return surface;
}

class MeshoptimizerCodec final : public Codec {
 public:
  std::string name() const override { return "meshopt + zstd -19"; }
  bool takes(int bits) const override { return bits <= 16; }

  // The order that gltfpack gives before compression: strips, then vertices as they are first used.
  Result<Encoded> encode(const Workload& workload) const override {
    const size_t stride = workload.bits > 0 ? sizeof(Lattice) : 3 * sizeof(float);
    const size_t count = workload.triangles.size();
    std::vector<uint32_t> triangles(count);
    meshopt_optimizeVertexCacheStrip(triangles.data(), workload.triangles.data(), count,
                                     workload.surface.vertices());
    std::vector<unsigned char> vertices = vertex_buffer(workload);
    const size_t used = meshopt_optimizeVertexFetch(vertices.data(), triangles.data(), count, vertices.data(),
                                                    workload.surface.vertices(), stride);

    meshopt_encodeIndexVersion(1);
    std::vector<unsigned char> indices(meshopt_encodeIndexBufferBound(count, used));
    indices.resize(meshopt_encodeIndexBuffer(indices.data(), indices.size(), triangles.data(), count));
    std::vector<unsigned char> points(meshopt_encodeVertexBufferBound(used, stride));
    points.resize(meshopt_encodeVertexBuffer(points.data(), points.size(), vertices.data(), used, stride));

    Encoded encoded;
    encoded.bytes.resize(sizeof(Header));
    append_zstd(encoded.bytes, indices);
    encoded.connectivity = encoded.bytes.size() - sizeof(Header);
    append_zstd(encoded.bytes, points);
    encoded.geometry = encoded.bytes.size() - sizeof(Header) - *encoded.connectivity;
    const Header header{static_cast<uint32_t>(used), static_cast<uint32_t>(count), *encoded.connectivity};
    std::memcpy(encoded.bytes.data(), &header, sizeof(Header));
    return encoded;
  }

  Result<Decoded> decode(Bytes bytes, const Workload& workload) const override {
    const size_t stride = workload.bits > 0 ? sizeof(Lattice) : 3 * sizeof(float);
    Header header;
    std::memcpy(&header, bytes.data(), sizeof(Header));
    const auto indices = from_zstd(bytes.subspan(sizeof(Header), header.index_bytes));
    const auto points = from_zstd(bytes.subspan(sizeof(Header) + header.index_bytes));
    if (!indices || !points) return failure(ErrorCode::corrupt, "zstd");
    const auto out = std::make_shared<Output>();
    out->triangles.resize(header.indices);
    out->vertices.resize(header.vertices * stride);
    if (meshopt_decodeIndexBuffer(out->triangles.data(), header.indices, sizeof(uint32_t), indices->data(),
                                  indices->size()) != 0 ||
        meshopt_decodeVertexBuffer(out->vertices.data(), header.vertices, stride, points->data(),
                                   points->size()) != 0) {
      return failure(ErrorCode::corrupt, "meshoptimizer");
    }
    return [out, bits = workload.bits] { return surface_of(*out, bits); };
  }
};

}  // namespace

std::unique_ptr<Codec> meshoptimizer_codec() {
  return std::make_unique<MeshoptimizerCodec>();
}

}  // namespace maille::bench
