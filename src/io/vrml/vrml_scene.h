#pragma once

#include <maille/io.h>

#include <array>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace maille {

/// What belongs to the points, corners or faces of a VRML geometry.
enum class VrmlKind : uint8_t { coordinate, normal, colour, texture_coordinate };
inline constexpr size_t vrml_kinds = 4;
inline uint32_t components_of(VrmlKind kind) {
  return kind == VrmlKind::texture_coordinate ? 2 : 3;
}

/// Numbers of a Coordinate, Normal, Color or TextureCoordinate node: f32, or f64 where some node of this kind
/// has numbers that need it.
struct VrmlValues {
  VrmlKind kind = VrmlKind::coordinate;
  Scalar type = Scalar::f32;
  std::vector<std::byte> bytes;
  uint64_t numbers() const { return bytes.size() / size_of(type); }
};

// A geometry as it stands in the file. The arrays are indexed by VrmlKind; a null list of values means the
// file gives none, and an empty index that the order of coordIndex holds.
struct VrmlGeometry {
  enum class Type : uint8_t { faces, lines, points };
  Type type = Type::faces;
  std::string name;
  std::string transform;
  /// Where it begins, for error messages.
  uint64_t line = 0;
  std::array<std::shared_ptr<const VrmlValues>, vrml_kinds> values;
  std::array<std::vector<int32_t>, vrml_kinds> indices;
  std::array<bool, vrml_kinds> per_vertex = {true, true, true, true};
};

struct VrmlScene {
  std::vector<VrmlGeometry> geometries;
  std::map<std::string, uint64_t>
      left_out;                       ///< types of nodes that are shapes, but not of triangles or lines
  std::vector<std::string> textures;  ///< files
  uint64_t reused = 0;                ///< USE of something that holds geometry
  uint64_t clockwise = 0;             ///< geometries with ccw FALSE
  bool transforms = false, materials = false;
};

/// Finds all geometry in a VRML97 text. Errors: malformed_input with the line, unsupported for VRML 1.0 and
/// X3D.
Result<VrmlScene> parse_vrml(std::string_view text, const std::string& file, const ReadOptions& options);

}  // namespace maille
