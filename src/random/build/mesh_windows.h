#pragma once

#include <maille/mesh_source.h>
#include <maille/out_of_core.h>

#include <optional>
#include <vector>

#include "random/build/local_positions.h"
#include "random/build/spilled_parts.h"

namespace maille {

/// A mesh that is read in parts, cut into windows that fit into memory: runs along Hilbert's curve with about
/// as many points each. A point belongs to the window where it lies, a face to that of most of its corners.
/// Memory beside a window: two bytes a point, and some bytes for each point that a window has of another.

/// What one window holds, as it was read.
struct LoadedWindow {
  uint32_t number = 0;
  std::vector<std::byte> own, faces, foreign;  ///< records: see WindowLayout
  std::vector<uint32_t> foreign_ids;           ///< rising
  /// By foreign point: the lowest one at its place, and its number among the points there.
  std::vector<uint32_t> foreign_lowest, foreign_copies;
  std::vector<uint32_t> requested_lowest;  ///< what stands for own points that others have, rising
};

/// A window as a mesh: own points, then those of others.
struct WindowMesh {
  Mesh mesh;  ///< one block; arrays of points and cells
  LocalPositions positions;
  std::vector<uint32_t> unused;    ///< points without a face in the whole mesh
  std::vector<uint32_t> ids;       ///< by point: its number in the whole mesh
  std::vector<uint32_t> cell_ids;  ///< by face, if they are kept: its number in the whole mesh
  std::vector<uint32_t> class_of;  ///< by point: the one that stands for all at its place
  std::vector<uint32_t> copies;    ///< by point: its number among those of the same position, bit for bit
  std::vector<uint8_t> outside;    ///< by point: other windows have it
  std::vector<uint8_t> held;       ///< by point: other windows have one that it stands for
};

/// Records of points are number and tuples, of faces number of corners (if it varies), corners, number (if
/// those are kept) and tuples.
struct WindowLayout {
  CellType type = CellType::triangle;
  uint32_t degree = 3;  ///< 0: varies
  bool numbered = false;
  Scalar point_type = Scalar::f32;
  std::vector<Array> arrays;               ///< positions, then those of the mesh; without tuples
  size_t point_bytes = 0, cell_bytes = 0;  ///< of all tuples of a point, of a cell
};

class MeshWindows {
 public:
  /// Reads the mesh three times. `faces`: of a window, about. `numbered`: windows know the numbers of faces.
  static Result<MeshWindows> distribute(MeshSource& mesh, const std::vector<ArrayMaps>& maps, uint64_t faces,
                                        bool numbered, const WorkingSpace& space, const Progress& progress);

  uint32_t count() const { return windows_; }
  const Vector3& origin() const { return origin_; }
  /// The box of all positions, around the origin, and its longest side.
  const Box& box() const { return box_; }
  Result<LoadedWindow> load(uint32_t window);
  /// May run at once for several windows.
  WindowMesh mesh_of(LoadedWindow window) const;
  /// Triangles of the largest window: more than were wished for, where many points lie at few places.
  uint64_t largest() const {
    return corners_.empty() ? 0 : *std::max_element(corners_.begin(), corners_.end()) / 3;
  }
  /// A place on the curve; of anything in the box.
  uint64_t key_of(const Vector3& position) const;
  /// All windows have been loaded: only places on the curve are asked for from here on.
  void let_go() {
    std::vector<uint16_t>().swap(owner_);
    points_.reset();
    faces_.reset();
    foreign_.clear();
    answers_.clear();
  }

 private:
  struct Answer {
    uint32_t id, lowest, copy;
  };
  MeshWindows(MeshSource& mesh, const std::vector<ArrayMaps>& maps) : mesh_(&mesh), maps_(&maps) {}
  Result<> lay_out();
  Result<> measure();
  Result<> cut(uint64_t faces);
  Result<> deal_points(const Progress& progress);
  Result<> deal_faces(const Progress& progress);
  Result<> deal_face(uint64_t face, std::span<const uint64_t> nodes, Bytes tuples,
                     std::vector<std::byte>& record);
  Result<> answer();
  std::vector<uint64_t> keys_of(const Array& positions) const;
  Result<> read_foreign(LoadedWindow& window);
  void add_faces(const LoadedWindow& window, uint32_t own, WindowMesh& made) const;
  void find_identities(const LoadedWindow& window, uint32_t own, WindowMesh& made) const;

  static constexpr uint16_t requested_bit = 0x8000;
  MeshSource* mesh_;
  const std::vector<ArrayMaps>* maps_;
  WindowLayout layout_;
  uint32_t windows_ = 1;
  Vector3 origin_;
  Box box_;
  double scale_ = 0;
  std::vector<uint64_t> cuts_;     ///< where each window but the first begins on the curve
  std::vector<uint64_t> corners_;  ///< by window: of its faces
  std::vector<uint16_t> owner_;    ///< by point: its window
  std::optional<SpilledParts> points_, faces_;
  std::vector<std::vector<uint32_t>> foreign_;  ///< by window: points of others
  std::vector<std::vector<Answer>> answers_;    ///< by window: own points that others have
};

}  // namespace maille
