#include "volume/pieces/cut_cells.h"

#include "volume/pieces/bisection.h"
#include "volume/pieces/cut_rules.h"

namespace maille {
namespace {

/// By cell its middle, side by side in stretches; each is a sum of its own, so that threads change nothing.
std::vector<Middle> middles_of(const Mesh& mesh, Executor& executor) {
  constexpr uint64_t at_once = uint64_t{1} << 14;
  const std::vector<CutPosition> positions = cut_positions(mesh.points, executor);
  std::vector<Middle> middles(mesh.cell_count());
  uint64_t before = 0;
  for (const CellBlock& block : mesh.blocks) {
    const uint64_t cells = block.size();
    executor.parallel_for((cells + at_once - 1) / at_once, [&](size_t stretch) {
      const uint64_t end = std::min(cells, (stretch + 1) * at_once);
      for (uint64_t i = stretch * at_once; i < end; ++i) {
        MiddleSum sum;
        for (const uint32_t point : block.cell(i)) sum.add(positions[point]);
        middles[before + i] = {sum.middle(), static_cast<uint32_t>(before + i)};
      }
    });
    before += cells;
  }
  return middles;
}

}  // namespace

std::vector<std::vector<uint32_t>> cut_cells(const Mesh& mesh, uint64_t target, Executor& executor) {
  const std::vector<Middle> middles = middles_of(mesh, executor);
  const Bisection found = bisect(middles, pieces_of(middles.size(), target), executor);
  std::vector<std::vector<uint32_t>> pieces(found.ends.size());
  executor.parallel_for(pieces.size(), [&](size_t i) {
    const auto cells = found.piece(i);  // middles stand by their numbers
    pieces[i].assign(cells.begin(), cells.end());
  });
  return pieces;
}

}  // namespace maille
