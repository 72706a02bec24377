#pragma once

#include <maille/error.h>
#include <maille/limits.h>
#include <maille/mesh.h>
#include <maille/source.h>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace maille {

using Position = std::array<double, 3>;

/// A stretch of an edge: its share of the length and of the cells (of the sums over all sections), and the
/// size of its last cell over that of its first.
struct GradingSection {
  double length = 1;
  double cells = 1;
  double expansion = 1;
};
/// How the cells of an edge are spaced; never empty.
using Grading = std::vector<GradingSection>;

/// A surface that vertices, edges and faces of blocks are projected to: each point goes to the nearest one.
struct BlockSurface {
  enum class Kind : uint8_t {
    sphere,    ///< centre a, radius
    cylinder,  ///< from a to b, with both end caps, radius
    plane,     ///< through a, normal b
    box,       ///< its six sides, or one plate, with opposite corners a and b
    triangles
  };
  std::string name;  ///< how messages call it
  Kind kind = Kind::sphere;
  Position a{}, b{};
  double radius = 0;
  std::vector<Position> points;  ///< of triangles
  std::vector<std::array<uint32_t, 3>> triangles;
};

enum class CurveKind : uint8_t {
  line,
  arc,       ///< circle through both ends and one point; sets off towards it by the shorter way
  polyline,  ///< straight from point to point, by length
  spline,    ///< Catmull-Rom through the points, a segment as long as its chord
  b_spline,  ///< cubic B-spline near the points
  bezier,    ///< Bezier curve of both ends and the points
  projected  ///< the chord on surfaces, by length
};

/// The shape of an edge between two vertices, in that direction.
struct BlockCurve {
  CurveKind kind = CurveKind::line;
  uint32_t from = 0;
  uint32_t to = 0;
  std::vector<Position> points;         ///< between the ends
  std::vector<uint32_t> surfaces = {};  ///< of a projected one; several: where they meet
};

/// A hexahedron of cells. Corners in VTK's order, which is OpenFOAM's: 0-1 along x, 0-3 along y, 0-4 along z.
/// A corner may be repeated: the block is a prism or a pyramid then.
struct HexBlock {
  std::array<uint32_t, 8> corners{};
  std::array<uint32_t, 3> divisions{1, 1, 1};
  /// The edges along x (0-1, 3-2, 7-6, 4-5), along y (0-3, 1-2, 5-6, 4-7), along z (0-4, 1-5, 2-6, 3-7).
  std::array<Grading, 12> gradings;
  std::string zone;  ///< empty: none
  std::string name;  ///< how messages call it; empty: its number
};

/// Part of the boundary, as faces of blocks given by their corners in any order.
struct BlockPatch {
  std::string name;
  std::string type;
  std::vector<std::array<uint32_t, 4>> faces;
};

/// A vertex, or a face of blocks by its corners in any order, that lies on surfaces: where they meet, if
/// there are several. Edges stay where they are when a face is projected; the points within the blocks beside
/// it move with it, the less the farther.
struct ProjectedVertex {
  uint32_t vertex = 0;
  std::vector<uint32_t> surfaces;
};
struct ProjectedFace {
  std::array<uint32_t, 4> corners{};
  std::vector<uint32_t> surfaces;
};

/// A mesh of transfinite hexahedral blocks. Blocks with a face of the same four vertices are joined there.
struct BlockDescription {
  std::vector<Position> vertices;
  std::vector<HexBlock> blocks;
  std::vector<BlockCurve> curves;
  std::vector<BlockPatch> patches;
  std::vector<BlockSurface> surfaces;
  std::vector<ProjectedVertex> projected_vertices;
  std::vector<ProjectedFace> projected_faces;
  /// Where outer faces go which are in no patch.
  BlockPatch default_patch{"defaultFaces", "empty", {}};
};

/// Most cells along an edge of a block.
inline constexpr uint32_t max_block_divisions = 1u << 22;

/// What is about to be generated.
struct GeneratedSize {
  uint64_t points = 0;
  uint64_t cells = 0;               ///< volume cells
  std::vector<BlockPatch> patches;  ///< with the default patch behind the others if it is needed
};

/// Takes a mesh as it is generated: points before the first face or cell that has them, faces before the cell
/// behind them.
class GeneratedOutput {
 public:
  virtual ~GeneratedOutput() = default;
  [[nodiscard]] virtual Result<> begin(const GeneratedSize& size) = 0;
  /// Three coordinates of each of the points `first`, first + 1, ...; points are numbered as they come.
  [[nodiscard]] virtual Result<> points(uint64_t first, std::span<const double> coordinates) = 0;
  /// Outer faces, all triangles or all quads, seen from outside.
  [[nodiscard]] virtual Result<> faces(uint32_t patch, CellType type, std::span<const uint64_t> nodes) = 0;
  /// Cells of one block and one type. `last_use`: a flag for each node, not 0 where no later face, cell or
  /// node of the cell is the same point. A hexahedron that is neither prism, pyramid nor tetrahedron keeps
  /// its repeated nodes.
  [[nodiscard]] virtual Result<> cells(uint32_t block, CellType type, std::span<const uint64_t> nodes,
                                       std::span<const uint8_t> last_use) = 0;
};

struct GenerateOptions {
  /// Multiplies all divisions.
  uint32_t refine = 1;
  /// Blocks side by side are swept together, layer by layer, so that few points are alive at any time.
  /// Otherwise the order of cells and points is that of OpenFOAM's blockMesh: block by block.
  bool streaming_order = false;
  /// Outer faces come behind all cells, patch by patch in the order of OpenFOAM's blockMesh: for what holds
  /// the mesh, as flags of last uses do not count them. Not in streaming order.
  bool faces_last = false;
};

/// Generates the mesh of a description. Memory: tables along the edges of blocks, their projected faces and a
/// row of cells, whatever the size of the mesh. Coordinates are made with sin, cos, atan2 and pow of the
/// machine's library: they can differ in the last digits from machine to machine. Errors: malformed_input,
/// naming the block; unsupported; those of `output`.
[[nodiscard]] Result<> generate(const BlockDescription& description, const GenerateOptions& options,
                                GeneratedOutput& output);

/// The same as a mesh: blocks of hexahedra (mixed where some are collapsed) for each zone, and blocks of
/// faces named as the patches. Patch types are in the metadata. Error: memory_bound, before anything is made.
[[nodiscard]] Result<Mesh> generate_mesh(const BlockDescription& description, const GenerateOptions& options,
                                         const Limits& limits = {});

/// What a blockMeshDict of OpenFOAM says.
struct BlockDictionary {
  BlockDescription description;
  std::vector<std::string> notes;
};

/// Reads a blockMeshDict. `limits`: of each file with triangles that it names. Errors: malformed_input or
/// unsupported, naming file, line and entry; those of reading such a file.
[[nodiscard]] Result<BlockDictionary> read_block_dictionary(const std::string& path,
                                                            const Limits& limits = {});
/// The same of what is open already, such as a pipe. Files that it names are looked for in the folder of the
/// source's name; without one, in the current folder.
[[nodiscard]] Result<BlockDictionary> read_block_dictionary(const Source& source, const Limits& limits = {});

}  // namespace maille
