#include "mesh/cell_turns.h"

#include <gtest/gtest.h>
#include <maille/compare.h>
#include <maille/faces.h>

#include <algorithm>
#include <numeric>
#include <set>

namespace maille {
namespace {

struct Solid {
  CellType type;
  unsigned corners;
  size_t turns;
};
constexpr Solid solids[] = {{CellType::tetrahedron, 4, 12},
                            {CellType::pyramid, 5, 4},
                            {CellType::wedge, 6, 6},
                            {CellType::hexahedron, 8, 24}};

TEST(CellTurns, AreAllThatLeaveTheFacesOutwards) {
  for (const Solid& solid : solids) {
    const FacesOfSolid& faces = faces_of(solid.type);
    std::set<std::array<uint8_t, 8>> different;
    for (const CellTurn& turn : turns_of(solid.type)) {
      different.insert(turn.corner);
      for (unsigned f = 0; f < faces.count; ++f) {
        const auto face = faces.face(f), before = faces.face(turn.face[f]);
        ASSERT_EQ(face.size(), before.size());
        const auto start = std::find(before.begin(), before.end(), turn.corner[face[0]]) - before.begin();
        for (size_t k = 0; k < face.size(); ++k)
          EXPECT_EQ(turn.corner[face[k]], before[(static_cast<size_t>(start) + k) % face.size()]);
      }
    }
    EXPECT_EQ(different.size(), solid.turns);
    EXPECT_EQ(turns_of(solid.type).size(), solid.turns);
  }
  EXPECT_TRUE(turns_of(CellType::voxel).empty());
}

Mesh one_cell(const Solid& solid, bool all_alike) {
  Mesh mesh;
  mesh.points = make_array("position", Domain::point, Scalar::f32, 3);
  mesh.points.resize(solid.corners);
  const auto numbers = mesh.points.values<float>();
  if (!all_alike) std::iota(numbers.begin(), numbers.end(), 0.0F);
  mesh.blocks.emplace_back().type = solid.type;
  mesh.blocks[0].connectivity.resize(solid.corners);
  std::iota(mesh.blocks[0].connectivity.begin(), mesh.blocks[0].connectivity.end(), 0u);
  return mesh;
}

TEST(CellTurns, LeaveAMeshTheSameAndMirroringDoesNot) {
  for (const Solid& solid : solids) {
    for (const bool all_alike : {false, true}) {
      const Mesh mesh = one_cell(solid, all_alike);
      for (const CellTurn& turn : turns_of(solid.type)) {
        Mesh turned = mesh;
        for (unsigned k = 0; k < solid.corners; ++k) turned.blocks[0].connectivity[k] = turn.corner[k];
        EXPECT_TRUE(compare(mesh, turned).equal);
      }
      Mesh mirrored = mesh;
      auto& points = mirrored.blocks[0].connectivity;
      std::swap(points[0], points[1]);
      EXPECT_EQ(compare(mesh, mirrored).equal, all_alike);
    }
  }
}

}  // namespace
}  // namespace maille
