// What files of mode random take and give: docs/random-access.md.
#include <fmt/format.h>
#include <maille/source.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "chart_sizes.h"
#include "cracks.h"
#include "exact.h"
#include "measures.h"
#include "speed.h"

namespace maille {
namespace {

Result<> report(const std::string& path) {
  const std::unique_ptr<Source> source = MAILLE_TRY(file_source(path));
  RandomReader reader = MAILLE_TRY(RandomReader::open(*source, {}));
  const FileReader& file = MAILLE_TRY(reader.whole_file());
  std::array<ChartSet, chart_sets> sets;
  uint64_t tables = 0;
  for (uint32_t set = 0; set < chart_sets; ++set) {
    std::vector<std::byte> bytes;
    if (file.has_stream(tables_key(set))) bytes = MAILLE_TRY(file.read_stream(tables_key(set)));
    sets[set] = MAILLE_TRY(chart_set(reader.description(), set, bytes));
    tables += bytes.size();
  }
  const std::vector<ChartBytes> charts = MAILLE_TRY(read_all(reader));
  uint64_t finest = 0, coarser = 0;
  for (const ChartBytes& chart : charts) (chart.level == 0 ? finest : coarser) += chart.bytes.size();
  const auto& directory = reader.directory();
  const auto faces = static_cast<double>(directory.faces[0]);
  const auto bits = [&](uint64_t bytes) { return 8 * static_cast<double>(bytes) / faces; };
  const uint64_t other = source->size() - finest - coarser - tables;
  fmt::print("{}: {} faces, {} charts\n", path, directory.faces[0], directory.charts[0]);
  fmt::print("  bits per face: finest {:.3f} (topology {:.3f}, positions {:.3f}, other {:.3f})\n",
             bits(finest), bits(directory.finest.topology), bits(directory.finest.arrays[0]),
             bits(directory.finest.other));
  fmt::print("    coarser {:.3f} (topology {:.3f}, positions {:.3f}, other {:.3f}), tables {:.3f}\n",
             bits(coarser), bits(directory.coarser.topology),
             directory.coarser.arrays.empty() ? 0 : bits(directory.coarser.arrays[0]),
             bits(directory.coarser.other), bits(tables));
  fmt::print("    index and headers {:.3f}; all {:.3f} = {:.3f} bytes\n", bits(other), bits(source->size()),
             bits(source->size()) / 8);
  fmt::print("  decoding charts: {:.1f} M faces/s to show, {:.1f} to join",
             MAILLE_TRY(decode_speed(charts, sets[0], 0, ChartUse::show)),
             MAILLE_TRY(decode_speed(charts, sets[0], 0, ChartUse::join)));
  if (directory.levels > 1)
    fmt::print(", level 1 {:.1f}", MAILLE_TRY(decode_speed(charts, sets[1], 1, ChartUse::show)));
  fmt::print("\n");
  for (const double part : {0.01, 0.1}) {
    const ReadForBox read = MAILLE_TRY(read_for_boxes(reader, sets[0], charts, part));
    fmt::print("  faces read for {:.0f} % of them: {:.2f} times as many\n", 100 * part, read.faces);
  }
  return {};
}

}  // namespace
}  // namespace maille

int usage(const char* name) {
  fmt::print(
      stderr,
      "usage: {0} FILE.maille...               sizes, speed of decoding, faces read for boxes\n"
      "       {0} --cracks VIEWS FILE.maille... edges open that are not in the mesh\n"
      "       {0} --chart-sizes MESH...         charts of 128 to 32768 faces\n"
      "       {0} --decode FILE.maille...       speed of decoding alone, of all files in the same rounds\n"
      "       {0} --peers MESH...               the same, of charts of all kinds beside meshoptimizer\n"
      "       {0} --exact EFFORT MESH...        is all, and a part, what it was?\n"
      "       {0} --boxes COUNT MESH...         so many boxes of each, with all arrays: are they what they "
      "were?\n",
      name);
  return 2;
}

int main(int argc, char** argv) {
  std::vector<std::string> files(argv + 1, argv + argc);
  const std::string what = files.empty() || files[0].rfind("--", 0) != 0 ? "" : files[0];
  if (!what.empty()) files.erase(files.begin());
  uint32_t number = 0;
  if ((what == "--cracks" || what == "--exact" || what == "--boxes") && !files.empty()) {
    number = static_cast<uint32_t>(std::strtoul(files[0].c_str(), nullptr, 10));
    files.erase(files.begin());
  }
  const std::array<std::string, 7> known{"",        "--cracks", "--chart-sizes", "--decode",
                                         "--peers", "--exact",  "--boxes"};
  if (files.empty() || std::find(known.begin(), known.end(), what) == known.end()) return usage(argv[0]);
  if (what == "--exact" || what == "--boxes") {
    const auto wrong = what == "--boxes" ? maille::check_boxes(files, number)
                                         : maille::check_exact(files, {.effort = static_cast<int>(number)});
    if (!wrong) fmt::print(stderr, "{}\n", wrong.error().message);
    return wrong && *wrong == 0 ? 0 : 1;
  }
  if (what == "--decode" || what == "--peers") {
    const auto done =
        what == "--decode" ? maille::compare_decoding(files) : maille::compare_with_peers(files);
    if (!done) fmt::print(stderr, "{}\n", done.error().message);
    return done ? 0 : 1;
  }
  uint64_t cracks = 0;
  for (const std::string& file : files) {
    maille::Result<> done;
    if (what == "--cracks") {
      const auto counted = maille::count_cracks(file, number);
      if (counted) cracks += *counted;
      if (!counted) done = tl::unexpected(counted.error());
    } else {
      done = what.empty() ? maille::report(file) : maille::study_chart_sizes(file);
    }
    if (done) continue;
    fmt::print(stderr, "{}\n", done.error().message);
    return 1;
  }
  return cracks > 0 ? 1 : 0;
}
