#include "volume/pieces/cut_cells.h"

#include "volume/pieces/bisection.h"
#include "volume/pieces/cut_rules.h"

namespace maille {
namespace {

/// By cell its middle, side by side in stretches; each is a sum of its own, so that threads change nothing.
/// 65,536 cells: enough work for a task, and counts of 24 KiB for each stretch are half a byte a cell.
/// `reaches`: none where nobody asks how far cells reach.
std::vector<Middle> middles_of(const Mesh& mesh, ReachCounts* reaches, Executor& executor) {
  constexpr uint64_t at_once = uint64_t{1} << 16;
  const std::vector<CutPosition> positions = cut_positions(mesh.points, executor);
  std::vector<Middle> middles(mesh.cell_count());
  uint64_t before = 0;
  for (const CellBlock& block : mesh.blocks) {
    const uint64_t cells = block.size();
    const uint64_t stretches = (cells + at_once - 1) / at_once;
    std::vector<ReachCounts> counts(reaches == nullptr ? 0 : stretches);
    executor.parallel_for(stretches, [&](size_t stretch) {
      const uint64_t end = std::min(cells, (stretch + 1) * at_once);
      for (uint64_t i = stretch * at_once; i < end; ++i) {
        CellCorners corners;
        for (const uint32_t point : block.cell(i)) corners.add(positions[point]);
        middles[before + i] = {corners.middle(), static_cast<uint32_t>(before + i)};
        if (reaches != nullptr) counts[stretch].add(corners.reach());
      }
    });
    for (const ReachCounts& some : counts) reaches->add(some);
    before += cells;
  }
  return middles;
}

std::vector<std::vector<uint32_t>> lists_of(const Bisection& found, Executor& executor) {
  std::vector<std::vector<uint32_t>> pieces(found.ends.size());
  executor.parallel_for(pieces.size(), [&](size_t i) {
    const auto cells = found.piece(i);  // middles stand by their numbers
    pieces[i].assign(cells.begin(), cells.end());
  });
  return pieces;
}

}  // namespace

std::vector<std::vector<uint32_t>> cut_cells(const Mesh& mesh, uint64_t target, Executor& executor) {
  ReachCounts reaches;
  const std::vector<Middle> middles = middles_of(mesh, &reaches, executor);
  return lists_of(bisect(middles, reaches.median(), pieces_of(middles.size(), target), executor), executor);
}

std::vector<std::vector<uint32_t>> group_cells(const Mesh& mesh, uint64_t target) {
  const std::vector<Middle> middles = middles_of(mesh, nullptr, serial_executor());
  const uint64_t groups = pieces_of(middles.size(), target);
  return lists_of(bisect(middles, CutPosition{}, groups, serial_executor()), serial_executor());
}

}  // namespace maille
