#pragma once

#include <maille/geometry.h>

#include <array>
#include <span>
#include <vector>

#include "volume/cells/cell_coder.h"
#include "volume/values/tuple_values.h"

namespace maille {

/// Where the points of a block are, from numbers that a decoder has. NaN and infinities come as they are;
/// expect() answers with "not known" then.
void find_places(Scalar type, Bytes positions, std::vector<Vector3>& places);

/// The same from the numbers that an encoder was given: each goes through its map first, so that the places
/// are the ones that a decoder will have.
class DecodedPlaces {
 public:
  explicit DecodedPlaces(const StreamedArray& positions);
  void find(Bytes positions, std::vector<Vector3>& places) const;

 private:
  StreamedArray positions_;
  std::vector<NumberSpace> spaces_;  ///< none if numbers keep their bits
};

/// What the numbers of a point or cell may be expected to be from where it is: on the plane that fits best
/// those around it. Each point in memory has the sums of the samples next to it; those of a cell's known
/// corners give the plane, by least squares. Doubles and + - * / in a fixed order.
/// It makes fields of tetrahedra that are smooth take half (bracket, xdsp at 1e-4: 3.99 to 1.43 bits),
/// lossless fields 4 % less. Cost: about 100 bytes a point in memory and 40 for each of its components.
/// docs/format.md, 16.12, "Planes".
class PlaneFit {
 public:
  explicit PlaneFit(uint32_t components) : components_(components), expected_(components) {}

  /// Points that came up with the block, before any of it is asked for.
  void begin_block(const CodedCells& cells, std::span<const Vector3> places);
  /// By component; null: not known. learn() has to follow before the next one.
  const double* expect_point(const NewPoint& point, const CodedCells& cells);
  const double* expect_cell(const CodedCells& cells, size_t cell);
  /// The numbers of the point or cell that was asked for.
  void learn(const double* values);
  uint64_t bytes() const { return bytes_held(points_) + bytes_held(values_); }

 private:
  /// Sums over the samples around a point, of where they are from it.
  struct Moments {
    double count = 0;
    std::array<double, 3> sum{};
    std::array<double, 6> products{};  ///< the lower triangle, row by row
  };
  struct Point {
    Vector3 place;
    Moments moments;
  };
  /// Of one component: sums of the samples' values, and of these times where they are.
  struct Values {
    double own = 0;  ///< the point's
    double sum = 0;
    Vector3 products;
  };
  void add_corner(uint32_t slot);
  Moments moments_around() const;
  const double* expect(const Moments& around, const Vector3& way, double of_mean);
  static void add_sample(Moments& moments, const Vector3& away, double count);
  Values* values_at(uint32_t slot) { return &values_[size_t{slot} * components_]; }

  uint32_t components_;
  std::vector<Point> points_;   ///< by slot
  std::vector<Values> values_;  ///< by slot and component
  std::vector<double> expected_;

  // Of the point or cell at hand.
  uint32_t slot_ = no_slot;  ///< of a point
  Vector3 here_;
  unsigned corners_ = 0;  ///< known ones of the cell
  std::array<uint32_t, most_nodes> corner_{};
  std::array<Vector3, most_nodes> offset_{};  ///< where they are from here
  std::array<double, most_nodes> of_own_{};   ///< what part each one's own number has
};

}  // namespace maille
