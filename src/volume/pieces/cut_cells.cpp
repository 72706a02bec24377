#include "volume/pieces/cut_cells.h"

#include <algorithm>

#include "volume/pieces/bisection.h"
#include "volume/pieces/cut_rules.h"

namespace maille {
namespace {

std::vector<Middle> middles_of(const Mesh& mesh) {
  std::vector<Middle> middles;
  middles.reserve(mesh.cell_count());
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto cell = static_cast<uint32_t>(middles.size());
      middles.push_back({middle_of(mesh.points, block.cell(i)), cell});
    }
  }
  return middles;
}

}  // namespace

std::vector<std::vector<uint32_t>> cut_cells(const Mesh& mesh, uint64_t target, Executor& executor) {
  const Bisection found = bisect(middles_of(mesh), pieces_of(mesh.cell_count(), target), executor);
  std::vector<std::vector<uint32_t>> pieces(found.ends.size());
  executor.parallel_for(pieces.size(), [&](size_t i) {
    for (size_t k = i == 0 ? 0 : found.ends[i - 1]; k < found.ends[i]; ++k)
      pieces[i].push_back(found.middles[k].cell);
    std::sort(pieces[i].begin(), pieces[i].end());
  });
  return pieces;
}

}  // namespace maille
