#pragma once

#include <maille/decode.h>
#include <maille/file.h>
#include <maille/geometry.h>
#include <maille/mesh.h>
#include <maille/source.h>

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace maille {

/// Files of mode `random`: a hierarchy of charts, of which any part can be read at any level of detail. Level
/// 0 is the mesh, face for face; each coarser level has about a fourth of the faces of the finer one.
/// docs/random-access.md.

/// A perspective view. An error is seen from the nearest point of what it belongs to.
struct View {
  Vector3 eye;
  double pixels_per_radian = 1;  ///< height in pixels / (2 tan(vertical field of view / 2))
  double pixels = 1;             ///< error that may be seen
};

/// How fine: the coarsest charts that keep within all these limits, where any do.
struct Detail {
  /// No point of the mesh is farther than this from what is chosen, world units.
  double bound = std::numeric_limits<double>::infinity();
  /// The quadric error, world units: what drives views. Smaller than the distance, mostly.
  double view_error = std::numeric_limits<double>::infinity();
  std::optional<View> view;
  uint32_t level = std::numeric_limits<uint32_t>::max();  ///< no charts coarser than this one

  /// The mesh itself.
  static Detail full() {
    Detail detail;
    detail.level = 0;
    return detail;
  }
};

/// A chart: the number of its group, and its place in it. Charts of one group lie together in the file.
struct ChartPlace {
  uint32_t group = 0;
  uint32_t chart = 0;
  bool operator==(const ChartPlace&) const = default;
};

/// Charts that together have no cracks, as far as they meet a region.
struct Selection {
  std::vector<ChartPlace> charts;  ///< in the order of the file
  uint64_t faces = 0;              ///< of these charts
  std::vector<uint32_t> missing;   ///< pages of the index that were not read; empty after File::select()
};

/// What is known of a chart without reading it.
struct ChartInfo {
  uint32_t level = 0;
  uint64_t faces = 0;
  uint64_t bytes = 0;  ///< in the file
  Sphere sphere;
  Box box;
};

/// What is known of a group: for renderers that choose charts themselves, by what they have in memory. Group
/// 0 has the coarsest charts. Group g may be shown in the place of the charts that have `refined_by == g`
/// where these may be shown, all of them or none; that is the whole rule for having no cracks. Its errors and
/// its sphere enclose those of the groups that refine it.
struct GroupInfo {
  static constexpr uint32_t none = std::numeric_limits<uint32_t>::max();
  struct Chart {
    uint32_t refined_by = none;  ///< a group of a higher number; none at level 0
    uint64_t faces = 0;
    uint64_t bytes = 0;  ///< in the file
    Sphere sphere;
  };
  uint32_t level = 0;     ///< of its charts
  double view_error = 0;  ///< of the charts that it refines; infinite for group 0, and so is `bound`
  double bound = 0;
  Sphere sphere;
  uint32_t replaces = 0;  ///< how many charts have this group as `refined_by`; 0 for group 0
  std::vector<Chart> charts;
};

/// What is hit by a ray, or near a point. The face is one of the mesh itself, never of a coarser level.
struct SurfacePoint {
  ChartPlace chart;
  uint64_t face = 0;                  ///< in the chart
  std::array<uint32_t, 3> corners{};  ///< points of the chart: the triangle (of a polygon's fan) that was hit
  std::array<double, 3> weights{};    ///< barycentric coordinates
  Vector3 position;
  double distance = 0;  ///< along the ray, in lengths of its direction; or from the point
};

/// A point of the mesh itself. One that several charts have is there once, as the first of them has it.
struct NearPoint {
  ChartPlace chart;
  uint32_t point = 0;  ///< of the chart
  Vector3 position;
  double distance = 0;
};

/// All that hangs together with a point: its cells, those that have a point in common with these, and so on.
struct Component {
  struct Part {
    ChartPlace chart;
    std::vector<uint32_t> cells;  ///< of the chart, numbered through its blocks, rising
  };
  std::vector<Part> parts;  ///< in the order of the file
  uint64_t cells = 0;       ///< of all of them
};

/// An open file. Keeps the pages of its index, not its charts. For one thread at a time: several files may be
/// open on one source. Errors of reading, where nothing else is said: cannot_read, network, corrupt,
/// memory_bound (DecodeOptions::limits).
class File {
 public:
  /// Reads the front of the file: directory, and the first page of the index. `source` must outlive it.
  /// Errors: cannot_read, network, corrupt, unsupported (usage for a file of another mode).
  [[nodiscard]] static Result<File> open(const Source& source, const DecodeOptions& options = {});
  File(File&&) noexcept;
  File& operator=(File&&) noexcept;
  ~File();

  /// Levels of detail, at least 1: 0 is the mesh itself, levels() - 1 the coarsest. `level` below is smaller
  /// than this.
  uint32_t levels() const;
  uint64_t faces(uint32_t level) const;
  uint32_t charts(uint32_t level) const;
  /// Around the whole mesh.
  Sphere sphere() const;

  /// The coarsest charts that keep within the limits, as far as they meet the region. Reads pages of the
  /// index.
  [[nodiscard]] Result<Selection> select(const Region& region, const Detail& detail);
  /// The finest charts of at most so many faces; the worst error, as seen by `view` if given, is refined
  /// first.
  [[nodiscard]] Result<Selection> select(const Region& region, uint64_t most_faces,
                                         const std::optional<View>& view = {});

  /// Error: usage, for a chart that is not there.
  [[nodiscard]] Result<ChartInfo> info(const ChartPlace& place);
  /// How many groups there are.
  uint32_t groups() const;
  /// Error: usage, for a group that is not there.
  [[nodiscard]] Result<GroupInfo> group(uint32_t number);
  /// One chart as a mesh of its own: at level 0 with all blocks of the mesh, most of them empty where there
  /// are many; at coarser levels with one block of triangles.
  [[nodiscard]] Result<Mesh> read(const ChartPlace& place);
  /// Charts as one mesh. Of level 0 alone: with all blocks and arrays, bit for bit those of the original.
  /// With coarser charts: triangles, with values of points, cells and corners that the mesh has there; seams
  /// stay where they are. Faces that only touch the region come with their charts: see clip().
  [[nodiscard]] Result<Mesh> extract(const Selection& selection);
  /// The same, without charts that are damaged; `problems` names them.
  [[nodiscard]] Result<Mesh> salvage(const Selection& selection, std::vector<std::string>& problems);

  /// The first face that the ray from `origin` hits; decodes only charts that it passes.
  [[nodiscard]] Result<std::optional<SurfacePoint>> hit(const Vector3& origin, const Vector3& direction);
  /// The point of the surface nearest to this one.
  [[nodiscard]] Result<std::optional<SurfacePoint>> nearest(const Vector3& point);
  /// The `count` points of the mesh nearest to this one, the nearest first, or all points if the mesh has
  /// fewer. Only points of cells count, and none whose position is not a number. Decodes only charts that may
  /// have one of them.
  [[nodiscard]] Result<std::vector<NearPoint>> nearest_points(const Vector3& point, uint64_t count);
  /// What hangs together with a point of a chart of level 0; for a face take any of its corners. Decodes the
  /// charts that it reaches, and those whose boxes touch it, each once. Takes 4 bytes for each of their
  /// cells; errors: usage (no such point), memory_bound (DecodeOptions::limits.mesh_bytes).
  [[nodiscard]] Result<Component> component(const ChartPlace& chart, uint32_t point);
  /// As one mesh, bit for bit as in the original.
  [[nodiscard]] Result<Mesh> extract(const Component& component);

 private:
  struct State;
  explicit File(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// The faces of a mesh that have a point in the region, with the points they use, arrays following; all else
/// falls away. Faces are kept whole, not cut at the region's border, and keep their order. A region without
/// limits has all of the mesh, also points of no face. The mesh must be valid.
Mesh clip(const Mesh& mesh, const Region& region);

/// NVIDIA recommends 64 points and at most 126 triangles for mesh shaders (Kubisch 2018); 124 is the multiple
/// of 4 below.
inline constexpr uint32_t most_meshlet_points = 64;
inline constexpr uint32_t most_meshlet_triangles = 124;

/// Triangles of a chart in small pieces for a renderer, each of at most 64 points and 124 triangles. Each
/// triangle (polygons as fans) is in one piece, its corners in their order; lines and points are in none.
/// No piece is empty, pieces are made of triangles that share sides as far as there are such, and the same
/// chart always gives the same pieces.
struct Meshlets {
  struct Piece {
    uint32_t first_point = 0, points = 0;        ///< in `points`
    uint32_t first_triangle = 0, triangles = 0;  ///< in `corners`, three each, and `faces`
  };
  std::vector<Piece> pieces;
  std::vector<uint32_t> points;  ///< of the mesh
  std::vector<uint8_t> corners;  ///< places in the points of the piece
  std::vector<uint32_t> faces;   ///< by triangle: the cell of the mesh, numbered through its blocks
};
Meshlets meshlets(const Mesh& mesh);

}  // namespace maille
