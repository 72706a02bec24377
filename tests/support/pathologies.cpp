#include "support/pathologies.h"

#include <algorithm>
#include <map>

namespace maille::testing {

namespace {

using Face = std::vector<uint32_t>;

uint32_t point_count(const Surface& surface) {
  return static_cast<uint32_t>(surface.points.size());
}

Face& any_face(Surface& surface, Random& random) {
  return surface.faces[random.below(surface.faces.size())];
}

uint32_t any_point(const Surface& surface, Random& random) {
  return random.below(surface.points.size());
}

uint32_t add_point(Surface& surface, Random& random) {
  surface.points.push_back({random.unit() * 9, random.unit() * 9, random.unit() * 9});
  return point_count(surface) - 1;
}

Surface soup(Random& random, uint32_t faces) {
  Surface surface;
  for (uint32_t i = 0; i < faces; ++i) {
    Face face(random.between(3, 6));
    for (uint32_t& point : face) point = add_point(surface, random);
    surface.faces.push_back(std::move(face));
  }
  return surface;
}

/// Faces over points drawn at random: everything non-manifold at once.
Surface random_indices(Random& random, uint32_t faces) {
  Surface surface;
  const uint32_t points = random.between(1, faces + 3);
  for (uint32_t i = 0; i < points; ++i) add_point(surface, random);
  for (uint32_t i = 0; i < faces; ++i) {
    Face face(random.chance(70) ? 3 : random.between(3, 7));
    for (uint32_t& point : face) point = any_point(surface, random);
    // A face that visits a point twice comes only from mutilate(): it can be switched off there.
    std::sort(face.begin(), face.end());
    face.erase(std::unique(face.begin(), face.end()), face.end());
    if (face.size() < 3) continue;
    shuffle(face, random);
    surface.faces.push_back(std::move(face));
  }
  return surface;
}

Surface random_voxels(Random& random, uint32_t faces) {
  const uint32_t n = faces < 30 ? 2 : 3;
  std::vector<bool> set(size_t{n} * n * n);
  const unsigned density = random.between(20, 80);
  for (size_t i = 0; i < set.size(); ++i) set[i] = random.chance(density);
  return shapes::voxels(set, n, n, n);
}

Surface one_polygon(Random& random) {
  Surface surface;
  Face face(random.between(3, 40));
  for (uint32_t& point : face) point = add_point(surface, random);
  surface.faces.push_back(std::move(face));
  return surface;
}

Surface only_points(Random& random) {
  Surface surface;
  for (uint32_t i = random.chance(50) ? 0 : random.between(1, 5); i > 0; --i) add_point(surface, random);
  return surface;
}

Surface single_shape(Random& random, uint32_t faces) {
  uint32_t side = 1;
  while ((side + 1) * (side + 1) <= faces) ++side;
  const uint32_t n = random.between(1, side);
  const uint32_t m = std::max(1u, faces / (2 * n));
  switch (random.below(16)) {
    case 0:
      return shapes::grid(n, m);
    case 1:
      return shapes::torus(std::max(n, 3u), std::max(m, 3u));
    case 2:
      return shapes::torus(n, m);  // narrow ones are glued to themselves
    case 3:
      return shapes::sphere(std::max(n, 3u), std::max(2u, m / 2));
    case 4:
      return shapes::plate(random.below(4));
    case 5:
      return random_voxels(random, faces);
    case 6:
      return shapes::moebius(std::max(m, 3u), n);
    case 7:
      return shapes::klein_bottle(std::max(n, 3u), std::max(m, 3u));
    case 8:
      return shapes::cylinder(std::max(m, 3u), n);
    case 9:
      return shapes::fan(std::max(3u, faces / 2), random.chance(50));
    case 10:
      return shapes::book(random.between(3, 6));
    case 11:
      return shapes::tetrahedron();
    case 12:
      return soup(random, std::max(1u, faces / 4));
    case 13:
      return random_indices(random, std::max(1u, faces / 2));
    case 14:
      return one_polygon(random);
    default:
      return only_points(random);
  }
}

/// Joins two faces along the edge (a, b) that one runs forwards and the other backwards.
bool join(const Face& forward, const Face& backward, uint32_t a, uint32_t b, Face& joined) {
  const auto turned = [](Face face, uint32_t first) {
    std::rotate(face.begin(), std::find(face.begin(), face.end(), first), face.end());
    return face;
  };
  const Face one = turned(forward, b);   // b ... a
  const Face two = turned(backward, a);  // a ... b
  if (one.back() != a || two.back() != b) return false;
  joined = one;
  joined.insert(joined.end(), two.begin() + 1, two.end() - 1);
  return joined.size() >= 3;
}

void join_neighbours(Surface& surface, Random& random, unsigned percent) {
  std::map<std::pair<uint32_t, uint32_t>, size_t> edges;
  for (size_t f = 0; f < surface.faces.size(); ++f) {
    const Face& face = surface.faces[f];
    for (size_t i = 0; i < face.size(); ++i) edges[{face[i], face[(i + 1) % face.size()]}] = f;
  }
  std::vector<bool> used(surface.faces.size(), false);
  std::vector<Face> faces;
  for (const auto& [edge, f] : edges) {
    const auto other = edges.find({edge.second, edge.first});
    if (other == edges.end() || used[f] || used[other->second] || other->second == f ||
        !random.chance(percent))
      continue;
    Face joined;
    if (!join(surface.faces[f], surface.faces[other->second], edge.first, edge.second, joined)) continue;
    used[f] = used[other->second] = true;
    faces.push_back(std::move(joined));
  }
  for (size_t f = 0; f < surface.faces.size(); ++f) {
    if (!used[f]) faces.push_back(surface.faces[f]);
  }
  surface.faces = std::move(faces);
}

void cut_by_diagonals(Surface& surface, Random& random, unsigned percent) {
  const size_t count = surface.faces.size();
  for (size_t f = 0; f < count; ++f) {
    if (surface.faces[f].size() < 4 || !random.chance(percent)) continue;
    Face& face = surface.faces[f];
    std::rotate(face.begin(), face.begin() + random.below(face.size()), face.end());
    const auto cut = static_cast<std::ptrdiff_t>(random.between(2, static_cast<uint32_t>(face.size()) - 2));
    Face rest(face.begin() + cut, face.end());
    rest.push_back(face[0]);
    face.resize(static_cast<size_t>(cut) + 1);
    surface.faces.push_back(std::move(rest));
  }
}

void remove_faces(Surface& surface, Random& random) {
  const unsigned percent = random.between(2, 30);
  std::erase_if(surface.faces, [&](const Face&) { return random.chance(percent); });
}

void flip_faces(Surface& surface, Random& random) {
  const unsigned percent = random.chance(50) ? 50 : random.between(1, 20);
  for (Face& face : surface.faces) {
    if (random.chance(percent)) std::reverse(face.begin(), face.end());
  }
}

void duplicate_faces(Surface& surface, Random& random) {
  for (uint32_t i = random.between(1, 4); i > 0; --i) {
    Face face = any_face(surface, random);
    if (face.size() > 1 && random.chance(50)) {
      std::rotate(face.begin(), face.begin() + random.below(face.size()), face.end());
    }
    if (random.chance(30)) std::reverse(face.begin(), face.end());
    surface.faces.push_back(std::move(face));
  }
}

/// 1 to 4 more faces on an edge that has one already, some on new points, some between old ones.
void glue_to_edges(Surface& surface, Random& random) {
  for (uint32_t i = random.between(1, 5); i > 0; --i) {
    const Face face = any_face(surface, random);
    if (face.size() < 2) continue;
    const size_t at = random.below(face.size());
    uint32_t a = face[at], b = face[(at + 1) % face.size()];
    for (uint32_t k = random.between(1, 4); k > 0; --k) {
      const uint32_t tip = random.chance(60) ? add_point(surface, random) : any_point(surface, random);
      if (tip == a || tip == b || a == b) continue;
      if (random.chance(50)) std::swap(a, b);
      surface.faces.push_back({a, b, tip});
    }
  }
}

/// Bow ties: triangles that meet the rest in one point only, and shapes that hang on one point.
void glue_to_points(Surface& surface, Random& random) {
  for (uint32_t i = random.between(1, 4); i > 0; --i) {
    const uint32_t centre = any_point(surface, random);
    for (uint32_t k = random.between(1, 3); k > 0; --k) {
      const uint32_t a = add_point(surface, random);
      surface.faces.push_back({centre, a, add_point(surface, random)});
    }
  }
}

/// Every use of one point becomes another: pinches, handles, edges with many faces. Faces that would visit a
/// point twice stay as they are unless `degenerate`.
void merge_points(Surface& surface, Random& random, bool degenerate) {
  for (uint32_t i = random.between(1, 3); i > 0; --i) {
    const uint32_t from = any_point(surface, random);
    const uint32_t to = any_point(surface, random);
    for (Face& face : surface.faces) {
      if (!degenerate && std::find(face.begin(), face.end(), to) != face.end()) continue;
      std::replace(face.begin(), face.end(), from, to);
    }
  }
}

void isolate_points(Surface& surface, Random& random) {
  for (uint32_t i = random.between(1, 6); i > 0; --i) {
    if (random.chance(50) && !surface.points.empty()) {
      const auto copy = surface.points[any_point(surface, random)];
      surface.points.push_back(copy);
    } else {
      add_point(surface, random);
    }
  }
}

void duplicate_positions(Surface& surface, Random& random) {
  const unsigned percent = random.chance(20) ? 100 : random.between(2, 40);
  for (auto& point : surface.points) {
    if (random.chance(percent)) point = surface.points[random.chance(50) ? 0 : any_point(surface, random)];
  }
}

/// Faces get corners of their own: cracks with equal positions, as in unwelded files.
void split_points(Surface& surface, Random& random) {
  const unsigned percent = random.between(2, 30);
  for (Face& face : surface.faces) {
    for (uint32_t& point : face) {
      if (!random.chance(percent)) continue;
      const auto copy = surface.points[point];
      surface.points.push_back(copy);
      point = point_count(surface) - 1;
    }
  }
}

void repeat_corners(Surface& surface, Random& random) {
  for (uint32_t i = random.between(1, 4); i > 0; --i) {
    Face& face = any_face(surface, random);
    if (face.empty()) continue;
    const uint32_t again = face[random.below(face.size())];
    face.insert(face.begin() + random.below(face.size() + 1), again);
  }
}

/// 0, 1 and 2 corners, one point many times, a b a, a b a c, two loops joined by a bridge.
void add_degenerate(Surface& surface, Random& random) {
  for (uint32_t i = random.between(1, 4); i > 0; --i) {
    const uint32_t a = any_point(surface, random), b = any_point(surface, random),
                   c = any_point(surface, random);
    const uint32_t d = any_point(surface, random);
    const Face choices[] = {{},
                            {a},
                            {a, b},
                            {a, a},
                            {a, a, a},
                            {a, b, a},
                            {a, b, a, c},
                            {a, b, c, a, b, c},
                            {a, b, c, d, c, b},
                            {a, a, b, b, c, c},
                            {a, b, c, a, d, b}};
    surface.faces.push_back(choices[random.below(std::size(choices))]);
  }
}

/// Midpoints on edges of one side only: T-junctions, polygons with straight angles.
void add_midpoints(Surface& surface, Random& random) {
  for (uint32_t i = random.between(1, 12); i > 0; --i) {
    Face& face = any_face(surface, random);
    if (face.size() < 2) continue;
    const size_t at = random.below(face.size());
    const auto p = surface.points[face[at]], q = surface.points[face[(at + 1) % face.size()]];
    surface.points.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
    face.insert(face.begin() + static_cast<std::ptrdiff_t>(at) + 1, point_count(surface) - 1);
  }
}

/// The whole surface once more: beside itself, or on the same points or positions.
void repeat_all(Surface& surface, Random& random) {
  if (surface.faces.size() > 400) return;
  switch (random.below(3)) {
    case 0:
      append(surface, Surface(surface), {20, 0, 0});
      break;
    case 1:
      append(surface, Surface(surface));
      break;
    default: {
      const std::vector<Face> faces = surface.faces;
      surface.faces.insert(surface.faces.end(), faces.begin(), faces.end());
    }
  }
}

}  // namespace

Surface random_shape(Random& random, uint32_t faces) {
  Surface surface = single_shape(random, faces);
  if (!random.chance(30)) return surface;
  for (uint32_t i = random.between(1, 4); i > 0; --i) {
    append(surface, single_shape(random, std::max(1u, faces / 4)), {double(12 * i), 0, 0});
  }
  return surface;
}

void vary_degrees(Surface& surface, Random& random) {
  for (uint32_t i = random.below(4); i > 0; --i) {
    if (random.chance(50)) {
      join_neighbours(surface, random, random.between(5, 60));
    } else {
      cut_by_diagonals(surface, random, random.chance(30) ? 100 : random.between(5, 60));
    }
  }
}

void mutilate(Surface& surface, Random& random, bool degenerate_faces) {
  for (uint32_t i = random.chance(25) ? random.between(3, 8) : random.between(1, 2); i > 0; --i) {
    if (surface.points.empty() || surface.faces.empty()) return isolate_points(surface, random);
    switch (random.below(degenerate_faces ? 14 : 12)) {
      case 0:
        remove_faces(surface, random);
        break;
      case 1:
        flip_faces(surface, random);
        break;
      case 2:
        duplicate_faces(surface, random);
        break;
      case 3:
        glue_to_edges(surface, random);
        break;
      case 4:
        glue_to_points(surface, random);
        break;
      case 5:
        merge_points(surface, random, degenerate_faces && random.chance(50));
        break;
      case 6:
        isolate_points(surface, random);
        break;
      case 7:
        duplicate_positions(surface, random);
        break;
      case 8:
        split_points(surface, random);
        break;
      case 9:
        add_midpoints(surface, random);
        break;
      case 10:
        repeat_all(surface, random);
        break;
      case 11:
        append(surface, single_shape(random, 12));
        break;
      case 12:
        repeat_corners(surface, random);
        break;
      default:
        add_degenerate(surface, random);
    }
  }
}

}  // namespace maille::testing
