#include "cracks.h"

#include <fmt/format.h>
#include <maille/source.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <set>

#include "base/result.h"
#include "random/read/join_charts.h"
#include "random/read/random_reader.h"
#include "random/read/selection.h"

namespace maille {
namespace {

using Edges = std::vector<uint64_t>;

/// Those that are there an odd number of times, rising.
Edges odd_ones(Edges edges) {
  std::sort(edges.begin(), edges.end());
  size_t kept = 0;
  for (size_t i = 0, j = 0; i < edges.size(); i = j) {
    while (j < edges.size() && edges[j] == edges[i]) ++j;
    if ((j - i) % 2 == 1) edges[kept++] = edges[i];
  }
  edges.resize(kept);
  return edges;
}

/// Positions as numbers: what is at one place is drawn at one place.
class PlaceNumbers {
 public:
  uint32_t operator()(const Array& positions, uint32_t point) {
    Place place = place_of(positions, point);
    // Zeros of both signs are one place.
    const size_t bits = 8 * size_of(positions.type);
    const bool is_float = positions.type == Scalar::f32 || positions.type == Scalar::f64;
    for (uint64_t& x : place) {
      if (is_float && x << (65 - bits) == 0) x = 0;
    }
    return numbers_.emplace(place, static_cast<uint32_t>(numbers_.size())).first->second;
  }
  size_t size() const { return numbers_.size(); }

 private:
  std::map<Place, uint32_t> numbers_;
};

Edges edges_of(const Mesh& mesh, PlaceNumbers& numbers) {
  Edges edges;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      if (!is_face(block.type_of(i))) continue;
      const auto cell = block.cell(i);
      for (size_t k = 0; k < cell.size(); ++k) {
        const uint32_t a = numbers(mesh.points, cell[k]);
        const uint32_t b = numbers(mesh.points, cell[(k + 1) % cell.size()]);
        if (a != b) edges.push_back(uint64_t{std::min(a, b)} << 32 | std::max(a, b));
      }
    }
  }
  return odd_ones(std::move(edges));
}

/// What is left of the edges of each chart when those with an even number of its faces are gone: in any cut
/// an edge is open if an odd number of charts have it.
class OpenEdges {
 public:
  Result<> read(RandomReader& reader) {
    // All pages of the index.
    MAILLE_CHECK(reader.select([](const ChartIndex& index) { return select(index, {}, Detail::full()); }));
    Edges finest;
    for (uint32_t g = 0; g < reader.index().size(); ++g) {
      std::vector<Edges>& of_group = edges_.emplace_back();
      for (uint32_t i = 0; i < reader.index().group(g).charts.size(); ++i) {
        const std::vector<DecodedChart> chart = MAILLE_TRY(reader.read_charts({{g, i}}));
        of_group.push_back(edges_of(chart[0].mesh, numbers_));
        if (reader.index().group(g).level == 0)
          finest.insert(finest.end(), of_group.back().begin(), of_group.back().end());
      }
    }
    in_mesh_.resize(numbers_.size());
    for (const uint64_t edge : odd_ones(std::move(finest)))
      in_mesh_[edge >> 32] = in_mesh_[edge & 0xffffffff] = true;
    return {};
  }
  /// Open edges whose ends are not both at open edges of the mesh: borders of the mesh are simplified, too.
  uint64_t cracks(const Selection& selection) const {
    Edges all;
    for (const ChartPlace& place : selection.charts) {
      const Edges& edges = edges_[place.group][place.chart];
      all.insert(all.end(), edges.begin(), edges.end());
    }
    uint64_t count = 0;
    for (const uint64_t edge : odd_ones(std::move(all)))
      count += !in_mesh_[edge >> 32] || !in_mesh_[edge & 0xffffffff];
    return count;
  }

 private:
  PlaceNumbers numbers_;
  std::vector<std::vector<Edges>> edges_;  ///< by group and chart
  std::vector<bool> in_mesh_;              ///< by place
};

/// Numbers that are the same everywhere.
class Random {
 public:
  double unit() { return static_cast<double>(engine_() >> 11) / 9007199254740992.0; }
  /// Of all sizes between.
  double size(double low, double high) { return low * std::pow(high / low, unit()); }

 private:
  std::mt19937_64 engine_{20090708};
};

Selection random_cut(const ChartIndex& index, uint64_t faces, uint32_t number, Random& random) {
  const Sphere& all = index.group(0).sphere;
  Vector3 direction;
  for (unsigned k = 0; k < 3; ++k) direction[k] = random.unit() - 0.5;
  const double length = std::sqrt(dot(direction, direction)) + 1e-9;
  const double far = all.radius * random.size(0.05, 50);
  const View view{all.centre + direction * (far / length), 935, random.size(0.05, 500)};
  if (number % 2 == 1) {
    const auto budget = static_cast<uint64_t>(random.size(2000, static_cast<double>(faces) + 3000));
    return select_within(index, {}, budget, view);
  }
  Detail detail;
  detail.view = view;
  return select(index, {}, detail);
}

}  // namespace

Result<uint64_t> count_cracks(const std::string& path, uint32_t views) {
  const std::unique_ptr<Source> source = MAILLE_TRY(file_source(path));
  RandomReader reader = MAILLE_TRY(RandomReader::open(*source, {}));
  OpenEdges edges;
  MAILLE_CHECK(edges.read(reader));
  Random random;
  std::set<uint64_t> sizes;
  uint64_t mixed = 0, cracks = 0;
  for (uint32_t i = 0; i < views; ++i) {
    const Selection cut = random_cut(reader.index(), reader.directory().faces[0], i, random);
    uint32_t lowest = UINT32_MAX, highest = 0;
    for (const ChartPlace& place : cut.charts) {
      lowest = std::min(lowest, reader.index().group(place.group).level);
      highest = std::max(highest, reader.index().group(place.group).level);
    }
    mixed += lowest < highest;
    sizes.insert(cut.faces);
    cracks += edges.cracks(cut);
  }
  fmt::print(
      "{}: {} views, {} different numbers of faces, {} of several levels: {} edges open that are not "
      "open in the mesh\n",
      path, views, sizes.size(), mixed, cracks);
  return cracks;
}

}  // namespace maille
