#pragma once

#include <maille/generate.h>
#include <array>
#include <cstdint>
#include <vector>

#include "generate/surfaces.h"
#include "generate/transfinite_topology.h"

namespace maille {

/// The points of one block, by transfinite interpolation of its twelve edges:
///
///     X = (S_x + S_y + S_z) / 3 + sum over edges of w_e * (curve_e - chord_e)
///
/// where S_a is the sum over the four edges along axis a of w_e * chord_e. At parameter t of an edge, w_e is
/// (1 - t) * (product of the other two axes' weights at its first end) + t * (the same at its last end), and
/// the four weights of an axis are scaled to a sum of 1; a weight at a corner is the parameter (or 1 - it) of
/// the edge that leaves the corner along the axis asked for. With the same spacing on the four edges of each
/// axis this is the interpolation of Coons and Gordon. Found to be what OpenFOAM's blockMesh does.
///
/// A projected face adds where its points go from there, times 1 less the parameter from the face on.
class BlockPoints {
 public:
  /// `surfaces`: those of the description, for the time of the call.
  static Result<BlockPoints> make(const BlockDescription& description, const BlockTopology& topology,
                                  const Surfaces& surfaces, size_t block);

  /// Whether the block has these corners at one end of an axis, in any order.
  static bool has_corners(const HexBlock& block, unsigned axis, unsigned end,
                          std::array<uint32_t, 4> corners);

  using Place = std::array<uint32_t, 3>;

  /// The points first, first + 1, ..., last of a row along `axis` through `at`; three coordinates each.
  void row(Place at, unsigned axis, uint32_t first, uint32_t last, std::vector<double>& out) const;

 private:
  struct Edge {
    unsigned from = 0;
    unsigned to = 0;
    uint32_t parameters = 0;       ///< in tables_
    std::vector<Position> offset;  ///< curve less chord; empty: straight
  };

  /// An edge that is not straight: its place along the other two axes.
  struct Curved {
    uint8_t edge, u, v, at_u, at_v;
  };

  /// A face that is projected, its points by the place along its two axes, the first one fastest.
  struct Projected {
    uint8_t axis, end, u, v;
    uint32_t stride;
    std::vector<Position> offset;
  };

  Result<> add_curve(const BlockDescription& description, const HexBlock& block, const Surfaces& surfaces,
                     unsigned edge, int32_t curve);
  /// False: the face has too many points.
  bool add_projected(const ProjectedFace& face, const HexBlock& block, const Surfaces& surfaces,
                     const std::array<uint32_t, 3>& divisions, std::vector<Projected>& to) const;
  Position point(const Place& at) const;
  /// By the edges alone, with the parameter of each axis.
  Position by_edges(const Place& at, std::array<double, 3>& parameters) const {
    return uniform_ ? uniform(at, parameters) : general(at, parameters);
  }
  Position general(const Place& at, std::array<double, 3>& parameters) const;
  /// The same where the four edges of each axis have one spacing: corners, and what curved edges add.
  Position uniform(const Place& at, std::array<double, 3>& parameters) const;
  double parameter(unsigned edge, uint32_t i) const { return tables_[edges_[edge].parameters][i]; }

  std::array<Position, 8> corners_{};
  std::array<Edge, 12> edges_;
  std::vector<Curved> curved_;
  std::vector<Projected> projected_;
  std::vector<std::vector<double>> tables_;
  bool uniform_ = true;
};

}  // namespace maille
