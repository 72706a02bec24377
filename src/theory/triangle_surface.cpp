#include "theory/triangle_surface.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/result.h"
#include "numbers/number_map.h"

namespace maille {

namespace {

std::string edge_name(const TriangleSurface& surface, uint32_t h) {
  return "the edge between points " + std::to_string(surface.origin(h)) + " and " +
         std::to_string(surface.target(h));
}

/// Half-edges by the smaller point of their edge: those of point v are places[v] to places[v + 1]. Sorting by
/// counting, which is linear.
struct Buckets {
  explicit Buckets(const TriangleSurface& surface)
      : places(surface.points.size() + 1), members(surface.half_edges()) {
    const auto smaller = [&](uint32_t h) { return std::min(surface.origin(h), surface.target(h)); };
    for (uint32_t h = 0; h < surface.half_edges(); ++h) ++places[smaller(h) + 1];
    for (size_t v = 1; v < places.size(); ++v) places[v] += places[v - 1];
    std::vector<uint32_t> next(places.begin(), places.end() - 1);
    for (uint32_t h = 0; h < surface.half_edges(); ++h) members[next[smaller(h)]++] = h;
  }
  std::vector<uint32_t> places;
  std::vector<uint32_t> members;
};

/// Glues the half-edges around one point, sorted by their other point; among equals by number, so that errors
/// name the same edge everywhere.
Result<> glue_bucket(TriangleSurface& surface, std::span<uint32_t> members) {
  const auto larger = [&](uint32_t h) { return std::max(surface.origin(h), surface.target(h)); };
  std::sort(members.begin(), members.end(),
            [&](uint32_t a, uint32_t b) { return std::pair(larger(a), a) < std::pair(larger(b), b); });
  for (size_t first = 0, end = 0; first < members.size(); first = end) {
    while (end < members.size() && larger(members[end]) == larger(members[first])) ++end;
    const uint32_t a = members[first];
    if (end - first == 1) continue;
    if (end - first > 2) {
      return failure(ErrorCode::malformed_input, edge_name(surface, a) + " belongs to " +
                                                     std::to_string(end - first) +
                                                     " triangles; only surfaces can be subdivided");
    }
    const uint32_t b = members[first + 1];
    if (surface.origin(a) == surface.origin(b)) {
      return failure(ErrorCode::malformed_input,
                     edge_name(surface, a) + " has two triangles that disagree on which side is up");
    }
    surface.opposite[a] = b;
    surface.opposite[b] = a;
  }
  return {};
}

/// Errors name block and cell, as a user would look for them.
Result<> append_triangles(const CellBlock& block, size_t number, std::vector<uint32_t>& corners) {
  const auto complain = [&](uint64_t cell, const std::string& what) {
    return failure(ErrorCode::malformed_input, "block " + std::to_string(number) + ", cell " +
                                                   std::to_string(cell) + " " + what +
                                                   "; only triangles can be subdivided");
  };
  for (uint64_t i = 0; i < block.size(); ++i) {
    const std::span<const uint32_t> cell = block.cell(i);
    const CellType type = block.type == CellType::mixed ? static_cast<CellType>(block.types[i]) : block.type;
    if (!is_face(type)) return complain(i, std::string("is a ") + name_of(type));
    if (cell.size() != 3) return complain(i, "has " + std::to_string(cell.size()) + " corners");
    if (cell[0] == cell[1] || cell[1] == cell[2] || cell[2] == cell[0])
      return complain(i, "has the same point twice");
    corners.insert(corners.end(), cell.begin(), cell.end());
  }
  return {};
}

Result<> read_points(const Mesh& mesh, std::vector<Position>& points) {
  const size_t size = size_of(mesh.points.type);
  points.resize(mesh.point_count());
  for (size_t i = 0; i < points.size(); ++i) {
    for (size_t k = 0; k < 3; ++k) {
      points[i][k] = number_as_double(mesh.points.type, mesh.points.bytes.data() + (3 * i + k) * size);
      if (!std::isfinite(points[i][k])) {
        return failure(ErrorCode::malformed_input, "point " + std::to_string(i) +
                                                       " is not finite; nothing can be "
                                                       "predicted from it");
      }
    }
  }
  return {};
}

}  // namespace

Result<> find_opposites(TriangleSurface& surface) {
  surface.opposite.assign(surface.corners.size(), TriangleSurface::border);
  Buckets buckets(surface);
  for (size_t v = 0; v + 1 < buckets.places.size(); ++v) {
    const std::span<uint32_t> all(buckets.members);
    MAILLE_CHECK(
        glue_bucket(surface, all.subspan(buckets.places[v], buckets.places[v + 1] - buckets.places[v])));
  }
  return {};
}

Result<TriangleSurface> triangle_surface(const Mesh& mesh) {
  MAILLE_CHECK(validate(mesh));
  if (mesh.points.components != 3)
    return failure(ErrorCode::malformed_input, "points have no three coordinates");
  TriangleSurface surface;
  MAILLE_CHECK(read_points(mesh, surface.points));
  for (size_t i = 0; i < mesh.blocks.size(); ++i)
    MAILLE_CHECK(append_triangles(mesh.blocks[i], i, surface.corners));
  if (surface.corners.size() >= TriangleSurface::border) {
    return failure(ErrorCode::usage, "the mesh has more triangles than can be subdivided");
  }
  MAILLE_CHECK(find_opposites(surface));
  return surface;
}

}  // namespace maille
