#pragma once

#include <vector>

#include "entropy/residual_model.h"

namespace maille {

/// Residuals of the numbers of a stream. Where small ones are expected a residual is one symbol, as most are
/// on a smooth mesh; larger ones, and those of other places, go the way of ResidualModel. In two stages, so
/// that the components of a tuple can take them side by side, each in its lane.
template <unsigned Bits>
class ValueResiduals {
 public:
  ValueResiduals() : small_(components * small_classes * spreads), large_(true) {}

  /// What code_rest() needs: whole_value + the number of a small residual, or the number of significant bits.
  template <class Coder>
  [[gnu::always_inline]] unsigned code_first(Coder& coder, int64_t residual, unsigned component,
                                             const ResidualContext& context, unsigned lane) {
    const auto bits = static_cast<uint64_t>(residual);
    const uint64_t sign = residual < 0 ? ~uint64_t{0} : 0;
    if (context.expected < small_classes) {
      SymbolModel& model =
          small_[(component * small_classes + context.expected) * spreads + context.spread];
      const uint64_t folded = bits << 1 ^ sign;
      const unsigned symbol =
          model.code(coder, static_cast<unsigned>(folded < escape ? folded : escape), lane);
      if (symbol < escape) return whole_value + symbol;
    }
    const uint64_t size = (bits ^ sign) - sign;
    return large_.code_length(coder, bit_length(size), component, context, lane);
  }

  template <class Coder>
  [[gnu::always_inline]] int64_t code_rest(Coder& coder, int64_t residual, unsigned first, unsigned component,
                                           unsigned lane) {
    if (first >= whole_value) {
      const auto folded = static_cast<int64_t>(first - whole_value);
      return folded >> 1 ^ -(folded & 1);
    }
    return large_.code_value(coder, residual, first, component, lane);
  }

 private:
  static constexpr unsigned components = ResidualModel<Bits>::components;
  static constexpr unsigned small_classes = 7;
  static constexpr unsigned spreads = 12;
  static constexpr unsigned escape = 15;
  static constexpr unsigned whole_value = 256;

  std::vector<SymbolModel> small_;
  ResidualModel<Bits> large_;
};

}  // namespace maille
