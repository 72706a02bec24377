#include "generate/transfinite_block.h"

#include <algorithm>

#include "base/result.h"
#include "generate/transfinite_curve.h"
#include "generate/transfinite_grading.h"
#include "generate/transfinite_vector.h"

namespace maille {

namespace {

/// Points of a projected face whose offsets are held, 24 bytes each: 400 MB. Chosen, not swept.
constexpr uint64_t most_projected_points = uint64_t{1} << 24;

// The two axes other than `axis`, in order.
unsigned first_of(unsigned axis) {
  return axis == 0 ? 1 : 0;
}
unsigned second_of(unsigned axis) {
  return axis == 2 ? 1 : 2;
}

bool same(const Grading& a, const Grading& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.length == y.length && x.cells == y.cells && x.expansion == y.expansion;
  });
}

}  // namespace

bool BlockPoints::has_corners(const HexBlock& block, unsigned axis, unsigned end,
                              std::array<uint32_t, 4> corners) {
  std::array<uint32_t, 4> own{};
  for (unsigned uv = 0; uv < 4; ++uv) {
    std::array<unsigned, 3> at{};
    at[axis] = end;
    at[first_of(axis)] = uv & 1;
    at[second_of(axis)] = uv >> 1;
    own[uv] = block.corners[corner_at(at[0], at[1], at[2])];
  }
  std::sort(own.begin(), own.end());
  std::sort(corners.begin(), corners.end());
  return own == corners;
}

Result<BlockPoints> BlockPoints::make(const BlockDescription& description, const BlockTopology& topology,
                                      const Surfaces& surfaces, size_t block) {
  const HexBlock& from = description.blocks[block];
  BlockPoints points;
  for (unsigned i = 0; i < 8; ++i) points.corners_[i] = description.vertices[from.corners[i]];
  for (unsigned axis = 0; axis < 3; ++axis) {
    std::vector<unsigned> spaced;  // edges whose spacing differs from those before
    for (unsigned uv = 0; uv < 4; ++uv) {
      std::array<unsigned, 3> at{};
      at[first_of(axis)] = uv & 1;
      at[second_of(axis)] = uv >> 1;
      const unsigned e = edge_at(axis, uv & 1, uv >> 1);
      Edge& edge = points.edges_[e];
      edge.from = corner_at(at[0], at[1], at[2]);
      at[axis] = 1;
      edge.to = corner_at(at[0], at[1], at[2]);
      const auto like = std::find_if(spaced.begin(), spaced.end(),
                                     [&](unsigned i) { return same(from.gradings[i], from.gradings[e]); });
      if (like != spaced.end()) {
        edge.parameters = points.edges_[*like].parameters;
        continue;
      }
      points.uniform_ = points.uniform_ && spaced.empty();
      spaced.push_back(e);
      edge.parameters = static_cast<uint32_t>(points.tables_.size());
      points.tables_.push_back(edge_parameters(from.gradings[e], topology.divisions[block][axis]));
    }
  }
  for (unsigned e = 0; e < 12; ++e) {
    const auto curved = points.add_curve(description, from, surfaces, e, topology.curve[block][e]);
    if (!curved) {
      return failure(curved.error().code, block_text(description, block) + ": edge " +
                                              std::to_string(from.corners[points.edges_[e].from]) + " " +
                                              std::to_string(from.corners[points.edges_[e].to]) + ": " +
                                              curved.error().message);
    }
  }
  // Offsets of all faces are found before any counts; the borders that faces share do not move, so the order
  // of faces does not matter.
  std::vector<Projected> projected;
  for (const ProjectedFace& face : description.projected_faces) {
    if (points.add_projected(face, from, surfaces, topology.divisions[block], projected)) continue;
    return failure(ErrorCode::memory_bound, block_text(description, block) +
                                                ": a projected face has more than " +
                                                std::to_string(most_projected_points) + " points");
  }
  points.projected_ = std::move(projected);
  return points;
}

bool BlockPoints::add_projected(const ProjectedFace& face, const HexBlock& block, const Surfaces& surfaces,
                                const std::array<uint32_t, 3>& divisions, std::vector<Projected>& to) const {
  for (unsigned side = 0; side < 6; ++side) {
    const unsigned axis = side / 2, end = side % 2;
    if (!has_corners(block, axis, end, face.corners)) continue;
    const unsigned u = first_of(axis), v = second_of(axis);
    Projected added{static_cast<uint8_t>(axis), static_cast<uint8_t>(end), static_cast<uint8_t>(u),
                    static_cast<uint8_t>(v),    divisions[u] + 1,          {}};
    const uint64_t count = uint64_t{added.stride} * (uint64_t{divisions[v]} + 1);
    if (count > most_projected_points) return false;
    added.offset.resize(count);
    Place at{};
    at[axis] = end != 0 ? divisions[axis] : 0;
    // Inner points only.
    for (at[v] = 1; at[v] < divisions[v]; ++at[v]) {
      for (at[u] = 1; at[u] < divisions[u]; ++at[u]) {
        std::array<double, 3> parameters;
        const Position from = by_edges(at, parameters);
        added.offset[size_t{at[v]} * added.stride + at[u]] = surfaces.project(from, face.surfaces) - from;
      }
    }
    to.push_back(std::move(added));
  }
  return true;
}

Result<> BlockPoints::add_curve(const BlockDescription& description, const HexBlock& block,
                                const Surfaces& surfaces, unsigned e, int32_t number) {
  Edge& edge = edges_[e];
  const uint32_t from = block.corners[edge.from];
  if (number < 0) return {};
  const BlockCurve& given = description.curves[static_cast<size_t>(number)];
  const Curve curve = MAILLE_TRY(
      Curve::make(given, description.vertices[given.from], description.vertices[given.to], surfaces));
  // The curve goes from its own first vertex, the edge along the block's axis.
  const bool backwards = given.from != from;
  for (const double t : tables_[edge.parameters]) {
    const Position chord = (1 - t) * corners_[edge.from] + t * corners_[edge.to];
    edge.offset.push_back(curve.at(backwards ? 1 - t : t) - chord);
  }
  const unsigned axis = e / 4;
  Curved curved;
  curved.edge = static_cast<uint8_t>(e);
  curved.u = static_cast<uint8_t>(first_of(axis));
  curved.v = static_cast<uint8_t>(second_of(axis));
  const unsigned x = (edge.from & 1) ^ (edge.from >> 1 & 1);
  const std::array<unsigned, 3> at{x, edge.from >> 1 & 1, edge.from >> 2};
  curved.at_u = static_cast<uint8_t>(at[curved.u]);
  curved.at_v = static_cast<uint8_t>(at[curved.v]);
  curved_.push_back(curved);
  return {};
}

// The formula of the class, with a weight for each edge at each point, as spacings differ.
Position BlockPoints::general(const Place& at, std::array<double, 3>& parameters) const {
  parameters = {};
  Position straight{};
  Position bent{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    double weights[4];
    double sum = 0;
    for (unsigned uv = 0; uv < 4; ++uv) {
      const unsigned e = edge_at(axis, uv & 1, uv >> 1);
      const double t = parameter(e, at[axis]);
      // At an end of this edge: the weight of its place along each of the other axes.
      const auto weight = [&](unsigned end) {
        std::array<unsigned, 3> corner{};
        corner[axis] = end;
        corner[first_of(axis)] = uv & 1;
        corner[second_of(axis)] = uv >> 1;
        double product = 1;
        for (const unsigned other : {first_of(axis), second_of(axis)}) {
          const unsigned along = edge_at(other, corner[first_of(other)], corner[second_of(other)]);
          const double s = parameter(along, at[other]);
          product *= corner[other] != 0 ? s : 1 - s;
        }
        return product;
      };
      weights[uv] = (1 - t) * weight(0) + t * weight(1);
      sum += weights[uv];
    }
    for (unsigned uv = 0; uv < 4; ++uv) {
      const Edge& edge = edges_[edge_at(axis, uv & 1, uv >> 1)];
      const double t = tables_[edge.parameters][at[axis]];
      const double w = weights[uv] / sum;
      parameters[axis] += w * t;
      straight = straight + w * ((1 - t) * corners_[edge.from] + t * corners_[edge.to]);
      if (!edge.offset.empty()) bent = bent + w * edge.offset[at[axis]];
    }
  }
  // Each axis interpolates the corners once, so the straight part is there three times.
  return (1.0 / 3) * straight + bent;
}

// The terms and factors come in an order that does not depend on anything: the same bits in any order of
// points.
Position BlockPoints::uniform(const Place& at, std::array<double, 3>& parameters) const {
  double w[3][2];
  for (unsigned axis = 0; axis < 3; ++axis) {
    w[axis][1] = parameters[axis] = parameter(4 * axis, at[axis]);
    w[axis][0] = 1 - w[axis][1];
  }
  Position sum{};
  for (unsigned i = 0; i < 8; ++i) {
    const double weight = w[0][i & 1] * w[1][i >> 1 & 1] * w[2][i >> 2];
    const Position& corner = corners_[corner_at(i & 1, i >> 1 & 1, i >> 2)];
    for (unsigned c = 0; c < 3; ++c) sum[c] += weight * corner[c];
  }
  for (const Curved& curved : curved_) {
    const double weight = w[curved.u][curved.at_u] * w[curved.v][curved.at_v];
    const Position& offset = edges_[curved.edge].offset[at[curved.edge / 4]];
    for (unsigned c = 0; c < 3; ++c) sum[c] += weight * offset[c];
  }
  return sum;
}

Position BlockPoints::point(const Place& at) const {
  std::array<double, 3> parameters;
  Position sum = by_edges(at, parameters);
  for (const Projected& face : projected_) {
    const double t = parameters[face.axis];
    sum = sum + (face.end != 0 ? t : 1 - t) * face.offset[size_t{at[face.v]} * face.stride + at[face.u]];
  }
  return sum;
}

void BlockPoints::row(Place at, unsigned axis, uint32_t first, uint32_t last,
                      std::vector<double>& out) const {
  const size_t start = out.size();
  out.resize(start + 3 * (size_t{last} - first + 1));
  double* p = out.data() + start;
  for (at[axis] = first; at[axis] <= last; ++at[axis], p += 3) {
    const Position x = point(at);
    std::copy(x.begin(), x.end(), p);
  }
}

}  // namespace maille
