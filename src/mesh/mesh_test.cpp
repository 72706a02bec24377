#include <maille/mesh.h>

#include "support/shapes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace maille::testing {
namespace {

using ::testing::HasSubstr;

std::string complaint(const Mesh& mesh) {
  const auto valid = validate(mesh);
  if (valid) return "valid";
  EXPECT_EQ(valid.error().code, ErrorCode::malformed_input);
  return valid.error().message;
}

/// A mesh over `points` points with one block.
Mesh with_block(uint64_t points, CellType type, std::vector<uint64_t> offsets,
                std::vector<uint32_t> connectivity, std::vector<uint8_t> types = {}) {
  Mesh mesh;
  mesh.points.resize(points);
  CellBlock block;
  block.type = type;
  block.offsets = std::move(offsets);
  block.connectivity = std::move(connectivity);
  block.types = std::move(types);
  mesh.blocks.push_back(std::move(block));
  return mesh;
}

TEST(CellTypes, OfEachShapeHaveItsDimensionWhateverTheirOrder) {
  const std::pair<int, std::vector<CellType>> shapes[] = {
      {0, {CellType::vertex, CellType::poly_vertex}},
      {1, {CellType::line, CellType::poly_line, CellType::cubic_line, CellType::lagrange_curve}},
      {2, {CellType::triangle, CellType::polygon, CellType::biquadratic_quad, CellType::lagrange_triangle}},
      {3, {CellType::voxel, CellType::polyhedron, CellType::triquadratic_pyramid, CellType::lagrange_wedge}},
      {-1, {CellType::mixed}}};
  for (const auto& [dimension, types] : shapes) {
    for (const CellType type : types) EXPECT_EQ(dimension_of(type), dimension) << name_of(type);
  }
}

TEST(Validate, TakesEmptyMeshesAndBlocks) {
  EXPECT_EQ(complaint(Mesh{}), "valid");
  EXPECT_EQ(complaint(with_block(0, CellType::polygon, {}, {})), "valid");
  EXPECT_EQ(complaint(with_block(0, CellType::polygon, {0}, {})), "valid");
  EXPECT_EQ(complaint(with_block(0, CellType::triangle, {}, {})), "valid");
  EXPECT_EQ(complaint(with_block(0, CellType::mixed, {0}, {})), "valid");
}

TEST(Validate, TakesDegenerateFaces) {
  EXPECT_EQ(complaint(with_block(1, CellType::polygon, {0, 0, 1, 3, 6}, {0, 0, 0, 0, 0, 0})), "valid");
}

/// A tetrahedron given by its faces, and a triangle.
Mesh with_polyhedron() {
  Mesh mesh =
      with_block(4, CellType::mixed, {0, 12, 15}, {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3, 0, 1, 2}, {42, 5});
  mesh.blocks[0].face_sizes = {3, 3, 3, 3};
  mesh.blocks[0].cell_faces = {0, 4, 4};
  return mesh;
}

TEST(Validate, TakesPolyhedraWithFaces) {
  EXPECT_EQ(complaint(with_polyhedron()), "valid");
  EXPECT_EQ(complaint(with_block(0, CellType::polyhedron, {0}, {})), "valid");
}

TEST(Validate, RefusesFacesThatAreNotTheCells) {
  Mesh mesh = with_polyhedron();
  mesh.blocks[0].face_sizes[2] = 4;
  EXPECT_EQ(complaint(mesh), "block 0: the faces of cell 0 have 13 corners, not those of the cell");
  mesh = with_polyhedron();
  mesh.blocks[0].cell_faces = {0, 3, 4};
  EXPECT_EQ(complaint(mesh), "block 0: the faces of cell 0 have 9 corners, not those of the cell");
  mesh = with_polyhedron();
  mesh.blocks[0].cell_faces = {0, 4};
  EXPECT_EQ(complaint(mesh), "block 0: the cells' faces must run from 0 to the number of faces");
  mesh = with_polyhedron();
  mesh.blocks[0].cell_faces = {0, 5, 4};
  EXPECT_NE(complaint(mesh), "valid");
  mesh = with_polyhedron();
  mesh.blocks[0].cell_faces.clear();
  EXPECT_EQ(complaint(mesh), "block 0: faces of polyhedra without the cells they belong to");
  mesh.blocks[0].face_sizes.clear();
  EXPECT_EQ(complaint(mesh), "block 0: cell 0 is a polyhedron without faces");
  mesh = with_block(3, CellType::triangle, {}, {0, 1, 2});
  mesh.blocks[0].cell_faces = {0, 0};
  EXPECT_EQ(complaint(mesh), "block 0: only polyhedra have faces");
}

TEST(Validate, RefusesPositionsThatAreNotTriples) {
  Mesh mesh = cube();
  mesh.points.components = 2;
  EXPECT_EQ(complaint(mesh), "positions must have 3 components");
  mesh = cube();
  mesh.points.bytes.pop_back();
  EXPECT_EQ(complaint(mesh), "positions must have 3 components");
}

TEST(Validate, NamesTheEntryThatIsNoPoint) {
  EXPECT_EQ(complaint(with_block(3, CellType::triangle, {}, {0, 1, 2, 0, 3, 1})),
            "block 0: connectivity entry 4 is point 3, but there are 3 points");
  EXPECT_THAT(complaint(with_block(3, CellType::polygon, {0, 3}, {0, 1, 0xffffffff})),
              HasSubstr("entry 2 is point 4294967295"));
  EXPECT_THAT(complaint(with_block(0, CellType::vertex, {}, {0})), HasSubstr("there are 0 points"));
}

TEST(Validate, RefusesOffsetsThatDoNotFit) {
  EXPECT_THAT(complaint(with_block(3, CellType::polygon, {}, {0, 1, 2})), HasSubstr("offsets are missing"));
  EXPECT_THAT(complaint(with_block(3, CellType::polygon, {1, 3}, {0, 1, 2})),
              HasSubstr("from 0 to the size"));
  EXPECT_THAT(complaint(with_block(3, CellType::polygon, {0, 2}, {0, 1, 2})),
              HasSubstr("from 0 to the size"));
  EXPECT_THAT(complaint(with_block(3, CellType::polygon, {0, 4}, {0, 1, 2})),
              HasSubstr("from 0 to the size"));
  EXPECT_THAT(complaint(with_block(3, CellType::polygon, {0, 2, 1, 3}, {0, 1, 2})),
              HasSubstr("offset 2 goes backwards"));
  EXPECT_THAT(
      complaint(with_block(3, CellType::polygon, {0, std::numeric_limits<uint64_t>::max(), 3}, {0, 1, 2})),
      HasSubstr("offset 2 goes backwards"));
  EXPECT_THAT(complaint(with_block(3, CellType::triangle, {0, 3}, {0, 1, 2})), HasSubstr("takes no offsets"));
}

TEST(Validate, RefusesWrongNodeCounts) {
  EXPECT_THAT(complaint(with_block(3, CellType::triangle, {}, {0, 1})), HasSubstr("not a multiple"));
  EXPECT_THAT(complaint(with_block(4, CellType::mixed, {0, 3}, {0, 1, 2}, {10})),
              HasSubstr("cell 0 (tetrahedron) has 3 nodes instead of 4"));
}

TEST(Validate, RefusesUnknownTypes) {
  EXPECT_THAT(complaint(with_block(3, static_cast<CellType>(99), {0, 3}, {0, 1, 2})),
              HasSubstr("unknown type 99"));
  EXPECT_THAT(complaint(with_block(3, CellType::mixed, {0, 3}, {0, 1, 2}, {98})),
              HasSubstr("cell 0 has the unknown type 98"));
  EXPECT_THAT(complaint(with_block(3, CellType::mixed, {0, 3}, {0, 1, 2}, {255})),
              HasSubstr("unknown type 255"));
}

TEST(Validate, AsksMixedBlocksForOneTypePerCell) {
  EXPECT_EQ(complaint(with_block(3, CellType::mixed, {0, 3, 4}, {0, 1, 2, 0}, {5, 1})), "valid");
  EXPECT_THAT(complaint(with_block(3, CellType::mixed, {0, 3}, {0, 1, 2})), HasSubstr("one type per cell"));
  EXPECT_THAT(complaint(with_block(3, CellType::mixed, {0, 3}, {0, 1, 2}, {5, 5})),
              HasSubstr("one type per cell"));
}

TEST(Validate, AsksArraysForOneTuplePerElement) {
  for (const Domain domain : {Domain::point, Domain::corner, Domain::cell}) {
    Mesh mesh = cube();
    Array array = make_array("a", domain, Scalar::i16, 2);
    array.resize(mesh.count_of(domain));
    mesh.arrays = {array};
    EXPECT_EQ(complaint(mesh), "valid");
    mesh.arrays[0].resize(mesh.count_of(domain) + 1);
    EXPECT_THAT(complaint(mesh), HasSubstr(std::string("array \"a\" on ") + name_of(domain) + "s has"));
    mesh.arrays[0].bytes.resize(3);
    EXPECT_THAT(complaint(mesh), HasSubstr("ends inside a tuple"));
  }
  Mesh mesh = cube();
  mesh.arrays = {make_array("m", Domain::mesh, Scalar::f64, 1)};
  mesh.arrays[0].resize(17);
  EXPECT_EQ(complaint(mesh), "valid");
  mesh.arrays[0].components = 0;
  EXPECT_THAT(complaint(mesh), HasSubstr("has no components"));
}

TEST(Mesh, CountsOverAllBlocks) {
  Mesh mesh = with_block(8, CellType::triangle, {}, {0, 1, 2, 3, 4, 5});
  mesh.blocks.push_back(with_block(8, CellType::polygon, {0, 5, 5}, {0, 1, 2, 3, 4}).blocks[0]);
  EXPECT_EQ(mesh.cell_count(), 4u);
  EXPECT_EQ(mesh.corner_count(), 11u);
  EXPECT_EQ(mesh.count_of(Domain::point), 8u);
  EXPECT_EQ(mesh.blocks[0].cell(1)[0], 3u);
  EXPECT_EQ(mesh.blocks[1].cell(0).size(), 5u);
  EXPECT_TRUE(mesh.blocks[1].cell(1).empty());
}

TEST(Mesh, FindsArraysByNameAndDomain) {
  Mesh mesh;
  mesh.arrays = {make_array("a", Domain::point, Scalar::f32, 1),
                 make_array("a", Domain::cell, Scalar::f32, 2)};
  EXPECT_EQ(mesh.find("a", Domain::cell), &mesh.arrays[1]);
  EXPECT_EQ(mesh.find("a", Domain::corner), nullptr);
}

TEST(Array, SizesFollowTypeAndComponents) {
  for (unsigned i = 0; i < scalar_count; ++i) {
    Array array = make_array("a", Domain::point, static_cast<Scalar>(i), 3);
    array.resize(5);
    EXPECT_EQ(array.count(), 5u);
    EXPECT_EQ(array.bytes.size(), 15 * size_of(array.type));
    array.components = 0;
    EXPECT_EQ(array.count(), 0u);
  }
}

TEST(Validate, RefusesBorrowedNumbersThatDoNotLieAsTheirTypeNeedsIt) {
  const std::vector<double> numbers(4);
  const auto bytes = std::as_bytes(std::span(numbers));
  Mesh mesh;
  mesh.points.bytes = Buffer<std::byte>::borrow(bytes.first(24));
  EXPECT_EQ(complaint(mesh), "valid");
  mesh.points.bytes = Buffer<std::byte>::borrow(bytes.subspan(1, 24));
  EXPECT_THAT(complaint(mesh), HasSubstr("multiple of 4"));
  mesh.points.bytes = {};
  mesh.arrays = {make_array("w", Domain::mesh, Scalar::f64, 1)};
  mesh.arrays[0].bytes = Buffer<std::byte>::borrow(bytes.subspan(4, 8));
  EXPECT_THAT(complaint(mesh), HasSubstr("\"w\""));
}

}  // namespace
}  // namespace maille::testing
