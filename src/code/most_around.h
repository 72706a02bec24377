#pragma once

namespace maille {

/// How many cells, faces or corners around a point are looked at: time stays linear however many meet there.
/// 80,000 triangles that share nothing but one point took 5.8 s without it. Part of the format; not swept,
/// docs/history.md has 1,024.
inline constexpr unsigned most_around = 64;

}  // namespace maille
