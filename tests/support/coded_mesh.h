#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "support/shapes.h"
#include "surface/arrays/array_coder.h"
#include "surface/arrays/surface_normals.h"
#include "surface/patch_topology.h"

// For tests of the surface codec: meshes as the coders of arrays see them, positions, comparison of numbers
// in coded order.

namespace maille::testing {

/// A mesh as arrays see it.
struct CodedMesh {
  Mesh mesh;
  EncodedTopology encoded;
  std::vector<Vector3> positions;

  explicit CodedMesh(Mesh from) : mesh(std::move(from)) {
    auto topology = encode_topology(mesh);
    EXPECT_TRUE(topology) << topology.error().message;
    if (topology) encoded = std::move(*topology);
    find_corner_sources(mesh, encoded);
    const auto maps = choose_maps(mesh.points, {}, true);
    if (maps) positions = decoded_positions(mesh.points, *maps, encoded.sources.points);
  }
  PatchElements elements() const {
    PatchElements elements = encoded.topology.elements();
    elements.positions = positions;
    return elements;
  }
  /// Tuples of the mesh in coded order.
  std::vector<uint32_t> sources(const Array& array) const {
    if (array.domain == Domain::point) return encoded.sources.points;
    if (array.domain == Domain::cell) return encoded.sources.cells;
    if (array.domain == Domain::corner) return encoded.sources.corners;
    std::vector<uint32_t> all(array.count());
    for (uint32_t i = 0; i < all.size(); ++i) all[i] = i;
    return all;
  }
};

inline Array positions(Scalar type, size_t points) {
  Array array = make_array("position", Domain::point, type, 3);
  array.resize(points);
  return array;
}

/// Those of a shape, scaled.
inline Array smooth(const Surface& shape, double scale) {
  Array array = positions(Scalar::f32, shape.points.size());
  for (size_t i = 0; i < shape.points.size(); ++i) {
    for (size_t k = 0; k < 3; ++k)
      array.values<float>()[3 * i + k] = static_cast<float>(scale * shape.points[i][k]);
  }
  return array;
}

/// Which point differs; those of a lattice are to lie on it. Empty when none does.
inline std::string difference(const Array& array, const ArrayMaps& maps, const std::vector<uint32_t>& sources,
                              const Array& decoded) {
  if (decoded.count() != array.count()) return "another number of points";
  const size_t size = size_of(array.type);
  for (size_t i = 0; i < 3 * sources.size(); ++i) {
    const std::byte* number = array.bytes.data() + (size_t{3} * sources[i / 3] + i % 3) * size;
    std::vector<std::byte> wanted(number, number + size);
    const NumberMap& map = maps.maps[i % 3];
    const uint64_t stored = uint64_t{3} * sources[i / 3] + i % 3;
    const bool exception = std::binary_search(maps.exceptions.begin(), maps.exceptions.end(), stored);
    if (!maps.lossless && !exception)
      map.store_number(array.type, map.code_of(array.type, number), wanted.data());
    if (std::memcmp(wanted.data(), decoded.bytes.data() + i * size, size) != 0)
      return "point " + std::to_string(i / 3) + " differs";
  }
  return {};
}

}  // namespace maille::testing
