#include "speed.h"

#include <fmt/format.h>
#include <maille/io.h>
#include <maille/random_access.h>
#include <maille/source.h>

#include <algorithm>
#include <memory>

#include "base/result.h"
#include "measures.h"
#include "peers/codec.h"
#include "random/random_file.h"

namespace maille {
namespace {

constexpr int rounds = 15;

/// The charts of level 0 of a file, ready to be decoded.
struct FinestCharts {
  std::string name;
  ChartSet set;
  std::vector<ChartBytes> charts;
  uint64_t bytes = 0;  ///< with tables
  double triangles = 0;
  double show = 1e30, join = 1e30;  ///< seconds
};

/// Polygons count as the triangles of a fan, so that speeds of all meshes are of one kind.
Result<double> triangles_of(const FinestCharts& finest) {
  double count = 0;
  for (const ChartBytes& chart : finest.charts) {
    const DecodedChart decoded = MAILLE_TRY(decode_chart(finest.set, chart.bytes, {}));
    for (const CellBlock& block : decoded.mesh.blocks)
      count += static_cast<double>(block.connectivity.size()) - 2 * static_cast<double>(block.size());
  }
  return count;
}

Result<FinestCharts> finest_charts(const Source& source, std::string name) {
  RandomReader reader = MAILLE_TRY(RandomReader::open(source, {}));
  const FileReader& file = MAILLE_TRY(reader.whole_file());
  std::vector<std::byte> tables;
  if (file.has_stream(tables_key(0))) tables = MAILLE_TRY(file.read_stream(tables_key(0)));
  FinestCharts finest{
      std::move(name), MAILLE_TRY(chart_set(reader.description(), 0, tables)), {}, tables.size()};
  finest.charts = MAILLE_TRY(read_all(reader));
  std::erase_if(finest.charts, [](const ChartBytes& chart) { return chart.level > 0; });
  for (const ChartBytes& chart : finest.charts) finest.bytes += chart.bytes.size();
  finest.triangles = MAILLE_TRY(triangles_of(finest));
  return finest;
}

Result<> decode_once(FinestCharts& finest, FanBuffers& buffers) {
  for (const ChartUse use : {ChartUse::show, ChartUse::join}) {
    const double begin = cpu_seconds();
    for (const ChartBytes& chart : finest.charts)
      MAILLE_CHECK(decode_chart(finest.set, chart.bytes, {}, &buffers, use));
    double& best = use == ChartUse::show ? finest.show : finest.join;
    best = std::min(best, cpu_seconds() - begin);
  }
  return {};
}

void print_row(const FinestCharts& finest, double reference) {
  const double show = 1e-6 * finest.triangles / finest.show, join = 1e-6 * finest.triangles / finest.join;
  fmt::print("| {} | {:.3f} | {:.1f} | {:.1f} | {:.2f} |\n", finest.name,
             static_cast<double>(finest.bytes) / finest.triangles, show, join, show / reference);
}

constexpr const char* head =
    "| charts of level 0 | bytes a triangle | M triangles/s, to show | to join | to show, against the first "
    "row |\n"
    "|---|--:|--:|--:|--:|\n";

Result<FinestCharts> coded_charts(const Mesh& mesh, const std::string& name, int effort, unsigned bits) {
  EncodeOptions options;
  options.effort = effort;
  if (bits > 0) options.positions = {Tolerance::Kind::bits, static_cast<double>(bits)};
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  MAILLE_CHECK(encode_random(mesh, *sink, options, HierarchyOptions{}));
  const auto source = memory_source(Bytes(bytes));
  return finest_charts(*source, fmt::format("{}, {}, -{}", name,
                                            bits > 0 ? fmt::format("{} bits", bits) : "lossless", effort));
}

Result<> compare_one(const std::string& path) {
  const Mesh mesh = MAILLE_TRY(read_mesh(path)).mesh;
  const std::string name = path.substr(path.rfind('/') + 1);
  const bench::Workload workload = bench::make_workload(MAILLE_TRY(bench::surface_of(mesh)), 14);
  const auto peer = bench::meshoptimizer_codec();
  const bench::Encoded encoded = MAILLE_TRY(peer->encode(workload));
  std::vector<FinestCharts> all;
  for (const unsigned bits : {14u, 0u}) {
    for (const int effort : {1, 2, 5}) all.push_back(MAILLE_TRY(coded_charts(mesh, name, effort, bits)));
  }
  double best = 1e30;
  FanBuffers buffers;
  for (int round = 0; round < rounds; ++round) {
    const double begin = cpu_seconds();
    MAILLE_CHECK(peer->decode(encoded.bytes, workload));
    best = std::min(best, cpu_seconds() - begin);
    for (FinestCharts& finest : all) MAILLE_CHECK(decode_once(finest, buffers));
  }
  const double triangles = static_cast<double>(workload.triangles.size()) / 3,
               speed = 1e-6 * triangles / best;
  fmt::print("| {}, 14 bits, {} | {:.3f} | {:.1f} | | 1 |\n", name, peer->name(),
             static_cast<double>(encoded.bytes.size()) / triangles, speed);
  for (const FinestCharts& finest : all) print_row(finest, speed);
  return {};
}

}  // namespace

Result<> compare_decoding(const std::vector<std::string>& files) {
  std::vector<FinestCharts> all;
  for (const std::string& path : files)
    all.push_back(MAILLE_TRY(finest_charts(*MAILLE_TRY(file_source(path)), path)));
  FanBuffers buffers;
  for (int round = 0; round < rounds; ++round) {
    for (FinestCharts& finest : all) MAILLE_CHECK(decode_once(finest, buffers));
  }
  fmt::print("{}", head);
  for (const FinestCharts& finest : all) print_row(finest, 1e-6 * all[0].triangles / all[0].show);
  return {};
}

Result<> compare_with_peers(const std::vector<std::string>& meshes) {
  fmt::print("{}", head);
  for (const std::string& path : meshes) MAILLE_CHECK(compare_one(path));
  return {};
}

}  // namespace maille
