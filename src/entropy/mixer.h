#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/short_lanes.h"
#include "entropy/mixing.h"

namespace maille {

/// Adds the logits of N models with two sets of weights, each chosen by a small context, each learning from
/// its own error; their mean goes through a map of what such predictions turned out to be (PAQ's APM).
/// Weights are numbers of 16 bits, so that a processor does eight at once, in 1/16384; they stay within -2
/// and 2. Encoder and decoder call predict() and update() in turns with the same arguments, and so have the
/// same weights: integers only. docs/format.md, 10.5.
template <unsigned N>
class Mixer {
 public:
  static_assert(N % 8 == 0 && N <= 32, "for the processor's vectors; sums of products stay below 2^31");
  static constexpr unsigned blocks = N / 8;
  using Inputs = std::array<ShortLanes, blocks>;

  /// `initial` weights are in 1/65536.
  Mixer(unsigned first_rows, unsigned second_rows, unsigned maps, const std::array<int32_t, N>& initial)
      : rows_{std::vector<Weights>(first_rows, weights_of(initial)),
              std::vector<Weights>(second_rows, weights_of(initial))},
        maps_(maps, initial_map()) {}

  /// `used`: inputs from 8 * used on are all 0, and left out. (The result is the same.)
  [[gnu::always_inline]] uint32_t predict(const Inputs& inputs, unsigned first, unsigned second, unsigned map,
                                          unsigned used = blocks) {
    inputs_ = inputs;
    used_ = used;
    row_ = {&rows_[0][first], &rows_[1][second]};
    logit_[0] = clamp_logit(dot(*row_[0]));
    logit_[1] = clamp_logit(dot(*row_[1]));
    const int32_t mean = (logit_[0] + logit_[1]) >> 1;
    const auto place = static_cast<uint32_t>(mean + 2048);
    map_ = &maps_[map][place >> 7];
    const uint32_t within = place & 127;
    // A map has a place for every 128 logits and some beyond, so map_[1] is there, too.
    const uint32_t mapped = (map_[0] * (128 - within) + map_[1] * within) >> 7;
    // The nearer one learns.
    map_ += within >> 6;
    // Half of the correction: the map knows little at first.
    const uint32_t probability = (logistic_table[place] + mapped + 1) >> 1;
    constexpr uint32_t most = 65536 - least_probability;
    return probability < least_probability ? least_probability : probability > most ? most : probability;
  }

  [[gnu::always_inline]] void update(bool bit) {
    for (unsigned i = 0; i < 2; ++i) {
      const int32_t error =
          (bit ? 65536 : 0) - static_cast<int32_t>(logistic_table[static_cast<size_t>(logit_[i] + 2048)]);
      learn(*row_[i], static_cast<int16_t>(error * rate_ >> 13));
    }
    *map_ = static_cast<uint16_t>(*map_ + (((bit ? 65535 : 0) - *map_) >> 7));
    if (++decisions_ % 256 == 0) slow_down();
  }

 private:
  using Weights = std::array<ShortLanes, blocks>;
  using Map = std::array<uint16_t, 34>;

  static Weights weights_of(const std::array<int32_t, N>& initial) {
    Weights weights{};
    for (unsigned i = 0; i < N; ++i) weights[i / 8][i % 8] = static_cast<int16_t>(initial[i] / 4);
    return weights;
  }
  static Map initial_map() {
    Map map{};
    for (size_t i = 0; i < 34; ++i) {
      const auto logit = static_cast<int32_t>(i * 128) - 2048;
      map[i] = static_cast<uint16_t>(probability_of(logit));
    }
    return map;
  }

  /// Calls with the number of each block in use: a loop that compilers do not unroll by themselves.
  template <class Function>
  [[gnu::always_inline]] void for_used(Function call) const {
    call(0);
    if constexpr (blocks > 1) {
      if (used_ > 1) call(1);
    }
    if constexpr (blocks > 2) {
      if (used_ > 2) call(2);
    }
    if constexpr (blocks > 3) {
      if (used_ > 3) call(3);
    }
  }
  [[gnu::always_inline]] int32_t dot(const Weights& weights) const {
    SignedLanes sum = {};
    for_used([&](unsigned i) { sum += pair_products(weights[i], inputs_[i]); });
    return (sum[0] + sum[1] + sum[2] + sum[3]) >> 14;
  }
  /// A weight moves by rate * error * input, to the nearest number. This is the gradient of the cost in bits
  /// for a logistic mixture (as PAQ has). An input is at most 2047, so 16 times it fits 16 bits.
  [[gnu::always_inline]] void learn(Weights& weights, int16_t step) const {
    const ShortLanes steps = ShortLanes{} + step;
    for_used([&](unsigned i) {
      const ShortLanes twice = high_products(inputs_[i] << 4, steps);
      weights[i] = saturated_sums(weights[i], (twice + 1) >> 1);
    });
  }
  /// The rate of learning, in 1/65536: .03 at first, falling to .002, half way down after 300,000 decisions.
  /// (An error of 1 makes a step of 15728, which fits 16 bits.) Chosen without a record of a sweep; for
  /// values of volumes other rates changed less than 0.4 % (docs/history.md, 8de1c4c).
  void slow_down() {
    const uint64_t count = decisions_;
    rate_ = 131 + static_cast<int32_t>(1835 * uint64_t{300000} / (300000 + count));
  }

  Inputs inputs_ = {};
  unsigned used_ = blocks;
  std::array<std::vector<Weights>, 2> rows_;
  std::vector<Map> maps_;
  std::array<Weights*, 2> row_ = {};
  std::array<int32_t, 2> logit_ = {};
  uint16_t* map_ = nullptr;
  uint64_t decisions_ = 0;
  int32_t rate_ = 131 + 1835;
};

}  // namespace maille
