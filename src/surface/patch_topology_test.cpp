// What decode_topology() refuses; that meshes come back is tested with whole files.
#include "surface/patch_topology.h"

#include <gtest/gtest.h>

#include <array>

#include "base/bytes.h"
#include "support/shapes.h"

namespace maille::testing {
namespace {

struct Coded {
  Mesh mesh;
  std::vector<std::byte> bytes;

  explicit Coded(Mesh from) : mesh(std::move(from)) {
    auto encoded = encode_topology(mesh);
    EXPECT_TRUE(encoded) << encoded.error().message;
    if (encoded) bytes = encoded->bytes;
  }
  Result<PatchTopology> decode(Bytes changed) const {
    std::vector<BlockShape> shapes;
    for (const CellBlock& block : mesh.blocks) shapes.push_back({block.type, block.size()});
    return decode_topology(changed, shapes, static_cast<uint32_t>(mesh.point_count()), mesh.corner_count(),
                           true);
  }
};

enum Section { connectivity, identity, labels, loose };

std::vector<std::byte> with_section(Bytes bytes, Section number, Bytes content) {
  ByteReader in(bytes);
  ByteWriter out;
  for (int i = 0; i < 3; ++i) out.put_count(in.get_count());
  out.put(in.get<uint8_t>());
  for (int i = 0; i < 4; ++i) {
    const Bytes before = in.get_bytes(in.get_count());
    const Bytes after = i == number ? content : before;
    out.put_count(after.size());
    out.put_bytes(after);
  }
  EXPECT_TRUE(in.ok() && in.remaining() == 0);
  return out.take();
}

void expect_corrupt(const Result<PatchTopology>& decoded) {
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::corrupt) << decoded.error().message;
}

TEST(PatchTopology, LabelsOfFacesThatNobodyKnowsAreRefused) {
  const Coded coded(to_mesh(shapes::tetrahedron()));
  ASSERT_TRUE(coded.decode(with_section(coded.bytes, labels, std::array{std::byte{0}})));
  expect_corrupt(coded.decode(with_section(coded.bytes, labels, {})));
  for (unsigned unknown = 4; unknown < 256; unknown *= 2) {
    const std::array flags{static_cast<std::byte>(unknown)};
    expect_corrupt(coded.decode(with_section(coded.bytes, labels, flags)));
  }
}

TEST(PatchTopology, CellsOfUnknownTypesInMixedBlocksAreRefused) {
  for (unsigned type = 0; type < 256; ++type) {
    Mesh mesh;
    mesh.points.resize(4);
    CellBlock& block = mesh.blocks.emplace_back();
    block.type = CellType::mixed;
    const unsigned nodes = nodes_of(static_cast<CellType>(type));
    for (unsigned i = 0; i < (nodes == 0 ? 2 : nodes); ++i) block.connectivity.push_back(i % 4);
    block.offsets = {0, block.connectivity.size()};
    block.types = {static_cast<uint8_t>(type)};
    const Coded coded(mesh);
    if (validate(mesh)) {
      EXPECT_TRUE(coded.decode(coded.bytes)) << type;
    } else {
      expect_corrupt(coded.decode(coded.bytes));
    }
  }
}

}  // namespace
}  // namespace maille::testing
