#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/lanes.h"
#include "surface/patch_surface.h"
#include "surface/vector3.h"

namespace maille {

/// The neighbours of each vertex, dummies apart, in the order in which edges turn around it. On the border
/// the two along it come first.
class VertexRings {
 public:
  /// A vertex with as many neighbours has no row, and the others do not count: what is done for a vertex
  /// stays bounded.
  static constexpr unsigned most = 24;

  explicit VertexRings(const PatchSurface& surface);

  std::span<const uint32_t> all(uint32_t vertex) const {
    return {neighbours_.data() + first_[vertex], first_[vertex + 1] - first_[vertex]};
  }
  /// Those whose mean a vertex of a smooth surface is near: all; on the border those along it.
  std::span<const uint32_t> row(uint32_t vertex) const { return all(vertex).first(in_row_[vertex]); }
  bool has_part_only(uint32_t vertex) const { return row(vertex).size() != all(vertex).size(); }

 private:
  void add(const PatchSurface& surface, uint32_t vertex);

  std::vector<uint32_t> first_;  // by vertex
  std::vector<uint32_t> neighbours_;
  std::vector<uint8_t> in_row_;
};

/// Where vertices lie on the smoothest surface through the known ones. All connectivity is known before the
/// first position, so the unknown vertices around one count as well: with L(v) = v - the mean of its row,
/// they minimise
///     sum over edges of |L(i) - L(j)|^2 + 0.2 * sum of |L|^2 + 0.002 * sum over edges of |i - j|^2,
/// that is, mainly the change of curvature. (This is the mean of a Gaussian field, given what is known.)
/// Vertices that come one after the other and are neighbours share a system of equations: its unknowns are
/// eliminated from the farthest to the first vertex, and what is left in each of their rows tells one vertex
/// from those before it. Floats with + - * / in a fixed order; matrices depend on connectivity only.
class SmoothSurface {
 public:
  SmoothSurface(const PatchSurface& surface, const VertexRings& rings);

  /// `positions`, by point, hold all before this vertex's; `base` is any place near it. False: nothing is
  /// known of it. Positions beyond all range can give what is not finite.
  bool predict(uint32_t vertex, std::span<const Vector3> positions, const Vector3& base, Vector3& found);

 private:
  // Edges up to which unknown vertices count. Four edges, or more than 48 unknowns, gained 0.2 % for 15 % of
  // the time (be83a6c). The other bounds keep the work for a vertex constant: eliminating an unknown changes
  // at most 48 * 48 / 2 numbers.
  static constexpr unsigned radius = 3;
  static constexpr unsigned most_unknown = 48;
  static constexpr unsigned most_members = 192;
  static constexpr unsigned most_together = 8;
  static constexpr uint8_t known_slot = 0xff;
  static constexpr unsigned blocks = most_unknown / 4;

  struct Mark {
    uint32_t system = 0;
    uint32_t member = 0;
  };
  /// A vertex of the system, with its L = known + [the vertex is unknown] * itself - share * sum of slots.
  struct Member {
    uint32_t vertex;
    uint8_t distance;
    uint8_t slot;     ///< its place among the unknown
    uint8_t counted;  ///< neighbours in the row that are known or in the system
    uint8_t unknown_neighbours;
    bool complete;  ///< all of the row are
    float share;
    FloatLanes known;
    std::array<uint8_t, VertexRings::most> slots;  ///< of its unknown neighbours
    bool is_unknown() const { return slot != known_slot; }
  };
  using Row = std::array<FloatLanes, blocks>;

  bool is_known(uint32_t vertex) const { return surface_.point(vertex) < first_unknown_; }
  FloatLanes place(uint32_t vertex) const;

  void set_up(uint32_t vertex);
  void join_together(uint32_t vertex);
  void join(uint32_t vertex, unsigned distance);
  void find_members();
  void find_laplacian(Member& member);
  void count_neighbours(Member& member);
  void clear();
  void add_edges(const Member& member);
  void add_bending(const Member& member);
  void eliminate();

  const PatchSurface& surface_;
  const VertexRings& rings_;
  std::vector<Mark> marks_;                       // by vertex
  std::vector<std::array<float, 3>> laplacians_;  // by vertex, once it and its row are known
  std::vector<bool> has_laplacian_;

  // The system at hand.
  std::span<const Vector3> positions_;
  Vector3 base_;
  uint32_t system_ = 0;
  uint32_t first_vertex_ = 0;
  uint32_t first_unknown_ = 0;  // as a point
  unsigned together_ = 0;       // vertices from the first one on that it predicts
  unsigned unknown_ = 0;
  std::vector<Member> members_;
  std::array<Row, most_unknown> matrix_;  // up to the block of the diagonal
  std::array<FloatLanes, most_unknown> right_;
};

}  // namespace maille
