#include "volume/values/plane_fit.h"

#include <algorithm>
#include <cstring>

#include "numbers/point_position.h"
#include "volume/cells/slots.h"

namespace maille {
namespace {

/// A ridge keeps the plane flat where no samples are: of the mean square of the samples' distances from their
/// middle (10 times more takes 0.3 % more bytes over the shared fields), and of its distance from here. Both
/// are relative, so that the unit of length does not matter.
constexpr double ridge = 1e-4, far_ridge = 3e-3;

/// Solves (A + more) x = b, with the lower triangle of a symmetric A, by elimination from the first row on.
/// False: a pivot is not above 0, or no number, so that there is no solution to rely on.
bool solve(const std::array<double, 6>& a, double more, const Vector3& b, Vector3& x) {
  const double first = a[0] + more;
  if (!(first > 0)) return false;
  const double by_first = a[1] / first, by_first_too = a[3] / first;
  const double second = a[2] + more - by_first * a[1];
  if (!(second > 0)) return false;
  const double off = a[4] - by_first_too * a[1];
  const double by_second = off / second;
  const double third = a[5] + more - by_first_too * a[3] - by_second * off;
  if (!(third > 0)) return false;
  const double y = b[1] - by_first * b[0];
  x[2] = (b[2] - by_first_too * b[0] - by_second * y) / third;
  x[1] = y / second - by_second * x[2];
  x[0] = b[0] / first - by_first * x[1] - by_first_too * x[2];
  return true;
}

}  // namespace

void find_places(Scalar type, Bytes positions, std::vector<Vector3>& places) {
  places.resize(positions.size() / (3 * size_of(type)));
  for (size_t i = 0; i < places.size(); ++i) places[i] = point_position(type, positions.data(), i);
}

DecodedPlaces::DecodedPlaces(const StreamedArray& positions) : positions_(positions) {
  for (const NumberMap& map : positions.maps) spaces_.emplace_back(positions.type, map);
  if (positions.bound == 0) spaces_.clear();
}

void DecodedPlaces::find(Bytes positions, std::vector<Vector3>& places) const {
  find_places(positions_.type, positions, places);
  if (spaces_.empty()) return;
  const size_t size = size_of(positions_.type);
  for (size_t i = 0; i < places.size(); ++i) {
    for (unsigned k = 0; k < 3; ++k) {
      const std::byte* number = positions.data() + (3 * i + k) * size;
      std::array<std::byte, 8> back{};
      spaces_[k].store_number(spaces_[k].code_of(number), back.data());
      double error = 0;
      if (is_kept(positions_, spaces_[k].is_logarithm(), number, back.data(), error))
        places[i][k] = number_as_double(positions_.type, back.data());
    }
  }
}

void PlaneFit::begin_block(const CodedCells& cells, std::span<const Vector3> places) {
  for (size_t i = 0; i < places.size(); ++i) {
    const uint32_t slot = cells.points[i].slot;
    if (slot >= points_.size()) {
      points_.resize(rows_for(slot));
      values_.resize(points_.size() * components_);
    }
    points_[slot] = {places[i], {}};
    std::fill_n(values_at(slot), components_, Values{});
  }
}

void PlaneFit::add_corner(uint32_t slot) {
  const auto end = corner_.begin() + corners_;
  if (slot == slot_ || slot >= points_.size() || std::find(corner_.begin(), end, slot) != end) return;
  offset_[corners_] = points_[slot].place - here_;
  corner_[corners_++] = slot;
}

/// The moments of all samples of the corners. Those of a corner are from that corner; from here they are
/// shifted: sum + n d, and products + s d' + d s' + n d d'. Then the middle instead of the sum, and products
/// from there, which loses the fewest digits for samples far from here.
PlaneFit::Moments PlaneFit::moments_around() const {
  Moments all;
  for (unsigned i = 0; i < corners_; ++i) {
    const Moments& some = points_[corner_[i]].moments;
    const Vector3& offset = offset_[i];
    all.count += some.count;
    for (unsigned j = 0, at = 0; j < 3; ++j) {
      all.sum[j] += some.sum[j] + some.count * offset[j];
      for (unsigned k = 0; k <= j; ++k, ++at)
        all.products[at] += some.products[at] + some.sum[j] * offset[k] + some.sum[k] * offset[j] +
                            some.count * offset[j] * offset[k];
    }
  }
  if (all.count == 0) return all;
  for (double& each : all.sum) each /= all.count;
  for (unsigned j = 0, at = 0; j < 3; ++j) {
    for (unsigned k = 0; k <= j; ++k, ++at) all.products[at] -= all.count * all.sum[j] * all.sum[k];
  }
  return all;
}

const double* PlaneFit::expect_point(const NewPoint& point, const CodedCells& cells) {
  corners_ = 0;
  slot_ = point.slot < points_.size() ? point.slot : no_slot;
  if (slot_ == no_slot || point.cell == no_slot || cells.kinds[point.cell] >= shape_count) return nullptr;
  here_ = points_[slot_].place;
  const CellShape& shape = cell_shapes[cells.kinds[point.cell]];
  const bool between = point.node >= shape.corners;
  // New corners come up in order.
  unsigned known = between ? shape.lies_on[point.node]
                           : ((1u << shape.corners) - 1) & ~(point.fresh & ~((1u << point.node) - 1));
  for (; known != 0; known &= known - 1)
    add_corner(cells.nodes[cells.begin[point.cell] + static_cast<unsigned>(__builtin_ctz(known))]);
  // From the mean of the corners, the nearer the more, along the plane. Corners at the very place of the
  // point say nothing about a direction and are left out.
  double sum = 0;
  for (unsigned i = 0; i < corners_; ++i) {
    const double square = dot(offset_[i], offset_[i]);
    of_own_[i] = square > 1e-60 ? 1 / square : 0;
    // 1e-60: the square of a distance whose square is still a normal double.
    sum += of_own_[i];
  }
  if (!(sum > 0)) return nullptr;
  Vector3 way;
  for (unsigned i = 0; i < corners_; ++i) {
    of_own_[i] /= sum;
    way = way - offset_[i] * of_own_[i];
  }
  return expect(moments_around(), way, 0);
}

/// A cell is expected from its middle. Its corners need places: slots that never had a point of a block with
/// places give "not known".
const double* PlaneFit::expect_cell(const CodedCells& cells, size_t cell) {
  corners_ = 0;
  slot_ = no_slot;
  if (cells.kinds[cell] >= shape_count) return nullptr;
  const unsigned count = cell_shapes[cells.kinds[cell]].corners;
  const uint32_t* const nodes = cells.nodes.data() + cells.begin[cell];
  here_ = {};
  for (unsigned i = 0; i < count; ++i) {
    if (nodes[i] >= points_.size()) return nullptr;
    here_ = here_ + points_[nodes[i]].place * (1.0 / count);
  }
  for (unsigned i = 0; i < count; ++i) add_corner(nodes[i]);
  of_own_.fill(0);
  // From the middle of the samples.
  const Moments around = moments_around();
  if (around.count == 0) return nullptr;
  const Vector3 way{{-around.sum[0], -around.sum[1], -around.sum[2]}};
  return expect(around, way, 1 / around.count);
}

/// Goes along the plane by `way`, from what `of_own_` and `of_mean` say. All that depends on the place is
/// solved once; each component then costs a few products. What is not within +-1e30 is not known, NaN
/// included.
const double* PlaneFit::expect(const Moments& around, const Vector3& way, double of_mean) {
  const Vector3 middle{around.sum};
  const double spread = around.products[0] + around.products[2] + around.products[5];
  Vector3 slope;
  if (around.count > 0) {
    const double more = ridge * spread + far_ridge * dot(middle, middle);
    if (!solve(around.products, more, way, slope)) return nullptr;
  }
  for (uint32_t c = 0; c < components_; ++c) {
    double value = 0;
    for (unsigned i = 0; i < corners_; ++i) {
      const Values& known = values_at(corner_[i])[c];
      value += of_own_[i] * known.own + (of_mean + dot(slope, offset_[i] - middle)) * known.sum +
               dot(slope, known.products);
    }
    if (!(value < 1e30 && value > -1e30)) return nullptr;
    expected_[c] = value;
  }
  return expected_.data();
}

/// A point and each corner are samples of each other and of themselves (hence two for each edge); a cell is
/// one sample at all its corners.
void PlaneFit::learn(const double* values) {
  const bool is_point = slot_ != no_slot;
  for (unsigned i = 0; i < corners_; ++i) {
    Values* const of_corner = values_at(corner_[i]);
    const double count = is_point ? 2 : 1;
    add_sample(points_[corner_[i]].moments, offset_[i] * -1, count);
    if (is_point) add_sample(points_[slot_].moments, offset_[i], count);
    for (uint32_t c = 0; c < components_; ++c) {
      const double own = is_point ? of_corner[c].own : 0;
      of_corner[c].sum += values[c] + own;
      of_corner[c].products = of_corner[c].products - offset_[i] * values[c];
      if (!is_point) continue;
      Values& here = values_at(slot_)[c];
      here.sum += values[c] + own;
      here.products = here.products + offset_[i] * own;
    }
  }
  for (uint32_t c = 0; is_point && c < components_; ++c) values_at(slot_)[c].own = values[c];
}

/// One sample of `count` is away, the others are at the point.
void PlaneFit::add_sample(Moments& moments, const Vector3& away, double count) {
  moments.count += count;
  for (unsigned j = 0, at = 0; j < 3; ++j) {
    moments.sum[j] += away[j];
    for (unsigned k = 0; k <= j; ++k, ++at) moments.products[at] += away[j] * away[k];
  }
}

}  // namespace maille
