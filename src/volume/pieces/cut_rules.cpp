#include "volume/pieces/cut_rules.h"

#include <maille/with_type.h>

#include <numeric>

#include "numbers/number_map.h"

namespace maille {
namespace {

/// 0 for what is not finite, or so large that sums and boxes could overflow a float.
template <class T>
float cut_coordinate(T x) {
  constexpr double most = 1e37;
  const auto number = static_cast<double>(x);
  return number > -most && number < most ? static_cast<float>(number) : 0;
}

template <class T>
void take_positions(const Array& positions, uint64_t begin, uint64_t end, std::vector<CutPosition>& out) {
  const std::byte* from = positions.bytes.data() + begin * 3 * sizeof(T);
  for (uint64_t i = begin; i < end; ++i) {
    for (float& x : out[i]) {
      x = cut_coordinate(load<T>(from));
      from += sizeof(T);
    }
  }
}

}  // namespace

CutPosition cut_position(Scalar type, const std::byte* position) {
  CutPosition at;
  for (float& x : at) {
    x = cut_coordinate(number_as_double(type, position));
    position += size_of(type);
  }
  return at;
}

std::vector<CutPosition> cut_positions(const Array& positions, Executor& executor) {
  constexpr uint64_t at_once = uint64_t{1} << 16;
  std::vector<CutPosition> all(positions.count());
  executor.parallel_for((all.size() + at_once - 1) / at_once, [&](size_t stretch) {
    const uint64_t begin = stretch * at_once, end = std::min<uint64_t>(all.size(), begin + at_once);
    with_type(positions.type,
              [&](auto number) { take_positions<decltype(number)>(positions, begin, end, all); });
  });
  return all;
}

CutPosition ReachCounts::median() const {
  CutPosition reach{};
  for (unsigned k = 0; k < 3; ++k) {
    const auto counts = std::span(counts_).subspan(size_t{k} * steps, steps);
    const uint64_t all = std::accumulate(counts.begin(), counts.end(), uint64_t{0});
    uint32_t step = 0;
    for (uint64_t below = counts[0]; 2 * below < all; below += counts[++step]) {
    }
    reach[k] = bits_as<float>(step << step_bits);
  }
  return reach;
}

}  // namespace maille
