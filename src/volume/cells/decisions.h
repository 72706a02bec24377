#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "entropy/bit_model.h"
#include "entropy/mixer.h"

namespace maille {

/// Adaptive probability for decisions that are nearly always the same: 32 bits, of which the upper 16 are
/// used, moved by 1 / (n + 1.6) of the distance at the n-th visit, up to the 1000th. A run costs down to
/// 2^-15 bit a decision; with the floor of the other models structured meshes would cost thirty times as
/// much. docs/format.md, 16.4, run(M).
class RunModel {
 public:
  template <class Coder>
  [[gnu::always_inline]] bool code(Coder& coder, bool bit) {
    const uint32_t high = probability_ >> 16;
    // A probability of 0 would make the other outcome impossible to code. The upper end cannot be reached, as
    // 0xffffffff >> 16 is below 2^16.
    bit = coder.code(bit, high == 0 ? 1 : high);
    const uint64_t rate = rates()[visits_];
    if (bit) {
      probability_ += static_cast<uint32_t>((0xffffffff - probability_) * rate >> 16);
    } else {
      probability_ -= static_cast<uint32_t>(probability_ * rate >> 16);
    }
    visits_ = static_cast<uint16_t>(visits_ + (visits_ < limit));
    return bit;
  }

 private:
  // From here on a model forgets with a time constant of a thousand decisions. Chosen with the first version
  // (b97e9ac), no sweep is on record.
  static constexpr unsigned limit = 1000;
  // By n: 65536 * 10 / (10 n + 16), rounded down. Integers, so that all compilers agree.
  static const std::array<uint32_t, limit + 1>& rates() {
    static constexpr auto table = [] {
      std::array<uint32_t, limit + 1> rate{};
      for (unsigned n = 0; n <= limit; ++n) rate[n] = 655360 / (10 * n + 16);
      return rate;
    }();
    return table;
  }

  uint32_t probability_ = 0x80000000;
  uint16_t visits_ = 0;
};

/// What is known when a decision of the slow path is coded. Each of these predicts beside the local context.
/// All must be the same in encoder and decoder, and none may depend on what is still to be decided.
struct Evidence {
  uint32_t local = 0;    ///< the geometry of the decision itself
  uint32_t nearby = 0;   ///< how the cell next to it was coded
  uint32_t valence = 0;  ///< how many cells meet here
  uint32_t before = 0;   ///< all decisions of this cell so far
};

/// How decisions are predicted: by the local context alone, or mixed of four contexts (efforts 4 and above).
/// Eight gained 0.05 % in the mean of twelve meshes and took twice the time. Four at efforts 4 to 6 cost 0 to
/// 0.5 % of the files (docs/history.md, "Contexts").
enum class Mixing : uint8_t { none, mixed };
inline constexpr unsigned mixing_count = 2;

/// Decisions of the slow path: a few kinds of questions, each with evidence. Contexts are mixed unless the
/// local one is sure that the answer is no: most ends of points are so (8 to 38 % of all decisions), and the
/// others would cost accesses to memory to say the same. docs/format.md, 16.6, ask().
template <unsigned Questions>
class Decisions {
 public:
  explicit Decisions(Mixing mixing)
      : mixing_(mixing),
        cells_(size_t{1} << small_table_bits),
        // In 1/65536. The other half of the inputs is always 0, and so are its weights.
        mixer_(Questions * 8, Questions * 16, Questions, {20000, 20000, 20000, 20000}) {}

  /// Codes one decision and returns it. Contexts are hashes into a table without keys: two contexts that meet
  /// share a cell, which costs bits in both directions alike, never correctness.
  template <class Coder>
  bool code(Coder& coder, bool bit, unsigned question, const Evidence& evidence) {
    const uint32_t base = hashed(question + 1, evidence.local);
    WideCell& alone = mixing_ == Mixing::none ? cells_[base >> (32 - small_table_bits)] : cell_at(base);
    if (mixing_ == Mixing::none || (alone.probability < least_doubt && alone.visits >= least_visits)) {
      bit = coder.code(bit, bounded(alone.probability));
      alone.update(bit);
      return bit;
    }
    // The constants keep the four contexts of one decision, and those of other decisions, apart.
    const uint32_t near = hashed(base, evidence.nearby + 0x20000);
    const unsigned row = question * 16 + (evidence.local & 15);
    return mix(coder, bit, question, row,
               {base, hashed(base, evidence.valence + 0x30000), hashed(base, evidence.before + 0x40000),
                hashed(near, evidence.before + 0x70000)});
  }

 private:
  static constexpr uint16_t least_doubt = 128;  // from 256 on hexahedra in good order get larger
  static constexpr uint8_t least_visits = 100;
  // 16,384 cells: what a small or coherent mesh needs. Such meshes work in 64 to 500 KB instead of 4 MB
  // (37683a5), a tenth to a fifth faster.
  static constexpr unsigned small_table_bits = 14;
  // The largest table: tables of 2^18 cost 0.4 to 4 % of connectivity against larger ones, of 2^16 1 to 12 %
  // (docs/history.md, "Speed of scattered cells").
  static constexpr unsigned most_bits = 18;  // 1 MB: what stays near the processor
  WideCell& cell_at(uint32_t hash) { return cells_[hash * 0x9e3779b1u >> (32 - bits_)]; }

  static constexpr unsigned contexts = 4;

  template <class Coder>
  [[gnu::always_inline]] bool mix(Coder& coder, bool bit, unsigned question, unsigned row,
                                  const std::array<uint32_t, contexts>& places) {
    std::array<WideCell*, contexts> cell;
    SignedLanes logits;
    unsigned met = 0;
    for (unsigned i = 0; i < contexts; ++i) {
      cell[i] = &cell_at(places[i]);
      logits[i] = cell[i]->logit();
      met += cell[i]->visits > 2;
    }
    // How many of the cells have a history chooses a row of weights: cells that were hardly met are trusted
    // less. None and one share a row.
    const Mixer<8>::Inputs inputs = {shortened(logits, SignedLanes{})};
    bit = coder.code(bit, mixer_.predict(inputs, question * 8 + (met == 0 ? 0 : met - 1), row, question));
    mixer_.update(bit);
    for (WideCell* each : cell) {
      claims_ += each->visits < 2;
      each->update(bit);
    }
    // A cell met less than twice is taken as claimed by a new context.
    if (claims_ * 2 > cells_.size() && bits_ < most_bits) grow();
    return bit;
  }
  /// Twice as many cells, where half of them were claimed since the last time: few contexts that come again
  /// and again, as in structured meshes, never need the large table. Each begins with the probability of the
  /// one that it comes from, which may have been another context's: met once.
  void grow() {
    claims_ = 0;
    std::vector<WideCell> twice;
    twice.reserve(2 * cells_.size());
    for (const WideCell& cell : cells_) {
      const WideCell half = {cell.probability, static_cast<uint8_t>(cell.visits > 0 ? 1 : 0)};
      twice.push_back(half);
      twice.push_back(half);
    }
    cells_ = std::move(twice);
    ++bits_;
  }
  static uint32_t bounded(uint32_t probability) {
    return probability < 32 ? 32 : probability > 65536 - 32 ? 65536 - 32 : probability;
  }

  Mixing mixing_;
  unsigned bits_ = small_table_bits;
  uint64_t claims_ = 0;  ///< updates of cells that were met once at most
  std::vector<WideCell> cells_;
  Mixer<8> mixer_;  ///< half of its inputs are 0
};

/// Signed integers of 64 bits: number of bits, sign, then the bits, the first two below the top one with
/// models. Negative ones as their complement, so that both signs have at most 63 bits. docs/format.md, 16.4,
/// difference(M).
class DifferenceModel {
 public:
  template <class Coder>
  int64_t code(Coder& coder, int64_t value) {
    const uint64_t size = value < 0 ? ~static_cast<uint64_t>(value) : static_cast<uint64_t>(value);
    const unsigned length = code_length(coder, bit_length(size));
    const bool negative = sign_[length].code(coder, value < 0);
    uint64_t found = length == 0 ? 0 : 1;
    for (unsigned left = length == 0 ? 0 : length - 1; left > 0; --left) {
      const bool bit = (size >> (left - 1) & 1) != 0;
      const bool modelled = length - left <= 2;
      found = found << 1 | (modelled ? head_[length * 8 + found].code(coder, bit)
                                     : coder.code_raw(static_cast<uint32_t>(bit), 1) != 0);
    }
    return static_cast<int64_t>(negative ? ~found : found);
  }

  // A tree of six levels tells a length from 0 to 63.
 private:
  template <class Coder>
  unsigned code_length(Coder& coder, unsigned length) {
    unsigned node = 1;
    for (unsigned level = 0; level < 6; ++level) {
      node = node * 2 + length_[node].code(coder, (length >> (5 - level) & 1) != 0);
    }
    return node - 64;  // up to 63: sizes have at most 63 bits
  }

  std::array<BitModel, 64> length_;
  std::array<BitModel, 64> sign_;
  // By length, then by what of the head is known: 1, or 2 and 3.
  std::array<BitModel, 64 * 8> head_;
};

}  // namespace maille
