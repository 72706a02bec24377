#pragma once

#include <cstdint>
#include <span>

#include "numbers/shear.h"
#include "surface/fans/fan_connectivity.h"

namespace maille {

/// The shear after which what parallelograms leave of codes is smallest; none if it saves too little.
/// `codes`: of all vertices of the fans, and perhaps of points behind them, `components` (2 to 4) each.
Shear fit_shear(const FanSurface& fans, std::span<const int64_t> codes, unsigned components);

}  // namespace maille
