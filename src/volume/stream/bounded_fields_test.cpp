// Fields within a bound: what is kept exactly, what it costs, and what the file says of errors.
#include <maille/file.h>

#include <cmath>
#include <limits>

#include "support/cases.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;
using Kind = Tolerance::Kind;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

/// A smooth field with a little noise on the points of a grid.
Mesh with_field(uint32_t components = 1) {
  Mesh mesh = grid(20, 20, 20);
  Array field = make_array("field", Domain::point, Scalar::f64, components);
  field.resize(mesh.point_count());
  const auto points = mesh.points.values<float>();
  for (size_t i = 0; i < mesh.point_count(); ++i) {
    for (size_t c = 0; c < components; ++c) {
      const auto x = static_cast<double>(points[3 * i + (c % 3)]);
      const double noise = static_cast<double>((i * 7919 + c) % 1009) * 1e-5;
      field.values<double>()[i * components + c] = std::sin(x * 0.3 + static_cast<double>(c)) + noise;
    }
  }
  mesh.arrays = {field};
  return mesh;
}
std::span<double> field_of(Mesh& mesh) {
  return mesh.arrays[0].values<double>();
}
EncodeOptions bounded(Kind kind, double value, int effort = 5) {
  EncodeOptions options = kept();
  options.effort = effort;
  options.arrays["field"] = {kind, value};
  return options;
}
struct Stored {
  uint64_t bytes;
  double promised, largest;
  Mesh back;
};
Stored stored(const Mesh& mesh, const EncodeOptions& options) {
  std::vector<std::byte> bytes;
  const auto report = encode(mesh, *memory_sink(bytes), options);
  EXPECT_TRUE(report) << report.error().message;
  const auto source = memory_source(bytes);
  auto back = decode(*source);
  EXPECT_TRUE(back) << back.error().message;
  const auto info = inspect(*source);
  EXPECT_TRUE(info);
  EXPECT_EQ(info->arrays[0].maximum_error, report->arrays[0].maximum_error);
  EXPECT_EQ(info->arrays[0].bound, report->arrays[0].bound);
  return {report->arrays[0].coded_bytes, report->arrays[0].bound, report->arrays[0].maximum_error,
          std::move(*back)};
}

TEST(BoundedField, TheLargestErrorIsMeasuredAndStored) {
  for (const int effort : {2, 7}) {
    const Mesh mesh = with_field(3);
    Stored it = stored(mesh, bounded(Kind::relative, 1e-3, effort));
    double largest = 0, low = infinity, high = -infinity;
    const auto before = mesh.arrays[0].values<double>();
    for (size_t i = 0; i < before.size(); ++i) {
      largest = std::max(largest, std::fabs(before[i] - field_of(it.back)[i]));
      low = std::min(low, before[i]);
      high = std::max(high, before[i]);
    }
    EXPECT_EQ(it.largest, largest);
    EXPECT_LE(largest, it.promised);
    EXPECT_LE(it.promised, 1e-3 * (high - low));
    EXPECT_GT(it.promised, 0.99e-3 * (high - low));
  }
}

TEST(BoundedField, NaNInfinitiesAndOutliersCostTheirMask) {
  for (const int effort : {2, 5, 7}) {
    Mesh mesh = with_field();
    const EncodeOptions options = bounded(Kind::absolute, 1e-3, effort);
    const uint64_t without = stored(mesh, options).bytes;
    Mesh one = mesh, outlier = mesh;
    const auto region = field_of(one);
    for (size_t i = 3000; i < 3900; ++i) region[i] = nan;
    Stored masked = stored(one, options);
    EXPECT_LE(masked.bytes * 100, without * 105) << effort;
    for (size_t i = 3000; i < 3900; ++i) {
      ASSERT_EQ(std::memcmp(&field_of(masked.back)[i], &region[i], 8), 0);
    }
    field_of(outlier)[5000] = 1e30;
    field_of(outlier)[5001] = -infinity;
    Stored kept_one = stored(outlier, options);
    EXPECT_LE(kept_one.bytes, without + 40) << effort;
    EXPECT_EQ(field_of(kept_one.back)[5000], 1e30);
    EXPECT_EQ(field_of(kept_one.back)[5001], -infinity);
    EXPECT_LE(std::fabs(field_of(kept_one.back)[5002] - field_of(mesh)[5002]), 1e-3);
  }
}

/// Points of a grid, each moved by up to 0.3, with a field of them and one of cells that are linear in where
/// points are (and the middle of cells is).
Mesh with_linear_fields() {
  Mesh mesh = grid(12, 12, 12);
  auto points = mesh.points.values<float>();
  for (size_t i = 0; i < points.size(); ++i)
    points[i] += static_cast<float>((i * 2654435761 >> 8) % 1024) * (0.6F / 1024) - 0.3F;
  const auto at = [&](size_t point) {
    return 3.0 * static_cast<double>(points[3 * point]) - 2.0 * static_cast<double>(points[3 * point + 1]) +
           static_cast<double>(points[3 * point + 2]);
  };
  mesh.arrays = {make_array("field", Domain::point, Scalar::f64, 1),
                 make_array("of cells", Domain::cell, Scalar::f64, 1)};
  for (Array& array : mesh.arrays)
    array.resize(array.domain == Domain::point ? mesh.point_count() : mesh.cell_count());
  for (size_t i = 0; i < mesh.point_count(); ++i) mesh.arrays[0].values<double>()[i] = at(i);
  for (size_t i = 0; i < mesh.cell_count(); ++i) {
    for (const uint32_t point : mesh.blocks[0].cell(i)) mesh.arrays[1].values<double>()[i] += at(point) / 8;
  }
  return mesh;
}

TEST(BoundedField, FieldsThatAreLinearInThePlacesOfPointsTakeLittleAtAnyBound) {
  const Mesh mesh = with_linear_fields();
  EncodeOptions options = bounded(Kind::relative, 1e-5);
  options.arrays["of cells"] = {Kind::relative, 1e-5};
  std::vector<std::byte> bytes;
  const auto report = encode(mesh, *memory_sink(bytes), options);
  ASSERT_TRUE(report);
  ASSERT_TRUE(decode(*memory_source(bytes)));
  // Without where points are 13 bits a number and more.
  EXPECT_LT(report->arrays[0].coded_bytes, mesh.point_count() * 3 / 4);
  EXPECT_LT(report->arrays[1].coded_bytes, mesh.cell_count() * 3 / 4);
}

TEST(BoundedField, TheDecoderExpectsTheSameWhereverPointsAreAndHoweverRounded) {
  Mesh mesh = with_linear_fields();
  auto points = mesh.points.values<float>();
  const float strange[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                           3e38F, -3e38F, 1e-42F};
  for (size_t i = 0; i < points.size(); i += 13) points[i] = strange[i / 13 % 5];
  for (const bool rounded : {false, true}) {
    EncodeOptions options = bounded(Kind::relative, 1e-4, 9);
    if (rounded) options.positions = {Kind::absolute, 0.01};
    const Stored it = stored(mesh, options);
    EXPECT_LE(it.largest, it.promised);
    EXPECT_EQ(it.back.arrays[1].bytes, mesh.arrays[1].bytes);
  }
}

TEST(BoundedField, PointwiseBoundsHoldForEveryNumberWithItsSign) {
  for (const double part : {0.3, 1e-2, 1e-4}) {
    Mesh mesh = with_field(2);
    const auto field = field_of(mesh);
    for (size_t i = 0; i < field.size(); ++i) field[i] *= std::pow(10.0, static_cast<double>(i % 7) - 5.0);
    field[10] = 0;
    field[11] = nan;
    field[12] = infinity;
    field[13] = 5e-324;
    field[14] = -1.7e308;
    Stored it = stored(mesh, bounded(Kind::pointwise, part));
    for (size_t i = 0; i < field.size(); ++i) {
      const double back = field_of(it.back)[i];
      if (!std::isfinite(field[i])) {
        ASSERT_EQ(std::memcmp(&back, &field[i], 8), 0);
        continue;
      }
      ASSERT_LE(std::fabs(back - field[i]), part * std::fabs(field[i])) << i;
      ASSERT_EQ(std::signbit(back), std::signbit(field[i])) << i;
    }
    EXPECT_LE(it.largest, part);
    EXPECT_GT(it.largest, part * 0.9);
  }
}

TEST(BoundedField, BoundsOfTheNormHoldForVectors) {
  const Mesh mesh = with_field(3);
  Stored it = stored(mesh, bounded(Kind::norm, 1e-2));
  const auto before = mesh.arrays[0].values<double>();
  double largest = 0;
  for (size_t i = 0; i < before.size(); i += 3) {
    double square = 0;
    for (size_t c = 0; c < 3; ++c) square += std::pow(before[i + c] - field_of(it.back)[i + c], 2);
    largest = std::max(largest, std::sqrt(square));
  }
  EXPECT_LE(largest, 1e-2);
  EXPECT_GT(largest, 0.8e-2);
}

TEST(BoundedField, HasTheRatioOfSignalToNoiseAskedFor) {
  for (const double decibels : {30.0, 60.5, 90.0}) {
    for (const size_t every :
         {size_t{100000}, size_t{3}}) {  // so many numbers apart there is a NaN, which has no error
      Mesh mesh = with_field(2);
      const auto before = field_of(mesh);
      for (size_t i = every; i < before.size(); i += every) before[i] = nan;
      Stored it = stored(mesh, bounded(Kind::psnr, decibels));
      double squares = 0, finite = 0, low[2] = {9, 9}, high[2] = {-9, -9};
      for (size_t i = 0; i < before.size(); ++i) {
        if (std::isnan(before[i])) continue;
        ++finite;
        squares += std::pow(before[i] - field_of(it.back)[i], 2);
        low[i % 2] = std::min(low[i % 2], before[i]);
        high[i % 2] = std::max(high[i % 2], before[i]);
      }
      const double range = std::max(high[0] - low[0], high[1] - low[1]);
      const double reached = 20 * std::log10(range / std::sqrt(squares / finite));
      EXPECT_GE(reached, decibels);
      EXPECT_LT(reached, decibels + 1.5);
    }
  }
}

TEST(BoundedField, OddFieldsKeepTheirBounds) {
  for (const Kind kind :
       {Kind::absolute, Kind::relative, Kind::norm, Kind::psnr, Kind::pointwise, Kind::bits}) {
    for (const double odd : {nan, infinity, 0.0, 5e-324, 1.7e308}) {
      for (const double value : {1e-300, 0.5, 12.0, 1e300}) {
        if (kind == Kind::pointwise && value >= 1) continue;
        if (kind == Kind::bits && value != 12) continue;
        Mesh mesh = with_field();
        for (double& number : field_of(mesh)) number = odd;
        field_of(mesh)[7] = 1;
        Stored it = stored(mesh, bounded(kind, value, 2));
        for (size_t i = 0; i < mesh.point_count(); ++i) {
          const double before = field_of(mesh)[i], back = field_of(it.back)[i];
          if (!std::isfinite(before)) {
            ASSERT_EQ(std::memcmp(&before, &back, 8), 0) << before;
          } else if (kind == Kind::absolute) {
            ASSERT_LE(std::fabs(before - back), value);
          } else {
            ASSERT_TRUE(std::isfinite(back));
          }
        }
      }
    }
  }
}

TEST(BoundedField, RefusesBoundsWithoutMeaning) {
  const Mesh mesh = with_field();
  for (const Kind kind : {Kind::absolute, Kind::relative, Kind::norm, Kind::psnr, Kind::pointwise}) {
    for (const double value : {0.0, -1.0, nan, infinity}) {
      std::vector<std::byte> bytes;
      const auto report = encode(mesh, *memory_sink(bytes), bounded(kind, value));
      ASSERT_FALSE(report);
      EXPECT_EQ(report.error().code, ErrorCode::usage);
    }
  }
  std::vector<std::byte> bytes;
  EXPECT_FALSE(encode(mesh, *memory_sink(bytes), bounded(Kind::pointwise, 1)));
  EncodeOptions single = bounded(Kind::pointwise, 0.1);
  single.mode = Mode::single;
  EXPECT_FALSE(encode(mesh, *memory_sink(bytes), single));
}

}  // namespace
}  // namespace maille
