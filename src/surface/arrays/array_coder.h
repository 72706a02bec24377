#pragma once

#include <maille/mesh.h>

#include <cstdint>
#include <span>
#include <vector>

#include "base/pace.h"
#include "numbers/number_map.h"
#include "surface/patch_surface.h"
#include "surface/vector3.h"

namespace maille {

struct FanSurface;
class ArrayAround;

/// The elements of a patch that arrays belong to, in coded order: first those of the surface, then the
/// others.
///   points:  those of the surface, then points that only loose cells use, or none
///   cells:   the faces of the surface, then loose cells
///   corners: by half-edge of the surface (border triangles leave gaps), then those of loose cells
struct PatchElements {
  const PatchSurface* surface = nullptr;
  uint32_t points = 0;
  uint32_t loose_cells = 0;
  uint32_t loose_corners = 0;
  /// By face of the surface: was it turned over? Empty or nullptr: none was.
  const std::vector<bool>* flipped = nullptr;
  /// Of the points as they were decoded, finite; empty while these are coded themselves.
  std::span<const Vector3> positions = {};
  /// By corner: corners of a vertex with one number have the same tuple. Empty: nothing is known of them.
  std::span<const uint32_t> twins = {};
  /// The faces where they were coded as fans; what half-edges say is not asked then, but for normals.
  const FanSurface* fans = nullptr;
  /// What arrays of one patch need again and again.
  ArrayAround* around = nullptr;

  uint32_t cells() const { return surface->face_count + loose_cells; }
  uint32_t corners() const;
  uint32_t count(Domain domain) const;
};

/// Codes an array whose tuples are numbered as in PatchElements: `source` gives for each of them its tuple in
/// the array, none for gaps. Normals are coded by the surface where that is smaller. `mixed`: an array that
/// is like positions is mixed (MixedPositionCoder). `pace` is told of elements and may stop it, which the
/// caller must ask; the bytes are of no use then.
std::vector<std::byte> encode_array(const PatchElements& elements, const Array& array, const ArrayMaps& maps,
                                    std::span<const uint32_t> source, bool mixed, Pace* pace = nullptr);

/// Inverse: fills `array.bytes` with tuples numbered as in PatchElements (gaps are zero). The array's
/// description (domain, type, components) is known; for Domain::mesh so is its count. Safe on any bytes.
/// Errors: corrupt, cancelled.
Result<> decode_array(const PatchElements& elements, Bytes bytes, uint64_t mesh_tuples, Array& array,
                      Pace* pace = nullptr);

}  // namespace maille
