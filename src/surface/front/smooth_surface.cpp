#include "surface/front/smooth_surface.h"

#include <algorithm>

namespace maille {
namespace {

// These gave the smallest files of armadillo, skull, camel and bear at 14 bits among radii of 2 to 4, 1 to 12
// vertices together, and weights three times as large or small. Scans like larger ones (skull 0.3 %),
// modelled surfaces smaller ones. Without the last one nothing holds the outermost vertices. All are part of
// the format (14.6).
constexpr float weight_of_laplacian = 0.2F;
constexpr float weight_of_edges = 0.002F;
/// Unknowns of a smaller pivot hang on nothing: what is left of their row is rounding error of floats.
constexpr float least_pivot = 1e-7F;

}  // namespace

VertexRings::VertexRings(const PatchSurface& surface) {
  const uint32_t count = surface.vertices.size();
  first_.reserve(size_t{count} + 1);
  first_.push_back(0);
  in_row_.reserve(count);
  neighbours_.reserve(surface.half_edges.size());
  for (uint32_t vertex = 0; vertex < count; ++vertex) add(surface, vertex);
}

/// Neighbours along the border are swapped to the front of the vertex's range as they come.
void VertexRings::add(const PatchSurface& surface, uint32_t vertex) {
  const HalfEdges& edges = surface.half_edges;
  const auto is_dummy = [&](uint32_t h) { return edges.origin[h] >= first_dummy; };
  const uint32_t first = surface.vertices.corner[vertex];
  unsigned count = 0, along = 0;
  uint32_t h = first;
  do {
    const uint32_t back = edges.opposite[h];
    const uint32_t before = edges.previous(h);
    if (!is_dummy(back) && count < most) {
      neighbours_.push_back(edges.origin[back]);
      ++count;
      if (is_dummy(before) || is_dummy(edges.previous(back)))
        std::swap(neighbours_.back(), neighbours_[first_.back() + along++]);
    }
    h = edges.opposite[before];
  } while (h != first);
  in_row_.push_back(static_cast<uint8_t>(count == most ? 0 : along > 0 ? along : count));
  first_.push_back(static_cast<uint32_t>(neighbours_.size()));
}

SmoothSurface::SmoothSurface(const PatchSurface& surface, const VertexRings& rings)
    : surface_(surface),
      rings_(rings),
      marks_(surface.vertices.size()),
      laplacians_(surface.vertices.size()),
      has_laplacian_(surface.vertices.size()) {}

bool SmoothSurface::predict(uint32_t vertex, std::span<const Vector3> positions, const Vector3& base,
                            Vector3& found) {
  if (vertex - first_vertex_ >= together_) {
    positions_ = positions;
    base_ = base;
    set_up(vertex);
    if (together_ == 0) return false;
  }
  const unsigned slot = vertex - first_vertex_;
  const Row& row = matrix_[slot];
  FloatLanes sum = right_[slot];
  for (unsigned i = 0; i < slot; ++i) sum += place(first_vertex_ + i) * row[i / 4][i % 4];
  const float inverse = -1 / row[slot / 4][slot % 4];
  for (unsigned k = 0; k < 3; ++k) found[k] = base_[k] + static_cast<double>(sum[k] * inverse);
  return true;
}

/// Relative to the base, so that floats will do.
FloatLanes SmoothSurface::place(uint32_t vertex) const {
  const Vector3 apart = positions_[surface_.point(vertex)] - base_;
  return FloatLanes{static_cast<float>(apart[0]), static_cast<float>(apart[1]), static_cast<float>(apart[2]),
                    0};
}

/// A system of equations for this vertex and those that share it. What is known is what came before the first
/// of them, also for the later ones: their own row then takes the positions of those between.
void SmoothSurface::set_up(uint32_t vertex) {
  ++system_;
  first_vertex_ = vertex;
  first_unknown_ = surface_.point(vertex);
  join_together(vertex);
  find_members();
  for (Member& member : members_) find_laplacian(member);
  clear();
  for (const Member& member : members_) {
    if (member.is_unknown()) add_edges(member);
    if (member.complete && (member.is_unknown() || member.unknown_neighbours > 0)) add_bending(member);
  }
  eliminate();
}

/// The vertex, and those after it as long as each is a neighbour of the one before: five in the mean, which
/// takes a third of the time of a system for each (be83a6c).
void SmoothSurface::join_together(uint32_t vertex) {
  members_.clear();
  unknown_ = together_ = 0;
  for (; together_ < most_together; ++together_) {
    const uint32_t next = vertex + together_;
    if (together_ > 0) {
      const auto around = rings_.all(next - 1);
      if (std::find(around.begin(), around.end(), next) == around.end()) return;
      if (surface_.point(next) != first_unknown_ + together_) return;  // another fan of a known point
    }
    join(next, 0);
  }
}

void SmoothSurface::join(uint32_t vertex, unsigned distance) {
  Mark& mark = marks_[vertex];
  if (mark.system == system_) return;
  const bool known = is_known(vertex);
  // The nearest come first, so the farthest are left out; rows that miss them are not complete and do not
  // count.
  if (!known && unknown_ == most_unknown) return;
  mark = {system_, static_cast<uint32_t>(members_.size())};
  Member& member = members_.emplace_back();
  member.vertex = vertex;
  member.distance = static_cast<uint8_t>(distance);
  member.slot = known ? known_slot : static_cast<uint8_t>(unknown_++);
}

/// All up to the radius, the nearest first.
void SmoothSurface::find_members() {
  for (size_t i = 0; i < members_.size() && members_.size() < most_members; ++i) {
    const unsigned distance = members_[i].distance;
    if (distance == radius) return;
    for (const uint32_t neighbour : rings_.all(members_[i].vertex)) join(neighbour, distance + 1);
  }
}

/// Once a vertex and its row are known, its L never changes and is kept; until then it is known plus shares
/// of unknowns.
void SmoothSurface::find_laplacian(Member& member) {
  const uint32_t vertex = member.vertex;
  member.unknown_neighbours = 0;
  if (has_laplacian_[vertex]) {
    const auto& [x, y, z] = laplacians_[vertex];
    member.known = FloatLanes{x, y, z, 0};
    member.share = 0;
    member.complete = true;
    return;
  }
  count_neighbours(member);
  if (member.is_unknown()) return;
  member.known += place(vertex);
  if (!member.complete || member.unknown_neighbours > 0) return;
  laplacians_[vertex] = {member.known[0], member.known[1], member.known[2]};
  has_laplacian_[vertex] = true;
}

void SmoothSurface::count_neighbours(Member& member) {
  const auto row = rings_.row(member.vertex);
  member.share = row.empty() ? 0 : 1.0F / static_cast<float>(row.size());
  FloatLanes sum = {};
  unsigned counted = 0;
  for (const uint32_t neighbour : row) {
    if (is_known(neighbour)) {
      sum += place(neighbour);
    } else if (marks_[neighbour].system == system_) {
      member.slots[member.unknown_neighbours++] = members_[marks_[neighbour].member].slot;
    } else {
      continue;
    }
    ++counted;
  }
  member.counted = static_cast<uint8_t>(counted);
  member.complete = counted == row.size() && !row.empty();
  member.known = sum * -member.share;
}

void SmoothSurface::clear() {
  for (unsigned i = 0; i < unknown_; ++i) {
    for (unsigned j = 0; j <= i / 4; ++j) matrix_[i][j] = FloatLanes{};
    right_[i] = FloatLanes{};
  }
}

/// The term 0.002 * sum of |i - j|^2: the row of the graph's Laplacian for this unknown.
void SmoothSurface::add_edges(const Member& member) {
  const unsigned i = member.slot;
  const auto all = static_cast<float>(rings_.row(member.vertex).size());
  matrix_[i][i / 4][i % 4] += weight_of_edges * static_cast<float>(member.counted);
  right_[i] += member.known * (weight_of_edges * all);
  for (unsigned n = 0; n < member.unknown_neighbours; ++n) {
    const unsigned j = member.slots[n];
    if (j < i) matrix_[i][j / 4][j % 4] -= weight_of_edges;
  }
}

/// L, as a column, times the row of the sum of its differences to those of its neighbours, and of itself
/// times its weight. (Only neighbours that have each other in their rows: so the matrix is symmetric.)
void SmoothSurface::add_bending(const Member& member) {
  Row sum;
  unsigned used = 0;
  FloatLanes known = {};
  const auto put = [&](unsigned slot, float factor) {
    for (; used <= slot / 4; ++used) sum[used] = FloatLanes{};
    sum[slot / 4][slot % 4] += factor;
  };
  const auto take = [&](const Member& from, float factor) {
    known += from.known * factor;
    if (from.is_unknown()) put(from.slot, factor);
    for (unsigned n = 0; n < from.unknown_neighbours; ++n) put(from.slots[n], -factor * from.share);
  };
  const bool part_only = rings_.has_part_only(member.vertex);
  float weight = weight_of_laplacian;
  for (const uint32_t neighbour : rings_.row(member.vertex)) {
    const Mark& mark = marks_[neighbour];
    if (mark.system != system_ || rings_.has_part_only(neighbour) != part_only) continue;
    if (!members_[mark.member].complete) continue;
    take(members_[mark.member], -1);
    weight += 1;
  }
  take(member, weight);
  const auto add = [&](unsigned i, float factor) {
    const unsigned end = std::min(i / 4 + 1, used);
    for (unsigned j = 0; j < end; ++j) matrix_[i][j] += sum[j] * factor;
    right_[i] += known * factor;
  };
  if (member.is_unknown()) add(member.slot, 1);
  for (unsigned n = 0; n < member.unknown_neighbours; ++n) add(member.slots[n], -member.share);
}

/// Gauss from the farthest unknown to the first vertex, over the lower triangle only, as the matrix is
/// symmetric. What is left in row s tells vertex s from those before it.
void SmoothSurface::eliminate() {
  for (unsigned k = unknown_; k-- > 0;) {
    const Row& last = matrix_[k];
    const float pivot = last[k / 4][k % 4];
    if (!(pivot > least_pivot)) {
      together_ = std::min(together_, k);
      continue;
    }
    const float inverse = 1 / pivot;
    for (unsigned i = 0; i < k; ++i) {
      const float factor = last[i / 4][i % 4] * inverse;
      if (factor == 0) continue;
      for (unsigned j = 0; j <= i / 4; ++j) matrix_[i][j] -= last[j] * factor;
      right_[i] -= right_[k] * factor;
    }
  }
}

}  // namespace maille
