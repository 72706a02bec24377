#include "draco_arrays.h"

#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <algorithm>
#include <array>
#include <vector>

namespace maille::bench {
namespace {

using Attribute = draco::GeometryAttribute;

struct Corner {
  uint64_t index;  ///< among the entries of the connectivity
  uint32_t point;
};
using Triangle = std::array<Corner, 3>;

std::vector<Triangle> triangles_of(const Mesh& mesh) {
  std::vector<Triangle> triangles;
  uint64_t first = 0;
  for (const CellBlock& block : mesh.blocks) {
    for (uint64_t i = 0; i < block.size(); ++i) {
      const auto face = block.cell(i);
      const auto corner = [&](uint64_t k) { return Corner{first + k, face[k]}; };
      for (uint64_t k = 2; is_face(block.type) && k < face.size(); ++k)
        triangles.push_back({corner(0), corner(k - 1), corner(k)});
      first += face.size();
    }
  }
  return triangles;
}

/// The numbers of an array as floats, for a corner of a triangle.
class Floats {
 public:
  explicit Floats(const Array& array) : array_(array) {
    if (array.type == Scalar::f64) {
      values_.assign(array.values<double>().begin(), array.values<double>().end());
    } else {
      values_.assign(array.values<float>().begin(), array.values<float>().end());
    }
  }
  const float* at(const Corner& corner) const {
    return &values_[(array_.domain == Domain::corner ? corner.index : corner.point) * array_.components];
  }

 private:
  const Array& array_;
  std::vector<float> values_;
};

void add(draco::TriangleSoupMeshBuilder& builder, const std::vector<Triangle>& triangles, const Array& array,
         Attribute::Type type) {
  const Floats floats(array);
  const int id = builder.AddAttribute(type, static_cast<int8_t>(array.components), draco::DT_FLOAT32);
  for (uint32_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    builder.SetAttributeValuesForFace(id, draco::FaceIndex(i), floats.at(t[0]), floats.at(t[1]),
                                      floats.at(t[2]));
  }
}

bool usable(const Array& array) {
  return is_float(array.type) && (array.domain == Domain::point || array.domain == Domain::corner);
}

std::optional<uint64_t> draco_bytes(const Mesh& mesh, bool with_textures) {
  const std::vector<Triangle> triangles = triangles_of(mesh);
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(static_cast<int>(triangles.size()));
  add(builder, triangles, mesh.points, Attribute::POSITION);
  for (const Array& array : mesh.arrays) {
    if (!usable(array)) continue;
    if (array.role == Role::normal && array.components == 3)
      add(builder, triangles, array, Attribute::NORMAL);
    if (array.role == Role::texture_coordinate && array.components == 2 && with_textures)
      add(builder, triangles, array, Attribute::TEX_COORD);
  }
  const auto built = builder.Finalize();
  if (!built) return {};
  draco::Encoder encoder;
  encoder.SetSpeedOptions(0, 0);
  encoder.SetAttributeQuantization(Attribute::POSITION, 14);
  encoder.SetAttributeQuantization(Attribute::NORMAL, 10);
  encoder.SetAttributeQuantization(Attribute::TEX_COORD, 12);
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeMeshToBuffer(*built, &buffer).ok()) return {};
  return buffer.size();
}

}  // namespace

std::optional<uint64_t> draco_texture_bytes(const Mesh& mesh) {
  if (!is_float(mesh.points.type)) return {};
  const auto with = draco_bytes(mesh, true), without = draco_bytes(mesh, false);
  if (!with || !without || *with <= *without) return {};
  return *with - *without;
}

}  // namespace maille::bench
