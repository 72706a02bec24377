#include "surface/front/mirror_images.h"

#include <algorithm>
#include <limits>

namespace maille {
namespace {

struct Pair {
  uint64_t others;  // hash of the codes on the two other axes
  int64_t code;
  bool operator<(const Pair& with) const {
    return others != with.others ? others < with.others : code < with.code;
  }
};

/// The sum of codes that the most pairs of points with the same other codes have, and how many.
template <class Code>
std::pair<int64_t, size_t> commonest_sum(std::span<const Code> codes, unsigned axis) {
  // In longer rows of points that differ on the axis only, images are there by chance: all pairs of a lattice
  // have some. It also bounds the pairs to 2.5 a point. Chosen, not swept.
  constexpr size_t longest_row = 6;
  std::vector<Pair> pairs;
  for (size_t i = 0; i < codes.size(); i += 3) {
    const auto code = [&](unsigned k) { return static_cast<uint64_t>(codes[i + k]); };
    // Two pairs of codes with the same hash would only add a sum that hardly any other pair has.
    const uint64_t others =
        (code((axis + 1) % 3) * 0x9e3779b97f4a7c15u) ^ code((axis + 2) % 3) * 0xc2b2ae3d27d4eb4fu;
    pairs.push_back({others, static_cast<int64_t>(codes[i + axis])});
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<int64_t> sums;
  for (size_t begin = 0, end = 0; begin < pairs.size(); begin = end) {
    while (end < pairs.size() && pairs[end].others == pairs[begin].others) ++end;
    if (end - begin > longest_row) continue;
    for (size_t i = begin; i < end; ++i) {
      for (size_t j = i + 1; j < end; ++j) {
        int64_t sum = 0;
        // Points in the plane itself are their own images, and would favour any plane with many points.
        if (!__builtin_add_overflow(pairs[i].code, pairs[j].code, &sum) && pairs[i].code != pairs[j].code)
          sums.push_back(sum);
      }
    }
  }
  std::sort(sums.begin(), sums.end());
  std::pair<int64_t, size_t> best;
  for (size_t begin = 0, end = 0; begin < sums.size(); begin = end) {
    while (end < sums.size() && sums[end] == sums[begin]) ++end;
    if (end - begin > best.second) best = {sums[begin], end - begin};
  }
  return best;
}

}  // namespace

template <class Code>
std::optional<MirrorPlane> find_mirror_plane(std::span<const Code> codes) {
  std::optional<MirrorPlane> plane;
  // A pair has two points: a sixteenth of all as pairs is an eighth of all points. Meshes without such a
  // plane lose a byte, or 0.4 % of 3 kB (featuretype; 337281d). The share was chosen, not swept.
  size_t most = codes.size() / 3 / 16;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto [sum, count] = commonest_sum(codes, axis);
    if (count <= most) continue;
    most = count;
    plane = MirrorPlane{static_cast<uint8_t>(axis), sum};
  }
  return plane;
}

template std::optional<MirrorPlane> find_mirror_plane<int32_t>(std::span<const int32_t>);
template std::optional<MirrorPlane> find_mirror_plane<int64_t>(std::span<const int64_t>);

}  // namespace maille
