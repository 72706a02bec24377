#pragma once

#include <maille/mesh.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace maille {

/// The upper three rows of an affine map; [row][column], the last column moves. In doubles: chains of nodes
/// multiply.
struct GltfAffine {
  std::array<std::array<double, 4>, 3> m = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

  GltfAffine operator*(const GltfAffine& inner) const {
    GltfAffine product;
    for (size_t i = 0; i < 3; ++i) {
      for (size_t k = 0; k < 4; ++k) {
        product.m[i][k] = k == 3 ? m[i][3] : 0;
        for (size_t j = 0; j < 3; ++j) product.m[i][k] += m[i][j] * inner.m[j][k];
      }
    }
    return product;
  }
  bool is_identity() const { return m == GltfAffine().m; }
  double determinant() const {
    return m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
  }
  /// Cofactors turn normals as the inverse transposed does, up to their length and the determinant's sign:
  /// the inverse transposed is the matrix of cofactors divided by the determinant, which may be 0.
  double cofactor(size_t i, size_t k) const {
    const size_t i1 = (i + 1) % 3, i2 = (i + 2) % 3, k1 = (k + 1) % 3, k2 = (k + 2) % 3;
    return m[i1][k1] * m[i2][k2] - m[i1][k2] * m[i2][k1];
  }
};

/// A mesh of the asset at one place of the scene.
struct GltfInstance {
  size_t mesh = 0;
  GltfAffine transform;
  std::string name;  ///< of the node
};

/// What the metadata of a mesh say about the scene it was read from.
struct GltfScene {
  std::vector<std::vector<size_t>> meshes;  ///< blocks of each
  std::vector<GltfInstance> instances;
};
/// Without a value where there is no scene, or where it is not that of this mesh. Metadata can come from
/// anybody: numbers of meshes are valid, and instances bounded by the nodes.
std::optional<GltfScene> gltf_scene_of(const Mesh& mesh);

}  // namespace maille
