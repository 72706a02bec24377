#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/bytes.h"
#include "base/result.h"

namespace maille {

/// Adds to each component of a tuple of codes a multiple of those before it, in some order of components.
/// What is left of red or blue without green, or of heights above tilted ground, is smaller than the
/// components are. Integers wrap around, so undo() is exact for all codes. Terrain that lies askew becomes 8
/// to 15 % smaller at 14 bits (docs/encoder.md).
///
/// A shear in lifting steps: Bruekers and van den Enden, "New networks for perfect inversion and perfect
/// reconstruction", 1992.
class Shear {
 public:
  static constexpr unsigned most_components = 4;
  static constexpr int unit = 1 << 8;  ///< of weights: finer ones gain less than 0.1 % on terrain and colours
  /// A factor of 256: what a decoder accepts, so that weights fit their type; nothing else depends on it.
  static constexpr int64_t most_weight = 1 << 16;

  /// Changes nothing.
  Shear() = default;
  /// `order`: a permutation of its components. `weights`: for component order[i] those of order[0], ...,
  /// order[i - 1].
  Shear(std::span<const uint8_t> order, const std::array<std::array<int32_t, 4>, 4>& weights);

  bool any() const { return components_ > 0; }
  /// Works on codes of any width: the low 32 bits of sums in 64 bits are those of sums in 32. It goes from
  /// the last component to the first, so that each step uses components as undo(), which goes the other way,
  /// will have them.
  template <class Code>
  void apply(Code* codes) const {
    for (unsigned i = components_; i-- > 1;) codes[order_[i]] = moved(codes, i, -1);
  }
  template <class Code>
  void undo(Code* codes) const {
    for (unsigned i = 1; i < components_; ++i) codes[order_[i]] = moved(codes, i, 1);
  }
  /// How many times as far as before codes may lie apart.
  int64_t growth() const;

  void write(ByteWriter& out) const;
  /// Error: corrupt.
  static Result<Shear> read(ByteReader& in, unsigned components);

 private:
  template <class Code>
  Code moved(const Code* codes, unsigned i, int sign) const {
    uint64_t sum = unit / 2;
    for (unsigned j = 0; j < i; ++j)
      sum +=
          static_cast<uint64_t>(int64_t{weights_[i][j]}) * static_cast<uint64_t>(int64_t{codes[order_[j]]});
    const auto part = static_cast<uint64_t>(static_cast<int64_t>(sum) >> 8);
    const auto code = static_cast<uint64_t>(int64_t{codes[order_[i]]});
    return static_cast<Code>(sign < 0 ? code - part : code + part);
  }

  unsigned components_ = 0;
  std::array<uint8_t, 4> order_{};
  std::array<std::array<int32_t, 4>, 4> weights_{};
};

}  // namespace maille
