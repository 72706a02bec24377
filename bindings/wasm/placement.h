#pragma once

#include <maille/mesh.h>

#include <span>
#include <vector>

#include "drawable.h"

namespace maille::wasm {

/// Origin and positions of what is drawn: vertex i is at the tuple tuples[i] of `positions`; no list: at
/// tuple i.
void place(const Array& positions, std::span<const uint32_t> tuples, Drawable& drawable);

}  // namespace maille::wasm
