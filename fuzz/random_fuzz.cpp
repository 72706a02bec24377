// Files of mode random: opened, and asked what programs ask of them. The first byte says whether the others
// are a file or the streams of one, and what is asked.

#include <maille/file.h>
#include <maille/random_access.h>

#include <algorithm>

#include "fuzzing.h"
#include "packed_streams.h"

namespace maille::fuzzing {
namespace {

constexpr Limits limits{uint64_t{16} << 20};
constexpr auto fitting = {ErrorCode::corrupt, ErrorCode::unsupported, ErrorCode::memory_bound};
constexpr Vector3 somewhere = {{0.3, -0.2, 0.4}};

void require_valid(const Result<Mesh>& mesh) {
  if (!mesh) return require_kind(mesh.error(), fitting);
  require(validate(*mesh).has_value(), "a mesh that was extracted is valid");
}

Detail detail_of(unsigned choice) {
  Detail detail;
  if (choice % 4 == 0) return Detail::full();
  if (choice % 4 == 1) detail.bound = 0.1;
  if (choice % 4 == 2) detail.view = View{somewhere, 1000, 1};
  if (choice % 4 == 3) detail.level = 1;
  return detail;
}

void read_charts(File& file, unsigned choice) {
  Region region;
  if (choice % 3 == 1) region.box = Box{{{-0.5, -0.5, -0.5}}, {{0.5, 0.5, 0.5}}};
  if (choice % 3 == 2) region.sphere = Sphere{somewhere, 0.5};
  const auto selection =
      choice % 5 == 4 ? file.select(region, choice) : file.select(region, detail_of(choice));
  if (!selection) return require_kind(selection.error(), fitting);
  require(std::is_sorted(selection->charts.begin(), selection->charts.end(),
                         [](const ChartPlace& a, const ChartPlace& b) {
                           return a.group != b.group ? a.group < b.group : a.chart < b.chart;
                         }),
          "charts are chosen in the order of the file");
  std::vector<std::string> problems;
  const auto mesh = choice % 2 == 0 ? file.extract(*selection) : file.salvage(*selection, problems);
  require_valid(mesh);
  if (mesh) require(validate(clip(*mesh, region)).has_value(), "what is clipped is valid");
}

void read_one_by_one(File& file) {
  for (uint32_t g = 0; g < std::min(file.groups(), 20u); ++g) {
    const auto group = file.group(g);
    if (!group) return require_kind(group.error(), fitting);
    for (uint32_t c = 0; c < std::min<size_t>(group->charts.size(), 20); ++c) {
      const auto info = file.info({g, c});
      require(info.has_value(), "a chart of a known group is known");
      const auto mesh = file.read({g, c});
      require_valid(mesh);
      if (!mesh) continue;
      uint64_t triangles = 0;
      const Meshlets pieces = meshlets(*mesh);
      for (const Meshlets::Piece& piece : pieces.pieces) {
        require(piece.points <= most_meshlet_points && piece.triangles <= most_meshlet_triangles,
                "meshlets are small");
        triangles += piece.triangles;
      }
      require(triangles == pieces.faces.size(), "each triangle is in one piece");
    }
  }
}

void search(File& file) {
  const auto hit = file.hit(somewhere, {{-0.3, 0.25, -0.4}});
  if (!hit) require_kind(hit.error(), fitting);
  const auto nearest = file.nearest(somewhere);
  if (!nearest) require_kind(nearest.error(), fitting);
  const auto points = file.nearest_points(somewhere, 5);
  if (!points) return require_kind(points.error(), fitting);
  require(points->size() <= 5, "no more points than asked for");
  if (points->empty()) return;
  const auto component = file.component(points->front().chart, points->front().point);
  if (!component) return require_kind(component.error(), fitting);
  require_valid(file.extract(*component));
}

void read_whole(const Source& source) {
  const auto mesh = decode(source, {.limits = limits});
  require_valid(mesh);
  if (!mesh) return;
  const auto info = inspect(source);
  require(info.has_value(), "what decodes can be inspected");
  require(info->points == mesh->point_count() && info->cells == mesh->cell_count(),
          "the description tells the truth");
}

void ask(const Source& source, unsigned choice) {
  if (choice % 4 == 0) return read_whole(source);
  auto file = File::open(source, {.limits = limits});
  if (!file)
    return require_kind(file.error(), {ErrorCode::corrupt, ErrorCode::unsupported, ErrorCode::memory_bound,
                                       ErrorCode::usage});
  if (choice % 4 == 1) return read_charts(*file, choice / 4);
  if (choice % 4 == 2) return read_one_by_one(*file);
  search(*file);
}

}  // namespace
}  // namespace maille::fuzzing

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace maille;
  using namespace maille::fuzzing;
  if (size == 0) return 0;
  const Bytes input = std::as_bytes(std::span(data, size)).subspan(1);
  const std::vector<std::byte> packed =
      data[0] % 2 == 0 ? std::vector<std::byte>() : file_of_streams(input, Mode::random);
  const auto source = memory_source(data[0] % 2 == 0 ? input : Bytes(packed), "x.maille");
  if (const auto info = inspect(*source); !info) require_kind(info.error(), fitting);
  ask(*source, data[0] / 2);
  return 0;
}
