#include "chart_sizes.h"

#include <fmt/format.h>
#include <maille/io.h>
#include <maille/random_access.h>

#include <algorithm>
#include <memory>

#include "base/result.h"
#include "measures.h"
#include "random/mesh_geometry.h"
#include "random/random_file.h"

namespace maille {
namespace {

/// Counts what is read.
class CountingSource final : public Source {
 public:
  explicit CountingSource(Bytes bytes) : bytes_(bytes) {}
  uint64_t size() const override { return bytes_.size(); }
  Result<> read_at(uint64_t offset, std::span<std::byte> out) const override {
    std::copy_n(bytes_.begin() + static_cast<ptrdiff_t>(offset), out.size(), out.begin());
    read_ += out.size();
    return {};
  }
  std::string name() const override { return "<counted>"; }
  uint64_t read() const { return read_; }

 private:
  Bytes bytes_;
  mutable uint64_t read_ = 0;
};

/// Bytes of pages of the index and charts for the face nearest to some point: the mean over points of the
/// mesh, without what opening the file reads.
Result<double> bytes_for_one_face(Bytes file, const Mesh& mesh) {
  constexpr uint64_t faces = 20;
  double sum = 0;
  for (uint64_t i = 0; i < faces; ++i) {
    const CountingSource source(file);
    File open = MAILLE_TRY(File::open(source));
    const uint64_t before = source.read();
    MAILLE_CHECK(open.nearest(point_position(mesh.points, mesh.point_count() * i / faces)));
    sum += static_cast<double>(source.read() - before);
  }
  return sum / faces;
}

Result<> print_row(const Mesh& mesh, uint32_t chart_faces) {
  EncodeOptions options;
  options.mode = Mode::random;
  options.effort = 2;
  options.positions = {Tolerance::Kind::bits, 14};
  options.most_cells_per_part = chart_faces;
  std::vector<std::byte> bytes;
  const auto sink = memory_sink(bytes);
  MAILLE_CHECK(encode(mesh, *sink, options));
  const auto source = memory_source(Bytes(bytes));
  RandomReader reader = MAILLE_TRY(RandomReader::open(*source, {}));
  const FileReader& file = MAILLE_TRY(reader.whole_file());
  std::vector<std::byte> tables;
  if (file.has_stream(tables_key(0))) tables = MAILLE_TRY(file.read_stream(tables_key(0)));
  const ChartSet set = MAILLE_TRY(chart_set(reader.description(), 0, tables));
  const std::vector<ChartBytes> charts = MAILLE_TRY(read_all(reader));
  uint64_t finest = 0, all = 0;
  for (const ChartBytes& chart : charts) {
    finest += chart.level == 0 ? chart.bytes.size() : 0;
    all += chart.bytes.size();
  }
  const auto faces = static_cast<double>(reader.directory().faces[0]);
  const auto bits = [&](uint64_t size) { return 8 * static_cast<double>(size) / faces; };
  const ReadForBox small = MAILLE_TRY(read_for_boxes(reader, set, charts, 0.01));
  const ReadForBox large = MAILLE_TRY(read_for_boxes(reader, set, charts, 0.1));
  fmt::print("| {} | {:.2f} | {:.2f} | {:.3f} | {:.1f} | {:.2f} | {:.0f} | {:.2f} | {:.1f} | {:.0f} |\n",
             chart_faces, bits(finest), bits(bytes.size()), bits(bytes.size() - all - tables.size()),
             MAILLE_TRY(bytes_for_one_face(bytes, mesh)) / 1024, small.faces, small.bits, large.faces,
             large.bits, MAILLE_TRY(decode_speed(charts, set, 0, ChartUse::show)));
  return {};
}

}  // namespace

Result<> study_chart_sizes(const std::string& path) {
  const Mesh mesh = MAILLE_TRY(read_mesh(path)).mesh;
  fmt::print("{}: {} faces\n", path, mesh.cell_count());
  fmt::print(
      "| faces a chart | finest level, bits a face | all levels | index, headers, tables of coarser charts | "
      "one face, KiB | "
      "1 % box, faces | bits | 10 % box, faces | bits | decoding, M faces/s |\n");
  fmt::print("|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
  for (uint32_t size = 128; size <= 32768; size *= 2) MAILLE_CHECK(print_row(mesh, size));
  return {};
}

}  // namespace maille
