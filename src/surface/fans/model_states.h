#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "entropy/integer_model.h"
#include "entropy/symbol_model.h"

namespace maille {

/// Codes what symbol models have learnt, one after the other: frequencies to an octave, as steps from those
/// of the model before, since models of neighbouring contexts are alike. A few bytes a model. docs/format.md,
/// "Start of charts".
template <class Coder>
class ModelStateCoder {
 public:
  explicit ModelStateCoder(Coder& coder) : coder_(coder) { levels_.fill(11); }

  void operator()(SymbolModel& model) {
    if (coder_.exhausted()) return;
    learnt_ = there_[learnt_].code(coder_, model.visits() >= least_visits);
    if (!learnt_) return forget(model);
    const unsigned visits = visits_.code(coder_, Coder::encoding ? bit_length(model.visits()) : 0);
    unsigned before = 1;
    for (unsigned i = 0; i < 16; ++i) {
      uint32_t& level = levels_[i];
      const uint32_t wanted = Coder::encoding ? level_of(model.frequency(i)) : 0;
      OffsetModel& steps = steps_[level / 2 * 3 + before];
      const int32_t step = steps.code(coder_, static_cast<int32_t>(wanted - level));
      before = step < 0 ? 0 : step == 0 ? 1 : 2;
      // Only damaged bytes lead beyond.
      level = static_cast<uint32_t>(std::clamp(int64_t{level} + step, int64_t{0}, int64_t{15}));
    }
    model.set(frequencies(), (1u << std::min(visits, 6u)) - 1);
  }

 private:
  /// What fewer teach is not worth its bytes.
  static constexpr unsigned least_visits = 12;
  /// What is rarer hardly counts, and how rare tells of nothing but the visits.
  static constexpr uint32_t least_level = 4;

  /// A model that is not written is as new, on both sides.
  static void forget(SymbolModel& model) { model = SymbolModel(); }

  /// The power of two nearest by its logarithm.
  static uint32_t level_of(uint32_t frequency) {
    uint32_t level = 15;
    while (level > least_level && 1000 * frequency < 707u << level) --level;
    return level;
  }
  /// 2^level, made to be 2^15 together; what is left over goes to the first of the largest.
  std::array<uint32_t, 16> frequencies() const {
    uint32_t sum = 0;
    for (const uint32_t level : levels_) sum += 1u << level;
    std::array<uint32_t, 16> result;
    uint32_t left = 32768;
    for (unsigned i = 0; i < 16; ++i)
      left -= result[i] = 1 + static_cast<uint32_t>((uint64_t{32768 - 16} << levels_[i]) / sum);
    result[static_cast<size_t>(std::max_element(levels_.begin(), levels_.end()) - levels_.begin())] += left;
    return result;
  }

  Coder& coder_;
  std::array<BitModel, 2> there_;
  SymbolModel visits_;
  std::array<OffsetModel, 8 * 3> steps_;
  std::array<uint32_t, 16> levels_;  ///< of the model before
  bool learnt_ = false;
};

}  // namespace maille
