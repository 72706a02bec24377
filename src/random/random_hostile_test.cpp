// Files of mode `random` with good checksums that are made to do harm.
#include <gtest/gtest.h>
#include <maille/random_access.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "base/hash.h"
#include "random/chart_index.h"
#include "random/random_file.h"
#include "random/random_layout.h"
#include "support/data.h"
#include "support/files.h"
#include "support/random.h"
#include "support/random_streams.h"

namespace maille::testing {
namespace {

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
  const std::string path = tests_folder() + "/corrupt/maille/" + name + ".maille";
  const char* update = std::getenv("UPDATE");
  if (update != nullptr && std::string(update) == "1") {
    write_bytes(path, bytes);
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
    directory = decode_directory(streams.of("CDIR").bytes, {}).value();
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

TEST(RandomHostile, HostileIndexesAreBorne) {
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
TEST(RandomHostile, IndexesWithManyWaysAreBorne) {
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

TEST(RandomHostile, ManyGroupsInSmallFilesAreRefused) {
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
TEST(RandomHostile, ChartsThatClaimMuchMemoryAreRefused) {
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

TEST(RandomHostile, ChartsThatShareBytesAreRefused) {
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

/// A coarse chart that nothing refines, in front of the finest ones, has other blocks and not the array of
/// the mesh that comes first in these.
TEST(RandomHostile, CoarseChartsAreNotJoinedToTheFinest) {
  Mesh mesh = sample_mesh();
  std::rotate(mesh.arrays.begin(), mesh.arrays.end() - 1, mesh.arrays.end());
  ASSERT_EQ(mesh.arrays[0].domain, Domain::mesh);
  const RandomFile file = random_file(mesh, {}, 16);
  for (const bool claims_level_0 : {false, true}) {
    Streams streams(file.bytes);
    IndexOfFile index(streams);
    const auto coarse = std::find_if(index.groups.begin(), index.groups.end(),
                                     [](const IndexedGroup& group) { return group.level == 1; });
    ASSERT_NE(coarse, index.groups.end());
    const uint32_t refined_by = coarse->charts[0].producer;
    for (IndexedGroup& group : index.groups) {
      for (IndexedChart& chart : group.charts) {
        if (chart.producer == refined_by) chart.producer = no_group;
      }
    }
    if (claims_level_0) coarse->level = 0;
    index.put(streams);
    const std::vector<std::byte> bytes = streams.written();
    ASSERT_FALSE(decode_bytes(bytes));
    const auto salvaged = salvage(*memory_source(Bytes(bytes)));
    ASSERT_TRUE(salvaged) << salvaged.error().message;
    EXPECT_TRUE(validate(salvaged->mesh));
    ASSERT_TRUE(salvaged->damage);
    EXPECT_EQ(salvaged->damage->message.find("lost: 0 of"), std::string::npos) << salvaged->damage->message;
  }
}

/// Bytes of charts with good checks.
TEST(RandomHostile, HostileChartsAreBorne) {
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

TEST(RandomHostile, HostilePageHeadsAreBorne) {
  const RandomFile file = random_file(sample_mesh(), {}, 16);
  for (uint64_t i = 0; i < cases(1000); ++i) {
    Random random(i);
    Streams streams(file.bytes);
    const uint32_t groups = decode_directory(streams.of("CDIR").bytes, {}).value().groups;
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
