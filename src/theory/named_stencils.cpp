#include "theory/named_stencils.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace maille {

namespace {

using Point = std::vector<double>;

const double pi = std::acos(-1.0);
const double triangle_height = std::sqrt(0.75);

Point on_circle(double radius, double angle) {
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

Point reflected(const Point& point, const Point& a, const Point& b) {
  return {a[0] + b[0] - point[0], a[1] + b[1] - point[1]};
}

void add(Stencil& stencil, std::string label, Point position) {
  stencil.known.push_back({std::move(label), std::move(position)});
}

std::string numbered(const char* letter, size_t number) {
  return letter + std::to_string(number);
}

double squared_distance(const Point& a, const Point& b) {
  double sum = 0;
  for (size_t axis = 0; axis < a.size(); ++axis) sum += (a[axis] - b[axis]) * (a[axis] - b[axis]);
  return sum;
}

/// Edges between all samples that lie 1 apart, which in lattices of triangles, quads and cubes are just their
/// edges. Numbers of samples: known ones, the target, hidden ones.
void join_neighbours(Stencil& stencil) {
  std::vector<Point> points;
  for (const auto& sample : stencil.known) points.push_back(sample.position);
  points.push_back(stencil.target);
  for (const auto& sample : stencil.hidden) points.push_back(sample.position);
  for (uint32_t a = 0; a < points.size(); ++a) {
    for (uint32_t b = a + 1; b < points.size(); ++b) {
      if (std::fabs(squared_distance(points[a], points[b]) - 1) < 1e-6) stencil.edges.emplace_back(a, b);
    }
  }
}

/// Corners of a regular polygon on the edge from `a` to `b` (1 long), to the left of it; a and b come first.
/// Each further edge turns by 360 degrees / degree.
std::vector<Point> polygon_on(const Point& a, const Point& b, unsigned degree) {
  std::vector<Point> corners{a, b};
  double angle = std::atan2(b[1] - a[1], b[0] - a[0]);
  while (corners.size() < degree) {
    angle += 2 * pi / degree;
    const Point& last = corners.back();
    corners.push_back({last[0] + std::cos(angle), last[1] + std::sin(angle)});
  }
  return corners;
}

/// Edges of a cycle through the given samples.
void join_cycle(Stencil& stencil, const std::vector<uint32_t>& cycle) {
  for (size_t i = 0; i < cycle.size(); ++i) {
    const std::pair<uint32_t, uint32_t> edge = std::minmax(cycle[i], cycle[(i + 1) % cycle.size()]);
    if (std::find(stencil.edges.begin(), stencil.edges.end(), edge) == stencil.edges.end()) {
      stencil.edges.push_back(edge);
    }
  }
}

/// The corners after the target of a polygon are hidden: there, but not known. Taylor's rule does not need
/// them, the spectral one does.
void add_hidden(Stencil& stencil, const std::vector<Point>& corners, size_t first, const char* letter) {
  for (size_t i = first; i < corners.size(); ++i) {
    stencil.hidden.push_back({numbered(letter, i), corners[i]});
  }
}

}  // namespace

Stencil parallelogram_stencil() {
  Stencil stencil{"parallelogram", 2, {0, triangle_height}, {}, {}, {}};
  add(stencil, "a", {-0.5, 0});
  add(stencil, "b", {0.5, 0});
  add(stencil, "across", {0, -triangle_height});
  join_neighbours(stencil);
  return stencil;
}

Stencil quad_stencil() {
  Stencil stencil{"quad", 2, {0, 1}, {}, {}, {}};
  add(stencil, "a", {0, 0});
  add(stencil, "b", {1, 0});
  add(stencil, "c", {1, 1});
  join_neighbours(stencil);
  return stencil;
}

/// In a fan of K corners of 360 / K degrees. With valences 3 and 4 the farther neighbours coincide with
/// nearer ones or with each other.
Stencil dual_parallelogram_stencil(unsigned valence) {
  const double angle = 2 * pi / valence;
  Stencil stencil{"dual-parallelogram:" + std::to_string(valence), 2, {1, 0}, {}, {}, {}};
  add(stencil, "focus", {0, 0});
  add(stencil, "l", on_circle(1, angle));
  add(stencil, "k", on_circle(1, -angle));
  if (valence > 3) add(stencil, "o1", on_circle(1, 2 * angle));
  if (valence > 4) add(stencil, "o2", on_circle(1, -2 * angle));
  const auto target = static_cast<uint32_t>(stencil.known.size());
  for (uint32_t i = 1; i <= target; ++i) stencil.edges.emplace_back(0, i);
  stencil.edges.insert(stencil.edges.end(), {{1, target}, {2, target}});
  if (valence == 3) stencil.edges.emplace_back(1, 2);
  if (valence > 3) stencil.edges.emplace_back(1, 3);
  if (valence == 4) stencil.edges.emplace_back(2, 3);
  if (valence > 4) stencil.edges.emplace_back(2, 4);
  if (valence == 5) stencil.edges.emplace_back(3, 4);
  return stencil;
}

/// With the ring at radius 1, an edge of it lies cos(180 / K) from the centre and is 2 sin(180 / K) long:
/// reflected tips lie twice as far, equilateral ones the height of their triangle beyond.
double tip_distance(unsigned valence, Tips tips) {
  const double half_angle = pi / valence;
  if (tips == Tips::reflected) return 2 * std::cos(half_angle);
  return std::cos(half_angle) + std::sqrt(3.0) * std::sin(half_angle);
}

Stencil k_star_stencil(unsigned valence, double tips) {
  Stencil stencil{"k-star:" + std::to_string(valence), 2, {0, 0}, {}, {}, {}};
  for (unsigned i = 0; i < valence; ++i) add(stencil, numbered("r", i), on_circle(1, 2 * pi * i / valence));
  for (uint32_t i = 0; i < valence; ++i) {
    const uint32_t j = (i + 1) % valence;
    add(stencil, numbered("t", i), on_circle(tips, pi * (2 * i + 1) / valence));
    stencil.edges.insert(stencil.edges.end(), {{i, 2 * valence}, {i, j}, {i, valence + i}, {j, valence + i}});
  }
  return stencil;
}

Stencil polygon_stencil(unsigned degree, unsigned known) {
  const std::vector<Point> corners = polygon_on({0, 0}, {1, 0}, degree);
  Stencil stencil{
      "polygon:" + std::to_string(degree) + ":" + std::to_string(known), 2, corners[known], {}, {}, {}};
  for (unsigned i = 0; i < known; ++i) add(stencil, numbered("v", i), corners[i]);
  add_hidden(stencil, corners, known + 1, "v");
  std::vector<uint32_t> cycle;
  for (uint32_t i = 0; i < degree; ++i) cycle.push_back(i);
  join_cycle(stencil, cycle);
  return stencil;
}

Stencil polygon_beside_stencil(unsigned known_degree, unsigned degree, unsigned known) {
  const std::vector<Point> old = polygon_on({0, 0}, {1, 0}, known_degree);
  // The new one lies on the other side of the same edge; after 1 and 0 its corners begin next to corner 0.
  const std::vector<Point> fresh = polygon_on({1, 0}, {0, 0}, degree);
  Stencil stencil{"polygon-beside:" + std::to_string(known_degree) + ":" + std::to_string(degree) + ":" +
                      std::to_string(known),
                  2,
                  fresh[2 + known],
                  {},
                  {},
                  {}};
  for (unsigned i = 0; i < known_degree; ++i) add(stencil, numbered("a", i), old[i]);
  for (unsigned i = 0; i < known; ++i) add(stencil, numbered("b", i), fresh[2 + i]);
  add_hidden(stencil, fresh, 3 + known, "b");
  std::vector<uint32_t> cycle;
  for (uint32_t i = 0; i < known_degree; ++i) cycle.push_back(i);
  join_cycle(stencil, cycle);
  cycle = {1, 0};
  for (uint32_t i = 2; i < degree; ++i) cycle.push_back(known_degree + i - 2);
  join_cycle(stencil, cycle);
  return stencil;
}

/// One | makes it three-dimensional; else positions have two coordinates.
Result<Stencil> grid_stencil(std::string_view picture) {
  Stencil stencil{"grid:" + std::string(picture), 3, {}, {}, {}, {}};
  if (picture.find('|') == std::string_view::npos) stencil.dimension = 2;
  unsigned x = 0, y = 0, z = 0;
  for (const char cell : picture) {
    Point position{double(x), double(y), double(z)};
    position.resize(stencil.dimension);
    const std::string label = "(" + std::to_string(x) + " " + std::to_string(y) +
                              (stencil.dimension == 3 ? " " + std::to_string(z) : "") + ")";
    ++x;
    if (cell == '#') {
      add(stencil, label, position);
    } else if (cell == '.') {
      stencil.hidden.push_back({label, position});
    } else if (cell == 'x' && stencil.target.empty()) {
      stencil.target = position;
    } else if (cell == '/') {
      x = 0, ++y;
    } else if (cell == '|') {
      x = y = 0, ++z;
    } else {
      return failure(ErrorCode::usage,
                     "a grid is drawn with # (known), one x (wanted), . (neither), / between rows "
                     "and | between layers, not '" +
                         std::string(1, cell) + "'");
    }
  }
  if (stencil.target.empty()) return failure(ErrorCode::usage, "the grid has no x, the place that is wanted");
  join_neighbours(stencil);
  return stencil;
}

/// Without edges: these are for Taylor's rule, as the target is no vertex of the lattice.
Stencil butterfly_stencil(unsigned points) {
  const double h = triangle_height;
  Stencil stencil{points == 8 ? "butterfly" : "butterfly-10", 2, {0, 0}, {}, {}, {}};
  add(stencil, "a0", {-0.5, 0});
  add(stencil, "a1", {0.5, 0});
  add(stencil, "b0", {0, h});
  add(stencil, "b1", {0, -h});
  add(stencil, "c0", {-1, h});
  add(stencil, "c1", {1, h});
  add(stencil, "c2", {-1, -h});
  add(stencil, "c3", {1, -h});
  if (points == 10) {
    add(stencil, "d0", {-1.5, 0});
    add(stencil, "d1", {1.5, 0});
  }
  return stencil;
}

/// The centre of the ring is an end of the edge; the target lies half way to ring vertex 0.
Stencil modified_butterfly_stencil(unsigned valence) {
  Stencil stencil{"modified-butterfly:" + std::to_string(valence), 2, {0.5, 0}, {}, {}, {}};
  add(stencil, "centre", {0, 0});
  for (unsigned i = 0; i < valence; ++i) add(stencil, numbered("s", i), on_circle(1, 2 * pi * i / valence));
  return stencil;
}

Stencil sqrt3_stencil(unsigned points) {
  Stencil stencil{points == 12 ? "sqrt3" : "sqrt3-small", 2, {0, 0}, {}, {}, {}};
  const double radius = std::sqrt(1.0 / 3);
  std::vector<Point> corners;
  for (unsigned i = 0; i < 3; ++i) corners.push_back(on_circle(radius, 2 * pi * i / 3));
  for (unsigned i = 0; i < 3; ++i) add(stencil, numbered("a", i), corners[i]);
  for (unsigned i = 0; i < 3; ++i)
    add(stencil, numbered("b", i), on_circle(2 * radius, 2 * pi * i / 3 + pi / 3));
  if (points == 6) return stencil;
  // Beside each tip, across the two outer edges of its triangle.
  for (unsigned i = 0; i < 3; ++i) {
    const unsigned j = (i + 1) % 3;
    const Point tip = stencil.known[3 + i].position;
    add(stencil, numbered("c", 2 * i), reflected(corners[j], corners[i], tip));
    add(stencil, numbered("c", 2 * i + 1), reflected(corners[i], corners[j], tip));
  }
  return stencil;
}

/// The target is as far from the centre as the middle of an equilateral triangle with sides of 1, between
/// ring vertices 0 and 1.
Stencil sqrt3_ring_stencil(unsigned valence) {
  Stencil stencil{
      "sqrt3-ring:" + std::to_string(valence), 2, on_circle(std::sqrt(1.0 / 3), pi / valence), {}, {}, {}};
  add(stencil, "centre", {0, 0});
  for (unsigned i = 0; i < valence; ++i) add(stencil, numbered("s", i), on_circle(1, 2 * pi * i / valence));
  return stencil;
}

/// Corners that are not in the mask are hidden, so that the spectral rule has the whole cube's graph.
Stencil cube_stencil(unsigned mask) {
  Stencil stencil{"cube:" + std::to_string(mask), 3, {0, 0, 0}, {}, {}, {}};
  for (unsigned i = 1; i < 8; ++i) {
    const Stencil::Sample corner{std::to_string(i), {double(i & 1), double(i >> 1 & 1), double(i >> 2)}};
    if ((mask >> i & 1) != 0) stencil.known.push_back(corner);
    if ((mask >> i & 1) == 0) stencil.hidden.push_back(corner);
  }
  join_neighbours(stencil);
  return stencil;
}

/// Two layers of the known hexahedron, at z = -1 and 0, and the new corners at z = 1.
Stencil hexahedron_stencil(unsigned known) {
  // Round the face, so that each new corner but the first has a known neighbour.
  constexpr std::array<std::array<int, 2>, 4> round = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  const auto corner = [&](unsigned i, int z) {
    return Point{double(round[i][0]), double(round[i][1]), double(z)};
  };
  const auto label = [&](unsigned i, const char* layer) {
    return std::to_string(round[i][0]) + std::to_string(round[i][1]) + layer;
  };
  Stencil stencil{"hexahedron:" + std::to_string(known), 3, corner(known, 1), {}, {}, {}};
  for (unsigned i = 0; i < 4; ++i) add(stencil, label(i, "b"), corner(i, -1));
  for (unsigned i = 0; i < 4; ++i) add(stencil, label(i, "0"), corner(i, 0));
  for (unsigned i = 0; i < known; ++i) add(stencil, label(i, "1"), corner(i, 1));
  for (unsigned i = known + 1; i < 4; ++i) stencil.hidden.push_back({label(i, "1"), corner(i, 1)});
  join_neighbours(stencil);
  return stencil;
}

}  // namespace maille
