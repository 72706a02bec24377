#include <maille/encode.h>

#include <gtest/gtest.h>

#include <memory>

#include "support/sample_mesh.h"
#include "support/shapes.h"

namespace maille::testing {
namespace {

/// Every buffer of `mesh` borrowed, with `owner` as its owner.
Mesh view_of(const Mesh& mesh, const std::shared_ptr<const void>& owner) {
  const auto borrow = [&](auto& buffer, const auto& from) {
    buffer = std::decay_t<decltype(buffer)>::borrow(std::span(from.data(), from.size()), owner);
  };
  Mesh view = mesh;
  borrow(view.points.bytes, mesh.points.bytes);
  for (size_t i = 0; i < mesh.arrays.size(); ++i) borrow(view.arrays[i].bytes, mesh.arrays[i].bytes);
  for (size_t b = 0; b < mesh.blocks.size(); ++b) {
    borrow(view.blocks[b].types, mesh.blocks[b].types);
    borrow(view.blocks[b].offsets, mesh.blocks[b].offsets);
    borrow(view.blocks[b].connectivity, mesh.blocks[b].connectivity);
    borrow(view.blocks[b].face_sizes, mesh.blocks[b].face_sizes);
    borrow(view.blocks[b].cell_faces, mesh.blocks[b].cell_faces);
  }
  return view;
}

std::vector<std::byte> coded(const Mesh& mesh, Mode mode) {
  EncodeOptions options;
  options.mode = mode;
  std::vector<std::byte> file;
  EXPECT_TRUE(encode(mesh, *memory_sink(file), options));
  return file;
}

TEST(BorrowedMesh, IsEncodedInAllModesToTheBytesOfOneThatOwnsItsNumbers) {
  const std::pair<Mesh, Mode> cases[] = {{sample_mesh(), Mode::single},
                                         {sample_mesh(), Mode::stream},
                                         {to_mesh(shapes::sphere(20, 20)), Mode::random}};
  for (const auto& [mesh, mode] : cases) {
    const Mesh view = view_of(mesh, nullptr);
    EXPECT_EQ(coded(view, mode), coded(mesh, mode));
    EXPECT_TRUE(view.points.bytes.is_borrowed());
    EXPECT_TRUE(view.blocks[0].connectivity.is_borrowed());
  }
}

TEST(BorrowedMesh, LetsGoOfItsOwnerWhenItIsGone) {
  const auto owner = std::make_shared<const int>(0);
  const Mesh mesh = sample_mesh();
  {
    const Mesh view = view_of(mesh, owner);
    const Mesh copy = view;
    EXPECT_GT(owner.use_count(), 5);
  }
  EXPECT_EQ(owner.use_count(), 1);
}

}  // namespace
}  // namespace maille::testing
