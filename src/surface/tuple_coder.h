#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "entropy/residual_model.h"
#include "mesh/number_map.h"
#include "predict/parallelogram.h"
#include "surface/stencil.h"

namespace maille {

/// How an array is coded, chosen by the encoder. docs/format.md, "Arrays".
struct TupleCoding {
  Predictor predictor = Predictor::all_gates;
  bool whole_values =
      false;  ///< frequent residuals are learnt as such; slower, for machine parts and voxel lattices
  bool repeats = false;  ///< a flag per element says that its tuple is its neighbour's
};

/// Codes the tuples of one array, each predicted from those in its stencil. `Code` is int64_t for numbers of
/// eight bytes, else int32_t. One class for both directions: the encoder finds the codes in `codes`, the
/// decoder puts them there.
/// `Fixed` is the number of components where it is known when compiling (positions), else 0.
template <class Coder, class Code, unsigned Fixed>
class TupleCoder {
 public:
  TupleCoder(Coder& coder, const TupleCoding& coding, Scalar type, std::span<const NumberMap> maps,
             std::span<Code> codes)
      : coder_(coder),
        coding_(coding),
        type_(type),
        maps_(maps),
        codes_(codes),
        model_(coding.whole_values),
        sizes_(codes.size()),
        errors_(maps.empty() ? 0 : codes.size() / maps.size()),
        predictions_(maps.size()),
        spreads_(maps.size()),
        residuals_(maps.size()),
        lengths_(maps.size()) {}

  /// Codes the tuple of `element`. Without a known neighbour the element coded before serves as one.
  void code(uint32_t element, const Stencil& stencil) {
    before_ = newest_;
    newest_ = element;
    neighbour_ = stencil.neighbour == none ? before_ : stencil.neighbour;
    if (coding_.repeats && neighbour_ != none && code_repeat(element)) return;
    choose_gates(stencil);
    for (unsigned k = 0; k < components(); ++k) predict(stencil, k);
    code_residuals(element, stencil);
  }

 private:
  unsigned components() const { return Fixed != 0 ? Fixed : static_cast<unsigned>(maps_.size()); }
  size_t at(uint32_t element, unsigned component) const { return size_t{element} * components() + component; }
  bool uses_gates() const { return coding_.predictor >= Predictor::nearest_gate; }

  bool code_repeat(uint32_t element) {
    bool same = true;
    if constexpr (Coder::encoding) {
      for (unsigned k = 0; k < components(); ++k) same &= codes_[at(element, k)] == codes_[at(neighbour_, k)];
    }
    same = repeat_[repeated_].code(coder_, same);
    repeated_ = (repeated_ << 1 | static_cast<unsigned>(same)) & 3;
    if (!same) return false;
    for (unsigned k = 0; k < components(); ++k) {
      codes_[at(element, k)] = codes_[at(neighbour_, k)];
      sizes_[at(element, k)] = sizes_[at(neighbour_, k)];
    }
    errors_[element] = errors_[neighbour_];
    return true;
  }

  /// The two gates with the smallest past errors (the first of equals). Selections, not branches: the outcome
  /// is random.
  [[gnu::always_inline]] void choose_gates(const Stencil& stencil) {
    best_ = second_ = none;
    if (stencil.gate_count == 0 || !uses_gates()) return;
    best_ = 0;
    uint64_t best_error = past_error(stencil.gates[0]);
    uint64_t second_error = ~uint64_t{0};
    for (uint32_t i = 1; i < stencil.gate_count; ++i) {
      const uint64_t error = past_error(stencil.gates[i]);
      const bool better = error < best_error;
      const bool runner_up = error < second_error;
      second_ = better ? best_ : runner_up ? i : second_;
      second_error = better ? best_error : runner_up ? error : second_error;
      best_ = better ? i : best_;
      best_error = better ? error : best_error;
    }
  }
  uint64_t past_error(const Gate& gate) const {
    return (uint64_t{1} << errors_[gate.a]) + (uint64_t{1} << errors_[gate.b]) +
           (uint64_t{1} << errors_[gate.across]);
  }

  [[gnu::always_inline]] Code parallelogram_at(const Gate& gate, unsigned k) const {
    const Code a = codes_[at(gate.a, k)];
    const Code b = codes_[at(gate.b, k)];
    const Code across = codes_[at(gate.across, k)];
    if (maps_[k].kind == NumberMap::Kind::ordered) [[unlikely]]
      return ordered_parallelogram(a, b, across);
    return parallelogram(a, b, across);
  }

  /// Among numbers: their codes are not proportional to them.
  [[gnu::noinline]] Code ordered_parallelogram(Code a, Code b, Code across) const {
    const double value = NumberMap::ordered_value(type_, a) + NumberMap::ordered_value(type_, b) -
                         NumberMap::ordered_value(type_, across);
    return static_cast<Code>(NumberMap::nearest_ordered(type_, value));
  }

  [[gnu::always_inline]] void predict(const Stencil& stencil, unsigned k) {
    spreads_[k] = one_prediction;
    if (best_ == none) {
      const uint32_t from = coding_.predictor == Predictor::previous ? before_ : neighbour_;
      predictions_[k] = from == none ? Code{0} : codes_[at(from, k)];
      return;
    }
    const Code best = parallelogram_at(stencil.gates[best_], k);
    predictions_[k] = best;
    if (second_ == none) return;
    const Code second = parallelogram_at(stencil.gates[second_], k);
    // Relative to the best one, so that nothing overflows.
    const Code apart = wrapped_difference(second, best);
    const auto size = static_cast<uint64_t>(apart < 0 ? -static_cast<int64_t>(apart + 1) : apart);
    spreads_[k] = std::min(half_octaves(size) / 2, one_prediction - 1);
    if (coding_.predictor == Predictor::nearest_gate) return;
    if (coding_.predictor == Predictor::two_gates || stencil.gate_count == 2) {
      predictions_[k] = wrapped_sum(best, static_cast<Code>(apart >> 1));
      return;
    }
    Sum sum = apart;
    for (unsigned i = 0; i < stencil.gate_count; ++i) {
      if (i != best_ && i != second_) sum += wrapped_difference(parallelogram_at(stencil.gates[i], k), best);
    }
    const auto count = static_cast<int>(stencil.gate_count);
    const Sum rounded = sum + (sum < 0 ? -(count / 2) : count / 2);
    predictions_[k] = wrapped_sum(best, static_cast<Code>(rounded / count));
  }

  /// Size of residual to expect in component k, in half octaves: the mean over the stencil.
  [[gnu::always_inline]] unsigned expected_size(const Stencil& stencil, unsigned k) const {
    if (best_ == none) return neighbour_ == none ? 0 : sizes_[at(neighbour_, k)];
    unsigned sum = 0;
    for (unsigned i = 0; i < stencil.gate_count; ++i) {
      const Gate& gate = stencil.gates[i];
      sum += unsigned{sizes_[at(gate.a, k)]} + sizes_[at(gate.b, k)] + sizes_[at(gate.across, k)];
    }
    return (sum * inverse_of_triple[stencil.gate_count] + 32768) >> 16;
  }

  [[gnu::always_inline]] void code_residuals(uint32_t element, const Stencil& stencil) {
    for (unsigned k = 0; k < components(); ++k) {
      if constexpr (Coder::encoding)
        residuals_[k] = wrapped_difference(codes_[at(element, k)], predictions_[k]);
      const ResidualContext context{expected_size(stencil, k), spreads_[k]};
      lengths_[k] =
          model_.code_length(coder_, bit_length(size_of_residual(k)), model_of(k), context, lane_of(k));
    }
    for (unsigned k = 0; k < components(); ++k) {
      residuals_[k] =
          static_cast<Code>(model_.code_value(coder_, residuals_[k], lengths_[k], model_of(k), lane_of(k)));
    }
    uint64_t error = 0;
    for (unsigned k = 0; k < components(); ++k) {
      if constexpr (!Coder::encoding) codes_[at(element, k)] = wrapped_sum(predictions_[k], residuals_[k]);
      const unsigned size = half_octaves(size_of_residual(k));
      sizes_[at(element, k)] = static_cast<uint8_t>(size);
      error += uint64_t{1} << std::min(size, largest_error);
    }
    errors_[element] = static_cast<uint8_t>(std::min(bit_length(error), largest_error));
  }

  uint64_t size_of_residual(unsigned k) const {
    const auto wide = static_cast<int64_t>(residuals_[k]);
    return wide < 0 ? -static_cast<uint64_t>(wide) : static_cast<uint64_t>(wide);
  }
  static unsigned model_of(unsigned k) { return k < 3 ? k : 2; }
  static unsigned lane_of(unsigned k) { return Fixed == 3 ? k : 0; }

  /// An array where the number of components is known, else a vector.
  template <class T>
  struct Fixture : std::array<T, Fixed> {
    explicit Fixture(size_t) : std::array<T, Fixed>{} {}
  };
  template <class T>
  using PerComponent = std::conditional_t<Fixed != 0, Fixture<T>, std::vector<T>>;
  using Sum = std::conditional_t<sizeof(Code) == 4, int64_t, __int128>;
  /// 65536 / 3n.
  static constexpr std::array<unsigned, Stencil::most_gates + 1> inverse_of_triple = {0,    21845, 10923,
                                                                                      7282, 5461,  4369};
  static constexpr unsigned one_prediction = 11;
  static constexpr unsigned largest_error = 60;  // sums of three still fit 64 bits

  Coder& coder_;
  TupleCoding coding_;
  Scalar type_;
  std::span<const NumberMap> maps_;
  std::span<Code> codes_;
  ResidualModel<8 * sizeof(Code)> model_;
  BitModel repeat_[4];
  std::vector<uint8_t> sizes_;   // of residuals, by number, in half octaves
  std::vector<uint8_t> errors_;  // by element: about twice the logarithm of the whole residual
  // By component, for the element at hand.
  PerComponent<Code> predictions_;
  PerComponent<unsigned> spreads_;
  PerComponent<Code> residuals_;
  PerComponent<unsigned> lengths_;
  uint32_t best_ = none;
  uint32_t second_ = none;
  uint32_t neighbour_ = none;
  uint32_t before_ = none;  // the element coded before this one
  uint32_t newest_ = none;
  unsigned repeated_ = 0;
};

}  // namespace maille
