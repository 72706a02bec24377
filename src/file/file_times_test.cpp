// A file of mode stream as a series of times.
#include <gtest/gtest.h>

#include <maille/encode.h>
#include <maille/file.h>
#include <maille/stream.h>

#include <limits>

#include "support/temporary_folder.h"

namespace maille {
namespace {

using testing::TemporaryFolder;

/// A hexahedron with a pressure.
Mesh mesh_with(float value) {
  Mesh mesh;
  mesh.points.resize(8);
  for (size_t i = 0; i < 24; ++i) mesh.points.values<float>()[i] = static_cast<float>((i / 3) >> (i % 3) & 1);
  mesh.blocks = {{"", CellType::hexahedron, {}, {}, {0, 1, 3, 2, 4, 5, 7, 6}}};
  Array& pressure = mesh.arrays.emplace_back(make_array("p", Domain::cell, Scalar::f32, 1));
  pressure.resize(1);
  pressure.values<float>()[0] = value;
  return mesh;
}

struct Series {
  TemporaryFolder folder;
  std::string path = folder.path("run.maille");

  explicit Series(const Mesh& mesh, std::optional<double> time, bool pieces = false) {
    const auto sink = file_sink(path);
    EncodeOptions options;
    options.mode = Mode::stream;
    options.order = Order::keep;
    options.time = time;
    if (pieces) options.most_cells_per_part = 1;
    const auto done = encode(mesh, **sink, options);
    EXPECT_TRUE(done) << done.error().message;
  }
  void append(double time, float value) {
    const auto done = append_step(path, time, mesh_with(value));
    EXPECT_TRUE(done) << done.error().message;
  }
  /// Steps and times, as text.
  std::string times() const {
    const auto source = file_source(path);
    const auto info = inspect(**source);
    EXPECT_TRUE(info) << info.error().message;
    std::string text;
    for (const FileTime& time : times_of(*info))
      text += std::to_string(time.step) + "@" + std::to_string(static_cast<int>(time.time)) + " ";
    return text;
  }
};

TEST(FileTimes, AMeshTellsItsTime) {
  EXPECT_EQ(Series(mesh_with(1), 7).times(), "0@7 ");
  EXPECT_EQ(Series(mesh_with(1), 7, true).times(), "0@7 ");
  EXPECT_EQ(Series(mesh_with(1), {}).times(), "");
}

TEST(FileTimes, TheMeshIsATimeUnlessAStepHasIt) {
  for (const bool pieces : {false, true}) {
    Series series(mesh_with(1), 3, pieces);
    series.append(4, 1);
    EXPECT_EQ(series.times(), "0@3 1@4 ");
    series.append(3, 1);
    EXPECT_EQ(series.times(), "1@4 2@3 ");
  }
}

TEST(FileTimes, AMeshOfUnknownTimeComesBeforeItsSteps) {
  Series series(mesh_with(1), {});
  series.append(4, 2);
  EXPECT_EQ(series.times(), "0@0 1@4 ");
}

TEST(FileTimes, AMeshOfUnknownTimeIsNoTimeWhereTheFirstStepRepeatsIt) {
  Series series(mesh_with(1), {});
  series.append(4, 1);
  series.append(5, 2);
  EXPECT_EQ(series.times(), "1@4 2@5 ");
}

TEST(FileTimes, AMeshWithoutValuesIsNoTime) {
  Mesh mesh = mesh_with(1);
  mesh.arrays.clear();
  Series series(mesh, {});
  series.append(4, 1);
  EXPECT_EQ(series.times(), "1@4 ");
}

TEST(FileTimes, AMeshIsOfNoTimeWhereStepsBeginWithZero) {
  Series series(mesh_with(1), {});
  series.append(0, 2);
  EXPECT_EQ(series.times(), "1@0 ");
}

TEST(FileTimes, ATimeIsANumber) {
  std::vector<std::byte> bytes;
  EncodeOptions options;
  options.mode = Mode::stream;
  options.time = std::numeric_limits<double>::quiet_NaN();
  const auto done = encode(mesh_with(1), *memory_sink(bytes), options);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::usage);
}

}  // namespace
}  // namespace maille
