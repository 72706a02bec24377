#pragma once

#include <maille/executor.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "volume/pieces/cut_rules.h"

namespace maille {

/// Cells, or a sample of them, cut into pieces by planes: a binary tree of cuts, whose leaves are the pieces.
/// piece_of() takes any cell to its piece in as many steps as the tree is deep.
struct Bisection {
  /// A plane: below it are cells whose middle is below `value`, and those at it whose number is below `cell`.
  struct Cut {
    unsigned axis = 0;
    float value = 0;
    uint32_t cell = 0;
    std::array<uint32_t, 2> sides{};  ///< below and above: the next cut, or ~ the piece
  };
  std::vector<uint32_t> places;  ///< of the middles in their list, piece after piece, rising in each
  std::vector<size_t> ends;      ///< of pieces
  std::vector<Cut> cuts;         ///< the first one is of all

  uint32_t piece_of(const Middle& middle) const;
  std::span<const uint32_t> piece(size_t number) const {
    const size_t begin = number == 0 ? 0 : ends[number - 1];
    return std::span(places).subspan(begin, ends[number] - begin);
  }

  /// A side of a cut is 2 x its number, + 1 for that above.
  static constexpr size_t no_side = ~size_t{0};
  /// Whoever made a side says where it leads once that is known: cuts are made level by level.
  void set_side(size_t side, uint32_t to);
};

/// Cuts by the rules of cut_rules.h. Fewer than 2^32 middles. `reach`: of most cells along each axis; zeros:
/// cuts run across the longest side. The same for any executor: threads count and move stretches of fixed
/// length, whose results are put together in order.
Bisection bisect(std::span<const Middle> middles, const CutPosition& reach, uint64_t pieces,
                 Executor& executor);

}  // namespace maille
