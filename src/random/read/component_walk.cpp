#include "random/read/component_walk.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <tuple>

#include "base/result.h"
#include "random/mesh_geometry.h"
#include "random/read/join_charts.h"
#include "random/read/selection.h"

namespace maille {
namespace {

/// Charts that are decoded at once: what they take besides what is remembered of them is bounded.
constexpr size_t charts_at_once = 32;

bool before(const ChartPlace& a, const ChartPlace& b) {
  return std::tie(a.group, a.chart) < std::tie(b.group, b.chart);
}

/// A point that other charts may have as well, and the piece of its chart that it is in.
struct Link {
  Place place;
  uint32_t copy;
  Vector3 position;
  uint32_t piece;
};
struct LinkOrder {
  bool operator()(const Link& a, const Link& b) const {
    return std::tie(a.place, a.copy) < std::tie(b.place, b.copy);
  }
};

/// A chart as pieces that hang together within it.
struct Pieces {
  std::vector<uint32_t> of_cell;
  std::vector<Link> links;  ///< in LinkOrder
  std::vector<bool> reached;

  uint64_t bytes() const {
    return of_cell.size() * sizeof(uint32_t) + links.size() * sizeof(Link) + reached.size() / 8;
  }
};

/// Points by the piece that they are in.
std::vector<uint32_t> pieces_of_points(const Mesh& mesh) {
  std::vector<uint32_t> parent(mesh.point_count());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto find = [&](uint32_t point) {
    while (parent[point] != point) point = parent[point] = parent[parent[point]];
    return point;
  };
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto cell = block.cell(i);
      for (const uint32_t point : cell) {
        const uint32_t a = find(cell[0]), b = find(point);
        // The lower number becomes the parent. That gives up the best bound of union-find, but makes the
        // result independent of the order of cells.
        parent[std::max(a, b)] = std::min(a, b);
      }
    }
  }
  // Parents have lower numbers, so theirs are known.
  uint32_t count = 0;
  std::vector<uint32_t> piece(parent.size());
  for (uint32_t i = 0; i < parent.size(); ++i) piece[i] = parent[i] == i ? count++ : piece[parent[i]];
  return piece;
}

Pieces pieces_of(const DecodedChart& chart, const std::vector<uint32_t>& piece) {
  Pieces pieces;
  uint32_t count = 0;
  for (const uint32_t number : piece) count = std::max(count, number + 1);
  pieces.reached.resize(count);
  for (const CellBlock& block : chart.mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto cell = block.cell(i);
      pieces.of_cell.push_back(cell.empty() ? count : piece[cell[0]]);
    }
  }
  for (const SharedPoint& shared : chart.shared) {
    pieces.links.push_back({place_of(chart.mesh.points, shared.point), shared.copy,
                            point_position(chart.mesh.points, shared.point), piece[shared.point]});
  }
  std::sort(pieces.links.begin(), pieces.links.end(), LinkOrder());
  return pieces;
}

/// Goes from chart to chart by shared points. Of each chart only the piece of each cell and the shared points
/// are remembered, a few bytes a cell, which `most_bytes` bounds; a chart is decoded once. Ends, as each
/// piece waits once at most.
class ComponentWalk {
 public:
  ComponentWalk(RandomReader& reader, uint64_t most_bytes) : reader_(reader), most_bytes_(most_bytes) {}

  Result<Component> run(const ChartPlace& place, uint32_t point) {
    MAILLE_CHECK(start(place, point));
    while (!waiting_.empty()) {
      const Waiting next = waiting_.back();
      waiting_.pop_back();
      const std::vector<ChartPlace> neighbours = MAILLE_TRY(charts_near(next));
      MAILLE_CHECK(load(neighbours));
      for (const ChartPlace& neighbour : neighbours) follow(next, neighbour);
    }
    return take();
  }

 private:
  struct Waiting {
    ChartPlace place;
    uint32_t piece;
  };
  struct Before {
    bool operator()(const ChartPlace& a, const ChartPlace& b) const { return before(a, b); }
  };

  Result<> start(const ChartPlace& place, uint32_t point) {
    MAILLE_CHECK(reader_.find({place}));
    if (reader_.index().group(place.group).level > 0)
      return failure(ErrorCode::usage, "components are those of the mesh itself: name a chart of level 0");
    const std::vector<DecodedChart> chart = MAILLE_TRY(reader_.read_charts({place}));
    const std::vector<uint32_t> piece = pieces_of_points(chart[0].mesh);
    if (point >= piece.size())
      return failure(ErrorCode::usage, "the chart has no point " + std::to_string(point));
    MAILLE_CHECK(remember(place, chart[0]));
    reach(place, piece[point]);
    return {};
  }
  void reach(const ChartPlace& place, uint32_t piece) {
    Pieces& pieces = charts_.find(place)->second;
    if (pieces.reached[piece]) return;
    pieces.reached[piece] = true;
    waiting_.push_back({place, piece});
  }

  Result<> remember(const ChartPlace& place, const DecodedChart& chart) {
    Pieces pieces = pieces_of(chart, pieces_of_points(chart.mesh));
    bytes_ += pieces.bytes();
    if (bytes_ > most_bytes_)
      return failure(ErrorCode::memory_bound, "what hangs together takes more than the memory allowed");
    charts_.emplace(place, std::move(pieces));
    return {};
  }
  Result<> load(const std::vector<ChartPlace>& places) {
    std::vector<ChartPlace> wanted;
    for (size_t i = 0; i < places.size(); ++i) {
      if (charts_.find(places[i]) == charts_.end()) wanted.push_back(places[i]);
      if (wanted.empty() || (wanted.size() < charts_at_once && i + 1 < places.size())) continue;
      const std::vector<DecodedChart> charts = MAILLE_TRY(reader_.read_charts(wanted));
      for (size_t k = 0; k < charts.size(); ++k) MAILLE_CHECK(remember(wanted[k], charts[k]));
      wanted.clear();
    }
    return {};
  }

  /// Those whose boxes meet the box of a piece's links; all, where one has no place.
  Result<std::vector<ChartPlace>> charts_near(const Waiting& from) {
    Region region;
    bool anywhere = false, first = true;
    Box box;
    for (const Link& link : charts_.find(from.place)->second.links) {
      if (link.piece != from.piece) continue;
      for (unsigned k = 0; k < 3; ++k) anywhere = anywhere || !std::isfinite(link.position[k]);
      enclose(box, link.position, first);
      first = false;
    }
    if (first) return std::vector<ChartPlace>();
    if (!anywhere) region.box = box;
    const unsigned rebuilt = reader_.rebuilt();
    const Selection near = MAILLE_TRY(
        reader_.select([&](const ChartIndex& index) { return select(index, region, Detail::full()); }));
    if (reader_.rebuilt() != rebuilt)
      return failure(ErrorCode::corrupt, "the index is damaged; it was made anew: ask again");
    return near.charts;
  }

  /// Pieces of `other` that have a link of this one are reached.
  void follow(const Waiting& from, const ChartPlace& other) {
    const Pieces& theirs = charts_.find(other)->second;
    std::vector<uint32_t> found;
    for (const Link& link : charts_.find(from.place)->second.links) {
      if (link.piece != from.piece) continue;
      const auto range = std::equal_range(theirs.links.begin(), theirs.links.end(), link, LinkOrder());
      for (auto at = range.first; at != range.second; ++at) found.push_back(at->piece);
    }
    for (const uint32_t piece : found) reach(other, piece);
  }

  Component take() const {
    Component component;
    for (const auto& [place, pieces] : charts_) {
      Component::Part part{place, {}};
      for (uint32_t i = 0; i < pieces.of_cell.size(); ++i) {
        const uint32_t piece = pieces.of_cell[i];
        if (piece < pieces.reached.size() && pieces.reached[piece]) part.cells.push_back(i);
      }
      component.cells += part.cells.size();
      if (!part.cells.empty()) component.parts.push_back(std::move(part));
    }
    return component;
  }

  RandomReader& reader_;
  uint64_t most_bytes_, bytes_ = 0;
  std::map<ChartPlace, Pieces, Before> charts_;
  std::vector<Waiting> waiting_;
};

}  // namespace

Result<Component> find_component(RandomReader& reader, const ChartPlace& place, uint32_t point,
                                 uint64_t most_bytes) {
  return ComponentWalk(reader, most_bytes).run(place, point);
}

}  // namespace maille
