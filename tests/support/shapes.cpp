#include "support/shapes.h"

#include <maille/with_type.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <type_traits>

#include "support/sine.h"

namespace maille::testing {

namespace {

constexpr double two_pi = 6.283185307179586;

/// Rounded and clamped for integers: converting an out-of-range double would be undefined.
template <class T>
void store_positions(const Surface& surface, Array& array) {
  T* out = array.values<T>().data();
  for (const auto& point : surface.points) {
    for (const double x : point) {
      if constexpr (std::is_floating_point_v<T>) {
        *out++ = static_cast<T>(x);
      } else {
        const double low = std::max(double(std::numeric_limits<T>::lowest()), -9e15);
        const double high = std::min(double(std::numeric_limits<T>::max()), 9e15);
        *out++ = static_cast<T>(std::clamp(std::nearbyint(x), low, high));
      }
    }
  }
}

/// n x m quads over points numbered by `number`, which glues the sides.
template <class Number>
void quads(Surface& surface, uint32_t n, uint32_t m, Number number) {
  for (uint32_t j = 0; j < m; ++j) {
    for (uint32_t i = 0; i < n; ++i) {
      surface.faces.push_back({number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)});
    }
  }
}

}  // namespace

void append(Surface& surface, const Surface& part, std::array<double, 3> offset) {
  const auto first = static_cast<uint32_t>(surface.points.size());
  for (const auto& p : part.points) {
    surface.points.push_back({p[0] + offset[0], p[1] + offset[1], p[2] + offset[2]});
  }
  for (std::vector<uint32_t> face : part.faces) {
    for (uint32_t& point : face) point += first;
    surface.faces.push_back(std::move(face));
  }
}

Surface triangulated(const Surface& surface) {
  Surface result = surface;
  result.faces.clear();
  for (const auto& face : surface.faces) {
    for (size_t i = 2; i < face.size(); ++i) result.faces.push_back({face[0], face[i - 1], face[i]});
  }
  return result;
}

Mesh to_mesh(const Surface& surface, Scalar type) {
  Mesh mesh;
  mesh.points = make_array("position", Domain::point, type, 3);
  mesh.points.resize(surface.points.size());
  with_type(type, [&](auto zero) { store_positions<decltype(zero)>(surface, mesh.points); });
  CellBlock block;
  block.offsets.push_back(0);
  for (const auto& face : surface.faces) {
    block.connectivity.insert(block.connectivity.end(), face.begin(), face.end());
    block.offsets.push_back(block.connectivity.size());
  }
  mesh.blocks.push_back(std::move(block));
  return mesh;
}

namespace shapes {

Surface tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
}

Surface cube() {
  return voxels({true}, 1, 1, 1);
}

Surface grid(uint32_t n, uint32_t m) {
  Surface surface;
  for (uint32_t j = 0; j <= m; ++j) {
    for (uint32_t i = 0; i <= n; ++i)
      surface.points.push_back({double(i), double(j), sine(0.3 * i + 0.2 * j)});
  }
  quads(surface, n, m, [&](uint32_t i, uint32_t j) { return j * (n + 1) + i; });
  return surface;
}

Surface torus(uint32_t n, uint32_t m) {
  Surface surface;
  for (uint32_t j = 0; j < m; ++j) {
    for (uint32_t i = 0; i < n; ++i) {
      const double u = two_pi * i / n;
      const double v = two_pi * j / m;
      const double r = 10 + 4 * cosine(v);
      surface.points.push_back({r * cosine(u), r * sine(u), 4 * sine(v)});
    }
  }
  quads(surface, n, m, [&](uint32_t i, uint32_t j) { return (j % m) * n + i % n; });
  return surface;
}

Surface sphere(uint32_t slices, uint32_t stacks) {
  Surface surface;
  surface.points.push_back({0, 0, 10});
  for (uint32_t j = 1; j < stacks; ++j) {
    for (uint32_t i = 0; i < slices; ++i) {
      const double u = two_pi * i / slices;
      const double v = two_pi / 2 * j / stacks;
      surface.points.push_back({10 * sine(v) * cosine(u), 10 * sine(v) * sine(u), 10 * cosine(v)});
    }
  }
  surface.points.push_back({0, 0, -10});
  const auto last = static_cast<uint32_t>(surface.points.size() - 1);
  const auto ring = [&](uint32_t i, uint32_t j) { return 1 + j * slices + i % slices; };
  for (uint32_t i = 0; i < slices; ++i) surface.faces.push_back({0, ring(i, 0), ring(i + 1, 0)});
  quads(surface, slices, stacks - 2, [&](uint32_t i, uint32_t j) { return ring(slices - i, j); });
  for (uint32_t i = 0; i < slices; ++i) {
    surface.faces.push_back({last, ring(i + 1, stacks - 2), ring(i, stacks - 2)});
  }
  return surface;
}

namespace {

/// Points on a band closed after n steps; `twisted` swaps its two sides there.
Surface band(uint32_t n, uint32_t m, bool twisted) {
  Surface surface;
  for (uint32_t j = 0; j <= m; ++j) {
    for (uint32_t i = 0; i < n; ++i) {
      const double u = two_pi * i / n;
      const double w = m == 0 ? 0 : double(j) / m - 0.5;
      const double r = 5 + (twisted ? w * cosine(u / 2) : 0.0);
      surface.points.push_back({r * cosine(u), r * sine(u), twisted ? w * sine(u / 2) : w});
    }
  }
  quads(surface, n, m,
        [&](uint32_t i, uint32_t j) { return i < n ? j * n + i : (twisted ? m - j : j) * n + (i - n); });
  return surface;
}

}  // namespace

Surface moebius(uint32_t n, uint32_t m) {
  return band(n, m, true);
}

Surface cylinder(uint32_t n, uint32_t m) {
  return band(n, m, false);
}

Surface klein_bottle(uint32_t n, uint32_t m) {
  Surface surface = torus(n, m);
  surface.faces.clear();
  quads(surface, n, m,
        [&](uint32_t i, uint32_t j) { return i < n ? (j % m) * n + i : ((2 * m - j) % m) * n + (i - n); });
  return surface;
}

Surface fan(uint32_t n, bool closed) {
  Surface surface;
  surface.points.push_back({0, 0, 1});
  const uint32_t rim = closed ? n : n + 1;
  for (uint32_t i = 0; i < rim; ++i) {
    const double u = two_pi * i / (n + 1);
    surface.points.push_back({cosine(u), sine(u), 0});
  }
  for (uint32_t i = 0; i < n; ++i) surface.faces.push_back({0, 1 + i, 1 + (i + 1) % rim});
  return surface;
}

Surface book(uint32_t n) {
  Surface surface;
  surface.points = {{0, 0, 0}, {0, 0, 1}};
  for (uint32_t i = 0; i < n; ++i) {
    surface.points.push_back({cosine(double(i)), sine(double(i)), 0.5});
    surface.faces.push_back({0, 1, 2 + i});
  }
  return surface;
}

Surface voxels(const std::vector<bool>& set, uint32_t nx, uint32_t ny, uint32_t nz) {
  const auto filled = [&](int64_t x, int64_t y, int64_t z) {
    if (x < 0 || y < 0 || z < 0 || x >= nx || y >= ny || z >= nz) return false;
    return bool(set[static_cast<size_t>((z * ny + y) * nx + x)]);
  };
  // The corners of a voxel's six sides as bits (x 1, y 2, z 4), counter-clockwise from outside.
  static constexpr struct {
    int dx, dy, dz;
    unsigned corners[4];
  } sides[6] = {{-1, 0, 0, {0, 4, 6, 2}}, {1, 0, 0, {1, 3, 7, 5}},  {0, -1, 0, {0, 1, 5, 4}},
                {0, 1, 0, {2, 6, 7, 3}},  {0, 0, -1, {0, 2, 3, 1}}, {0, 0, 1, {4, 5, 7, 6}}};
  Surface surface;
  std::map<std::array<int64_t, 3>, uint32_t> numbers;
  for (int64_t v = 0; v < int64_t{nx} * ny * nz; ++v) {
    const int64_t x = v % nx, y = v / nx % ny, z = v / nx / ny;
    if (!filled(x, y, z)) continue;
    for (const auto& side : sides) {
      if (filled(x + side.dx, y + side.dy, z + side.dz)) continue;
      std::vector<uint32_t> face;
      for (const unsigned corner : side.corners) {
        const std::array<int64_t, 3> at = {x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)};
        const auto [place, added] = numbers.try_emplace(at, static_cast<uint32_t>(surface.points.size()));
        if (added) surface.points.push_back({double(at[0]), double(at[1]), double(at[2])});
        face.push_back(place->second);
      }
      surface.faces.push_back(std::move(face));
    }
  }
  return surface;
}

Surface plate(uint32_t genus) {
  const uint32_t nx = 2 * genus + 1;
  std::vector<bool> set(size_t{nx} * 3, true);
  for (uint32_t hole = 0; hole < genus; ++hole) set[nx + 2 * hole + 1] = false;
  return voxels(set, nx, 3, 1);
}

}  // namespace shapes

Mesh tetrahedron() {
  return to_mesh(shapes::tetrahedron());
}
Mesh cube() {
  return to_mesh(shapes::cube());
}
Mesh torus(uint32_t n, uint32_t m) {
  return to_mesh(shapes::torus(n, m));
}
Mesh grid(uint32_t n, uint32_t m) {
  return to_mesh(shapes::grid(n, m));
}
Mesh sphere(uint32_t slices, uint32_t stacks) {
  return to_mesh(shapes::sphere(slices, stacks));
}
Mesh moebius(uint32_t n, uint32_t m) {
  return to_mesh(shapes::moebius(n, m));
}

}  // namespace maille::testing
