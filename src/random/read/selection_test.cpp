#include "random/read/selection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "random/build/build_hierarchy.h"
#include "random/build/hierarchy_index.h"
#include "support/cases.h"
#include "support/faces_in_space.h"
#include "support/random.h"

namespace maille::testing {
namespace {

struct Sample {
  FacesInSpace faces = hills(100, 4);
  Hierarchy hierarchy;
  IndexedHierarchy indexed;
  ChartIndex index;

  Sample() {
    HierarchyOptions options;
    options.sizes = {256, 256};
    hierarchy = build_hierarchy(faces.lists(), faces.positions, faces.vertices(), options).value();
    indexed = index_hierarchy(hierarchy, faces.lists(), {faces.positions, {}, 0});
    index = ChartIndex(static_cast<uint32_t>(indexed.groups.size()));
    index.set_page(0, decoded(0));
  }
  std::vector<IndexedGroup> decoded(uint32_t first) const {
    return decode_index_page(indexed.frame, encode_index_page(indexed.frame, indexed.groups, first), first,
                             static_cast<uint32_t>(indexed.groups.size()))
        .value();
  }
  const Chart& chart(const ChartPlace& place) const {
    return hierarchy.charts[indexed.charts[place.group][place.chart]];
  }
};

const Sample& sample() {
  static const Sample sample;
  return sample;
}

/// Each chart of the mesh stands in the cut, or what became of it, once.
void expect_whole(const Selection& selection) {
  const Sample& s = sample();
  std::set<uint32_t> chosen;
  for (const ChartPlace& place : selection.charts) chosen.insert(s.indexed.charts[place.group][place.chart]);
  ASSERT_EQ(chosen.size(), selection.charts.size());
  for (uint32_t i = 0; i < s.hierarchy.charts.size(); ++i) {
    const Chart& chart = s.hierarchy.charts[i];
    if (chart.level > 0) continue;
    // Along one path to the root there is exactly one level that is drawn.
    size_t drawn = chosen.count(i);
    for (uint32_t group = chart.consumer; group != no_group;) {
      const uint32_t output = s.hierarchy.groups[group].outputs.front();
      drawn += chosen.count(output);
      group = s.hierarchy.charts[output].consumer;
    }
    EXPECT_EQ(drawn, 1u);
  }
}

TEST(ChartIndex, KeepsSpheresAndBoxesOnTheSafeSide) {
  const Sample& s = sample();
  const std::vector<IndexedGroup> groups = s.decoded(0);
  ASSERT_EQ(groups.size(), s.indexed.groups.size());
  for (size_t g = 0; g < groups.size(); ++g) {
    EXPECT_GE(groups[g].view_error, s.indexed.groups[g].view_error);
    EXPECT_LE(groups[g].view_error, s.indexed.groups[g].view_error * 1.001);
    for (size_t i = 0; i < groups[g].charts.size(); ++i) {
      const IndexedChart &exact = s.indexed.groups[g].charts[i], &read = groups[g].charts[i];
      EXPECT_EQ(read.producer, exact.producer);
      EXPECT_EQ(read.faces, exact.faces);
      const Vector3 d = read.sphere.centre - exact.sphere.centre;
      EXPECT_GE(read.sphere.radius, std::sqrt(dot(d, d)) + exact.sphere.radius);
      EXPECT_LE(read.sphere.radius, exact.sphere.radius * 1.01);
      for (unsigned k = 0; k < 3; ++k) {
        EXPECT_LE(read.box.low[k], exact.box.low[k]);
        EXPECT_GE(read.box.high[k], exact.box.high[k]);
      }
    }
  }
}

TEST(ChartIndex, RefusesPagesThatAreNotWhole) {
  const Sample& s = sample();
  const auto count = static_cast<uint32_t>(s.indexed.groups.size());
  const auto page = encode_index_page(s.indexed.frame, s.indexed.groups, 0);
  for (size_t size = 0; size < page.size(); ++size) {
    EXPECT_FALSE(decode_index_page(s.indexed.frame, Bytes(page).first(size), 0, count));
  }
  Random random(3);
  for (uint64_t i = 0; i < cases(2000); ++i) {
    auto damaged = page;
    damaged[random.below(damaged.size())] ^= static_cast<std::byte>(1 + random.below(255));
    const auto groups = decode_index_page(s.indexed.frame, damaged, 0, count);
    if (!groups) continue;
    for (uint32_t g = 0; g < groups->size(); ++g) {
      for (const IndexedChart& chart : (*groups)[g].charts) {
        EXPECT_TRUE(chart.producer == no_group || (chart.producer > g && chart.producer < count));
      }
    }
  }
}

TEST(Selection, GivesEachLevelAndTheWholeMesh) {
  const Sample& s = sample();
  for (uint32_t level = 0; level < s.hierarchy.levels(); ++level) {
    Detail detail;
    detail.level = level;
    const Selection selection = select(s.index, {}, detail);
    expect_whole(selection);
    for (const ChartPlace& place : selection.charts) EXPECT_EQ(s.chart(place).level, level);
  }
}

TEST(Selection, CutsAreWholeForAnyView) {
  Random random(8);
  for (uint64_t i = 0; i < cases(200); ++i) {
    Detail detail;
    const Vector3 eye{{200 * random.unit() - 50, 200 * random.unit() - 50, 100 * random.unit()}};
    detail.view = View{eye, 500 + 1000 * random.unit(), 4 * random.unit()};
    expect_whole(select(sample().index, {}, detail));
    const uint64_t budget = 300 + random.below(20000);
    const Selection within = select_within(sample().index, {}, budget, detail.view);
    expect_whole(within);
    EXPECT_LE(within.faces, budget);
  }
}

TEST(Selection, IsFinerWhereTheEyeIs) {
  Detail detail;
  detail.view = View{{{5, 5, 5}}, 100, 1};
  const Selection selection = select(sample().index, {}, detail);
  double near = 0, far = 0;
  for (const ChartPlace& place : selection.charts) {
    const Chart& chart = sample().chart(place);
    const Vector3 d = chart.sphere.centre - detail.view->eye;
    (dot(d, d) < 900 ? near : far) = std::max(dot(d, d) < 900 ? near : far, static_cast<double>(chart.level));
  }
  EXPECT_LT(near, far);
}

TEST(Selection, FindsEveryFaceInABox) {
  const Sample& s = sample();
  Random random(4);
  for (uint64_t i = 0; i < cases(100); ++i) {
    Region region;
    Box box;
    for (unsigned k = 0; k < 3; ++k) {
      box.low[k] = 100 * random.unit();
      box.high[k] = box.low[k] + 20 * random.unit();
    }
    box.low[2] = -10;
    region.box = box;
    const Selection selection = select(s.index, region, Detail::full());
    std::set<uint32_t> found;
    for (const ChartPlace& place : selection.charts)
      found.insert(s.chart(place).faces.begin(), s.chart(place).faces.end());
    for (uint32_t f = 0; f < s.faces.lists().size(); ++f) {
      for (const uint32_t v : s.faces.lists().face(f)) {
        bool inside = true;
        for (unsigned k = 0; k < 3; ++k) {
          const auto x = static_cast<double>(s.faces.positions[size_t{3} * v + k]);
          inside = inside && x >= box.low[k] && x <= box.high[k];
        }
        if (inside) {
          ASSERT_TRUE(found.count(f));
        }
      }
    }
    EXPECT_LT(selection.faces, s.faces.lists().size());
  }
}

TEST(Selection, NamesPagesOfTheIndexThatItNeeds) {
  const ChartIndex empty(static_cast<uint32_t>(sample().indexed.groups.size()));
  const Selection selection = select(empty, {}, Detail::full());
  EXPECT_EQ(selection.missing, std::vector<uint32_t>{0});
  EXPECT_TRUE(selection.charts.empty());
}

}  // namespace
}  // namespace maille::testing
