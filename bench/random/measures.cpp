#include "measures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>

#include "base/result.h"
#include "random/read/selection.h"
#include "surface/arrays/surface_normals.h"

namespace maille {

double cpu_seconds() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

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

Result<double> decode_speed(const std::vector<ChartBytes>& charts, const ChartSet& set, uint32_t level,
                            ChartUse use) {
  double best = 0;
  uint64_t all = 0;
  FanBuffers buffers;
  for (const ChartBytes& chart : charts) all += chart.level == level ? chart.faces : 0;
  for (int run = 0; run < 7; ++run) {
    const double begin = cpu_seconds();
    for (const ChartBytes& chart : charts) {
      if (chart.level == level) MAILLE_CHECK(decode_chart(set, chart.bytes, {}, &buffers, use));
    }
    best = std::max(best, 1e-6 * static_cast<double>(all) / (cpu_seconds() - begin));
  }
  return best;
}

namespace {

using Centres = std::vector<std::array<double, 3>>;

Result<Centres> centres_of_faces(const ChartSet& set, const std::vector<ChartBytes>& charts) {
  Centres centres;
  for (const ChartBytes& chart : charts) {
    if (chart.level > 0) continue;
    const DecodedChart decoded = MAILLE_TRY(decode_chart(set, chart.bytes, {}));
    const std::vector<Vector3> points = positions_as_doubles(decoded.mesh.points);
    for (const CellBlock& block : decoded.mesh.blocks) {
      for (uint64_t i = 0; i < block.size(); ++i) {
        const auto cell = block.cell(i);
        std::array<double, 3>& centre = centres.emplace_back();
        for (const uint32_t p : cell) {
          for (unsigned k = 0; k < 3; ++k) centre[k] += points[p][k] / static_cast<double>(cell.size());
        }
      }
    }
  }
  return centres;
}

/// Half the side of the cube around a point that holds so many centres.
double half_side(const Centres& centres, const std::array<double, 3>& middle, size_t wanted) {
  std::vector<double> distances;
  for (const std::array<double, 3>& centre : centres) {
    double distance = 0;
    for (unsigned k = 0; k < 3; ++k) distance = std::max(distance, std::abs(centre[k] - middle[k]));
    distances.push_back(distance);
  }
  const auto nth = distances.begin() + static_cast<ptrdiff_t>(wanted - 1);
  std::nth_element(distances.begin(), nth, distances.end());
  return *nth;
}

}  // namespace

Result<ReadForBox> read_for_boxes(RandomReader& reader, const ChartSet& set,
                                  const std::vector<ChartBytes>& charts, double part) {
  Centres centres = MAILLE_TRY(centres_of_faces(set, charts));
  // So that the boxes are the same however the mesh is cut.
  std::sort(centres.begin(), centres.end());
  const auto wanted = static_cast<size_t>(part * static_cast<double>(centres.size()));
  constexpr size_t boxes = 200;
  ReadForBox mean;
  for (size_t b = 0; b < boxes && wanted > 0; ++b) {
    const std::array<double, 3> middle = centres[centres.size() * (2 * b + 1) / (2 * boxes)];
    const double half = half_side(centres, middle, wanted);
    Region region;
    region.box.emplace();
    for (unsigned k = 0; k < 3; ++k) {
      region.box->low[k] = middle[k] - half;
      region.box->high[k] = middle[k] + half;
    }
    const Selection chosen = MAILLE_TRY(
        reader.select([&](const ChartIndex& index) { return select(index, region, Detail::full()); }));
    uint64_t bytes = 0;
    for (const ChartPlace& place : chosen.charts)
      bytes += reader.index().group(place.group).charts[place.chart].bytes;
    mean.faces += static_cast<double>(chosen.faces) / static_cast<double>(wanted) / boxes;
    mean.bits += 8 * static_cast<double>(bytes) / static_cast<double>(wanted) / boxes;
  }
  return mean;
}

}  // namespace maille
