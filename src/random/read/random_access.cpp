#include <maille/random_access.h>

#include <algorithm>
#include <cmath>

#include "base/result.h"
#include "random/keep_cells.h"
#include "random/mesh_geometry.h"
#include "random/read/component_walk.h"
#include "random/read/join_charts.h"
#include "random/read/nearest_first.h"
#include "random/read/nearest_points.h"
#include "random/read/random_reader.h"
#include "random/read/selection.h"
#include "surface/parts/merge_parts.h"

namespace maille {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Calls f(face, corners) for the triangles of a chart's faces.
template <class F>
void for_each_triangle(const Mesh& mesh, F f) {
  uint64_t face = 0;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i, ++face) {
      if (!is_face(block.type_of(i))) continue;
      for_each_fan_triangle(mesh.points, block.cell(i), [&](uint32_t a, uint32_t b, uint32_t c) {
        f(face, std::array<uint32_t, 3>{a, b, c});
      });
    }
  }
}

/// How far along a ray a box or sphere begins.
struct AlongRay {
  Vector3 origin, direction;

  double operator()(const Sphere& sphere) const {
    const Vector3 d = sphere.centre - origin;
    const double along = dot(d, direction) / dot(direction, direction);
    const Vector3 off = d - direction * along;
    const double left = sphere.radius * sphere.radius - dot(off, off);
    if (left < 0) return infinity;
    const double half = std::sqrt(left / dot(direction, direction));
    return along + half < 0 ? infinity : std::max(along - half, 0.0);
  }
  double operator()(const Box& box) const {
    double begin = 0, end = infinity;
    for (unsigned k = 0; k < 3; ++k) {
      if (direction[k] == 0) {
        if (origin[k] < box.low[k] || origin[k] > box.high[k]) return infinity;
        continue;
      }
      const double a = (box.low[k] - origin[k]) / direction[k], b = (box.high[k] - origin[k]) / direction[k];
      begin = std::max(begin, std::min(a, b));
      end = std::min(end, std::max(a, b));
    }
    return begin <= end ? begin : infinity;
  }
};

/// Weights of the corners of a triangle at the point of it that is nearest to p.
std::array<double, 3> nearest_weights(const Vector3& p, const Vector3& a, const Vector3& b,
                                      const Vector3& c) {
  const Vector3 ab = b - a, ac = c - a, n = cross(ab, ac);
  const double area = dot(n, n);
  if (area > 0) {
    const double v = dot(cross(p - a, ac), n) / area, w = dot(cross(ab, p - a), n) / area;
    if (v >= 0 && w >= 0 && v + w <= 1) return {1 - v - w, v, w};
  }
  const std::array<Vector3, 3> corner = {a, b, c};
  std::array<double, 3> best{};
  double least = infinity;
  for (unsigned k = 0; k < 3; ++k) {
    const Vector3 &from = corner[k], &to = corner[(k + 1) % 3], edge = to - from;
    const double squared = dot(edge, edge);
    const double along = squared > 0 ? std::clamp(dot(p - from, edge) / squared, 0.0, 1.0) : 0;
    const Vector3 d = p - (from + edge * along);
    if (dot(d, d) >= least) continue;
    least = dot(d, d);
    best = {};
    best[k] = 1 - along;
    best[(k + 1) % 3] = along;
  }
  return best;
}

/// Nothing farther than what was found is of interest.
auto reach_of(const std::optional<SurfacePoint>& found) {
  return [&found] { return found ? found->distance : infinity; };
}

/// The blocks of a chart among all those of its level.
std::vector<CellBlock> all_blocks(std::vector<CellBlock> some, std::span<const uint32_t> numbers,
                                  std::span<const CodedBlock> described) {
  std::vector<CellBlock> blocks(described.size());
  for (size_t k = 0; k < numbers.size(); ++k) blocks[numbers[k]] = std::move(some[k]);
  for (size_t b = 0; b < blocks.size(); ++b) {
    blocks[b].type = described[b].shape.type;
    blocks[b].name = described[b].name;
  }
  return blocks;
}

/// Which cells of charts joined are those of the component.
std::vector<bool> cells_kept(const Component& component, std::span<const DecodedChart> charts) {
  std::vector<bool> keep;
  std::vector<size_t> next(charts.size());
  std::vector<uint64_t> first(charts.size());
  for (const BlockOfPart& here : blocks_in_order(charts)) {
    const size_t c = here.part;
    const std::vector<uint32_t>& cells = component.parts[c].cells;
    const uint64_t end = first[c] + charts[c].mesh.blocks[here.block].size();
    for (; first[c] < end; ++first[c]) {
      const bool kept = next[c] < cells.size() && cells[next[c]] == first[c];
      next[c] += kept;
      keep.push_back(kept);
    }
  }
  return keep;
}

}  // namespace

struct File::State {
  RandomReader reader;
  DecodeOptions options;

  /// `problems`: not null: damaged charts are left out, and named there.
  Result<Mesh> extract(const Selection& selection, std::vector<std::string>* problems) {
    MAILLE_CHECK(reader.find(selection.charts));
    const ChartIndex& index = reader.index();
    const bool finest =
        std::all_of(selection.charts.begin(), selection.charts.end(),
                    [&](const ChartPlace& place) { return index.group(place.group).level == 0; });
    std::vector<DecodedChart> charts =
        MAILLE_TRY(reader.read_charts(selection.charts, problems, finest ? ChartUse::join : ChartUse::show));
    if (!finest && !charts.empty()) return join_levels(charts);
    return join(std::move(charts), problems);
  }
  Result<Mesh> join(std::vector<DecodedChart> charts, std::vector<std::string>* problems) const {
    return join_finest(std::move(charts), reader, options, problems);
  }
};

File::File(std::unique_ptr<State> state) : state_(std::move(state)) {}
File::File(File&&) noexcept = default;
File& File::operator=(File&&) noexcept = default;
File::~File() = default;

Result<File> File::open(const Source& source, const DecodeOptions& options) {
  RandomReader reader = MAILLE_TRY(RandomReader::open(source, options));
  return File(std::make_unique<State>(State{std::move(reader), options}));
}

uint32_t File::levels() const {
  return state_->reader.directory().levels;
}
uint64_t File::faces(uint32_t level) const {
  return state_->reader.directory().faces[level];
}
uint32_t File::charts(uint32_t level) const {
  return state_->reader.directory().charts[level];
}
// The first group's sphere encloses those of all others, which refine it.
Sphere File::sphere() const {
  return state_->reader.index().group(0).sphere;
}

Result<Selection> File::select(const Region& region, const Detail& detail) {
  return state_->reader.select(
      [&](const ChartIndex& index) { return maille::select(index, region, detail); });
}
Result<Selection> File::select(const Region& region, uint64_t most_faces, const std::optional<View>& view) {
  return state_->reader.select(
      [&](const ChartIndex& index) { return select_within(index, region, most_faces, view); });
}

Result<ChartInfo> File::info(const ChartPlace& place) {
  MAILLE_CHECK(state_->reader.find({place}));
  const IndexedGroup& group = state_->reader.index().group(place.group);
  const IndexedChart& chart = group.charts[place.chart];
  return ChartInfo{group.level, chart.faces, chart.bytes, chart.sphere, chart.box};
}

uint32_t File::groups() const {
  return state_->reader.index().size();
}
Result<GroupInfo> File::group(uint32_t number) {
  MAILLE_CHECK(state_->reader.find({{number, 0}}));
  const IndexedGroup& group = state_->reader.index().group(number);
  GroupInfo info{group.level, group.view_error, group.bound, group.sphere, group.replaces, {}};
  for (const IndexedChart& chart : group.charts)
    info.charts.push_back({chart.producer, chart.faces, chart.bytes, chart.sphere});
  return info;
}

Result<Mesh> File::read(const ChartPlace& place) {
  MAILLE_CHECK(state_->reader.find({place}));
  std::vector<DecodedChart> charts = MAILLE_TRY(state_->reader.read_charts({place}, nullptr, ChartUse::show));
  Mesh mesh = std::move(charts[0].mesh);
  mesh.blocks = all_blocks(std::move(mesh.blocks), charts[0].block_numbers, state_->reader.blocks_of(place));
  return mesh;
}
Result<Mesh> File::extract(const Selection& selection) {
  return state_->extract(selection, nullptr);
}
Result<Mesh> File::salvage(const Selection& selection, std::vector<std::string>& problems) {
  return state_->extract(selection, &problems);
}

Result<std::optional<SurfacePoint>> File::hit(const Vector3& origin, const Vector3& direction) {
  // Written so that a direction with a NaN is refused, too.
  if (!(dot(direction, direction) > 0)) return failure(ErrorCode::usage, "a ray must have a direction");
  std::optional<SurfacePoint> found;
  const auto look = [&](const ChartPlace& place, const DecodedChart& chart) {
    const Mesh& mesh = chart.mesh;
    for_each_triangle(mesh, [&](uint64_t face, const std::array<uint32_t, 3>& corners) {
      std::array<Vector3, 3> p;
      for (unsigned k = 0; k < 3; ++k) p[k] = point_position(mesh.points, corners[k]);
      const auto hit = ray_hit(origin, direction, p[0], p[1], p[2]);
      if (!hit || (found && hit->distance >= found->distance)) return;
      found = SurfacePoint{place,
                           face,
                           corners,
                           {1 - hit->b - hit->c, hit->b, hit->c},
                           origin + direction * hit->distance,
                           hit->distance};
    });
  };
  MAILLE_CHECK(nearest_first(state_->reader, AlongRay{origin, direction}, reach_of(found), look));
  return found;
}

Result<std::optional<SurfacePoint>> File::nearest(const Vector3& point) {
  std::optional<SurfacePoint> found;
  const auto look = [&](const ChartPlace& place, const DecodedChart& chart) {
    const Mesh& mesh = chart.mesh;
    for_each_triangle(mesh, [&](uint64_t face, const std::array<uint32_t, 3>& corners) {
      std::array<Vector3, 3> p;
      for (unsigned k = 0; k < 3; ++k) p[k] = point_position(mesh.points, corners[k]);
      const double distance = std::sqrt(squared_distance(point, p[0], p[1], p[2]));
      if (!(distance < (found ? found->distance : infinity))) return;
      const std::array<double, 3> weights = nearest_weights(point, p[0], p[1], p[2]);
      const Vector3 at = p[0] * weights[0] + p[1] * weights[1] + p[2] * weights[2];
      found = SurfacePoint{place, face, corners, weights, at, distance};
    });
  };
  MAILLE_CHECK(nearest_first(state_->reader, FromPoint{point}, reach_of(found), look));
  return found;
}

Result<std::vector<NearPoint>> File::nearest_points(const Vector3& point, uint64_t count) {
  return maille::nearest_points(state_->reader, point, count);
}

Result<Component> File::component(const ChartPlace& chart, uint32_t point) {
  return find_component(state_->reader, chart, point, state_->options.limits.mesh_bytes);
}

Result<Mesh> File::extract(const Component& component) {
  std::vector<ChartPlace> places;
  for (const Component::Part& part : component.parts) places.push_back(part.chart);
  MAILLE_CHECK(state_->reader.find(places));
  std::vector<DecodedChart> charts = MAILLE_TRY(state_->reader.read_charts(places));
  const std::vector<bool> keep = charts.empty() ? std::vector<bool>() : cells_kept(component, charts);
  const Mesh mesh = MAILLE_TRY(state_->join(std::move(charts), nullptr));
  return keep_cells(mesh, keep);
}

}  // namespace maille
