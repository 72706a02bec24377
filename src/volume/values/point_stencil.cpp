#include "volume/values/point_stencil.h"

namespace maille {
namespace {

/// Stencils of points in cells with a shape, unless all seven other corners of a hexahedron are there.
class Builder {
 public:
  Builder(const NewPoint& point, const CodedCells& cells, PointStencil& stencil)
      : stencil_(stencil),
        point_(point),
        shape_(cell_shapes[cells.kinds[point.cell]]),
        nodes_(std::span(cells.nodes).subspan(cells.begin[point.cell])),
        // New corners come up in order, so those from this one on are not there yet.
        known_(((1u << shape_.corners) - 1) & ~(point.fresh & ~((1u << point.node) - 1))) {}

  void corner() {
    const unsigned c = point_.node;
    for (unsigned n = shape_.neighbours[c] & known_; n != 0 && stencil_.near_count < 3; n &= n - 1) {
      stencil_.near[stencil_.near_count++] = nodes_[static_cast<unsigned>(__builtin_ctz(n))];
    }
    const unsigned parallelograms = parallelogram_mean(c);
    extrapolations(c);
    if (stencil_.near_count > 0) mean_of(shape_.neighbours[c] & known_);
    stencil_.situation =
        static_cast<uint8_t>(PointStencil::partial + 4 * parallelograms + stencil_.near_count);
  }

  /// A node behind the corners: the middle of those it lies between. All corners are there.
  void between() {
    const unsigned corners = shape_.lies_on[point_.node];
    mean_of(corners);
    for (unsigned c = corners; c != 0 && stencil_.near_count < 3; c &= c - 1) {
      stencil_.near[stencil_.near_count++] = nodes_[static_cast<unsigned>(__builtin_ctz(c))];
    }
    const int size = __builtin_popcount(corners);
    stencil_.situation = static_cast<uint8_t>(PointStencil::between + (size == 2 ? 0 : size <= 4 ? 1 : 2));
  }

 private:
  bool is_known(unsigned corner) const { return (known_ >> corner & 1) != 0; }

  // At most two are added, as docs/format.md, 16.7 has it, though all whole ones are counted: how many there
  // are tells how well the place is known.
  unsigned parallelogram_mean(unsigned c) {
    unsigned count = 0;
    for (unsigned i = 0; i < shape_.parallelograms[c]; ++i) count += is_whole(shape_.parallelogram[c][i]);
    if (count == 0) return 0;
    PointSum& sum = stencil_.add_sum();
    const unsigned used = count < 2 ? count : 2;
    unsigned left = used;
    for (unsigned i = 0; i < shape_.parallelograms[c] && left > 0; ++i) {
      const auto& p = shape_.parallelogram[c][i];
      if (!is_whole(p)) continue;
      --left;
      sum.add(nodes_[p.a], 1.0 / used);
      sum.add(nodes_[p.b], 1.0 / used);
      sum.add(nodes_[p.opposite], -1.0 / used);
    }
    return count;
  }
  bool is_whole(const CellShape::Parallelogram& p) const {
    return is_known(p.a) && is_known(p.b) && is_known(p.opposite);
  }

  /// The mean of 2 n - b over the neighbours n that have a point b behind them: rows go on straight. `behind`
  /// counts all neighbours in order, known or not.
  void extrapolations(unsigned c) {
    unsigned place = 0, count = 0;
    std::array<std::array<uint32_t, 2>, 3> pair{};
    for (unsigned n = shape_.neighbours[c]; n != 0 && place < 3; n &= n - 1, ++place) {
      const auto corner = static_cast<unsigned>(__builtin_ctz(n));
      if (is_known(corner) && point_.behind[place] != no_slot)
        pair[count++] = {nodes_[corner], point_.behind[place]};
    }
    if (count == 0) return;
    PointSum& sum = stencil_.add_sum();
    for (unsigned i = 0; i < count; ++i) {
      sum.add(pair[i][0], 2.0 / count);
      sum.add(pair[i][1], -1.0 / count);
    }
  }

  void mean_of(unsigned corners) {
    PointSum& sum = stencil_.add_sum();
    const int count = __builtin_popcount(corners);
    for (unsigned c = corners; c != 0; c &= c - 1) {
      sum.add(nodes_[static_cast<unsigned>(__builtin_ctz(c))], 1.0 / count);
    }
  }

  PointStencil& stencil_;
  const NewPoint& point_;
  const CellShape& shape_;
  std::span<const uint32_t> nodes_;
  unsigned known_;
};

/// The polynomial of lowest degree through the seven others (Ibarria et al. 2003, "Out-of-core compression
/// and decompression of large n-dimensional scalar fields"); the sum is made where it is used.
void find_full(const NewPoint& point, const uint32_t* nodes, PointStencil& stencil) {
  const std::array<uint8_t, 7>& others = others_of_corner[point.node];
  for (unsigned k = 0; k < 7; ++k) stencil.others[k] = nodes[others[k]];
  stencil.near_count = 3;
  for (unsigned k = 0; k < 3; ++k) stencil.near[k] = stencil.others[k];
  stencil.situation = static_cast<uint8_t>(PointStencil::full + point.node);
}

/// A point of a face: near the corners before it, and one of the edge to which the face will come back.
void find_in_face(const NewPoint& point, PointStencil& stencil) {
  for (const uint32_t slot : point.behind) {
    if (slot != no_slot) stencil.near[stencil.near_count++] = slot;
  }
  if (stencil.near_count == 0) return;
  PointSum& mean = stencil.add_sum();
  for (unsigned i = 0; i < stencil.near_count; ++i) mean.add(stencil.near[i], 1.0 / stencil.near_count);
  stencil.add_sum().add(stencil.near[0], 1);
  stencil.situation = static_cast<uint8_t>(PointStencil::partial + stencil.near_count);
}

}  // namespace

const std::array<std::array<uint8_t, 7>, most_corners> others_of_corner = [] {
  std::array<std::array<uint8_t, 7>, most_corners> table{};
  const CellShape& shape = cell_shapes[kind_of(CellType::hexahedron)];
  for (unsigned c = 0; c < most_corners; ++c) {
    unsigned seen = 1u << c, at = 0;
    const auto add = [&](unsigned corner) {
      table[c][at++] = static_cast<uint8_t>(corner);
      seen |= 1u << corner;
    };
    for (unsigned n = shape.neighbours[c]; n != 0; n &= n - 1) add(static_cast<unsigned>(__builtin_ctz(n)));
    for (const auto& p : shape.parallelogram[c]) add(p.opposite);
    add(static_cast<unsigned>(__builtin_ctz(~seen)));
  }
  return table;
}();

void find_stencil(const NewPoint& point, const CodedCells& cells, PointStencil& stencil) {
  stencil.clear();
  if (point.cell != no_slot && cells.kinds[point.cell] == face_cell) return find_in_face(point, stencil);
  if (is_full(point, cells)) return find_full(point, cells.nodes.data() + cells.begin[point.cell], stencil);
  if (point.cell == no_slot || cells.kinds[point.cell] >= shape_count) return;
  Builder builder(point, cells, stencil);
  if (point.node < cell_shapes[cells.kinds[point.cell]].corners) {
    builder.corner();
  } else {
    builder.between();
  }
}

}  // namespace maille
