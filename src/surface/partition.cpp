#include "surface/partition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "surface/half_edges.h"

namespace maille {
namespace {

/// A cell and where it lies along the axis at hand.
struct PlacedCell {
  float place;
  uint32_t cell;
};

class Partition {
 public:
  Partition(const Mesh& mesh, std::span<const float> positions, uint64_t most_cells)
      : mesh_(mesh), positions_(positions), most_cells_(most_cells), cells_(mesh.cell_count()) {
    part_of_.resize(cells_.size());
    for (uint32_t i = 0; i < cells_.size(); ++i) cells_[i].cell = i;
    uint64_t before = 0;
    for (const CellBlock& block : mesh.blocks) first_cell_.push_back(before += block.size());
  }

  std::vector<uint32_t> run() {
    split(cells_);
    return std::move(part_of_);
  }

 private:
  std::span<const uint32_t> nodes(uint32_t cell) const {
    size_t block = 0;
    while (cell >= first_cell_[block]) ++block;
    return mesh_.blocks[block].cell(cell - (first_cell_[block] - mesh_.blocks[block].size()));
  }

  /// Twice the middle of the cell's box: the same whatever the order of its nodes.
  float place(uint32_t cell, unsigned axis) const {
    float low = std::numeric_limits<float>::max();
    float high = std::numeric_limits<float>::lowest();
    for (const uint32_t node : nodes(cell)) {
      const float position = positions_[size_t{3} * node + axis];
      low = std::min(low, position);
      high = std::max(high, position);
    }
    return low > high ? 0 : low / 2 + high / 2;
  }

  /// Each split leaves cells on both sides, and at most two in a row leave more than half on one: those of
  /// one place may be many. So it is at most 64 deep.
  void split(std::span<PlacedCell> cells) {
    size_t left = 0;
    if (cells.size() > most_cells_) {
      for (const unsigned axis : axes_by_length(cells)) {
        left = halve(cells, axis);
        if (left != 0) break;
      }
    }
    if (left == 0) {
      for (const PlacedCell& cell : cells) part_of_[cell.cell] = parts_;
      ++parts_;
      return;
    }
    split(cells.first(left));
    split(cells.subspan(left));
  }

  std::array<unsigned, 3> axes_by_length(std::span<const PlacedCell> cells) const {
    std::array<double, 3> length;
    for (unsigned axis = 0; axis < 3; ++axis) {
      float low = std::numeric_limits<float>::max();
      float high = std::numeric_limits<float>::lowest();
      for (const PlacedCell& cell : cells) {
        const float at = place(cell.cell, axis);
        low = std::min(low, at);
        high = std::max(high, at);
      }
      length[axis] = static_cast<double>(high) - static_cast<double>(low);
    }
    std::array<unsigned, 3> axes = {0, 1, 2};
    std::stable_sort(axes.begin(), axes.end(), [&](unsigned a, unsigned b) { return length[a] > length[b]; });
    return axes;
  }

  /// Puts the lower half in front; returns its size, 0 when all cells are in one place.
  size_t halve(std::span<PlacedCell> cells, unsigned axis) {
    for (PlacedCell& cell : cells) cell.place = place(cell.cell, axis);
    const auto middle = cells.begin() + static_cast<ptrdiff_t>(cells.size() / 2);
    std::nth_element(cells.begin(), middle, cells.end(),
                     [](const PlacedCell& a, const PlacedCell& b) { return a.place < b.place; });
    const float at = middle->place;
    const auto below =
        std::partition(cells.begin(), cells.end(), [at](const PlacedCell& cell) { return cell.place < at; });
    if (below != cells.begin()) return static_cast<size_t>(below - cells.begin());
    const auto equal =
        std::partition(cells.begin(), cells.end(), [at](const PlacedCell& cell) { return cell.place <= at; });
    return equal == cells.end() ? 0 : static_cast<size_t>(equal - cells.begin());
  }

  const Mesh& mesh_;
  std::span<const float> positions_;
  uint64_t most_cells_;
  std::vector<uint64_t> first_cell_;  // behind each block
  std::vector<PlacedCell> cells_;
  std::vector<uint32_t> part_of_;
  uint32_t parts_ = 0;
};

/// Points of each part in the order of the whole; `part_of_point` is filled part by part.
void number_points(const Mesh& mesh, std::span<const uint32_t> part_of, std::vector<MeshPart>& parts) {
  const size_t points = mesh.point_count();
  std::vector<bool> used(points);
  uint32_t cell = 0;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i, ++cell) {
      for (const uint32_t point : block.cell(i)) {
        used[point] = true;
        parts[part_of[cell]].numbers.points.push_back(point);
      }
    }
  }
  for (MeshPart& part : parts) {
    std::sort(part.numbers.points.begin(), part.numbers.points.end());
    part.numbers.points.erase(std::unique(part.numbers.points.begin(), part.numbers.points.end()),
                              part.numbers.points.end());
  }
  std::vector<uint32_t> unused;
  for (uint32_t point = 0; point < points; ++point) {
    if (!used[point]) unused.push_back(point);
  }
  if (unused.empty()) return;
  std::vector<uint32_t> merged(parts[0].numbers.points.size() + unused.size());
  std::merge(parts[0].numbers.points.begin(), parts[0].numbers.points.end(), unused.begin(), unused.end(),
             merged.begin());
  parts[0].numbers.points = std::move(merged);
}

void copy_positions(const Array& from, MeshPart& part) {
  Array& to = part.mesh.points;
  to = make_array(from.name, from.domain, from.type, from.components, from.role);
  to.resize(part.numbers.points.size());
  const size_t size = from.tuple_size();
  for (size_t i = 0; i < part.numbers.points.size(); ++i) {
    std::copy_n(from.bytes.begin() + static_cast<ptrdiff_t>(part.numbers.points[i] * size), size,
                to.bytes.begin() + static_cast<ptrdiff_t>(i * size));
  }
}

void copy_cells(const Mesh& mesh, const std::vector<uint32_t>& number, MeshPart& part) {
  uint64_t block_cell = 0;
  uint64_t block_corner = 0;
  size_t next = 0;
  for (const CellBlock& block : mesh.blocks) {
    CellBlock& taken = part.mesh.blocks.emplace_back();
    taken.type = block.type;
    for (; next < part.numbers.cells.size() && part.numbers.cells[next] < block_cell + block.size(); ++next) {
      const uint64_t i = part.numbers.cells[next] - block_cell;
      const auto nodes = block.cell(i);
      const uint64_t corner = block.offsets.empty() ? i * nodes.size() : block.offsets[i];
      part.numbers.first_corner.push_back(static_cast<uint32_t>(block_corner + corner));
      for (const uint32_t node : nodes) taken.connectivity.push_back(number[node]);
      if (!block.types.empty()) taken.types.push_back(block.types[i]);
      if (block.offsets.empty()) continue;
      if (taken.offsets.empty()) taken.offsets.push_back(0);
      taken.offsets.push_back(taken.connectivity.size());
    }
    block_cell += block.size();
    block_corner += block.connectivity.size();
  }
}

}  // namespace

std::vector<uint32_t> partition_cells(const Mesh& mesh, std::span<const float> positions,
                                      uint64_t most_cells) {
  return Partition(mesh, positions, most_cells).run();
}

std::vector<MeshPart> take_parts(const Mesh& mesh, std::span<const uint32_t> part_of) {
  uint32_t count = 1;
  for (const uint32_t part : part_of) count = std::max(count, part + 1);
  std::vector<MeshPart> parts(count);
  number_points(mesh, part_of, parts);
  for (uint32_t cell = 0; cell < part_of.size(); ++cell) parts[part_of[cell]].numbers.cells.push_back(cell);
  std::vector<uint32_t> number(mesh.point_count());  // of the points of the part at hand
  for (MeshPart& part : parts) {
    copy_positions(mesh.points, part);
    for (uint32_t i = 0; i < part.numbers.points.size(); ++i) number[part.numbers.points[i]] = i;
    copy_cells(mesh, number, part);
  }
  return parts;
}

}  // namespace maille
