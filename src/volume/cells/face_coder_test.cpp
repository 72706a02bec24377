// Polyhedra and polygons of any size in streams.
#include <maille/file.h>

#include <set>

#include "support/cases.h"
#include "support/random_volume.h"
#include "volume/cells/cell_coder.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

CellBlock polyhedra() {
  CellBlock block;
  block.type = CellType::polyhedron;
  block.offsets = {0};
  block.cell_faces = {0};
  return block;
}

void add_polyhedron(CellBlock& block, const std::vector<std::vector<uint32_t>>& faces) {
  for (const auto& face : faces) {
    block.connectivity.insert(block.connectivity.end(), face.begin(), face.end());
    block.face_sizes.push_back(static_cast<uint32_t>(face.size()));
  }
  block.offsets.push_back(block.connectivity.size());
  block.cell_faces.push_back(block.face_sizes.size());
  if (block.type == CellType::mixed) block.types.push_back(static_cast<uint8_t>(CellType::polyhedron));
}

/// A prism over hexagon (i, j) of a honeycomb, from layer k to the next.
std::vector<std::vector<uint32_t>> hexagonal_prism(uint32_t i, uint32_t j, uint32_t k, uint32_t nx,
                                                   uint32_t ny) {
  // Points of a brick wall: cell (i, j) begins at column 2 i + (j mod 2), with three points below and above.
  const uint32_t width = 2 * nx + 2, layer = width * (ny + 1);
  const auto point = [&](uint32_t column, uint32_t row, uint32_t level) {
    return level * layer + row * width + column;
  };
  const uint32_t c = 2 * i + j % 2;
  std::vector<uint32_t> below, above;
  for (const auto& [x, y] :
       {std::pair{c, j}, {c + 1, j}, {c + 2, j}, {c + 2, j + 1}, {c + 1, j + 1}, {c, j + 1}}) {
    below.insert(below.begin(), point(x, y, k));
    above.push_back(point(x, y, k + 1));
  }
  std::vector<std::vector<uint32_t>> faces = {below, above};
  for (size_t e = 0; e < 6; ++e) {
    const uint32_t a = below[e], b = below[(e + 1) % 6];
    faces.push_back({b, a, a + layer, b + layer});
  }
  return faces;
}

Mesh honeycomb(uint32_t nx, uint32_t ny, uint32_t nz) {
  Mesh mesh;
  mesh.blocks.push_back(polyhedra());
  for (uint32_t k = 0; k < nz; ++k) {
    for (uint32_t j = 0; j < ny; ++j) {
      for (uint32_t i = 0; i < nx; ++i) add_polyhedron(mesh.blocks[0], hexagonal_prism(i, j, k, nx, ny));
    }
  }
  std::vector<float> positions;
  for (uint32_t i = 0; i < (2 * nx + 2) * (ny + 1) * (nz + 1); ++i) {
    const uint32_t column = i % (2 * nx + 2), row = i / (2 * nx + 2) % (ny + 1),
                   level = i / (2 * nx + 2) / (ny + 1);
    positions.insert(positions.end(),
                     {static_cast<float>(column), static_cast<float>(row), static_cast<float>(level)});
  }
  set_positions(mesh, positions);
  return mesh;
}

TEST(FaceCoder, KeepsAHoneycombForLittle) {
  const Mesh mesh = honeycomb(20, 20, 20);
  expect_round_trip(mesh);
  expect_round_trip(mesh, 1);
  std::vector<std::byte> bytes;
  const auto report = encode(mesh, *memory_sink(bytes), kept());
  ASSERT_TRUE(report);
  const double faces = static_cast<double>(mesh.blocks[0].face_sizes.size());
  EXPECT_LT(static_cast<double>(report->connectivity.coded_bytes) * 8 / faces, 1);
}

TEST(FaceCoder, KeepsTheOrderOfFacesAndWhereTheyBegin) {
  Mesh mesh = honeycomb(5, 5, 5);
  CellBlock& block = mesh.blocks[0];
  std::mt19937 random(3);
  CellBlock turned = polyhedra();
  for (uint64_t cell = 0; cell < block.size(); ++cell) {
    std::vector<std::vector<uint32_t>> faces;
    auto corners = block.cell(cell);
    for (const uint32_t size : block.faces(cell)) {
      faces.emplace_back(corners.begin(), corners.begin() + size);
      corners = corners.subspan(size);
      std::rotate(faces.back().begin(), faces.back().begin() + random() % size, faces.back().end());
      if (random() % 3 == 0) std::reverse(faces.back().begin(), faces.back().end());
    }
    std::shuffle(faces.begin(), faces.end(), random);
    add_polyhedron(turned, faces);
  }
  mesh.blocks[0] = turned;
  expect_round_trip(mesh);
  expect_round_trip(mesh, 1);
}

TEST(FaceCoder, KeepsOddPolyhedra) {
  Mesh mesh;
  CellBlock block = polyhedra();
  const std::vector<std::vector<uint32_t>> cube = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                                   {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  add_polyhedron(block, {});
  add_polyhedron(block, {{}, {}});
  add_polyhedron(block, {{1}, {2, 2}, {1, 1, 1}, {}});
  add_polyhedron(block, cube);
  add_polyhedron(block, cube);                                     // twice
  add_polyhedron(block, {cube[0], cube[0], cube[1], cube[0]});     // a face again and again
  add_polyhedron(block, {{8, 9, 8, 9, 8}, {9, 8}, {0, 8, 0, 8}});  // points again in a face
  std::vector<std::vector<uint32_t>> tube;                         // a face of many corners, many faces
  tube.emplace_back();
  for (uint32_t i = 10; i < 500; ++i) {
    tube[0].push_back(i);
    tube.push_back({i, i + 1, i + 500, i + 501});
  }
  add_polyhedron(block, tube);
  add_polyhedron(block, tube);
  mesh.blocks.push_back(block);
  set_positions(mesh, std::vector<float>(3 * 1002, 1.25f));
  expect_round_trip(mesh);
  expect_round_trip(mesh, 1);
}

TEST(FaceCoder, KeepsPolygonsOnTheFacesOfPolyhedra) {
  Mesh mesh = honeycomb(6, 6, 3);
  CellBlock floor;
  floor.name = "floor";
  floor.type = CellType::polygon;
  floor.offsets = {0};
  CellBlock wall;
  wall.type = CellType::quad;
  for (uint32_t j = 0; j < 6; ++j) {
    for (uint32_t i = 0; i < 6; ++i) {
      const auto faces = hexagonal_prism(i, j, 0, 6, 6);
      floor.connectivity.insert(floor.connectivity.end(), faces[0].rbegin(), faces[0].rend());
      floor.offsets.push_back(floor.connectivity.size());
      if (j == 0) wall.connectivity.insert(wall.connectivity.end(), faces[2].begin(), faces[2].end());
    }
  }
  floor.connectivity.insert(floor.connectivity.end(), {0, 1, 2, 9, 17});  // on no face
  floor.offsets.push_back(floor.connectivity.size());
  mesh.blocks.push_back(floor);
  mesh.blocks.push_back(wall);
  expect_round_trip(mesh);
  expect_round_trip(mesh, 1);
}

TEST(FaceCoder, KeepsPolyhedraBetweenHexahedra) {
  Mesh mesh = grid(8, 8, 8);
  CellBlock& hexahedra = mesh.blocks[0];
  CellBlock mixed = polyhedra();
  mixed.type = CellType::mixed;
  for (size_t cell = 0; cell * 8 < hexahedra.connectivity.size(); ++cell) {
    const uint32_t* p = hexahedra.connectivity.data() + cell * 8;
    if (cell % 5 == 2) {
      add_polyhedron(mixed, {{p[0], p[4], p[7], p[3]},
                             {p[1], p[2], p[6], p[5]},
                             {p[0], p[1], p[5], p[4]},
                             {p[3], p[7], p[6], p[2]},
                             {p[0], p[3], p[2], p[1]},
                             {p[4], p[5], p[6], p[7]}});
    } else {
      mixed.connectivity.insert(mixed.connectivity.end(), p, p + 8);
      mixed.types.push_back(static_cast<uint8_t>(CellType::hexahedron));
      mixed.offsets.push_back(mixed.connectivity.size());
      mixed.cell_faces.push_back(mixed.face_sizes.size());
    }
  }
  mesh.blocks[0] = mixed;
  add_arrays(mesh, 2);
  expect_round_trip(mesh);
  expect_round_trip(mesh, 1);
}

RC_GTEST_PROP(FaceCoder, KeepsAnySoupWithPolyhedra, ()) {
  RandomVolumeOptions options;
  options.corner_arrays = false;
  Mesh mesh = random_volume(*rc::gen::arbitrary<uint64_t>(), options);
  const int effort = *rc::gen::element(1, 5);
  const auto back = decode(*memory_source(Bytes(encoded(mesh, kept(effort)))));
  RC_ASSERT(back.has_value());
  RC_ASSERT(back->blocks.size() == mesh.blocks.size());
  for (size_t b = 0; b < mesh.blocks.size(); ++b) {
    RC_ASSERT(back->blocks[b].connectivity == mesh.blocks[b].connectivity);
    RC_ASSERT(back->blocks[b].types == mesh.blocks[b].types);
    RC_ASSERT(back->blocks[b].offsets == mesh.blocks[b].offsets);
    RC_ASSERT(back->blocks[b].face_sizes == mesh.blocks[b].face_sizes);
    RC_ASSERT(back->blocks[b].cell_faces == mesh.blocks[b].cell_faces);
  }
  RC_ASSERT(back->points.bytes == mesh.points.bytes);
}

/// Few points, so that cells share faces all the time, and everything else.
Mesh crowded(unsigned seed) {
  std::mt19937 engine(seed);
  const auto random = [&] { return static_cast<uint32_t>(engine()); };
  Mesh mesh;
  CellBlock block = polyhedra();
  block.type = CellType::mixed;
  std::vector<std::vector<uint32_t>> known;
  const uint32_t points = 6 + random() % 20;
  for (unsigned cell = 0; cell < 60; ++cell) {
    std::vector<std::vector<uint32_t>> faces;
    for (unsigned f = random() % 7; f > 0; --f) {
      if (!known.empty() && random() % 3 != 0) {
        faces.push_back(known[random() % known.size()]);
        if (random() % 2 == 0) std::reverse(faces.back().begin(), faces.back().end());
        continue;
      }
      std::vector<uint32_t> face(1 + random() % 6);
      for (uint32_t& point : face) point = random() % points;
      known.push_back(face);
      faces.push_back(face);
    }
    add_polyhedron(block, faces);
    if (random() % 3 != 0 || known.empty()) continue;
    const auto& face = known[random() % known.size()];
    const CellType type = face.size() == 3 && random() % 2 == 0 ? CellType::triangle : CellType::polygon;
    block.types.push_back(static_cast<uint8_t>(type));
    block.connectivity.insert(block.connectivity.end(), face.begin(), face.end());
    block.offsets.push_back(block.connectivity.size());
    block.cell_faces.push_back(block.face_sizes.size());
    if (random() % 2 == 0) continue;
    block.types.push_back(static_cast<uint8_t>(CellType::hexahedron));
    for (unsigned i = 0; i < 8; ++i) block.connectivity.push_back(random() % points);
    block.offsets.push_back(block.connectivity.size());
    block.cell_faces.push_back(block.face_sizes.size());
  }
  mesh.blocks.push_back(block);
  std::vector<float> positions(3 * points);
  for (float& x : positions) x = static_cast<float>(random() % 100);
  set_positions(mesh, positions);
  return mesh;
}

RC_GTEST_PROP(FaceCoder, KeepsCrowdsOfCellsThatShareFaces, ()) {
  const Mesh mesh = crowded(*rc::gen::arbitrary<unsigned>());
  const auto back = decode(*memory_source(Bytes(encoded(mesh, kept(*rc::gen::element(1, 5))))));
  RC_ASSERT(back.has_value());
  RC_ASSERT(back->blocks[0].connectivity == mesh.blocks[0].connectivity);
  RC_ASSERT(back->blocks[0].face_sizes == mesh.blocks[0].face_sizes);
  RC_ASSERT(back->blocks[0].cell_faces == mesh.blocks[0].cell_faces);
  RC_ASSERT(back->blocks[0].types == mesh.blocks[0].types);
}

TEST(FaceCoder, AnyOrderIsTheSameMesh) {
  const Mesh mesh = honeycomb(4, 4, 4);
  EncodeOptions options;
  options.mode = Mode::stream;
  options.order = Order::canonical;
  const auto back = decode(*memory_source(Bytes(encoded(mesh, options))));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->point_count(), mesh.point_count());
  EXPECT_EQ(back->blocks[0].face_sizes.size(), mesh.blocks[0].face_sizes.size());
}

// Checksums keep accidents out, not attackers: the coder itself must take any bytes.
TEST(FaceCoder, DamagedPolyhedraDecodeOrAreRefused) {
  for (const Mesh& mesh : {crowded(5), honeycomb(4, 4, 4)}) {
    const CellBlock& block = mesh.blocks[0];
    RangeEncoder topology, numbers;
    CellCoder<RangeEncoder> encoder(Mixing::mixed, true);
    CodedCells out;
    std::vector<unsigned> uses(mesh.point_count());
    for (const uint32_t point : block.connectivity) ++uses[point];
    for (uint64_t i = 0; i < block.size(); ++i) {
      if (block.type_of(i) != CellType::polyhedron) continue;
      StreamedCell cell;
      cell.kind = face_cell;
      cell.type = CellType::polyhedron;
      const auto points = block.cell(i);
      cell.numbers.assign(points.begin(), points.end());
      cell.sizes.assign(block.faces(i).begin(), block.faces(i).end());
      for (const uint32_t point : points) cell.finals.push_back(--uses[point] == 0);
      encoder.code(topology, numbers, cell, out);
    }
    const std::vector<std::byte> right_cells = topology.finish(), right_numbers = numbers.finish();
    std::mt19937 random(2);
    for (unsigned round = 0; round < cases(500); ++round) {
      std::vector<std::byte> cells = right_cells, names = right_numbers;
      cells[random() % cells.size()] ^= static_cast<std::byte>(1u << random() % 8);
      if (round % 3 == 0) names[random() % names.size()] ^= static_cast<std::byte>(1u << random() % 8);
      RangeDecoder cell_decoder{Bytes(cells)}, name_decoder{Bytes(names)};
      CellCoder<RangeDecoder> decoder(Mixing::mixed, true);
      StreamedCell cell;
      out.clear();
      for (unsigned i = 0; i < 200; ++i) {
        if (!decoder.code(cell_decoder, name_decoder, cell, out) || cell_decoder.exhausted()) break;
        if (i % 32 == 31) {
          out.clear();
          decoder.end_block();
        }
      }
    }
  }
}

}  // namespace
}  // namespace maille
