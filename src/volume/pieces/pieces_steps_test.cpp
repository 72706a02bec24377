#include <maille/file.h>
#include <maille/out_of_core.h>
#include <maille/volume_file.h>

#include <cmath>

#include "support/files.h"
#include "support/temporary_folder.h"
#include "volume/stream/mesh_from_parts.h"
#include "volume/testing.h"

namespace maille {
namespace {

using namespace testing;

/// A grid with its ids, a field that moves, and one that stays.
Mesh at_time(unsigned time) {
  Mesh mesh = grid(9, 8, 7);
  Array ids = make_array("id", Domain::cell, Scalar::i64, 1),
        pressure = make_array("p", Domain::point, Scalar::f32, 1),
        material = make_array("material", Domain::cell, Scalar::i32, 2);
  ids.resize(mesh.cell_count());
  std::iota(ids.values<int64_t>().begin(), ids.values<int64_t>().end(), 1);
  pressure.resize(mesh.point_count());
  for (size_t i = 0; i < mesh.point_count(); ++i)
    pressure.values<float>()[i] = static_cast<float>(i % 21) * 0.5f + static_cast<float>(time * time);
  material.resize(mesh.cell_count());
  for (size_t i = 0; i < material.values<int32_t>().size(); ++i)
    material.values<int32_t>()[i] = static_cast<int32_t>(i * 7 % 11);
  mesh.arrays = {ids, pressure, material};
  Array now = make_array("TimeValue", Domain::mesh, Scalar::f64, 1);
  now.resize(1);
  now.values<double>()[0] = 0.5 * time;
  mesh.arrays.push_back(now);
  return mesh;
}

class PiecesSteps : public ::testing::Test {
 protected:
  void SetUp() override {
    EncodeOptions options = kept();
    options.most_cells_per_part = 60;
    write(encoded(at_time(0), options));
  }
  void write(const std::vector<std::byte>& bytes) const { EXPECT_TRUE(write_bytes(path_, bytes)); }
  std::vector<std::byte> bytes() const {
    const auto source = file_source(path_);
    std::vector<std::byte> all((*source)->size());
    EXPECT_TRUE((*source)->read_at(0, all));
    return all;
  }
  Result<Mesh> read(uint64_t step) const {
    const auto source = file_source(path_);
    DecodeOptions options;
    options.step = step;
    return decode(**source, options);
  }
  void append(unsigned time, const EncodeOptions& options = {}) const {
    const auto report = append_step(path_, 0.5 * time, at_time(time), options);
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->number, time);
    EXPECT_EQ(report->array_bytes.size(), 3u);
    EXPECT_EQ(report->array_bytes[0], 0u);
    EXPECT_EQ(report->array_bytes[2], 0u);
  }

  testing::TemporaryFolder folder_;
  const std::string path_ = folder_.path("steps.maille");
};

TEST_F(PiecesSteps, EachComesBackByItselfAlsoBehindAGroup) {
  for (unsigned time = 1; time < 20; ++time) append(time);
  for (const unsigned time : {3u, 0u, 16u, 17u, 19u, 1u}) {
    const auto mesh = read(time);
    ASSERT_TRUE(mesh) << mesh.error().message;
    expect_same(at_time(time), *mesh);
  }
  EXPECT_FALSE(read(20));
}

TEST_F(PiecesSteps, RemovingTheLastGivesTheFileBeforeIt) {
  const std::vector<std::byte> mesh = bytes();
  append(1);
  const std::vector<std::byte> one = bytes();
  append(2);
  EXPECT_EQ(remove_last_step(path_).value().number, 2u);
  EXPECT_EQ(bytes(), one);
  EXPECT_EQ(remove_last_step(path_).value().file_bytes, mesh.size());
  EXPECT_EQ(bytes(), mesh);
}

TEST_F(PiecesSteps, ARegionOfAStepIsFoundByItsOwnStatistics) {
  append(1);
  append(2);
  const auto source = file_source(path_);
  DecodeOptions options;
  options.step = 2;
  const auto file = VolumeFile::open(**source, options);
  ASSERT_TRUE(file) << file.error().message;
  VolumeQuery query;
  query.conditions.push_back({"p", 13.9, 14.0, {}});
  const auto found = file->extract(query);
  ASSERT_TRUE(found) << found.error().message;
  const Mesh mesh = at_time(2);
  const auto pressure = mesh.arrays[1].values<float>();
  std::vector<uint32_t> cells;
  for (uint32_t cell = 0; cell < mesh.cell_count(); ++cell) {
    const auto points = mesh.blocks[0].cell(cell);
    if (std::any_of(points.begin(), points.end(), [&](uint32_t p) { return pressure[p] == 14.0f; }))
      cells.push_back(cell);
  }
  ASSERT_FALSE(cells.empty());
  EXPECT_EQ(found->cell_numbers, cells);
  query.conditions[0] = {"p", 100, 200, {}};
  EXPECT_TRUE(file->select(query)->empty());
}

TEST_F(PiecesSteps, AreDecodedInPartsToo) {
  append(1);
  const auto source = file_source(path_);
  DecodeOptions options;
  options.step = 1;
  const auto description = describe(**source, options);
  ASSERT_TRUE(description);
  MeshFromParts sink(*description);
  const auto done = decode(**source, sink, options);
  ASSERT_TRUE(done) << done.error().message;
  expect_same(at_time(1), sink.mesh);
}

TEST_F(PiecesSteps, KeepTheirBounds) {
  EncodeOptions options;
  options.arrays["p"] = {Tolerance::Kind::absolute, 0.01};
  for (unsigned time = 1; time < 4; ++time) append(time, options);
  for (unsigned time = 1; time < 4; ++time) {
    const auto mesh = read(time);
    ASSERT_TRUE(mesh) << mesh.error().message;
    const Mesh given = at_time(time);
    for (size_t i = 0; i < given.point_count(); ++i)
      EXPECT_NEAR(mesh->arrays[1].values<float>()[i], given.arrays[1].values<float>()[i], 0.01);
  }
}

TEST_F(PiecesSteps, ADamagedStepLeavesTheMeshAndOtherSteps) {
  append(1);
  const auto info = inspect(*memory_source(bytes()));
  ASSERT_TRUE(info);
  const std::vector<std::byte> whole = bytes();
  for (const ChunkInfo& chunk : info->chunks) {
    if (chunk.type != "SVAL" && chunk.type != "SIDX") continue;
    std::vector<std::byte> damaged = whole;
    damaged[chunk.offset + 30] ^= std::byte{16};
    write(damaged);
    expect_same(at_time(0), *read(0));
    EXPECT_FALSE(read(1));
  }
}

TEST(PiecesNumbers, IdsOfPointsAndCellsTakeNoRoomInPieces) {
  Mesh mesh = grid(20, 18, 16);
  EncodeOptions options = kept(2);
  options.most_cells_per_part = 500;
  const size_t without = encoded(mesh, options).size();
  Array points = make_array("point", Domain::point, Scalar::u32, 1),
        cells = make_array("cell", Domain::cell, Scalar::i64, 1);
  points.resize(mesh.point_count());
  cells.resize(mesh.cell_count());
  std::iota(points.values<uint32_t>().begin(), points.values<uint32_t>().end(), 0u);
  std::iota(cells.values<int64_t>().begin(), cells.values<int64_t>().end(), -5);
  mesh.arrays = {points, cells};
  const std::vector<std::byte> bytes = encoded(mesh, options);
  EXPECT_LT(bytes.size(), without + 12 * 200);
  expect_same(mesh, *decode(*memory_source(Bytes(bytes))));
  DecodeOptions only;
  only.arrays = {{"cell"}};
  const auto source = memory_source(Bytes(bytes));
  const auto file = VolumeFile::open(*source, only);
  ASSERT_TRUE(file);
  VolumeQuery query;
  query.cells = {700, 710};
  const auto found = file->extract(query);
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->mesh.arrays.size(), 1u);
  for (size_t i = 0; i < 10; ++i)
    EXPECT_EQ(found->mesh.arrays[0].values<int64_t>()[i], static_cast<int64_t>(695 + i));
}

}  // namespace
}  // namespace maille
