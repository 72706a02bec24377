// maille_bench_random FILE.maille...: sizes of levels, speed of decoding charts, faces read for boxes.
#include <fmt/format.h>
#include <maille/source.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <memory>

#include "base/result.h"
#include "hierarchy/chart_codec.h"
#include "hierarchy/random_reader.h"
#include "hierarchy/selection.h"
#include "surface/surface_normals.h"

namespace maille {
namespace {

double cpu_seconds() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct ChartBytes {
  uint32_t level;
  uint64_t faces;
  std::vector<std::byte> bytes;
};

Result<std::vector<ChartBytes>> read_all(RandomReader& reader) {
  const Selection all =
      MAILLE_TRY(reader.select([](const ChartIndex& index) { return select(index, {}, Detail::full()); }));
  std::vector<ChartBytes> charts;
  for (uint32_t g = 0; g < reader.index().size(); ++g) {
    const IndexedGroup& group = reader.index().group(g);
    uint64_t offset = group.offset;
    for (const IndexedChart& chart : group.charts) {
      ChartBytes& read = charts.emplace_back(ChartBytes{group.level, chart.faces, {}});
      read.bytes.resize(chart.bytes);
      MAILLE_CHECK(reader.source().read_at(offset, read.bytes));
      offset += chart.bytes;
    }
  }
  return charts;
}

/// M faces per second of the best of some runs over the charts of `level`, in CPU time of one thread.
Result<double> decode_speed(const std::vector<ChartBytes>& charts, const ChartSet& set, uint32_t level) {
  double best = 0;
  uint64_t all = 0;
  FanBuffers buffers;
  for (const ChartBytes& chart : charts) all += chart.level == level ? chart.faces : 0;
  for (int run = 0; run < 7; ++run) {
    const double begin = cpu_seconds();
    for (const ChartBytes& chart : charts) {
      if (chart.level == level) MAILLE_CHECK(decode_chart(set, chart.bytes, {}, &buffers));
    }
    best = std::max(best, 1e-6 * static_cast<double>(all) / (cpu_seconds() - begin));
  }
  return best;
}

/// Faces of charts over the faces that are in a box of `part` of all faces: the mean over some boxes, each
/// around a face, grown until it holds so many.
Result<double> read_overhead(RandomReader& reader, const ChartSet& set, const std::vector<ChartBytes>& charts,
                             double part) {
  struct Centre {
    std::array<double, 3> at{};
  };
  std::vector<Centre> centres;
  for (const ChartBytes& chart : charts) {
    if (chart.level > 0) continue;
    const DecodedChart decoded = MAILLE_TRY(decode_chart(set, chart.bytes, {}));
    const std::vector<Vector3> points = positions_as_doubles(decoded.mesh.points);
    for (const CellBlock& block : decoded.mesh.blocks) {
      for (uint64_t i = 0; i < block.size(); ++i) {
        const auto cell = block.cell(i);
        Centre& centre = centres.emplace_back();
        for (const uint32_t p : cell) {
          for (unsigned k = 0; k < 3; ++k) centre.at[k] += points[p][k] / static_cast<double>(cell.size());
        }
      }
    }
  }
  const auto wanted = static_cast<size_t>(part * static_cast<double>(centres.size()));
  constexpr size_t boxes = 20;
  double sum = 0;
  for (size_t b = 0; b < boxes && wanted > 0; ++b) {
    const Centre middle = centres[centres.size() * (2 * b + 1) / (2 * boxes)];
    std::vector<double> distances;
    for (const Centre& centre : centres) {
      double distance = 0;
      for (unsigned k = 0; k < 3; ++k) distance = std::max(distance, std::abs(centre.at[k] - middle.at[k]));
      distances.push_back(distance);
    }
    std::nth_element(distances.begin(), distances.begin() + static_cast<ptrdiff_t>(wanted - 1),
                     distances.end());
    const double half = distances[wanted - 1];
    Region region;
    region.box.emplace();
    for (unsigned k = 0; k < 3; ++k) {
      region.box->low[k] = middle.at[k] - half;
      region.box->high[k] = middle.at[k] + half;
    }
    const Selection chosen = MAILLE_TRY(
        reader.select([&](const ChartIndex& index) { return select(index, region, Detail::full()); }));
    sum += static_cast<double>(chosen.faces) / static_cast<double>(wanted);
  }
  return sum / boxes;
}

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
  fmt::print("  decoding charts: {:.1f} M faces/s", MAILLE_TRY(decode_speed(charts, sets[0], 0)));
  if (directory.levels > 1) fmt::print(", level 1 {:.1f}", MAILLE_TRY(decode_speed(charts, sets[1], 1)));
  fmt::print("\n");
  for (const double part : {0.01, 0.1}) {
    fmt::print("  faces read for {:.0f} % of them: {:.2f} times as many\n", 100 * part,
               MAILLE_TRY(read_overhead(reader, sets[0], charts, part)));
  }
  return {};
}

}  // namespace
}  // namespace maille

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: {} FILE.maille...\n", argv[0]);
    return 2;
  }
  for (int i = 1; i < argc; ++i) {
    if (auto done = maille::report(argv[i]); !done) {
      fmt::print(stderr, "{}\n", done.error().message);
      return 1;
    }
  }
  return 0;
}
