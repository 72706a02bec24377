#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "code/residual_model.h"
#include "entropy/bit_model.h"
#include "entropy/symbol_model.h"

namespace maille {

/// Residuals of the numbers of a stream. Where small ones are expected a residual is one symbol, as most are
/// on a smooth mesh (positions of a pipe: 5.3 to 6.7 M points a second encoding, 5.237 to 5.203 bits;
/// c08fc68). Of others the number of significant bits, the sign and three more bits are symbols (as in
/// ResidualModel), the rest is raw. Where the same values come again (voxels, machine parts) eight bits more
/// are symbols; elsewhere these would learn noise, at 3 to 7 % of the size and a third of the time (52d5e54).
/// In two stages, so that the components of a tuple can take them side by side, each in its lane.
template <unsigned Bits>
class ValueResiduals {
 public:
  /// `of`: components of the tuples.
  explicit ValueResiduals(uint32_t of = components)
      : small_(with_models(of) * small_classes * spreads),
        lengths_(with_models(of)),
        rows_(with_models(of) * (Bits + 1)) {}

  /// What code_rest() needs: whole_value + the number of a small residual, or the number of significant bits.
  template <class Coder>
  [[gnu::always_inline]] unsigned code_first(Coder& coder, int64_t residual, unsigned component,
                                             const ResidualContext& context, unsigned lane) {
    const auto bits = static_cast<uint64_t>(residual);
    const uint64_t sign = residual < 0 ? ~uint64_t{0} : 0;
    if (context.expected < small_classes) {
      SymbolModel& model = small_[(component * small_classes + context.expected) * spreads + context.spread];
      const uint64_t folded = bits << 1 ^ sign;
      const unsigned symbol =
          model.code(coder, static_cast<unsigned>(folded < escape ? folded : escape), lane);
      if (symbol < escape) return whole_value + symbol;
    }
    const uint64_t size = (bits ^ sign) - sign;
    return lengths_.code_length(coder, bit_length(size), component, context, lane);
  }

  /// What came since it was made.
  uint64_t grown_bytes() const { return uint64_t{tails_} * tail_models * sizeof(SymbolModel); }

  /// The residual; `residual` is read by an encoder only, `first` is what code_first() gave. Never more than
  /// 64 bits: lengths are at most Bits.
  template <class Coder>
  [[gnu::always_inline]] int64_t code_rest(Coder& coder, int64_t residual, unsigned first, unsigned component,
                                           unsigned lane) {
    if (first >= whole_value) {
      const auto folded = static_cast<int64_t>(first - whole_value);
      return folded >> 1 ^ -(folded & 1);
    }
    if (first == 0) return 0;
    return code_value(coder, residual, first, rows_[component * (Bits + 1) + first], lane);
  }

 private:
  static constexpr unsigned components = ResidualModel<Bits>::components;
  // Expected sizes below 7 half octaves of 2 |residual| + 1 are residuals of 5 at most; the 15 symbols before
  // the escape hold -7 to 7.
  static constexpr unsigned small_classes = 7;
  static constexpr unsigned spreads = 12;
  static constexpr unsigned escape = 15;
  static constexpr unsigned whole_value = 256;
  static constexpr unsigned tail_models = 16 + 256;
  // Bounds for how long the past of a length counts. Part of the format.
  static constexpr int most_score = 255;

  /// Residuals of one length: most have no tails, and 272 models of 16 symbols each would be megabytes over
  /// all lengths.
  struct Row {
    SymbolModel head;
    std::vector<SymbolModel> tail;        ///< made when it pays, since that is rare
    std::array<uint8_t, 16> last_tail{};  ///< by head
    int score = 0;                        ///< above 0: tails come again
  };

  static constexpr unsigned with_models(uint32_t of) { return std::min<unsigned>(of, components); }

  template <class Coder>
  [[gnu::always_inline]] int64_t code_value(Coder& coder, int64_t residual, unsigned length, Row& row,
                                            unsigned lane) {
    const auto bits = static_cast<uint64_t>(residual);
    const uint64_t size = residual < 0 ? -bits : bits;
    // Sign and up to three bits below the top one.
    const unsigned head_bits = length < 4 ? length - 1 : 3;
    unsigned left = length - 1 - head_bits;
    const auto first = static_cast<unsigned>(size >> left & ((1u << head_bits) - 1));
    const unsigned head = row.head.code(coder, (residual < 0 ? 1u << head_bits : 0u) | first, lane);
    // A damaged stream can hold symbols that the encoder does not use: bits beyond the sign fall away, and so
    // no shift below exceeds the length.
    const bool negative = (head >> head_bits & 1) != 0;
    uint64_t value = uint64_t{1} << head_bits | (head & ((1u << head_bits) - 1));
    const unsigned tail_bits = left < 4 ? 0 : left < 8 ? left : 8;
    const unsigned below = left - tail_bits;
    if (row.score > 0 && tail_bits > 0) {
      value = code_tail(coder, size >> below, value, tail_bits, row, head, lane);
      left = below;
    }
    if constexpr (Bits > 32) {
      if (left > 32) {
        left -= 32;
        value = value << 32 | coder.code_raw(static_cast<uint32_t>(size >> left), 32, lane);
      }
    }
    const auto rest = static_cast<uint32_t>(size & ((uint64_t{1} << left) - 1));
    value = value << left | coder.code_raw(rest, left, lane);
    if (tail_bits > 0) learn_tail(row, head, static_cast<unsigned>(value >> below), tail_bits);
    return static_cast<int64_t>(negative ? -value : value);
  }

  /// Codes four bits in the context of the head, then the rest of `count` (4 to 8) in that of both.
  template <class Coder>
  [[gnu::noinline]] uint64_t code_tail(Coder& coder, uint64_t bits, uint64_t value, unsigned count, Row& row,
                                       unsigned head, unsigned lane) {
    if (row.tail.empty()) {
      row.tail.resize(tail_models);
      ++tails_;
    }
    const auto wanted = static_cast<unsigned>(bits & 0xff);
    const unsigned second_bits = count - 4;
    const unsigned first = row.tail[head].code(coder, wanted >> second_bits & 15, lane);
    value = value << 4 | first;
    if (second_bits == 0) return value;
    const unsigned mask = (1u << second_bits) - 1;
    SymbolModel& second = row.tail[16 + head * 16 + first];
    return value << second_bits | (second.code(coder, wanted & mask, lane) & mask);
  }

  /// A hit counts by how many bits it would have saved: 2^(count - 4) against 1 for a miss.
  static void learn_tail(Row& row, unsigned head, unsigned value, unsigned count) {
    const auto tail = static_cast<uint8_t>(value & ((1u << count) - 1));
    const int score = row.score + (row.last_tail[head] == tail ? 1 << (count - 4) : -1);
    row.score = score > most_score ? most_score : score < -most_score ? -most_score : score;
    row.last_tail[head] = tail;
  }

  std::vector<SymbolModel> small_;
  ResidualModel<Bits> lengths_;
  std::vector<Row> rows_;  ///< by component and length
  unsigned tails_ = 0;     ///< rows that have one
};

}  // namespace maille
