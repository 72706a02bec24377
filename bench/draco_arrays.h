#pragma once

#include <maille/mesh.h>
#include <cstdint>
#include <optional>

namespace maille::bench {

/// Bytes that Draco's best takes for texture coordinates on a lattice of 12 bits beside positions of 14 and
/// normals of 10: those of the file, less those of the file without them. Polygons are cut into fans, and
/// points whose values are equal become one, as Draco's readers have it. None where Draco fails.
std::optional<uint64_t> draco_texture_bytes(const Mesh& mesh);

}  // namespace maille::bench
