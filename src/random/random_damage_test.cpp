// Files of mode `random` that are damaged, cut off, or made to do harm.
#include <gtest/gtest.h>
#include <maille/random_access.h>
#include <maille/version.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <set>

#include "base/hash.h"
#include "container/file_reader.h"
#include "container/file_writer.h"
#include "random/random_file.h"
#include "random/read/random_reader.h"
#include "random/read/selection.h"
#include "support/cases.h"
#include "support/codec.h"
#include "support/random.h"
#include "support/random_file.h"
#include "support/random_mesh.h"
#include "support/shapes.h"

namespace maille::testing {
namespace {

DecodeOptions careful() {
  DecodeOptions options;
  options.limits.mesh_bytes = 64 << 20;
  return options;
}

/// Triangles with arrays of all domains, in many charts.
Mesh sample_mesh(uint32_t n = 12) {
  Mesh mesh = to_mesh(triangulated(shapes::grid(n, n)));
  const auto add = [&](const char* name, Domain domain, uint64_t tuples) {
    Array array = make_array(name, domain, Scalar::u8, 1);
    array.resize(tuples);
    for (uint64_t i = 0; i < tuples; ++i) array.bytes[i] = static_cast<std::byte>(i * i % 11);
    mesh.arrays.push_back(std::move(array));
  };
  add("height", Domain::point, mesh.point_count());
  add("material", Domain::cell, mesh.cell_count());
  add("uv", Domain::corner, mesh.corner_count());
  add("unit", Domain::mesh, 3);
  return mesh;
}

struct Sample {
  std::string name;
  std::vector<std::byte> bytes;
  Mesh decoded;
};

std::vector<Sample> samples() {
  std::vector<Sample> files;
  const auto add = [&](const std::string& name, const Mesh& mesh, const EncodeOptions& options) {
    const RandomFile file = random_file(mesh, options, 24);
    ASSERT_EQ(file.error, "") << name;
    files.push_back({name, file.bytes, decode_bytes(file.bytes).value()});
  };
  add("empty", Mesh{}, {});
  add("grid", sample_mesh(), {});
  EncodeOptions options;
  options.effort = 2;
  options.positions = {Tolerance::Kind::bits, 10};
  options.order = Order::keep;
  add("sphere in order", to_mesh(triangulated(shapes::sphere(12, 9))), options);
  for (uint64_t seed = 0; seed < 200 && files.size() < 6; ++seed) {
    const Mesh mesh = random_surface(seed);
    if (mesh.arrays.size() < 3 || mesh.cell_count() < 20) continue;
    options.positions = {};
    options.effort = 5;
    options.order = seed % 2 == 0 ? Order::keep : Order::canonical;
    add("seed " + std::to_string(seed), mesh, options);
  }
  return files;
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
  Array noise = make_array("noise", Domain::point, Scalar::u8, 4000);
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

/// A file as its streams, to be changed and written again with good checksums.
struct Streams {
  struct Stream {
    std::string type;
    uint32_t patch = 0, number = 0;
    std::vector<std::byte> bytes;
  };
  std::vector<Stream> streams;

  explicit Streams(const std::vector<std::byte>& bytes) {
    const auto source = memory_source(Bytes(bytes));
    const FileReader reader = FileReader::open(*source).value();
    for (const ChunkRecord& record : reader.records()) {
      if (record.header.part() > 0) continue;
      Stream& stream = streams.emplace_back();
      stream.type.assign(record.header.type.begin(), record.header.type.end());
      stream.patch = record.header.patch;
      stream.number = record.header.number;
      stream.bytes = reader.read_stream(key(stream)).value();
    }
  }
  static StreamKey key(const Stream& stream) {
    StreamKey key{"", stream.patch, stream.number};
    std::copy_n(stream.type.begin(), 4, key.type);
    return key;
  }
  Stream& of(const std::string& type, uint32_t patch = 0) {
    return *std::find_if(streams.begin(), streams.end(),
                         [&](const Stream& s) { return s.type == type && s.patch == patch; });
  }
  void remove(const std::string& type, uint32_t patch = 0) {
    std::erase_if(streams, [&](const Stream& s) { return s.type == type && s.patch == patch; });
  }
  std::vector<std::byte> written() const {
    std::vector<std::byte> bytes;
    const auto sink = memory_sink(bytes);
    FileWriter writer =
        FileWriter::begin(*sink, {.major = format_major, .minor = format_minor, .mode = Mode::random})
            .value();
    for (const Stream& stream : streams) EXPECT_TRUE(writer.write_stream(key(stream), stream.bytes));
    EXPECT_TRUE(writer.finish());
    return bytes;
  }
};

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

/// Everything that can be asked of a file ends, in valid meshes or errors.
void expect_bearable(const std::vector<std::byte>& bytes, const std::string& what) {
  const auto source = memory_source(Bytes(bytes));
  DecodeOptions options;
  options.limits.mesh_bytes = 16 << 20;
  const auto decoded = decode(*source, options);
  ASSERT_TRUE(!decoded || validate(*decoded)) << what;
  static_cast<void>(inspect(*source));
  auto file = File::open(*source, options);
  if (!file) return;
  Region region;
  region.sphere = Sphere{{{3, 3, 0}}, 2};
  Detail coarse;
  coarse.view = View{{{0, 0, 10}}, 1000, 1};
  std::vector<Result<Selection>> selections;
  selections.push_back(file->select({}, Detail::full()));
  selections.push_back(file->select(region, Detail::full()));
  selections.push_back(file->select({}, coarse));
  selections.push_back(file->select({}, Detail{}));
  selections.push_back(file->select({}, 100));
  selections.push_back(file->select(region, 1000000, coarse.view));
  for (const Result<Selection>& selection : selections) {
    if (!selection) continue;
    std::vector<std::string> problems;
    const auto mesh = file->salvage(*selection, problems);
    ASSERT_TRUE(!mesh || validate(*mesh)) << what;
  }
  static_cast<void>(file->hit({{3.2, 3.3, 50}}, {{0, 0, -1}}));
  static_cast<void>(file->nearest({{3.2, 3.3, 50}}));
}

/// What was found by attacks stays: tests/corrupt/maille, each file beside its code and sentence (UPDATE=1).
void expect_refused(const std::string& name, const std::vector<std::byte>& bytes, ErrorCode code) {
  const auto source = memory_source(Bytes(bytes), name + ".maille");
  DecodeOptions options;
  options.limits.mesh_bytes = 64 << 20;
  const auto decoded = decode(*source, options);
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, code) << decoded.error().message;
  const std::string path = MAILLE_TESTS_DIR "/corrupt/maille/" + name + ".maille";
  const char* update = std::getenv("UPDATE");
  if (update != nullptr && std::string(update) == "1") {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    std::ofstream(path + ".error") << static_cast<int>(code) << ' ' << decoded.error().message << '\n';
  }
  EXPECT_TRUE(std::filesystem::exists(path)) << path;
}

uint32_t odd_number(Random& random, uint32_t old) {
  static constexpr uint32_t odd[] = {0, 1, 2, 255, 256, 4096, 65535, 0x7fffffff, 0xfffffffe, 0xffffffff};
  switch (random.below(4)) {
    case 0:
      return old + 1;
    case 1:
      return old - 1;
    case 2:
      return odd[random.below(std::size(odd))];
    default:
      return old ^ (1u << random.below(32));
  }
}

struct IndexOfFile {
  ChartDirectory directory;
  std::vector<IndexedGroup> groups;

  explicit IndexOfFile(Streams& streams) {
    directory = decode_directory(streams.of("CDIR").bytes).value();
    for (uint32_t page = 0; page < directory.index_pages.size(); ++page) {
      auto more = decode_index_page(directory.frame, streams.of("CIDX", page).bytes,
                                    page * groups_per_index_page, directory.groups)
                      .value();
      groups.insert(groups.end(), more.begin(), more.end());
    }
  }
  void put(Streams& streams) const {
    streams.of("CDIR").bytes = encode_directory(directory);
    for (uint32_t first = 0; first < groups.size(); first += groups_per_index_page) {
      const size_t count = std::min<size_t>(groups_per_index_page, groups.size() - first);
      streams.of("CIDX", first / groups_per_index_page).bytes =
          encode_index_page(directory.frame, std::span(groups).subspan(first, count), first);
    }
  }
};

void spoil_group(IndexedGroup& group, Random& random) {
  IndexedChart& chart = group.charts[random.below(group.charts.size())];
  switch (random.below(12)) {
    case 0:
      group.level = odd_number(random, group.level) & 255;
      break;
    case 1:
      group.replaces = odd_number(random, group.replaces);
      break;
    case 2:
      group.offset = random.chance(50) ? odd_number(random, 0) : group.offset + random.below(100) - 50;
      break;
    case 3:
      group.offset = uint64_t{odd_number(random, 0)} << 32 | odd_number(random, 0);
      break;
    case 4:
      chart.producer = chart.producer == no_group ? random.below(40) : odd_number(random, chart.producer);
      break;
    case 5:
      chart.faces = odd_number(random, chart.faces);
      break;
    case 6:
      chart.bytes = odd_number(random, chart.bytes);
      break;
    case 7:
      chart.check = odd_number(random, chart.check);
      break;
    case 8:
      group.charts.push_back(chart);
      break;
    case 9:
      group.charts.clear();
      break;
    case 10:
      group.bound = random.chance(50) ? 0 : -1;
      break;
    default:
      chart.sphere.radius = -1;
      chart.box = {{{5, 5, 5}}, {{-5, -5, -5}}};
  }
}

TEST(RandomDamage, HostileIndexesAreBorne) {
  const RandomFile file = random_file(sample_mesh(), {}, 16);
  for (uint64_t i = 0; i < cases(1500); ++i) {
    Random random(i);
    Streams streams(file.bytes);
    IndexOfFile index(streams);
    for (uint32_t k = random.between(1, 3); k > 0; --k) {
      if (random.chance(15)) {
        ChartDirectory& directory = index.directory;
        switch (random.below(7)) {
          case 0:
            directory.groups = odd_number(random, directory.groups);
            break;
          case 1:
            directory.levels = odd_number(random, directory.levels) & 255;
            break;
          case 2:
            directory.faces.push_back(1);
            break;
          case 3:
            directory.index_pages.assign(directory.groups / groups_per_index_page + 1,
                                         {odd_number(random, 0), odd_number(random, 0)});
            break;
          case 4:
            directory.finest.arrays.resize(random.below(3));
            break;
          case 5:
            directory.frame.size = random.chance(50) ? 1e300 : 1e-300;
            break;
          default:
            directory.frame.low[1] = 1e308;
        }
      } else {
        IndexedGroup& group = index.groups[random.below(index.groups.size())];
        if (!group.charts.empty()) spoil_group(group, random);
      }
    }
    index.put(streams);
    ASSERT_NO_FATAL_FAILURE(expect_bearable(streams.written(), "case " + std::to_string(i)));
  }
}

/// Each group refers twice to the next, so that a reader that goes every way takes for ever.
TEST(RandomDamage, IndexesWithManyWaysAreBorne) {
  const RandomFile file = random_file(sample_mesh(20), {}, 8);
  Streams streams(file.bytes);
  IndexOfFile index(streams);
  for (uint32_t g = 0; g < index.groups.size(); ++g) {
    IndexedGroup& group = index.groups[g];
    group.replaces = 1;
    group.charts.resize(3, group.charts[0]);
    for (uint32_t i = 0; i < 3; ++i) {
      group.charts[i].faces = 0;
      group.charts[i].producer = g + 1 + i < index.groups.size() ? g + 1 + i : no_group;
    }
  }
  index.put(streams);
  const std::vector<std::byte> bytes = streams.written();
  expect_bearable(bytes, "");
  expect_refused("index_with_many_ways", bytes, ErrorCode::corrupt);
}

TEST(RandomDamage, ManyGroupsInSmallFilesAreRefused) {
  const RandomFile file = random_file(sample_mesh(), {}, 16);
  for (const uint32_t groups : {300u, 100000u, 0xffffffffu}) {
    Streams streams(file.bytes);
    IndexOfFile index(streams);
    index.directory.groups = groups;
    if (groups < 0xffffffff) index.directory.index_pages.resize((groups - 1) / groups_per_index_page + 1);
    streams.of("CDIR").bytes = encode_directory(index.directory);
    const auto decoded = decode_bytes(streams.written());
    // Its index is made anew from the pages.
    EXPECT_TRUE(!decoded || differences_between(sample_mesh(), *decoded).empty());
  }
  Streams streams(file.bytes);
  streams.remove("CDIR");
  streams.of("CHRT", 3).patch = 0xfffffffe;
  const auto decoded = decode_bytes(streams.written());
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
}

/// A few bytes that say they are four thousand million points.
TEST(RandomDamage, ChartsThatClaimMuchMemoryAreRefused) {
  const RandomFile file = random_file(sample_mesh(), {}, 16);
  Streams streams(file.bytes);
  IndexOfFile index(streams);
  const auto number = static_cast<uint32_t>(index.groups.size() - 1);
  IndexedGroup& group = index.groups[number];
  ASSERT_EQ(group.level, 0u);
  std::vector<std::byte>& page = streams.of("CHRT", number).bytes;
  const ParsedPageHead parsed = decode_page_head(page).value();
  std::vector<std::byte> chart(page.begin() + static_cast<ptrdiff_t>(parsed.bytes),
                               page.begin() + static_cast<ptrdiff_t>(parsed.bytes + group.charts[0].bytes));
  ASSERT_LT(std::to_integer<unsigned>(chart[0]), 128u);
  const std::byte claim[] = {std::byte{0xfd}, std::byte{0xff}, std::byte{0xff}, std::byte{0xff},
                             std::byte{0x0f}};
  chart.erase(chart.begin());
  chart.insert(chart.begin(), std::begin(claim), std::end(claim));
  group.charts.resize(1);
  group.charts[0].bytes = static_cast<uint32_t>(chart.size());
  group.charts[0].check = static_cast<uint32_t>(hash64(chart));
  PageHead head = parsed.head;
  head.charts.resize(1);
  head.charts[0].bytes = group.charts[0].bytes;
  page = encode_page_head(head);
  page.insert(page.end(), chart.begin(), chart.end());
  index.put(streams);
  expect_refused("chart_of_four_billion_points", streams.written(), ErrorCode::memory_bound);
}

TEST(RandomDamage, ChartsThatShareBytesAreRefused) {
  const RandomFile file = random_file(sample_mesh(), {}, 16);
  Streams streams(file.bytes);
  IndexOfFile index(streams);
  uint32_t finest = 0;
  for (IndexedGroup& group : index.groups) {
    if (group.level > 0) continue;
    if (finest == 0) finest = static_cast<uint32_t>(&group - index.groups.data());
    group.offset = index.groups[finest].offset;
    group.charts = index.groups[finest].charts;
  }
  index.put(streams);
  expect_refused("charts_that_share_bytes", streams.written(), ErrorCode::corrupt);
}

/// Bytes of charts with good checks.
TEST(RandomDamage, HostileChartsAreBorne) {
  const std::vector<Sample> files = samples();
  for (uint64_t i = 0; i < cases(1500); ++i) {
    Random random(i);
    Streams streams(files[random.below(files.size())].bytes);
    IndexOfFile index(streams);
    const uint32_t number = random.below(index.groups.size());
    IndexedGroup& group = index.groups[number];
    std::vector<std::byte>& page = streams.of("CHRT", number).bytes;
    size_t at = decode_page_head(page).value().bytes;
    for (IndexedChart& chart : group.charts) {
      for (uint32_t k = random.below(4); k > 0; --k) {
        // Counts stand in front.
        const size_t byte =
            at + (random.chance(50) ? random.below(std::min(chart.bytes, 12u)) : random.below(chart.bytes));
        page[byte] = random.chance(50) ? page[byte] ^ static_cast<std::byte>(1u << random.below(8))
                                       : static_cast<std::byte>(random.below(256));
      }
      chart.check = static_cast<uint32_t>(hash64(Bytes(page).subspan(at, chart.bytes)));
      at += chart.bytes;
    }
    index.put(streams);
    ASSERT_NO_FATAL_FAILURE(expect_bearable(streams.written(), "case " + std::to_string(i)));
  }
}

TEST(RandomDamage, HostilePageHeadsAreBorne) {
  const RandomFile file = random_file(sample_mesh(), {}, 16);
  for (uint64_t i = 0; i < cases(1000); ++i) {
    Random random(i);
    Streams streams(file.bytes);
    const uint32_t groups = decode_directory(streams.of("CDIR").bytes).value().groups;
    streams.remove(random.chance(50) ? "CIDX" : "CDIR");
    for (unsigned k = 0; k < 3; ++k) {
      std::vector<std::byte>& page = streams.of("CHRT", random.below(groups)).bytes;
      page[random.below(std::min<size_t>(page.size(), 60))] ^= static_cast<std::byte>(1u << random.below(8));
    }
    ASSERT_NO_FATAL_FAILURE(expect_bearable(streams.written(), "case " + std::to_string(i)));
  }
}

}  // namespace
}  // namespace maille::testing
