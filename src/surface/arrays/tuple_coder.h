#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "code/parallelogram.h"
#include "code/residual_model.h"
#include "numbers/number_map.h"
#include "surface/arrays/gate_placement.h"
#include "surface/arrays/stencil.h"

namespace maille {

/// How an array is coded, chosen by the encoder. docs/format.md, "Arrays".
struct TupleCoding {
  Predictor predictor = Predictor::all_gates;
  bool whole_values =
      false;  ///< frequent residuals are learnt as such; slower, for machine parts and voxel lattices
  bool repeats = false;  ///< a flag per element says that its tuple is its neighbour's
  Placement placement = Placement::parallelogram;
};

/// Sizes of past residuals in half octaves. The three of a position share one word, so that those of up to
/// fifteen tuples add up in one addition each: 15 x 64 fits 10 bits, 15 x 127 fits 20.
template <class Code, unsigned Fixed>
class ResidualSizes {
 public:
  using Sum = std::conditional_t<sizeof(Code) == 4, uint32_t, uint64_t>;

  ResidualSizes(size_t elements, size_t) : words_(elements) {}
  void clear(Sum& sum) const { sum = 0; }
  /// Adds those of a gate's elements; returns the sum over all components.
  [[gnu::always_inline]] unsigned add(const Gate& gate, Sum& sum) const {
    const Sum word = words_[gate.a] + words_[gate.b] + words_[gate.across];
    sum += word;
    return component(word, 0) + component(word, 1) + component(word, 2);
  }
  static unsigned component(Sum sum, unsigned k) { return static_cast<unsigned>(sum >> (width * k)) & mask; }
  unsigned at(uint32_t element, unsigned k) const { return component(words_[element], k); }
  void set(uint32_t element, unsigned k, unsigned size) { words_[element] |= Sum{size} << (width * k); }
  void copy(uint32_t to, uint32_t from) { words_[to] = words_[from]; }

 private:
  static constexpr unsigned width = sizeof(Code) == 4 ? 10 : 20;
  static constexpr unsigned mask = (1u << width) - 1;
  std::vector<Sum> words_;
};

/// The same for tuples of any number of components.
template <class Code>
class ResidualSizes<Code, 0> {
 public:
  using Sum = std::vector<unsigned>;

  ResidualSizes(size_t elements, size_t components)
      : components_(components), sizes_(elements * components) {}
  void clear(Sum& sum) const { sum.assign(components_, 0); }
  unsigned add(const Gate& gate, Sum& sum) const {
    unsigned total = 0;
    for (unsigned k = 0; k < components_; ++k) {
      const unsigned added = at(gate.a, k) + at(gate.b, k) + at(gate.across, k);
      sum[k] += added;
      total += added;
    }
    return total;
  }
  static unsigned component(const Sum& sum, unsigned k) { return sum[k]; }
  unsigned at(uint32_t element, unsigned k) const { return sizes_[element * components_ + k]; }
  void set(uint32_t element, unsigned k, unsigned size) {
    sizes_[element * components_ + k] = static_cast<uint8_t>(size);
  }
  void copy(uint32_t to, uint32_t from) {
    std::memcpy(&sizes_[to * components_], &sizes_[from * components_], components_);
  }

 private:
  size_t components_;
  std::vector<uint8_t> sizes_;
};

/// Codes the tuples of one array, each predicted from those in its stencil. `Code` is int64_t for numbers of
/// eight bytes, else int32_t. One class for both directions: the encoder finds the codes in `codes`, the
/// decoder puts them there; behind the last element is a tuple of zeros, for gates that are not there, and
/// one more code. `Fixed` is the number of components where it is known when compiling (positions), else 0.
template <class Coder, class Code, unsigned Fixed>
class TupleCoder {
 public:
  TupleCoder(Coder& coder, const TupleCoding& coding, Scalar type, std::span<const NumberMap> maps,
             std::span<Code> codes, const GatePlacement* places = nullptr)
      : coder_(coder),
        coding_(coding),
        type_(type),
        maps_(maps),
        codes_(codes),
        model_(coding.whole_values),
        sizes_((codes.size() - 1) / maps.size(), maps.size()),
        predictions_(maps.size()),
        spreads_(maps.size()),
        residuals_(maps.size()),
        lengths_(maps.size()),
        places_(coding.placement == Placement::parallelogram ? nullptr : places) {
    if (places_ != nullptr) {
      numbers_.resize(codes.size() - 1);
      placed_.resize(maps.size() * (GateStencil::most_gates + 1) + 1);
    }
    for (const NumberMap& map : maps) any_curved_ |= map.is_curved();
  }

  /// Codes the tuple of `element`. Without a known neighbour the element coded before serves as one.
  void code(uint32_t element, const GateStencil& stencil) {
    before_ = newest_;
    newest_ = element;
    neighbour_ = stencil.neighbour == none ? before_ : stencil.neighbour;
    if (coding_.repeats && neighbour_ != none && code_repeat(element)) return;
    if (stencil.gate_count > 0 && coding_.predictor >= Predictor::nearest_gate) {
      choose_gates(stencil);
      if (places_ != nullptr) place_gates(element, stencil);
      for (unsigned k = 0; k < components(); k += pack) predict_by_gates(stencil, k);
      const unsigned weight = inverse_of_triple[stencil.gate_count];
      code_lengths(element,
                   [&](unsigned k) { return (Sizes::component(past_sizes_, k) * weight + 32768) >> 16; });
    } else if (places_ != nullptr && stencil.edge.a != none) {
      predict_by_edge(element, stencil.edge);
      code_lengths(element, [&](unsigned k) {
        return (sizes_.at(stencil.edge.a, k) + sizes_.at(stencil.edge.b, k) + 1) / 2;
      });
    } else {
      for (unsigned k = 0; k < components(); ++k) predict_by_neighbour(k);
      code_lengths(element, [&](unsigned k) { return neighbour_ == none ? 0 : sizes_.at(neighbour_, k); });
    }
    code_values(element);
    if (places_ != nullptr) keep_numbers(element, stencil);
  }

  /// Gives an element the tuple of another one, with nothing coded.
  void copy(uint32_t to, uint32_t from) {
    for (unsigned k = 0; k < components(); ++k) codes_[at(to, k)] = codes_[at(from, k)];
    sizes_.copy(to, from);
    if (places_ == nullptr) return;
    for (unsigned k = 0; k < components(); ++k) numbers_[at(to, k)] = numbers_[at(from, k)];
  }

 private:
  using Sizes = ResidualSizes<Code, Fixed>;
  unsigned components() const { return Fixed != 0 ? Fixed : static_cast<unsigned>(maps_.size()); }
  size_t at(uint32_t element, unsigned component) const { return size_t{element} * components() + component; }

  bool code_repeat(uint32_t element) {
    bool same = true;
    if constexpr (Coder::encoding) {
      for (unsigned k = 0; k < components(); ++k) same &= codes_[at(element, k)] == codes_[at(neighbour_, k)];
    }
    same = repeat_[repeated_].code(coder_, same);
    repeated_ = (repeated_ << 1 | static_cast<unsigned>(same)) & 3;
    if (same) copy(element, neighbour_);
    return same;
  }

  /// The two gates with the smallest past residuals (the first of equals). Selections, not branches: which is
  /// best is as good as random.
  [[gnu::always_inline]] void choose_gates(const GateStencil& stencil) {
    sizes_.clear(past_sizes_);
    best_ = second_ = 0;
    unsigned smallest = sizes_.add(stencil.gates[0], past_sizes_);
    unsigned second_smallest = ~0u;
    for (unsigned i = 1; i < stencil.gate_count; ++i) {
      const unsigned size = sizes_.add(stencil.gates[i], past_sizes_);
      const bool better = size < smallest;
      const bool runner_up = size < second_smallest;
      second_ = better ? best_ : runner_up ? i : second_;
      second_smallest = better ? smallest : runner_up ? size : second_smallest;
      best_ = better ? i : best_;
      smallest = better ? size : smallest;
    }
  }

  /// Some components side by side, in one register: with three, the next code comes along as a fourth.
  static constexpr unsigned pack = Fixed != 0 ? Fixed : 1;
  using Pack[[gnu::vector_size(sizeof(Code) * (Fixed != 0 ? 4 : 1))]] = std::make_unsigned_t<Code>;

  [[gnu::always_inline]] void load_codes(uint32_t element, unsigned first, Pack& result) const {
    std::memcpy(&result, &codes_[at(element, first)], sizeof result);
  }
  [[gnu::always_inline]] void parallelogram_at(const Gate& gate, unsigned first, Pack& result) const {
    Pack a, b, across;
    load_codes(gate.a, first, a);
    load_codes(gate.b, first, b);
    load_codes(gate.across, first, across);
    result = a + b - across;
    if (any_curved_) [[unlikely]] {
      for (unsigned k = 0; k < pack; ++k) {
        if (maps_[first + k].is_curved()) {
          const auto code = [k](const Pack& codes) { return static_cast<Code>(codes[k]); };
          result[k] = static_cast<std::make_unsigned_t<Code>>(
              curved_parallelogram(maps_[first + k], code(a), code(b), code(across)));
        }
      }
    }
  }

  /// Among numbers: their codes are not proportional to them.
  [[gnu::noinline]] Code curved_parallelogram(const NumberMap& map, Code a, Code b, Code across) const {
    const double value = map.value_of(type_, a) + map.value_of(type_, b) - map.value_of(type_, across);
    return static_cast<Code>(map.nearest_code(type_, value));
  }

  /// Components from `first` on.
  [[gnu::always_inline]] void predict_by_gates(const GateStencil& stencil, unsigned first) {
    Pack predictions[GateStencil::most_gates] = {};
    Pack sum = {};
    for (unsigned i = 0; i < stencil.gate_count; ++i) {
      if (places_ != nullptr) {
        std::memcpy(&predictions[i], &placed_[i * components() + first], sizeof predictions[i]);
      } else {
        parallelogram_at(stencil.gates[i], first, predictions[i]);
      }
      sum += predictions[i];
    }
    const Pack best = predictions[best_];
    const bool alone = stencil.gate_count == 1;
    const Pack apart = predictions[second_] - best;  // relative, so that nothing overflows
    const Pack sum_apart = sum - best * stencil.gate_count;
    for (unsigned k = 0; k < pack; ++k) {
      const auto distance = static_cast<Code>(apart[k]);
      const auto size = static_cast<uint64_t>(distance < 0 ? -static_cast<int64_t>(distance + 1) : distance);
      const unsigned spread = std::min(bit_length(size | 1) - 1, one_prediction - 1);
      spreads_[first + k] = alone ? one_prediction : spread;
      Code step = 0;
      if (coding_.predictor == Predictor::two_gates) step = static_cast<Code>(distance >> 1);
      if (coding_.predictor == Predictor::all_gates)
        step = mean_of(static_cast<Code>(sum_apart[k]), stencil.gate_count);
      predictions_[first + k] = wrapped_sum(static_cast<Code>(best[k]), step);
    }
  }

  /// The codes of what each gate predicts with positions.
  [[gnu::noinline]] void place_gates(uint32_t element, const GateStencil& stencil) {
    for (unsigned i = 0; i < stencil.gate_count; ++i) {
      const Gate& gate = stencil.gates[i];
      const PlacedGate place = places_->place(element, gate);
      for (unsigned k = 0; k < components(); ++k) {
        placed_[i * components() + k] =
            static_cast<Code>(maps_[k].nearest_code(type_, placed_number(gate, place, k)));
      }
    }
  }

  double placed_number(const Gate& gate, const PlacedGate& place, unsigned k) const {
    const double a = numbers_[at(gate.a, k)];
    const double edge = numbers_[at(gate.b, k)] - a;
    const double from = numbers_[at(gate.across, k)] - a;
    if (place.flat) return a + (edge - from);
    const double on_edge = a + place.along * edge;
    const double hinge = on_edge - place.beyond * (from - place.across_along * edge);
    if (coding_.placement == Placement::hinge || gate.a == gate.b || components() != 2) return hinge;
    // A right angle from the edge, away from `across`.
    const unsigned other = 1 - k;
    const double other_edge = numbers_[at(gate.b, other)] - numbers_[at(gate.a, other)];
    const double other_from = numbers_[at(gate.across, other)] - numbers_[at(gate.a, other)];
    const double side = edge * other_from - other_edge * from;  // the same sign for k = 0 as -side for k = 1
    const double similar = on_edge + (side > 0 ? place.off : -place.off) * other_edge;
    return coding_.placement == Placement::similar ? similar : (hinge + similar) / 2;
  }

  /// Without a gate: along the edge, and beside it on the side that the last such element was.
  [[gnu::noinline]] void predict_by_edge(uint32_t element, const Gate& edge) {
    const PlacedGate place = places_->place(element, edge);
    const bool beside = coding_.placement != Placement::hinge && components() == 2 && !place.flat;
    for (unsigned k = 0; k < components(); ++k) {
      const double a = numbers_[at(edge.a, k)];
      double number =
          a + (place.flat ? 0.5 : std::clamp(place.along, -1.0, 2.0)) * (numbers_[at(edge.b, k)] - a);
      if (beside) {
        const unsigned other = 1 - k;
        const double turned = (numbers_[at(edge.b, other)] - numbers_[at(edge.a, other)]) * (k == 0 ? -1 : 1);
        number += side_ * place.off * turned;
      }
      predictions_[k] = static_cast<Code>(maps_[k].nearest_code(type_, number));
      spreads_[k] = one_prediction - 1;
    }
  }

  [[gnu::noinline]] void keep_numbers(uint32_t element, const GateStencil& stencil) {
    for (unsigned k = 0; k < components(); ++k)
      numbers_[at(element, k)] = maps_[k].number_near(type_, codes_[at(element, k)]);
    if (components() != 2 || stencil.edge.a == none) return;
    const auto from_a = [&](uint32_t other, unsigned k) {
      return numbers_[at(other, k)] - numbers_[at(stencil.edge.a, k)];
    };
    const double turn =
        from_a(stencil.edge.b, 0) * from_a(element, 1) - from_a(stencil.edge.b, 1) * from_a(element, 0);
    if (turn != 0) side_ = turn < 0 ? -1 : 1;
  }

  void predict_by_neighbour(unsigned k) {
    const uint32_t from = coding_.predictor == Predictor::previous ? before_ : neighbour_;
    predictions_[k] = from == none ? Code{0} : codes_[at(from, k)];
    spreads_[k] = one_prediction;
  }

  template <class ExpectedSize>
  [[gnu::always_inline]] void code_lengths(uint32_t element, ExpectedSize expected_size) {
    for (unsigned k = 0; k < components(); ++k) {
      if constexpr (Coder::encoding)
        residuals_[k] = wrapped_difference(codes_[at(element, k)], predictions_[k]);
      const ResidualContext context{informed(expected_size(k), k), spreads_[k]};
      lengths_[k] =
          model_.code_length(coder_, bit_length(size_of_residual(k)), model_of(k), context, lane_of(k));
    }
  }

  /// With placed gates components are wrong together: the one before tells.
  unsigned informed(unsigned expected, unsigned k) const {
    if (Fixed != 0 || places_ == nullptr || k == 0) return expected;
    return (expected + 2 * lengths_[k - 1]) / 2;
  }

  [[gnu::always_inline]] void code_values(uint32_t element) {
    for (unsigned k = 0; k < components(); ++k) {
      residuals_[k] =
          static_cast<Code>(model_.code_value(coder_, residuals_[k], lengths_[k], model_of(k), lane_of(k)));
    }
    for (unsigned k = 0; k < components(); ++k) {
      if constexpr (!Coder::encoding) codes_[at(element, k)] = wrapped_sum(predictions_[k], residuals_[k]);
      sizes_.set(element, k, half_octaves(size_of_residual(k)));
    }
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
  /// 65536 / 3n.
  static constexpr std::array<unsigned, GateStencil::most_gates + 1> inverse_of_triple = {0,    21845, 10923,
                                                                                          7282, 5461,  4369};
  static constexpr unsigned one_prediction = 11;
  Coder& coder_;
  TupleCoding coding_;
  Scalar type_;
  std::span<const NumberMap> maps_;
  std::span<Code> codes_;
  ResidualModel<8 * sizeof(Code)> model_;
  BitModel repeat_[4];
  Sizes sizes_;
  bool any_curved_ = false;
  typename Sizes::Sum past_sizes_ = {};
  // By component, for the element at hand.
  PerComponent<Code> predictions_;
  PerComponent<unsigned> spreads_;
  PerComponent<Code> residuals_;
  PerComponent<unsigned> lengths_;
  const GatePlacement* places_;
  std::vector<double> numbers_;  ///< of all codes so far, for placed gates
  std::vector<Code> placed_;
  double side_ = 1;    ///< of an edge, on which textures were last
  unsigned best_ = 0;  // gates
  unsigned second_ = 0;
  uint32_t neighbour_ = none;
  uint32_t before_ = none;  // the element coded before this one
  uint32_t newest_ = none;
  unsigned repeated_ = 0;
};

}  // namespace maille
