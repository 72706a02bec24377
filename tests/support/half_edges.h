#pragma once

// For tests of the surface codec: faces from shapes, shapes that are hard to grow over, what every closed
// surface must keep, random bytes.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "support/random.h"
#include "support/shapes.h"
#include "surface/gluing.h"

namespace maille::testing {

/// A voxel with an arm of three on each of its six sides: whatever grows and goes round it has to split.
inline Surface star() {
  std::vector<bool> set(343, false);
  for (size_t i = 0; i < 7; ++i)
    set[i * 49 + 3 * 7 + 3] = set[3 * 49 + i * 7 + 3] = set[3 * 49 + 3 * 7 + i] = true;
  return shapes::voxels(set, 7, 7, 7);
}

/// A grid that lacks five of its quads, two of them side by side.
inline Surface with_holes() {
  Surface surface = shapes::grid(9, 9);
  for (const int hole : {70, 60, 40, 12, 11}) surface.faces.erase(surface.faces.begin() + hole);
  return surface;
}

/// Faces that own their corners. Triangles have no offsets, as in the encoder.
struct FaceList {
  std::vector<uint32_t> corners;
  std::vector<uint32_t> offsets;
  uint32_t points = 0;

  Faces view() const { return {corners, offsets, points}; }
};

inline FaceList face_list(const Surface& surface) {
  FaceList list;
  list.points = static_cast<uint32_t>(surface.points.size());
  list.offsets.push_back(0);
  bool triangles = true;
  for (const auto& face : surface.faces) {
    if (!is_simple(face)) continue;
    list.corners.insert(list.corners.end(), face.begin(), face.end());
    list.offsets.push_back(static_cast<uint32_t>(list.corners.size()));
    triangles = triangles && face.size() == 3;
  }
  if (triangles) list.offsets.clear();
  return list;
}

/// The faces of a mesh's first block.
inline Surface surface_of(const Mesh& mesh) {
  Surface surface;
  surface.points.resize(mesh.point_count());
  if (mesh.blocks.empty()) return surface;
  for (uint64_t i = 0; i < mesh.blocks[0].size(); ++i) {
    const auto face = mesh.blocks[0].cell(i);
    surface.faces.emplace_back(face.begin(), face.end());
  }
  return surface;
}

inline GluedSurface glued(const Surface& surface) {
  const FaceList list = face_list(surface);
  return glue(list.view());
}

/// Every half-edge has an opposite one of another face's side that runs the other way. Empty when all is
/// well.
inline std::string check_closed(const HalfEdges& surface) {
  for (uint32_t h = 0; h < surface.size(); ++h) {
    const std::string where = "half-edge " + std::to_string(h);
    const uint32_t k = surface.opposite[h];
    if (k >= surface.size() || k == h) return where + " has no opposite";
    if (surface.opposite[k] != h) return where + " is not the opposite of its opposite";
    if (surface.origin[surface.next(h)] != surface.origin[k]) return where + " ends elsewhere";
    if (surface.next(surface.previous(h)) != h) return where + " is not behind the one before it";
  }
  for (uint32_t h = 0; h < surface.size(); h += surface.degree(h)) {
    if (surface.degree(h) < 3)
      return "half-edge " + std::to_string(h) + " is in a face of fewer than three edges";
  }
  return {};
}

/// Half-edges of every face, in the order in which faces are stored.
inline std::vector<uint32_t> first_half_edges(const HalfEdges& surface) {
  std::vector<uint32_t> first;
  for (uint32_t h = 0; h < surface.size(); h += surface.degree(h)) first.push_back(h);
  return first;
}

/// Vertices - edges + faces of a closed surface, whose vertices are its cycles of corners: 2 for a sphere, 0
/// for a torus.
inline int64_t euler_characteristic(const HalfEdges& surface) {
  std::vector<bool> seen(surface.size());
  int64_t vertices = 0;
  for (uint32_t h = 0; h < surface.size(); ++h) {
    if (seen[h]) continue;
    ++vertices;
    for (uint32_t e = h; !seen[e]; e = surface.turn(e)) seen[e] = true;
  }
  return vertices - surface.size() / 2 + static_cast<int64_t>(first_half_edges(surface).size());
}

inline std::vector<std::byte> random_bytes(Random& random, size_t count) {
  std::vector<std::byte> bytes(count);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random.below(256));
  return bytes;
}

/// One to three bits flipped.
inline std::vector<std::byte> damaged(std::vector<std::byte> bytes, Random& random) {
  for (uint32_t i = random.between(1, 3); i > 0 && !bytes.empty(); --i) {
    bytes[random.below(bytes.size())] ^= std::byte{1} << random.below(8);
  }
  return bytes;
}

}  // namespace maille::testing
