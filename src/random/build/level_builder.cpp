#include "random/build/level_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>

#include "mesh/ranked_set.h"
#include "random/build/bisection.h"
#include "random/build/deviation.h"
#include "random/build/simplifier.h"
#include "random/mesh_geometry.h"

namespace maille {
namespace {

/// A sphere around the middle of the box: at most sqrt(3) times as large as the smallest one, and found in
/// two passes. The factor makes up for the rounding of the root, so that no vertex lies outside.
Sphere sphere_of(std::span<const uint32_t> vertices, std::span<const float> positions) {
  const auto position = [&](uint32_t v) {
    Vector3 p;
    for (unsigned k = 0; k < 3; ++k) p[k] = static_cast<double>(positions[size_t{3} * v + k]);
    return p;
  };
  // Numbers that are none show in the sum of all.
  Vector3 low, high, sum;
  for (size_t i = 0; i < vertices.size(); ++i) {
    const Vector3 p = position(vertices[i]);
    for (unsigned k = 0; k < 3; ++k) {
      low[k] = i == 0 ? p[k] : std::min(low[k], p[k]);
      high[k] = i == 0 ? p[k] : std::max(high[k], p[k]);
      sum[k] += p[k];
    }
  }
  const bool finite = std::isfinite(sum[0] + sum[1] + sum[2]);
  Box box{low, high};
  for (size_t i = 0; i < vertices.size() && !finite; ++i)
    enclose(box, finite_position(positions, vertices[i]), i == 0);
  Sphere sphere{(box.low + box.high) * 0.5, 0};
  double farthest = 0;
  for (const uint32_t v : vertices) {
    const Vector3 d = (finite ? position(v) : finite_position(positions, v)) - sphere.centre;
    farthest = std::max(farthest, dot(d, d));
  }
  sphere.radius = std::sqrt(farthest) * (1 + 1e-12);
  return sphere;
}

/// What may be asked for. Below, headers and index are a third of a file (docs/random-access.md); above,
/// coarser levels of charts as large are no longer seen soon.
constexpr uint64_t least_chart_faces = 128, most_chart_faces = uint64_t{1} << 20;

/// A group at work: its triangles over vertices of its own.
struct GroupJob {
  std::vector<uint32_t> vertices;  ///< numbers in the mesh, rising
  std::vector<uint32_t> triangles;
  std::vector<float> positions;
  std::vector<uint8_t> locked;
  std::vector<uint32_t> corners, origins;  ///< of the mesh, by corner and triangle; with seams only
  std::vector<uint32_t> values;            ///< by corner
  double view_error = 0, bound = 0;
  std::vector<Chart> outputs;
};

class LevelBuilder {
 public:
  LevelBuilder(const FaceLists& faces, const LevelVertices& vertices, const ChartSizes& sizes,
               std::span<const Chart> charts = {})
      : faces_(faces), vertices_(vertices), sizes_(sizes), charts_(charts) {}

  /// Cuts the faces of the mesh into the charts of level 0.
  std::vector<Chart> cut(Executor& executor) const {
    const std::vector<uint32_t> joined = joined_on_borders();
    std::vector<uint32_t> corners(faces_.corners.size());
    for (size_t i = 0; i < corners.size(); ++i) corners[i] = joined[faces_.corners[i]];
    const SpatialGraph graph = dual_graph({corners, faces_.first}, vertices_.positions, vertices_.size());
    const std::vector<uint32_t> part_of = cut_into_parts(graph, {.target = sizes_.finest_faces}, executor);
    uint32_t count = 0;
    for (const uint32_t part : part_of) count = std::max(count, part + 1);
    std::vector<Chart> charts(count);
    for (uint32_t i = 0; i < part_of.size(); ++i) charts[part_of[i]].faces.push_back(i);
    std::vector<uint32_t> used;
    for (Chart& chart : charts) {
      used.clear();
      for (const uint32_t face : chart.faces) {
        used.insert(used.end(), faces_.face(face).begin(), faces_.face(face).end());
      }
      chart.sphere = sphere_of(used, vertices_.positions);
    }
    return charts;
  }

  /// Cuts the charts of a level into groups and simplifies each of these. Vertices that several groups have
  /// stay as they are, so groups can be simplified at once, and any mixture of levels fits together without
  /// cracks. The next level is cut into other groups, so that these borders can go then.
  std::vector<SimplifiedGroup> simplify(bool alone, Executor& executor) {
    const uint64_t target = uint64_t{sizes_.chart_faces} * sizes_.group_charts;
    const auto group_of = cut_into_parts(chart_graph(), {.target = target, .slack = 0.25, .axes = 3});
    std::vector<SimplifiedGroup> groups;
    for (uint32_t i = 0; i < group_of.size(); ++i) {
      if (group_of[i] >= groups.size()) groups.resize(size_t{group_of[i]} + 1);
      groups[group_of[i]].inputs.push_back(i);
    }
    find_shared(groups);
    const bool last = alone && groups.size() == 1;
    executor.parallel_for(groups.size(), [&](size_t i) {
      GroupJob job = run_group(groups[i], last);
      groups[i].view_error = job.view_error;
      groups[i].bound = job.bound;
      groups[i].outputs = std::move(job.outputs);
    });
    return groups;
  }

 private:
  /// Vertices on borders by the first one at their position, so that separate triangles are neighbours.
  /// Others stay what they are: on a coarse lattice many lie at one place, and cuts would be ragged there.
  std::vector<uint32_t> joined_on_borders() const {
    // Neighbours along the sides of faces cancel where there are two faces; 0 must count as well.
    std::vector<uint32_t> neighbours(vertices_.size());
    for (uint32_t i = 0; i < faces_.size(); ++i) {
      const auto face = faces_.face(i);
      for (size_t k = 0; k < face.size(); ++k) {
        const uint32_t next = face[k + 1 < face.size() ? k + 1 : 0];
        // The same exclusive or as in 15.1 of docs/format.md: it is not 0 where a vertex lies on a border.
        neighbours[face[k]] ^= next + 1;
        neighbours[next] ^= face[k] + 1;
      }
    }
    std::vector<uint32_t> first(vertices_.size(), vertices_.size()), joined(vertices_.size());
    for (uint32_t v = 0; v < vertices_.size(); ++v) {
      joined[v] = v;
      if (neighbours[v] == 0) continue;
      uint32_t& representative = first[vertices_.class_of[v]];
      if (representative == vertices_.size()) representative = v;
      joined[v] = representative;
    }
    return joined;
  }

  /// By vertex: is it in several charts?
  std::vector<uint8_t> on_borders_of_charts() const {
    std::vector<uint32_t> owner(vertices_.size(), no_group);
    std::vector<uint8_t> several(vertices_.size());
    for (uint32_t i = 0; i < charts_.size(); ++i) {
      for_each_triangle(faces_, vertices_.class_of, charts_[i], [&](uint32_t a, uint32_t b, uint32_t c) {
        for (const uint32_t v : {a, b, c}) {
          several[v] |= owner[v] != no_group && owner[v] != i;
          owner[v] = i;
        }
      });
    }
    return several;
  }
  /// An edge of a triangle, whose ends are both in several charts.
  struct BorderEdge {
    uint64_t ends;
    uint32_t triangle, chart;
    bool operator<(const BorderEdge& o) const {
      return ends != o.ends ? ends < o.ends : triangle < o.triangle;
    }
  };
  /// Charts that share an edge, from both sides, as often as they do: as in a dual graph, triangles at an
  /// edge are a chain.
  std::vector<uint64_t> links_of_charts(std::vector<uint32_t>& triangles_of) const {
    const std::vector<uint8_t> several = on_borders_of_charts();
    std::vector<BorderEdge> edges;
    uint32_t triangle = 0;
    for (uint32_t i = 0; i < charts_.size(); ++i) {
      const auto add = [&](uint32_t a, uint32_t b) {
        if (several[a] != 0 && several[b] != 0 && a != b)
          edges.push_back({uint64_t{std::min(a, b)} << 32 | std::max(a, b), triangle, i});
      };
      const uint32_t begin = triangle;
      for_each_triangle(faces_, vertices_.class_of, charts_[i], [&](uint32_t a, uint32_t b, uint32_t c) {
        add(a, b);
        add(b, c);
        add(c, a);
        ++triangle;
      });
      triangles_of.push_back(triangle - begin);
    }
    std::sort(edges.begin(), edges.end());
    std::vector<uint64_t> links;
    for (size_t i = 1; i < edges.size(); ++i) {
      const uint32_t from = edges[i - 1].chart, to = edges[i].chart;
      if (edges[i - 1].ends != edges[i].ends || from == to) continue;
      links.push_back(uint64_t{from} << 32 | to);
      links.push_back(uint64_t{to} << 32 | from);
    }
    return links;
  }

  /// Charts of a level, joined by as many edges as they share.
  SpatialGraph chart_graph() const {
    const auto count = static_cast<uint32_t>(charts_.size());
    SpatialGraph graph;
    std::vector<uint64_t> links = links_of_charts(graph.node_weight);
    std::sort(links.begin(), links.end());
    graph.first.assign(size_t{count} + 1, 0);
    for (size_t i = 0; i < links.size(); ++i) {
      if (i > 0 && links[i] == links[i - 1]) {
        ++graph.edge_weight.back();
        continue;
      }
      graph.neighbour.push_back(static_cast<uint32_t>(links[i]));
      graph.edge_weight.push_back(1);
      ++graph.first[(links[i] >> 32) + 1];
    }
    for (uint32_t i = 0; i < count; ++i) graph.first[i + 1] += graph.first[i];
    for (uint32_t i = 0; i < count; ++i) {
      const Vector3& centre = charts_[i].sphere.centre;
      graph.place.push_back(
          {static_cast<float>(centre[0]), static_cast<float>(centre[1]), static_cast<float>(centre[2])});
    }
    return graph;
  }

  /// Vertices of more than one group.
  void find_shared(std::span<const SimplifiedGroup> groups) {
    std::vector<uint32_t> owner(vertices_.size(), no_group);
    shared_.assign(vertices_.held.begin(), vertices_.held.end());
    shared_.resize(vertices_.size());
    for (uint32_t g = 0; g < groups.size(); ++g) {
      for (const uint32_t chart : groups[g].inputs) {
        for_each_triangle(faces_, vertices_.class_of, charts_[chart],
                          [&](uint32_t a, uint32_t b, uint32_t c) {
                            for (const uint32_t v : {a, b, c}) {
                              if (owner[v] == no_group) owner[v] = g;
                              if (owner[v] != g) shared_[v] = 1;
                            }
                          });
      }
    }
  }

  /// Calls f(face, a, b, c) for the triangles of a chart, with corners of the mesh.
  template <class F>
  void for_each_origin(const Chart& chart, F f) const {
    for (size_t t = 0; t < chart.corners.size(); t += 3) {
      f(chart.origins[t / 3], chart.corners[t], chart.corners[t + 1], chart.corners[t + 2]);
    }
    for (const uint32_t face : chart.faces) {
      const auto corners = faces_.face(face);
      const auto first = static_cast<uint32_t>(corners.data() - faces_.corners.data());
      for (uint32_t k = 2; k < corners.size(); ++k) f(face, first, first + k - 1, first + k);
    }
  }
  void collect_origins(const SimplifiedGroup& group, GroupJob& job) const {
    for (const uint32_t chart : group.inputs) {
      for_each_origin(charts_[chart], [&](uint32_t face, uint32_t a, uint32_t b, uint32_t c) {
        job.origins.push_back(face);
        for (const uint32_t corner : {a, b, c}) {
          job.corners.push_back(corner);
          job.values.push_back(vertices_.corner_values[corner]);
        }
      });
    }
  }

  GroupJob collect(const SimplifiedGroup& group) const {
    GroupJob job;
    for (const uint32_t chart : group.inputs) {
      for_each_triangle(faces_, vertices_.class_of, charts_[chart], [&](uint32_t a, uint32_t b, uint32_t c) {
        for (const uint32_t v : {a, b, c}) job.triangles.push_back(v);
      });
    }
    job.vertices = rank_all(job.triangles);
    for (const uint32_t v : job.vertices) {
      job.positions.insert(job.positions.end(), &vertices_.positions[size_t{3} * v],
                           &vertices_.positions[size_t{3} * v] + 3);
      job.locked.push_back(shared_[v]);
    }
    if (!vertices_.corner_values.empty()) collect_origins(group, job);
    return job;
  }

  GroupJob run_group(const SimplifiedGroup& group, bool last) const {
    GroupJob job = collect(group);
    const auto count = static_cast<uint32_t>(job.triangles.size() / 3);
    // The last level aims at one chart, with some room for triangles that cannot go.
    const auto root = static_cast<uint32_t>(0.9 * sizes_.chart_faces);
    const SimplifierInput input{job.triangles, job.positions,
                                job.locked,    last ? std::min(root, count / 4) : count / 4,
                                last,          job.values};
    const Simplified simplified = maille::simplify(input);
    job.view_error = simplified.view_error;
    job.bound = deviation(input, simplified);
    const auto left = static_cast<uint32_t>(simplified.triangles.size() / 3);
    uint32_t parts = 1;
    if (!last && left > sizes_.chart_faces / 2)
      parts = std::max(2u, (left + sizes_.chart_faces / 2) / sizes_.chart_faces);
    split(job, simplified, parts);
    // Of lines and points nothing is left, but what replaces them must be found.
    if (job.outputs.empty()) job.outputs.emplace_back();
    return job;
  }

  void split(GroupJob& job, const Simplified& simplified, uint32_t parts) const {
    const std::vector<uint32_t>& triangles = simplified.triangles;
    std::vector<uint32_t> part_of(triangles.size() / 3);
    if (parts > 1) {
      const SpatialGraph graph =
          dual_graph({triangles, {}}, job.positions, static_cast<uint32_t>(job.vertices.size()));
      part_of = cut_into_parts(graph, {.target = (graph.size() + parts - 1) / parts});
    }
    for (size_t t = 0; t < part_of.size(); ++t) {
      if (part_of[t] >= job.outputs.size()) job.outputs.resize(part_of[t] + 1);
      Chart& chart = job.outputs[part_of[t]];
      for (unsigned k = 0; k < 3; ++k) chart.triangles.push_back(job.vertices[triangles[3 * t + k]]);
      if (simplified.faces.empty()) continue;
      for (unsigned k = 0; k < 3; ++k) chart.corners.push_back(job.corners[simplified.corners[3 * t + k]]);
      chart.origins.push_back(job.origins[simplified.faces[t]]);
    }
    for (Chart& chart : job.outputs) chart.sphere = sphere_of(chart.triangles, vertices_.positions);
  }

  const FaceLists& faces_;
  const LevelVertices& vertices_;
  const ChartSizes& sizes_;
  std::span<const Chart> charts_;
  std::vector<uint8_t> shared_;
};

}  // namespace

std::vector<uint32_t> lowest_at_place(std::span<const float> positions) {
  const auto vertices = static_cast<uint32_t>(positions.size() / 3);
  const auto key = [&](uint32_t v) {
    std::array<float, 3> p;
    for (unsigned k = 0; k < 3; ++k) {
      const float x = positions[size_t{3} * v + k];
      p[k] = std::isfinite(x) ? x + 0.0f : 0.0f;
    }
    return p;
  };
  // Places half of which are free, by the bits of the position; in each the first vertex that came.
  size_t places = 16;
  while (places < size_t{2} * vertices) places *= 2;
  constexpr uint32_t nobody = 0xffffffff;
  std::vector<uint32_t> table(places, nobody);
  std::vector<uint32_t> class_of(vertices);
  const auto place_of = [&](const std::array<float, 3>& place) {
    std::array<uint32_t, 3> bits;
    std::memcpy(bits.data(), place.data(), sizeof bits);
    uint64_t hash = (bits[0] | uint64_t{bits[1]} << 32) * 0x9e3779b97f4a7c15;
    hash = ((hash ^ hash >> 32) + bits[2]) * 0x9e3779b97f4a7c15;
    return (hash >> 32) & (places - 1);
  };
  // The table does not fit into a cache: some vertices ahead, a processor is told what will be looked at.
  constexpr uint32_t ahead = 16;
  std::array<size_t, ahead> next{};
  for (uint32_t v = 0; v < vertices + ahead; ++v) {
    const size_t start = next[v % ahead];
    if (v < vertices) {
      next[v % ahead] = place_of(key(v));
      __builtin_prefetch(&table[next[v % ahead]]);
    }
    if (v < ahead) continue;
    const uint32_t now = v - ahead;
    const std::array<float, 3> place = key(now);
    size_t at = start;
    while (table[at] != nobody && key(table[at]) != place) at = (at + 1) & (places - 1);
    if (table[at] == nobody) table[at] = now;
    class_of[now] = table[at];
  }
  return class_of;
}

ChartSizes ChartSizes::of(const std::optional<uint64_t>& cells) {
  ChartSizes sizes;
  if (!cells) return sizes;
  sizes.finest_faces = static_cast<uint32_t>(std::clamp(*cells, least_chart_faces, most_chart_faces));
  sizes.chart_faces = std::max(sizes.chart_faces, sizes.finest_faces);
  return sizes;
}

std::vector<Chart> cut_into_charts(const FaceLists& faces, const LevelVertices& vertices,
                                   const ChartSizes& sizes, Executor& executor) {
  return LevelBuilder(faces, vertices, sizes).cut(executor);
}

std::vector<SimplifiedGroup> simplify_charts(const FaceLists& faces, const LevelVertices& vertices,
                                             std::span<const Chart> charts, bool alone,
                                             const ChartSizes& sizes, Executor& executor) {
  return LevelBuilder(faces, vertices, sizes, charts).simplify(alone, executor);
}

uint32_t add_group(Hierarchy& hierarchy, uint32_t level, std::vector<uint32_t> inputs, double view_error,
                   double bound) {
  const auto number = static_cast<uint32_t>(hierarchy.groups.size());
  ChartGroup group;
  group.level = level;
  group.inputs = std::move(inputs);
  for (size_t i = 0; i < group.inputs.size(); ++i) {
    Chart& chart = hierarchy.charts[group.inputs[i]];
    chart.consumer = number;
    group.sphere = i == 0 ? chart.sphere : enclosing(group.sphere, chart.sphere);
    if (chart.producer == no_group) continue;
    const ChartGroup& finer = hierarchy.groups[chart.producer];
    group.sphere = enclosing(group.sphere, finer.sphere);
    group.view_error = std::max(group.view_error, finer.view_error);
    group.bound = std::max(group.bound, finer.bound);
  }
  group.view_error += view_error;
  group.bound += bound;
  hierarchy.groups.push_back(std::move(group));
  return number;
}

uint64_t count_triangles(const FaceLists& faces, const Chart& chart) {
  uint64_t count = chart.triangles.size() / 3;
  for (const uint32_t face : chart.faces) count += std::max<size_t>(faces.face(face).size(), 2) - 2;
  return count;
}

}  // namespace maille
