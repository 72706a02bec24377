#pragma once

#include <maille/executor.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace maille {

/// The middle of a cell's corners.
struct Middle {
  std::array<float, 3> at;
  uint32_t cell;
};

/// Cells, or a sample of them, cut into pieces by planes.
struct Bisection {
  /// A plane: below it are cells whose middle is below `value`, and those at it whose number is below `cell`.
  struct Cut {
    unsigned axis = 0;
    float value = 0;
    uint32_t cell = 0;
    std::array<uint32_t, 2> sides{};  ///< below and above: the next cut, or ~ the piece
  };
  std::vector<Middle> middles;  ///< piece after piece
  std::vector<size_t> ends;     ///< of pieces
  std::vector<Cut> cuts;        ///< the first one is of all

  uint32_t piece_of(const Middle& middle) const;

  /// A side of a cut is 2 x its number, + 1 for that above.
  static constexpr size_t no_side = ~size_t{0};
  void set_side(size_t side, uint32_t to);
};

/// The rules are in cut_rules.h. The same for any executor.
Bisection bisect(std::vector<Middle> middles, uint64_t pieces, Executor& executor);

}  // namespace maille
