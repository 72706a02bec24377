#pragma once

#include <maille/encode.h>

#include <array>
#include <vector>

#include "description/element_order.h"
#include "random/build/hierarchy_index.h"
#include "random/build/level_builder.h"
#include "random/build/mesh_windows.h"
#include "random/chart_codec.h"
#include "surface/fans/shared_fans.h"

namespace maille {

// A hierarchy is built from pieces of each level that fit into memory: windows of the mesh, then runs of
// charts. Each is coded and simplified by itself; points that others have as well stay.

/// A chart of a coarser level on its way to the piece that codes it.
struct CoarseChart {
  Sphere sphere;                    ///< around the origin of local positions
  std::vector<uint32_t> ids;        ///< by vertex: its number in the mesh, rising
  std::vector<std::byte> tuples;    ///< positions of all vertices, then each array of points
  std::vector<uint32_t> triangles;  ///< of these vertices
  std::vector<uint32_t> border;     ///< ids that other charts have as well, rising
};
std::vector<std::byte> pack(const CoarseChart& chart);
/// Inverse, without sphere and border, of bytes of this process.
CoarseChart unpack_chart(Bytes bytes);

/// A chart as it will be in the file.
struct ChartOfPiece {
  std::vector<std::byte> bytes;
  Sphere sphere;
  ChartExtent extent;
  uint64_t triangles = 0;
  uint64_t topology = 0;
  std::vector<uint64_t> arrays;  ///< bytes, positions first
  ElementOrder order;            ///< of a chart of level 0, if it is kept
};
struct GroupOfPiece {
  std::vector<uint32_t> inputs;  ///< places in the piece
  std::vector<CoarseChart> outputs;
  double view_error = 0, bound = 0;
};
struct LevelPiece {
  std::vector<ChartOfPiece> charts;
  std::vector<GroupOfPiece> groups;
  double rounding = 0;  ///< see LocalPositions
};

/// What all pieces share.
struct PieceRules {
  ChartSizes sizes;
  EncodeOptions of_chart;       ///< without executor and progress
  std::vector<Array> arrays;    ///< positions, then those of the mesh; without tuples
  std::vector<ArrayMaps> maps;  ///< of these
  size_t blocks = 1;            ///< of the mesh: none, or one
  size_t mesh_arrays = 0;       ///< of the mesh as a whole: no bytes in charts of level 0, but a size
  Vector3 origin;
  std::array<SharedFanEncoder, chart_sets> tables;
};

/// A part of the sample that tables of level 0 are made of: charts of about so many faces.
Result<> sample_window(const WindowMesh& window, uint64_t faces, PieceRules& rules);
/// Of those of all other levels.
Result<> sample_chart(const CoarseChart& chart, PieceRules& rules);

/// `alone`: the level has no other piece. One chart alone is not simplified.
Result<LevelPiece> code_window(const WindowMesh& window, const PieceRules& rules, bool alone,
                               Executor& executor);
/// `held`: ids that other pieces have as well, rising.
Result<LevelPiece> code_charts(std::span<const CoarseChart> charts, std::span<const uint32_t> held,
                               const PieceRules& rules, bool alone, Executor& executor);

}  // namespace maille
