#include <maille/vtk.h>

#include <algorithm>
#include <functional>

namespace maille {
namespace {

VtkBlocks blocks_of(const Mesh& mesh) {
  VtkBlocks blocks;
  for (const CellBlock& block : mesh.blocks) blocks.push_back({block.name, block.type, block.size()});
  return blocks;
}

}  // namespace

// One block without a name follows from the cells, so only other meshes need blocks to be written.
bool vtk_needs_blocks(const VtkBlocks& blocks) {
  if (blocks.size() != 1) return !blocks.empty();
  return !blocks[0].name.empty() || blocks[0].cells == 0;
}

VtkBlocks vtk_needed_blocks(const Mesh& mesh) {
  VtkBlocks blocks = blocks_of(mesh);
  if (vtk_needs_blocks(blocks)) return blocks;
  // A reader takes cells of one type for a block of this type; this block is mixed, and would come back as
  // another.
  const auto uniform = [](const CellBlock& block) {
    return block.type == CellType::mixed && std::adjacent_find(block.types.begin(), block.types.end(),
                                                               std::not_equal_to<>()) == block.types.end();
  };
  if (std::none_of(mesh.blocks.begin(), mesh.blocks.end(), uniform)) blocks.clear();
  return blocks;
}

bool vtk_has_names(const VtkBlocks& blocks) {
  return std::any_of(blocks.begin(), blocks.end(),
                     [](const MeshDescription::Block& block) { return !block.name.empty(); });
}

Array vtk_block_sizes(const VtkBlocks& blocks) {
  Array array = make_array(vtk_blocks_name, Domain::mesh, Scalar::u64, 2);
  array.resize(blocks.size());
  for (size_t b = 0; b < blocks.size(); ++b) {
    array.values<uint64_t>()[2 * b] = blocks[b].cells;
    array.values<uint64_t>()[2 * b + 1] = static_cast<uint64_t>(blocks[b].type);
  }
  return array;
}

std::vector<std::string> vtk_block_names(const VtkBlocks& blocks) {
  std::vector<std::string> names;
  for (const MeshDescription::Block& block : blocks) names.push_back(block.name);
  return names;
}

// The names as labels of a cell array: what programs that know nothing of maille can colour by.
std::optional<Array> vtk_block_array(const Mesh& mesh) {
  const VtkBlocks blocks = blocks_of(mesh);
  if (!vtk_has_names(blocks) || mesh.find(vtk_block_array_name, Domain::cell)) return {};
  Array array = make_array(vtk_block_array_name, Domain::cell, Scalar::u32, 1, Role::label);
  array.resize(mesh.cell_count());
  array.labels = vtk_block_names(blocks);
  uint32_t* number = array.values<uint32_t>().data();
  for (uint32_t b = 0; b < blocks.size(); ++b) number = std::fill_n(number, blocks[b].cells, b);
  return array;
}

std::optional<VtkPolyKind> vtk_poly_kind(CellType type) {
  switch (type) {
    case CellType::vertex:
    case CellType::poly_vertex:
      return VtkPolyKind::verts;
    case CellType::line:
    case CellType::poly_line:
      return VtkPolyKind::lines;
    case CellType::triangle:
    case CellType::quad:
    case CellType::polygon:
      return VtkPolyKind::polys;
    case CellType::triangle_strip:
      return VtkPolyKind::strips;
    default:
      return {};
  }
}

}  // namespace maille
