#include "hierarchy/build_hierarchy.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/result.h"
#include "hierarchy/bisection.h"
#include "hierarchy/deviation.h"
#include "hierarchy/mesh_geometry.h"
#include "hierarchy/simplifier.h"

namespace maille {
namespace {

/// For each vertex the lowest one at the same place, bit for bit but for the sign of zero.
std::vector<uint32_t> weld(std::span<const float> positions, uint32_t vertices) {
  const auto key = [&](uint32_t v) {
    std::array<float, 3> p;
    for (unsigned k = 0; k < 3; ++k) {
      const float x = positions[size_t{3} * v + k];
      p[k] = std::isfinite(x) ? x + 0.0f : 0.0f;
    }
    return p;
  };
  std::vector<uint32_t> order(vertices);
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    const auto x = key(a), y = key(b);
    return x != y ? x < y : a < b;
  });
  std::vector<uint32_t> class_of(vertices);
  for (uint32_t i = 0; i < vertices; ++i) {
    const bool same = i > 0 && key(order[i]) == key(order[i - 1]);
    class_of[order[i]] = same ? class_of[order[i - 1]] : order[i];
  }
  return class_of;
}

/// Around the middle of the box.
Sphere sphere_of(std::span<const uint32_t> vertices, std::span<const float> positions) {
  Box box;
  for (size_t i = 0; i < vertices.size(); ++i) enclose(box, finite_position(positions, vertices[i]), i == 0);
  Sphere sphere{(box.low + box.high) * 0.5, 0};
  double farthest = 0;
  for (const uint32_t v : vertices) {
    const Vector3 d = finite_position(positions, v) - sphere.centre;
    farthest = std::max(farthest, dot(d, d));
  }
  sphere.radius = std::sqrt(farthest) * (1 + 1e-12);
  return sphere;
}

/// A group at work: its triangles over vertices of its own.
struct GroupJob {
  std::vector<uint32_t> vertices;  ///< numbers in the mesh, by first use
  std::vector<uint32_t> triangles;
  std::vector<float> positions;
  std::vector<uint8_t> locked;
  std::vector<uint32_t> corners, origins;  ///< of the mesh, by corner and triangle; with seams only
  std::vector<uint32_t> values;            ///< by corner
  double view_error = 0, bound = 0;
  std::vector<Chart> outputs;
};

class Builder {
 public:
  Builder(const FaceLists& faces, std::span<const float> positions, uint32_t vertices,
          const HierarchyOptions& options)
      : faces_(faces),
        positions_(positions),
        vertices_(vertices),
        options_(options),
        executor_(options.executor == nullptr ? serial_executor() : *options.executor) {}

  Result<Hierarchy> run() {
    class_of_ = weld(positions_, vertices_);
    MAILLE_CHECK(report(0));
    cut_level_0();
    const uint64_t all = triangles_from(0);
    uint64_t before = all;
    for (uint32_t begin = 0, end = size(); end - begin > 1; begin = end, end = size()) {
      // The cut into charts is about a third of the work, each level a fourth of the one before.
      MAILLE_CHECK(report(1 - 0.67 * static_cast<double>(before) / static_cast<double>(all)));
      simplify_level(begin, end);
      const uint64_t after = triangles_from(end);
      // Nothing more can be removed: this level stays out, and several roots are left.
      if (after + before / 32 >= before) {
        drop_level(end);
        break;
      }
      before = after;
    }
    return std::move(result_);
  }

 private:
  uint32_t size() const { return static_cast<uint32_t>(result_.charts.size()); }
  /// Polygons count as the triangles that they become.
  uint64_t triangles_from(uint32_t begin) const {
    uint64_t count = 0;
    for (uint32_t i = begin; i < size(); ++i) {
      for_each_triangle(result_.charts[i], [&](uint32_t, uint32_t, uint32_t) { ++count; });
    }
    return count;
  }
  Result<> report(double fraction) const {
    if (!options_.progress || options_.progress({"levels of detail", std::min(fraction, 1.0)})) return {};
    return failure(ErrorCode::cancelled, "building levels of detail was cancelled");
  }

  /// Vertices on borders by the first one at their position, so that separate triangles are neighbours.
  /// Others stay what they are: on a coarse lattice many lie at one place, and cuts would be ragged there.
  std::vector<uint32_t> joined_on_borders() const {
    // Neighbours along the sides of faces cancel where there are two faces; 0 must count as well.
    std::vector<uint32_t> neighbours(vertices_);
    for (uint32_t i = 0; i < faces_.size(); ++i) {
      const auto face = faces_.face(i);
      for (size_t k = 0; k < face.size(); ++k) {
        const uint32_t next = face[k + 1 < face.size() ? k + 1 : 0];
        neighbours[face[k]] ^= next + 1;
        neighbours[next] ^= face[k] + 1;
      }
    }
    std::vector<uint32_t> first(vertices_, vertices_), joined(vertices_);
    for (uint32_t v = 0; v < vertices_; ++v) {
      joined[v] = v;
      if (neighbours[v] == 0) continue;
      uint32_t& representative = first[class_of_[v]];
      if (representative == vertices_) representative = v;
      joined[v] = representative;
    }
    return joined;
  }

  void cut_level_0() {
    const std::vector<uint32_t> joined = joined_on_borders();
    std::vector<uint32_t> corners(faces_.corners.size());
    for (size_t i = 0; i < corners.size(); ++i) corners[i] = joined[faces_.corners[i]];
    const SpatialGraph graph = dual_graph({corners, faces_.first}, positions_, vertices_);
    const std::vector<uint32_t> part_of = cut_into_parts(graph, {.target = options_.chart_faces});
    uint32_t count = 0;
    for (const uint32_t part : part_of) count = std::max(count, part + 1);
    result_.charts.resize(count);
    for (uint32_t i = 0; i < part_of.size(); ++i) result_.charts[part_of[i]].faces.push_back(i);
    std::vector<uint32_t> used;
    for (Chart& chart : result_.charts) {
      used.clear();
      for (const uint32_t face : chart.faces) {
        used.insert(used.end(), faces_.face(face).begin(), faces_.face(face).end());
      }
      chart.sphere = sphere_of(used, positions_);
    }
  }

  /// Calls f(a, b, c) for the triangles of a chart, polygons as fans, over welded vertices.
  template <class F>
  void for_each_triangle(const Chart& chart, F f) const {
    for (size_t t = 0; t < chart.triangles.size(); t += 3) {
      f(chart.triangles[t], chart.triangles[t + 1], chart.triangles[t + 2]);
    }
    for (const uint32_t face : chart.faces) {
      const auto c = faces_.face(face);
      for (size_t k = 2; k < c.size(); ++k) f(class_of_[c[0]], class_of_[c[k - 1]], class_of_[c[k]]);
    }
  }

  /// Charts of a level, joined by as many edges as they share.
  SpatialGraph chart_graph(uint32_t begin, uint32_t end) const {
    std::vector<uint32_t> corners, chart_of;
    for (uint32_t i = begin; i < end; ++i) {
      for_each_triangle(result_.charts[i], [&](uint32_t a, uint32_t b, uint32_t c) {
        for (const uint32_t v : {a, b, c}) corners.push_back(v);
        chart_of.push_back(i - begin);
      });
    }
    const SpatialGraph dual = dual_graph({corners, {}}, positions_, vertices_);
    std::vector<uint64_t> links;
    for (uint32_t i = 0; i < dual.size(); ++i) {
      for (uint32_t a = dual.first[i]; a < dual.first[i + 1]; ++a) {
        const uint32_t from = chart_of[i], to = chart_of[dual.neighbour[a]];
        if (from != to) links.push_back(uint64_t{from} << 32 | to);
      }
    }
    std::sort(links.begin(), links.end());
    SpatialGraph graph;
    graph.first.assign(size_t{end - begin} + 1, 0);
    for (size_t i = 0; i < links.size(); ++i) {
      if (i > 0 && links[i] == links[i - 1]) {
        ++graph.edge_weight.back();
        continue;
      }
      graph.neighbour.push_back(static_cast<uint32_t>(links[i]));
      graph.edge_weight.push_back(1);
      ++graph.first[(links[i] >> 32) + 1];
    }
    for (uint32_t i = 0; i < end - begin; ++i) graph.first[i + 1] += graph.first[i];
    graph.node_weight.assign(end - begin, 0);
    for (const uint32_t chart : chart_of) ++graph.node_weight[chart];
    for (uint32_t i = begin; i < end; ++i) {
      const Vector3& centre = result_.charts[i].sphere.centre;
      graph.place.push_back(
          {static_cast<float>(centre[0]), static_cast<float>(centre[1]), static_cast<float>(centre[2])});
    }
    return graph;
  }

  void simplify_level(uint32_t begin, uint32_t end) {
    const SpatialGraph graph = chart_graph(begin, end);
    const uint64_t target = uint64_t{options_.chart_faces} * options_.group_charts;
    const auto group_of = cut_into_parts(graph, {.target = target, .slack = 0.25, .axes = 3});
    const auto first_group = static_cast<uint32_t>(result_.groups.size());
    uint32_t groups = 0;
    for (const uint32_t group : group_of) groups = std::max(groups, group + 1);
    result_.groups.resize(size_t{first_group} + groups);
    for (uint32_t i = begin; i < end; ++i) {
      const uint32_t group = first_group + group_of[i - begin];
      result_.charts[i].consumer = group;
      result_.groups[group].level = result_.charts[i].level;
      result_.groups[group].inputs.push_back(i);
    }
    find_shared(first_group);
    std::vector<GroupJob> jobs(groups);
    executor_.parallel_for(
        groups, [&](size_t i) { jobs[i] = run_group(result_.groups[first_group + i], groups == 1); });
    for (uint32_t i = 0; i < groups; ++i) finish_group(first_group + i, jobs[i]);
  }

  /// Vertices of more than one group.
  void find_shared(uint32_t first_group) {
    std::vector<uint32_t> owner(vertices_, no_group);
    shared_.assign(vertices_, 0);
    for (uint32_t g = first_group; g < result_.groups.size(); ++g) {
      for (const uint32_t chart : result_.groups[g].inputs) {
        for_each_triangle(result_.charts[chart], [&](uint32_t a, uint32_t b, uint32_t c) {
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
  void collect_origins(const ChartGroup& group, GroupJob& job) const {
    for (const uint32_t chart : group.inputs) {
      for_each_origin(result_.charts[chart], [&](uint32_t face, uint32_t a, uint32_t b, uint32_t c) {
        job.origins.push_back(face);
        for (const uint32_t corner : {a, b, c}) {
          job.corners.push_back(corner);
          job.values.push_back(options_.corner_values[corner]);
        }
      });
    }
  }

  GroupJob collect(const ChartGroup& group) const {
    GroupJob job;
    std::vector<uint32_t> used;
    for (const uint32_t chart : group.inputs) {
      for_each_triangle(result_.charts[chart], [&](uint32_t a, uint32_t b, uint32_t c) {
        for (const uint32_t v : {a, b, c}) job.triangles.push_back(v);
      });
    }
    job.vertices = job.triangles;
    std::sort(job.vertices.begin(), job.vertices.end());
    job.vertices.erase(std::unique(job.vertices.begin(), job.vertices.end()), job.vertices.end());
    for (uint32_t& v : job.triangles) {
      v = static_cast<uint32_t>(std::lower_bound(job.vertices.begin(), job.vertices.end(), v) -
                                job.vertices.begin());
    }
    for (const uint32_t v : job.vertices) {
      job.positions.insert(job.positions.end(), &positions_[size_t{3} * v], &positions_[size_t{3} * v] + 3);
      job.locked.push_back(shared_[v]);
    }
    if (!options_.corner_values.empty()) collect_origins(group, job);
    return job;
  }

  GroupJob run_group(const ChartGroup& group, bool last) const {
    GroupJob job = collect(group);
    const auto count = static_cast<uint32_t>(job.triangles.size() / 3);
    const auto root = static_cast<uint32_t>(0.9 * options_.chart_faces);
    const SimplifierInput input{job.triangles, job.positions,
                                job.locked,    last ? std::min(root, count / 4) : count / 4,
                                last,          job.values};
    const Simplified simplified = simplify(input);
    job.view_error = simplified.view_error;
    job.bound = deviation(input, simplified);
    const auto left = static_cast<uint32_t>(simplified.triangles.size() / 3);
    uint32_t parts = 1;
    if (!last && left > options_.chart_faces / 2)
      parts = std::max(2u, (left + options_.chart_faces / 2) / options_.chart_faces);
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
    for (Chart& chart : job.outputs) chart.sphere = sphere_of(chart.triangles, positions_);
  }

  void finish_group(uint32_t number, GroupJob& job) {
    ChartGroup& group = result_.groups[number];
    for (size_t i = 0; i < group.inputs.size(); ++i) {
      const Chart& chart = result_.charts[group.inputs[i]];
      group.sphere = i == 0 ? chart.sphere : enclosing(group.sphere, chart.sphere);
      if (chart.producer == no_group) continue;
      const ChartGroup& finer = result_.groups[chart.producer];
      group.sphere = enclosing(group.sphere, finer.sphere);
      group.view_error = std::max(group.view_error, finer.view_error);
      group.bound = std::max(group.bound, finer.bound);
    }
    group.view_error += job.view_error;
    group.bound += job.bound;
    for (Chart& chart : job.outputs) {
      chart.level = group.level + 1;
      chart.producer = number;
      if (chart.triangles.empty()) chart.sphere.centre = group.sphere.centre;
      group.outputs.push_back(size());
      result_.charts.push_back(std::move(chart));
    }
  }

  void drop_level(uint32_t begin) {
    const uint32_t level = result_.charts[begin - 1].level;
    result_.charts.resize(begin);
    std::erase_if(result_.groups, [level](const ChartGroup& group) { return group.level == level; });
    for (Chart& chart : result_.charts) {
      if (chart.level == level) chart.consumer = no_group;
    }
  }

  const FaceLists& faces_;
  std::span<const float> positions_;
  uint32_t vertices_;
  const HierarchyOptions& options_;
  Executor& executor_;
  Hierarchy result_;
  std::vector<uint32_t> class_of_;
  std::vector<uint8_t> shared_;
};

}  // namespace

Result<Hierarchy> build_hierarchy(const FaceLists& faces, std::span<const float> positions, uint32_t vertices,
                                  const HierarchyOptions& options) {
  return Builder(faces, positions, vertices, options).run();
}

}  // namespace maille
