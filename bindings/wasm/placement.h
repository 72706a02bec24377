#pragma once

#include <maille/mesh.h>

#include <optional>
#include <span>
#include <vector>

#include "drawable.h"

namespace maille::wasm {

/// Origin and positions of what is drawn: vertex i is at the tuple tuples[i] of `positions`; no list: at
/// tuple i. Without an origin it is the first vertex.
void place(const Array& positions, std::span<const uint32_t> tuples, const std::optional<Vector3>& origin,
           Drawable& drawable);

}  // namespace maille::wasm
