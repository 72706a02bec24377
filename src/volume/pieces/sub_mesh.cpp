#include "volume/pieces/sub_mesh.h"

#include "mesh/cut_out.h"

namespace maille {

SubMesh take_cells(const Mesh& mesh, std::span<const uint32_t> cells) {
  CutOut cut = cut_out(mesh, cells, CutArrays::elements);
  SubMesh sub;
  std::vector<CellBlock> blocks = std::move(cut.mesh.blocks);
  sub.mesh = std::move(cut.mesh);
  sub.mesh.blocks.clear();
  for (uint32_t b = 0; b < blocks.size(); ++b) {
    if (blocks[b].size() == 0) continue;
    sub.mesh.blocks.push_back(std::move(blocks[b]));
    sub.block_numbers.push_back(b);
  }
  sub.points = std::move(cut.points);
  return sub;
}

SubMesh take_points(const Mesh& mesh, std::vector<uint32_t> numbers) {
  SubMesh sub;
  sub.points = std::move(numbers);
  sub.mesh.points = taken(mesh.points, sub.points);
  for (const Array& array : mesh.arrays) {
    if (array.domain == Domain::point) sub.mesh.arrays.push_back(taken(array, sub.points));
    if (array.domain == Domain::cell) sub.mesh.arrays.push_back(taken(array, {}));
  }
  return sub;
}

}  // namespace maille
