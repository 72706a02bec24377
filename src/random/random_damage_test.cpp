// Files of mode `random` that are damaged or cut off.
#include <gtest/gtest.h>
#include <maille/random_access.h>

#include <algorithm>
#include <map>
#include <set>

#include "base/hash.h"
#include "container/file_reader.h"
#include "random/random_file.h"
#include "random/read/random_reader.h"
#include "random/read/selection.h"
#include "support/random.h"
#include "support/random_streams.h"

namespace maille::testing {
namespace {

DecodeOptions careful() {
  DecodeOptions options;
  options.limits.mesh_bytes = 64 << 20;
  return options;
}

std::string unfitting(const Error& error) {
  static const std::set<ErrorCode> fitting = {ErrorCode::corrupt, ErrorCode::unsupported,
                                              ErrorCode::memory_bound};
  if (fitting.count(error.code) == 0) return "odd error code: " + error.message;
  return error.message.empty() ? "error without a message" : "";
}

/// Empty when a damaged file gives an error of a fitting kind, or still the very mesh; and when what can be
/// saved of it is no more than that.
std::string reaction(const Sample& sample, const std::vector<std::byte>& damaged) {
  const auto source = memory_source(Bytes(damaged));
  const auto decoded = decode(*source, careful());
  if (decoded) {
    const std::string differences = differences_between(sample.decoded, *decoded, true);
    if (!differences.empty()) return "decodes to another mesh: " + differences;
  } else if (std::string odd = unfitting(decoded.error()); !odd.empty()) {
    return odd;
  }
  auto file = File::open(*source, careful());
  if (!file) return file.error().code == ErrorCode::usage ? "" : unfitting(file.error());
  const auto selection = file->select({}, Detail::full());
  if (!selection) return unfitting(selection.error());
  std::vector<std::string> problems;
  const auto saved = file->salvage(*selection, problems);
  if (!saved) return unfitting(saved.error());
  if (const auto valid = validate(*saved); !valid) return "saved an invalid mesh: " + valid.error().message;
  if (saved->cell_count() > sample.decoded.cell_count()) return "saved more than there was";
  if (!problems.empty()) return "";
  return differences_between(sample.decoded, *saved);
}

TEST(RandomDamage, EveryTruncationIsNoticed) {
  for (const Sample& sample : samples()) {
    for (size_t size = 0; size < sample.bytes.size(); size += every(size < 2000 ? 1 : 7)) {
      const std::vector<std::byte> part(sample.bytes.begin(),
                                        sample.bytes.begin() + static_cast<ptrdiff_t>(size));
      ASSERT_EQ(reaction(sample, part), "") << sample.name << ", first " << size << " bytes";
    }
  }
}

TEST(RandomDamage, EveryFlippedBitIsNoticedOrHarmless) {
  for (const Sample& sample : samples()) {
    Random random(sample.bytes.size());
    for (uint64_t i = 0; i < cases(1000); ++i) {
      std::vector<std::byte> damaged = sample.bytes;
      const size_t at = i < damaged.size() && i < 300 ? i : random.below(damaged.size());
      const uint32_t bit = random.below(8);
      damaged[at] ^= static_cast<std::byte>(1u << bit);
      ASSERT_EQ(reaction(sample, damaged), "") << sample.name << ", bit " << bit << " of byte " << at;
    }
  }
}

TEST(RandomDamage, OverwrittenLostAndDoubledBytesAreNoticed) {
  for (const Sample& sample : samples()) {
    Random random(sample.bytes.size() + 1);
    for (uint64_t i = 0; i < cases(300); ++i) {
      std::vector<std::byte> damaged = sample.bytes;
      const size_t at = random.below(damaged.size());
      const auto place = damaged.begin() + static_cast<ptrdiff_t>(at);
      if (i % 3 == 0) {
        damaged.erase(place);
      } else if (i % 3 == 1) {
        damaged.insert(place, *place);
      } else {
        const size_t end = std::min(damaged.size(), at + random.between(1, 64));
        for (size_t k = at; k < end; ++k) damaged[k] = static_cast<std::byte>(random.below(256));
      }
      ASSERT_EQ(reaction(sample, damaged), "") << sample.name << ", change " << i << " at byte " << at;
    }
  }
}

struct PlacedChart {
  ChartPlace place;
  uint64_t offset = 0, bytes = 0, faces = 0;
};

/// Charts of level 0, in the order of the file.
std::vector<PlacedChart> finest_charts(const std::vector<std::byte>& bytes) {
  const auto source = memory_source(Bytes(bytes));
  RandomReader reader = RandomReader::open(*source, {}).value();
  std::vector<PlacedChart> charts;
  const Selection all =
      reader.select([](const ChartIndex& index) { return maille::select(index, {}, Detail::full()); })
          .value();
  for (const ChartPlace& place : all.charts) {
    const IndexedGroup& group = reader.index().group(place.group);
    uint64_t offset = group.offset;
    for (uint32_t i = 0; i < place.chart; ++i) offset += group.charts[i].bytes;
    charts.push_back({place, offset, group.charts[place.chart].bytes, group.charts[place.chart].faces});
  }
  return charts;
}

struct Saved {
  std::string error;
  Mesh mesh;
  std::vector<std::string> problems;
};

Saved save(const std::vector<std::byte>& bytes) {
  const auto source = memory_source(Bytes(bytes), "x.maille");
  auto file = File::open(*source, careful());
  if (!file) return {file.error().message, {}, {}};
  const auto selection = file->select({}, Detail::full());
  if (!selection) return {selection.error().message, {}, {}};
  Saved saved;
  auto mesh = file->salvage(*selection, saved.problems);
  if (mesh) {
    saved.mesh = std::move(*mesh);
  } else {
    saved.error = mesh.error().message;
  }
  return saved;
}

TEST(RandomDamage, CostsOnlyTheChart) {
  const Mesh mesh = sample_mesh();
  const RandomFile file = random_file(mesh, {}, 24);
  const std::vector<PlacedChart> charts = finest_charts(file.bytes);
  ASSERT_GE(charts.size(), 8u);
  for (const PlacedChart& chart : charts) {
    std::vector<std::byte> damaged = file.bytes;
    damaged[chart.offset + chart.bytes / 2] ^= std::byte{4};
    const Saved saved = save(damaged);
    ASSERT_EQ(saved.error, "");
    EXPECT_EQ(saved.mesh.cell_count(), mesh.cell_count() - chart.faces);
    ASSERT_EQ(saved.problems.size(), 1u);
    EXPECT_EQ(saved.problems[0], "x.maille: chart " + std::to_string(chart.place.chart) + " of group " +
                                     std::to_string(chart.place.group) +
                                     " (level 0): is damaged, its checksum does not fit");
    const auto decoded = decode_bytes(damaged);
    ASSERT_FALSE(decoded);
    EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
  }
}

/// Groups whose page is larger than a chunk are found by their key.
TEST(RandomDamage, CostsOnlyTheChartInLargePages) {
  Mesh mesh = to_mesh(triangulated(shapes::grid(24, 24)));
  // Few components of many bytes: each has tables of its own, which cost minutes under sanitizers.
  Array noise = make_array("noise", Domain::point, Scalar::u64, 500);
  noise.resize(mesh.point_count());
  Random random(1);
  for (std::byte& byte : noise.bytes) byte = static_cast<std::byte>(random.below(256));
  mesh.arrays.push_back(std::move(noise));
  EncodeOptions options;
  options.effort = 1;
  const RandomFile file = random_file(mesh, options, 100);
  ASSERT_EQ(file.error, "");
  ASSERT_EQ(differences_between(mesh, decode_bytes(file.bytes).value()), "");
  std::vector<std::byte> damaged = file.bytes;
  damaged[damaged.size() / 2] ^= std::byte{4};
  const Saved saved = save(damaged);
  ASSERT_EQ(saved.error, "");
  EXPECT_EQ(saved.problems.size(), 1u);
  EXPECT_GE(saved.mesh.cell_count(), mesh.cell_count() - 250);
  EXPECT_LT(saved.mesh.cell_count(), mesh.cell_count());
}

/// Several pages of the index; charts that start fast, as there are many.
RandomFile many_groups(const Mesh& mesh) {
  EncodeOptions options;
  options.effort = 1;
  return random_file(mesh, options, 4);
}

TEST(RandomDamage, OfATruncatedFileLeavesTheChartsBeforeTheCut) {
  const Mesh mesh = sample_mesh(50);
  const RandomFile file = many_groups(mesh);
  const std::vector<PlacedChart> charts = finest_charts(file.bytes);
  ASSERT_GE(charts.back().place.group, groups_per_index_page);  // several pages of the index
  Random random(3);
  for (unsigned i = 0; i < cases(24); ++i) {
    const size_t size = charts[random.below(charts.size())].offset + random.below(60);
    if (size >= file.bytes.size()) continue;
    uint64_t faces = 0;
    for (const PlacedChart& chart : charts) faces += chart.offset + chart.bytes <= size ? chart.faces : 0;
    const std::vector<std::byte> part(file.bytes.begin(), file.bytes.begin() + static_cast<ptrdiff_t>(size));
    const Saved saved = save(part);
    ASSERT_EQ(saved.error, "");
    // Where the index is cut off as well, groups are found by pages that are whole.
    uint64_t in_whole_groups = 0;
    for (const PlacedChart& chart : charts) {
      const bool whole = std::all_of(charts.begin(), charts.end(), [&](const PlacedChart& other) {
        return other.place.group != chart.place.group ||
               other.offset + other.bytes + chunk_checksum_bytes <= size;
      });
      in_whole_groups += whole ? chart.faces : 0;
    }
    EXPECT_GE(saved.mesh.cell_count(), in_whole_groups) << size;
    EXPECT_LE(saved.mesh.cell_count(), faces) << size;
    EXPECT_FALSE(saved.problems.empty());
  }
}

TEST(RandomDamage, OfAFileThatLostBytesCostsOnlyTheGroup) {
  const Mesh mesh = sample_mesh();
  const RandomFile file = random_file(mesh, {}, 16);
  const std::vector<PlacedChart> charts = finest_charts(file.bytes);
  const PlacedChart& hit = charts[charts.size() / 2];
  std::vector<std::byte> damaged = file.bytes;
  damaged.erase(damaged.begin() + static_cast<ptrdiff_t>(hit.offset + 3));
  uint64_t faces = 0;
  for (const PlacedChart& chart : charts) faces += chart.place.group == hit.place.group ? 0 : chart.faces;
  const Saved saved = save(damaged);
  ASSERT_EQ(saved.error, "");
  EXPECT_GE(saved.mesh.cell_count(), faces);
  EXPECT_LT(saved.mesh.cell_count(), mesh.cell_count());
  EXPECT_FALSE(saved.problems.empty());
}

/// What a file gives of its levels.
std::map<uint32_t, Mesh> levels_of(File& file) {
  std::map<uint32_t, Mesh> meshes;
  for (uint32_t level = 0; level < file.levels(); level += static_cast<uint32_t>(every(1))) {
    Detail detail;
    detail.level = level;
    meshes[level] = file.extract(file.select({}, detail).value()).value();
  }
  return meshes;
}

TEST(RandomDamage, OfTheIndexIsMendedFromThePages) {
  const Mesh mesh = sample_mesh(50);
  const RandomFile file = many_groups(mesh);
  const auto intact_source = memory_source(Bytes(file.bytes));
  File intact = File::open(*intact_source).value();
  const std::map<uint32_t, Mesh> levels = levels_of(intact);
  for (const auto& lost :
       std::vector<std::vector<std::pair<std::string, uint32_t>>>{{{"CIDX", 0}},
                                                                  {{"CIDX", 1}},
                                                                  {{"CIDX", 0}, {"CIDX", 1}},
                                                                  {{"CDIR", 0}},
                                                                  {{"CDIR", 0}, {"CIDX", 0}, {"CIDX", 1}}}) {
    Streams streams(file.bytes);
    for (const auto& [type, patch] : lost) streams.remove(type, patch);
    const std::vector<std::byte> bytes = streams.written();
    const auto decoded = decode_bytes(bytes);
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(differences_between(mesh, *decoded), "");
    const auto source = memory_source(Bytes(bytes));
    File mended = File::open(*source).value();
    ASSERT_EQ(mended.levels(), intact.levels());
    const std::map<uint32_t, Mesh> mended_levels = levels_of(mended);
    for (uint32_t level = 0; level < intact.levels(); level += static_cast<uint32_t>(every(1))) {
      EXPECT_EQ(mended.faces(level), intact.faces(level));
      EXPECT_EQ(mended.charts(level), intact.charts(level));
      EXPECT_EQ(differences_between(mended_levels.at(level), levels.at(level)), "");
    }
    Region region;
    region.box = Box{{{10.2, 10.2, -100}}, {{14.7, 20.1, 100}}};
    const Mesh part = mended.extract(mended.select(region, Detail::full()).value()).value();
    EXPECT_EQ(differences_between(clip(mesh, region), clip(part, region)), "");
    EXPECT_TRUE(mended.hit({{20.3, 20.4, 100}}, {{0, 0, -1}}).value().has_value());
    EXPECT_TRUE(mended.nearest({{20.3, 20.4, 100}}).value().has_value());
  }
}

TEST(RandomDamage, OfTheIndexAndOfGroupsCostsTheseGroups) {
  const Mesh mesh = sample_mesh(50);
  const RandomFile file = many_groups(mesh);
  const std::vector<PlacedChart> charts = finest_charts(file.bytes);
  Random random(5);
  for (unsigned i = 0; i < cases(20); ++i) {
    Streams streams(file.bytes);
    streams.remove("CIDX", i % 2);
    std::set<uint32_t> lost;
    for (uint32_t k = random.between(1, 4); k > 0; --k)
      lost.insert(charts[random.below(charts.size())].place.group);
    if (i % 3 == 0) lost.insert(random.below(20));  // coarse ones
    for (const uint32_t group : lost) streams.remove("CHRT", group);
    uint64_t left = 0;
    for (const PlacedChart& chart : charts) left += lost.count(chart.place.group) == 0 ? chart.faces : 0;
    const Saved saved = save(streams.written());
    ASSERT_EQ(saved.error, "");
    EXPECT_EQ(saved.mesh.cell_count(), left) << i;
    EXPECT_FALSE(saved.problems.empty() && left < mesh.cell_count());
  }
}

}  // namespace
}  // namespace maille::testing
