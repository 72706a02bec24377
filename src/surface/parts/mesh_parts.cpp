#include "surface/parts/mesh_parts.h"

#include <algorithm>
#include <atomic>

#include "base/chunks.h"
#include "mesh/ranked_set.h"

namespace maille {
namespace {

std::vector<uint32_t> find_unused_points(const Mesh& mesh, Executor& executor) {
  // Several threads may set one point; all set the same, so no order is needed.
  std::vector<std::atomic<bool>> used(mesh.point_count());
  for (const CellBlock& block : mesh.blocks) {
    for_each_chunk(executor, block.connectivity.size(), [&](size_t, size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) used[block.connectivity[i]].store(true, std::memory_order_relaxed);
    });
  }
  std::vector<uint32_t> unused;
  for (uint32_t point = 0; point < used.size(); ++point) {
    if (!used[point].load(std::memory_order_relaxed)) unused.push_back(point);
  }
  return unused;
}

/// Calls visit(block number, cell in its block) for ascending cells. Blocks without any are passed over, as
/// there may be as many blocks as cells.
template <class Visit>
void visit_cells(std::span<const uint64_t> cells_before, std::span<const uint32_t> cells, Visit visit) {
  size_t block = 0;
  for (const uint32_t cell : cells) {
    if (cell >= cells_before[block + 1]) {
      const auto behind = std::upper_bound(cells_before.begin(), cells_before.end(), uint64_t{cell});
      block = static_cast<size_t>(behind - cells_before.begin()) - 1;
    }
    visit(block, cell - cells_before[block]);
  }
}

/// Cells keep their order, and corners get the ranks of their points. Corners are counted first, so that
/// nothing grows by doubling.
void copy_cells(const Mesh& mesh, std::span<const uint64_t> cells_before, std::span<const uint32_t> cells,
                const RankedSet& points, MeshPart& part) {
  std::vector<size_t> corners;
  visit_cells(cells_before, cells, [&](size_t b, uint64_t cell) {
    if (part.block_numbers.empty() || part.block_numbers.back() != b) {
      part.block_numbers.push_back(static_cast<uint32_t>(b));
      corners.push_back(0);
    }
    corners.back() += mesh.blocks[b].cell(cell).size();
  });
  part.mesh.blocks.resize(part.block_numbers.size());
  for (size_t k = 0; k < part.block_numbers.size(); ++k) {
    part.mesh.blocks[k].type = mesh.blocks[part.block_numbers[k]].type;
    part.mesh.blocks[k].connectivity.reserve(corners[k]);
  }
  size_t k = 0;
  visit_cells(cells_before, cells, [&](size_t b, uint64_t cell) {
    while (part.block_numbers[k] != b) ++k;
    const CellBlock& block = mesh.blocks[b];
    CellBlock& taken = part.mesh.blocks[k];
    for (const uint32_t node : block.cell(cell)) taken.connectivity.push_back(points.rank(node));
    if (!block.types.empty()) taken.types.push_back(block.types[cell]);
    if (block.offsets.empty()) return;
    if (taken.offsets.empty()) taken.offsets.push_back(0);
    taken.offsets.push_back(taken.connectivity.size());
  });
}

/// Counted over all blocks, as PartNumbers wants; of a mesh whose corners fit 32 bits.
std::vector<uint32_t> first_corners(const Mesh& mesh, std::span<const uint64_t> cells_before,
                                    std::span<const uint64_t> corners_before,
                                    std::span<const uint32_t> cells) {
  std::vector<uint32_t> first;
  first.reserve(cells.size());
  visit_cells(cells_before, cells, [&](size_t b, uint64_t cell) {
    const auto in_block = mesh.blocks[b].cell(cell).data() - mesh.blocks[b].connectivity.data();
    first.push_back(static_cast<uint32_t>(corners_before[b] + static_cast<uint64_t>(in_block)));
  });
  return first;
}

}  // namespace

std::vector<BlockCells> MeshPart::cells_by_block() const {
  std::vector<BlockCells> cells;
  for (size_t k = 0; k < block_numbers.size(); ++k)
    cells.push_back({block_numbers[k], mesh.blocks[k].size()});
  return cells;
}

MeshParts::MeshParts(const Mesh& mesh, std::span<const uint32_t> part_of, Executor& executor, bool with_cells)
    : mesh_(mesh), with_cells_(with_cells), unused_points_(find_unused_points(mesh, executor)) {
  cells_before_.push_back(0);
  corners_before_.push_back(0);
  for (const CellBlock& block : mesh.blocks) {
    cells_before_.push_back(cells_before_.back() + block.size());
    corners_before_.push_back(corners_before_.back() + block.connectivity.size());
  }
  std::vector<size_t> count(1);
  for (const uint32_t part : part_of) {
    if (part >= count.size()) count.resize(size_t{part} + 1);
    ++count[part];
  }
  cells_.resize(count.size());
  for (size_t part = 0; part < count.size(); ++part) cells_[part].reserve(count[part]);
  for (uint32_t cell = 0; cell < part_of.size(); ++cell) cells_[part_of[cell]].push_back(cell);
}

MeshPart MeshParts::take(size_t part) {
  MeshPart taken;
  std::vector<uint32_t> cells = std::move(cells_[part]);
  RankedSet points(mesh_.point_count());
  visit_cells(cells_before_, cells, [&](size_t b, uint64_t cell) {
    for (const uint32_t node : mesh_.blocks[b].cell(cell)) points.add(node);
  });
  // Points of no cell must be in one part.
  if (part == 0) {
    for (const uint32_t point : unused_points_) points.add(point);
  }
  points.count();
  taken.numbers.points = points.numbers();
  taken.mesh.points = make_array({}, Domain::point, Scalar::u8, 1);
  taken.mesh.points.resize(taken.numbers.points.size());
  copy_cells(mesh_, cells_before_, cells, points, taken);
  if (with_cells_) {
    taken.numbers.first_corner = first_corners(mesh_, cells_before_, corners_before_, cells);
    taken.numbers.cells = std::move(cells);
  }
  return taken;
}

}  // namespace maille
