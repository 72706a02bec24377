#include "support/codec.h"
#include "support/random.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

#include <gtest/gtest.h>
#include <maille/with_type.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <ostream>
#include <string>

namespace maille::testing {
namespace {

double number_at(const Array& array, size_t i) {
  return with_type(array.type,
                   [&](auto zero) { return static_cast<double>(array.values<decltype(zero)>()[i]); });
}

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void take(double x) {
    if (!std::isfinite(x)) return;
    low = std::min(low, x);
    high = std::max(high, x);
  }
  double length() const { return low <= high ? high - low : 0; }
};

/// Of the finite values, all components together.
double range_of(const Array& array) {
  Range range;
  for (size_t i = 0; i < array.count() * array.components; ++i) range.take(number_at(array, i));
  return range.length();
}

/// Sides of the bounding box of the finite coordinates.
std::array<double, 3> box_of(const Array& positions) {
  Range sides[3];
  for (size_t i = 0; i < positions.count() * 3; ++i) sides[i % 3].take(number_at(positions, i));
  return {sides[0].length(), sides[1].length(), sides[2].length()};
}

/// The largest error a tolerance allows for an array, as the header says. A lattice of 2^bits steps is half a
/// step wrong at most.
double allowed(const Array& array, bool positions, const Tolerance& tolerance) {
  const auto box = positions ? box_of(array) : std::array<double, 3>{};
  switch (tolerance.kind) {
    case Tolerance::Kind::lossless:
      return 0;
    case Tolerance::Kind::absolute:
      return tolerance.value;
    case Tolerance::Kind::relative:
      return tolerance.value * (positions ? std::hypot(box[0], box[1], box[2]) : range_of(array));
    case Tolerance::Kind::bits: {
      const double length = positions ? std::max({box[0], box[1], box[2]}) : range_of(array);
      // Unit normals lie on an octahedral lattice, which is up to three times coarser in one component.
      return length / (std::exp2(tolerance.value) - 1) / 2 * (array.role == Role::normal ? 3 : 1);
    }
    default:  // bounded_fields_test.cpp has the others
      break;
  }
  return 0;
}

/// NaNs stay NaNs, infinities keep their sign, finite values stay finite.
std::string compare_special(const Array& original, const Array& decoded) {
  for (size_t i = 0; i < original.count() * original.components; ++i) {
    const double x = number_at(original, i), y = number_at(decoded, i);
    const bool same = std::isnan(x) ? std::isnan(y) : std::isinf(x) ? x == y : std::isfinite(y);
    if (!same)
      return original.name + ": number " + std::to_string(i) + " was " + std::to_string(x) +
             ", came back as " + std::to_string(y);
  }
  return {};
}

/// Half a unit in the last place of the largest value: what rounding to the decoded type may add to half a
/// lattice step.
double rounding_of(const Array& array) {
  double largest = 0;
  for (size_t i = 0; i < array.count() * array.components; ++i) {
    const double x = std::abs(number_at(array, i));
    if (std::isfinite(x)) largest = std::max(largest, x);
  }
  if (!is_float(array.type)) return 0.5;
  return array.type == Scalar::f32 ? largest * 0x1p-23 : largest * 0x1p-52;
}

std::string check_array(const Array& original, const Array& decoded, const ArrayDifference& difference,
                        const ArrayReport& report, bool positions, const Tolerance& tolerance) {
  double bound = allowed(original, positions, tolerance);
  // "bits" promises a lattice, the other two a bound that includes all rounding.
  if (tolerance.kind == Tolerance::Kind::bits) bound += rounding_of(original);
  const std::string where =
      original.name + " (" + name_of(original.type) + " on " + name_of(original.domain) + "s): ";
  // The box and its diagonal may be rounded differently here and there.
  if (difference.maximum > bound * (1 + 1e-12)) {
    return where + "error " + std::to_string(difference.maximum) + " exceeds the bound " +
           std::to_string(bound);
  }
  if (report.maximum_error != difference.maximum) {
    return where + "reported error " + std::to_string(report.maximum_error) + ", measured " +
           std::to_string(difference.maximum);
  }
  if (tolerance.kind == Tolerance::Kind::lossless && difference.unequal != 0)
    return where + "lossless, but other bits";
  return compare_special(original, decoded);
}

std::string check_bounds(const Mesh& mesh, const EncodeOptions& options) {
  const auto encoded = encode_bytes(mesh, options);
  if (!encoded) return "encode: " + encoded.error().message;
  const auto decoded = decode_bytes(encoded->bytes);
  if (!decoded) return "decode: " + decoded.error().message;
  const auto differences = differences_by_order(mesh, *decoded);
  if (!differences) return differences.error().message;
  std::string wrong = check_array(mesh.points, decoded->points, (*differences)[0], encoded->report.positions,
                                  true, options.positions);
  for (size_t i = 0; i < mesh.arrays.size() && wrong.empty(); ++i) {
    const Array& array = mesh.arrays[i];
    const auto found = options.arrays.find(array.name);
    const Tolerance tolerance = found == options.arrays.end() ? Tolerance{} : found->second;
    wrong = check_array(array, *decoded->find(array.name, array.domain), (*differences)[i + 1],
                        encoded->report.arrays[i], false, tolerance);
  }
  if (!wrong.empty()) return wrong;
  CompareOptions connectivity;
  connectivity.same_order = true;
  connectivity.compare_arrays = false;
  connectivity.tolerance = std::numeric_limits<double>::max();
  const Comparison cells = compare(mesh, *decoded, connectivity);
  for (const std::string& difference : cells.differences) {
    if (difference.rfind("positions", 0) != 0) return difference;
  }
  return {};
}

/// Order::keep, so that values can be matched; every other array lossy.
EncodeOptions lossy_options(const Mesh& mesh, Tolerance tolerance, bool arrays) {
  EncodeOptions options;
  options.order = Order::keep;
  options.positions = tolerance;
  for (size_t i = 0; i < mesh.arrays.size(); ++i) {
    if (arrays && i % 2 == 0 && mesh.arrays[i].role != Role::label)
      options.arrays[mesh.arrays[i].name] = tolerance;
  }
  return options;
}

struct Case {
  const char* name;
  Tolerance tolerance;
};

/// Found by GoogleTest, which prints the bytes otherwise.
void PrintTo(const Case& which, std::ostream* out) {
  *out << which.name;
}

class LossyBound : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Kinds, LossyBound,
                         ::testing::Values(Case{"Absolute", {Tolerance::Kind::absolute, 0.01}},
                                           Case{"AbsoluteCoarse", {Tolerance::Kind::absolute, 100}},
                                           Case{"AbsoluteFine", {Tolerance::Kind::absolute, 1e-9}},
                                           Case{"Relative", {Tolerance::Kind::relative, 1e-3}},
                                           Case{"RelativeFine", {Tolerance::Kind::relative, 1e-9}},
                                           Case{"Bits1", {Tolerance::Kind::bits, 1}},
                                           Case{"Bits12", {Tolerance::Kind::bits, 12}},
                                           Case{"Bits24", {Tolerance::Kind::bits, 24}}),
                         [](const auto& info) { return std::string(info.param.name); });

TEST_P(LossyBound, HoldsForPositionsOfRandomMeshes) {
  const Tolerance tolerance = GetParam().tolerance;
  RandomMeshOptions options;
  options.arrays = false;
  const auto property = [&](const Mesh& mesh) {
    return check_bounds(mesh, lossy_options(mesh, tolerance, false));
  };
  EXPECT_EQ(check_random_surfaces(1000, 400, options, property), "");
}

TEST_P(LossyBound, HoldsForArraysOfRandomMeshesAndLeavesTheOthersLossless) {
  const Tolerance tolerance = GetParam().tolerance;
  const auto property = [&](const Mesh& mesh) {
    return check_bounds(mesh, lossy_options(mesh, tolerance, true));
  };
  EXPECT_EQ(check_random_surfaces(5000, 400, {}, property), "");
}

TEST(Lossy, IsSmallerTheMoreIsAllowed) {
  Mesh mesh = torus(120, 80);
  // A torus has few different numbers, and losslessly takes less than on a fine lattice, which has more.
  Random random(1);
  for (float& number : mesh.points.values<float>()) number += static_cast<float>(random.unit() * 1e-2);
  size_t before = 0;
  for (const double bits : {6, 10, 14, 18}) {
    EncodeOptions options;
    options.positions = {Tolerance::Kind::bits, bits};
    const auto encoded = encode_bytes(mesh, options);
    ASSERT_TRUE(encoded) << encoded.error().message;
    EXPECT_GT(encoded->bytes.size(), before) << bits << " bits";
    before = encoded->bytes.size();
  }
  EXPECT_LT(before, encode_bytes(mesh)->bytes.size());
}

TEST(Lossy, RefusesTolerancesWithoutMeaning) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Tolerance tolerance :
       {Tolerance{Tolerance::Kind::absolute, -1}, Tolerance{Tolerance::Kind::absolute, nan},
        Tolerance{Tolerance::Kind::relative, nan}, Tolerance{Tolerance::Kind::bits, 0},
        Tolerance{Tolerance::Kind::bits, 99}, Tolerance{Tolerance::Kind::bits, 1.5}}) {
    EncodeOptions options;
    options.positions = tolerance;
    const auto encoded = encode_bytes(cube(), options);
    ASSERT_FALSE(encoded) << tolerance.value;
    EXPECT_EQ(encoded.error().code, ErrorCode::usage) << encoded.error().message;
  }
}

}  // namespace
}  // namespace maille::testing
