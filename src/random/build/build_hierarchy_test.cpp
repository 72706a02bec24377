#include "random/build/build_hierarchy.h"

#include <gtest/gtest.h>
#include <maille/io.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "support/cases.h"
#include "support/data.h"
#include "support/faces_in_space.h"
#include "support/random.h"
#include "support/random_mesh.h"

namespace maille::testing {
namespace {

class Cuts {
 public:
  Cuts(const FacesInSpace& faces, const Hierarchy& hierarchy) : faces_(faces), hierarchy_(hierarchy) {
    std::map<std::array<float, 3>, uint32_t> first;
    for (uint32_t v = 0; v < faces.vertices(); ++v) {
      std::array<float, 3> p;
      for (unsigned k = 0; k < 3; ++k) {
        const float x = faces.positions[size_t{3} * v + k];
        p[k] = std::isfinite(x) ? x + 0.0f : 0.0f;
      }
      class_of_.push_back(first.emplace(p, v).first->second);
    }
    border_.resize(faces.vertices());
    for (const uint64_t edge : odd_edges(charts_of_level(0)))
      border_[edge >> 32] = border_[edge & 0xffffffff] = true;
  }

  std::vector<uint32_t> charts_of_level(uint32_t level) const {
    std::vector<uint32_t> charts;
    for (uint32_t i = 0; i < hierarchy_.charts.size(); ++i) {
      if (hierarchy_.charts[i].level == level) charts.push_back(i);
    }
    return charts;
  }

  /// Groups are refined with a chance, where their neighbours at the coarser level are.
  std::vector<uint32_t> random_cut(Random& random) const {
    const unsigned percent = random.below(101);
    std::vector<bool> refined(hierarchy_.groups.size());
    for (size_t g = refined.size(); g-- > 0;) {
      refined[g] = random.chance(percent);
      for (const uint32_t chart : hierarchy_.groups[g].outputs) {
        const uint32_t consumer = hierarchy_.charts[chart].consumer;
        if (consumer != no_group && !refined[consumer]) refined[g] = false;
      }
    }
    std::vector<uint32_t> charts;
    for (uint32_t i = 0; i < hierarchy_.charts.size(); ++i) {
      const Chart& chart = hierarchy_.charts[i];
      if ((chart.producer == no_group || !refined[chart.producer]) &&
          (chart.consumer == no_group || refined[chart.consumer])) {
        charts.push_back(i);
      }
    }
    return charts;
  }

  /// Edges with an odd number of faces whose ends do not both lie on such an edge of the original.
  size_t cracks(const std::vector<uint32_t>& charts) const {
    size_t bad = 0;
    for (const uint64_t edge : odd_edges(charts)) bad += !border_[edge >> 32] || !border_[edge & 0xffffffff];
    return bad;
  }

 private:
  std::vector<uint64_t> odd_edges(const std::vector<uint32_t>& charts) const {
    std::vector<uint64_t> edges;
    const auto add = [&](uint32_t a, uint32_t b) {
      if (a != b) edges.push_back(uint64_t{std::min(a, b)} << 32 | std::max(a, b));
    };
    for (const uint32_t number : charts) {
      const Chart& chart = hierarchy_.charts[number];
      for (const uint32_t face : chart.faces) {
        const auto c = faces_.lists().face(face);
        for (size_t k = 0; k < c.size(); ++k) add(class_of_[c[k]], class_of_[c[(k + 1) % c.size()]]);
      }
      for (size_t t = 0; t < chart.triangles.size(); t += 3) {
        for (unsigned k = 0; k < 3; ++k) add(chart.triangles[t + k], chart.triangles[t + (k + 1) % 3]);
      }
    }
    std::sort(edges.begin(), edges.end());
    std::vector<uint64_t> odd;
    for (size_t i = 0, j = 0; i < edges.size(); i = j) {
      while (j < edges.size() && edges[j] == edges[i]) ++j;
      if ((j - i) % 2 == 1) odd.push_back(edges[i]);
    }
    return odd;
  }

  const FacesInSpace& faces_;
  const Hierarchy& hierarchy_;
  std::vector<uint32_t> class_of_;
  std::vector<bool> border_;
};

Hierarchy build(const FacesInSpace& faces, uint32_t chart_faces, Executor* executor = nullptr) {
  HierarchyOptions options;
  options.sizes = {chart_faces, chart_faces};
  options.executor = executor;
  return build_hierarchy(faces.lists(), faces.positions, faces.vertices(), options).value();
}

void expect_every_face_once(const FacesInSpace& faces, const Hierarchy& hierarchy) {
  std::vector<uint32_t> all;
  for (const Chart& chart : hierarchy.charts) all.insert(all.end(), chart.faces.begin(), chart.faces.end());
  std::sort(all.begin(), all.end());
  ASSERT_EQ(all.size(), faces.lists().size());
  for (uint32_t i = 0; i < all.size(); ++i) ASSERT_EQ(all[i], i);
}

void expect_errors_and_spheres_grow(const Hierarchy& hierarchy) {
  for (const ChartGroup& group : hierarchy.groups) {
    for (const uint32_t input : group.inputs) {
      const uint32_t producer = hierarchy.charts[input].producer;
      if (producer == no_group) continue;
      const ChartGroup& finer = hierarchy.groups[producer];
      EXPECT_GE(group.view_error, finer.view_error);
      EXPECT_GE(group.bound, finer.bound);
      const Vector3 d = finer.sphere.centre - group.sphere.centre;
      EXPECT_GE(group.sphere.radius * (1 + 1e-9), std::sqrt(dot(d, d)) + finer.sphere.radius);
    }
  }
}

void expect_sound(const FacesInSpace& faces, const Hierarchy& hierarchy, uint64_t seed) {
  expect_every_face_once(faces, hierarchy);
  expect_errors_and_spheres_grow(hierarchy);
  const Cuts cuts(faces, hierarchy);
  Random random(seed);
  for (unsigned i = 0; i < 6; ++i) ASSERT_EQ(cuts.cracks(cuts.random_cut(random)), 0u) << "seed " << seed;
  for (uint32_t level = 0; level < hierarchy.levels(); ++level) {
    ASSERT_EQ(cuts.cracks(cuts.charts_of_level(level)), 0u) << "seed " << seed << ", level " << level;
  }
}

TEST(Hierarchy, HasAFourthOfTheFacesAtEachLevelAndOneRoot) {
  const FacesInSpace faces = hills(150, 4);
  const Hierarchy hierarchy = build(faces, 512);
  expect_sound(faces, hierarchy, 1);
  const Cuts cuts(faces, hierarchy);
  ASSERT_GE(hierarchy.levels(), 4u);
  EXPECT_EQ(cuts.charts_of_level(hierarchy.levels() - 1).size(), 1u);
  uint64_t coarse = 0;
  for (const Chart& chart : hierarchy.charts) coarse += chart.level == 1 ? chart.face_count() : 0;
  EXPECT_NEAR(static_cast<double>(coarse), 45000 / 4.0, 450);
}

TEST(Hierarchy, HasNoCracksWhateverTheSurface) {
  for (uint64_t seed = 0; seed < cases(600); ++seed) {
    RandomMeshOptions options;
    options.any_position_type = false;
    options.faces = 300;
    const FacesInSpace faces = faces_in_space(random_surface(seed, options));
    expect_sound(faces, build(faces, 8 + static_cast<uint32_t>(seed % 40)), seed);
    if (HasFatalFailure()) return;
  }
}

TEST(Hierarchy, SimplifiesSeparateTrianglesAsOneSurface) {
  const FacesInSpace welded = hills(60, 2);
  FacesInSpace separate;
  for (const uint32_t v : welded.corners) {
    separate.corners.push_back(separate.vertices());
    separate.positions.insert(separate.positions.end(), &welded.positions[size_t{3} * v],
                              &welded.positions[size_t{3} * v] + 3);
  }
  const Hierarchy hierarchy = build(separate, 256);
  expect_sound(separate, hierarchy, 3);
  EXPECT_LT(hierarchy.groups.back().bound, 2.0);
  EXPECT_LT(hierarchy.charts.back().face_count(), 300u);
}

// A strip over points anywhere: nothing can go without a large error. All levels together had 3.5 times the
// faces of the mesh where each was kept that lost a 32nd.
TEST(Hierarchy, OfWhatCannotBeSimplifiedStaysSmall) {
  FacesInSpace faces;
  Random random(7);
  constexpr uint32_t count = 8000;
  for (uint32_t i = 0; i < 3 * (count + 2); ++i) faces.positions.push_back(static_cast<float>(random.unit()));
  for (uint32_t i = 0; i < count; ++i) faces.corners.insert(faces.corners.end(), {i, i + 1, i + 2});
  const Hierarchy hierarchy = build(faces, 256);
  expect_sound(faces, hierarchy, 5);
  std::vector<uint64_t> of_level(hierarchy.levels());
  for (const Chart& chart : hierarchy.charts) of_level[chart.level] += chart.face_count();
  for (size_t level = 1; level < of_level.size(); ++level)
    EXPECT_LE(4 * of_level[level], 3 * of_level[level - 1]) << level;
}

TEST(Hierarchy, IsTheSameForAnyNumberOfThreads) {
  const FacesInSpace faces = hills(80, 3);
  const auto threads = thread_executor(3);
  const Hierarchy a = build(faces, 128), b = build(faces, 128, threads.get());
  ASSERT_EQ(a.charts.size(), b.charts.size());
  for (size_t i = 0; i < a.charts.size(); ++i) {
    EXPECT_EQ(a.charts[i].faces, b.charts[i].faces);
    EXPECT_EQ(a.charts[i].triangles, b.charts[i].triangles);
    EXPECT_EQ(a.charts[i].consumer, b.charts[i].consumer);
  }
}

TEST(Hierarchy, OfRealMeshesHasNoCracks) {
  for (const std::string& file : data_files("tri")) {
    if (file.find("bunny") == std::string::npos && file.find("99865") == std::string::npos) continue;
    const FacesInSpace faces = faces_in_space(read_mesh(file)->mesh);
    const Hierarchy hierarchy = build(faces, 1024);
    expect_sound(faces, hierarchy, 4);
  }
}

}  // namespace
}  // namespace maille::testing
