#pragma once

#include <array>
#include <cstdint>

#include "entropy/integer_model.h"
#include "surface/fans/fan_machine.h"

namespace maille {

/// Adaptive models of the symbols of a FanMachine and of the numbers beside them. docs/format.md, "TOPO 2".
class AdaptiveFanModel {
 public:
  /// `context` as in FanMachine.
  template <class Coder>
  [[gnu::always_inline]] unsigned code_symbol(Coder& coder, unsigned context, unsigned symbol) {
    context = mapped_context(context);
    const unsigned far = ((context >> 8) * most_recent + recent_) << 4 | (context & 15);
    const unsigned near = context >> 4;
    unsigned place = 0;
    if constexpr (Coder::encoding) place = place_of_symbol[symbol];
    const unsigned first =
        SymbolModel::code_in_mean(coder, near_[near], far_[far], place < escape ? place : escape);
    if (first < escape) {
      place = first;
    } else {
      place = escape + rare_.code(coder, place - escape);
    }
    symbol = symbol_at_place[place];
    recent_ = recent_class[symbol];
    return symbol;
  }

  template <class Coder>
  uint32_t code_number(Coder& coder, FanNumber kind, uint32_t value) {
    return numbers_[static_cast<size_t>(kind)].code(coder, value);
  }

  /// All that is learnt, but how long numbers of 15 and more are.
  template <class Visitor>
  void visit_models(Visitor& visitor) {
    for (SymbolModel& model : near_) visitor(model);
    for (SymbolModel& model : far_) visitor(model);
    visitor(rare_);
    for (CountModel& model : numbers_) visitor(model.small());
  }

 private:
  static constexpr unsigned escape = 15;
  static constexpr unsigned most_recent = 8;

  /// The first fifteen are the frequent ones.
  static constexpr std::array<uint8_t, 31> symbol_at_place = {0,  1,  2,  3,  4,  5,  6,  7,  8,  16, 17,
                                                              18, 21, 22, 9,  10, 11, 12, 13, 14, 15, 19,
                                                              20, 23, 24, 25, 26, 27, 28, 29, 30};
  static constexpr auto place_of_symbol = [] {
    std::array<uint8_t, fan_symbols> places{};
    for (unsigned place = 0; place < symbol_at_place.size(); ++place)
      places[symbol_at_place[place]] = static_cast<uint8_t>(place);
    return places;
  }();
  static constexpr auto recent_class = [] {
    std::array<uint8_t, fan_symbols> classes{};
    for (unsigned s = 0; s < fan_symbols; ++s) {
      classes[s] = static_cast<uint8_t>(s < 4 ? s : s < 8 ? 4 + (s > 4) : s < 16 ? 6 : 7);
    }
    return classes;
  }();

  std::array<SymbolModel, mapped_contexts / 16> near_;
  std::array<SymbolModel, mapped_contexts / 16 * most_recent> far_;
  SymbolModel rare_;
  std::array<CountModel, number_contexts> numbers_;
  unsigned recent_ = 0;
};

}  // namespace maille
