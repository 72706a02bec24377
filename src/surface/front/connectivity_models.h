#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "entropy/bit_model.h"
#include "entropy/integer_model.h"
#include "entropy/mixer.h"
#include "entropy/mixing.h"

namespace maille {

/// What both sides know around the place of the face or vertex that comes next: the front's nodes q -> p,
/// then r -> s behind the gap between them, and the vertex w across the gate.
struct FrontView {
  static constexpr int32_t dummy = 100;

  struct Node {
    int32_t valence = 0;  ///< relative to the regular one, -20 to 40, or dummy
    uint32_t free = 0;    ///< up to 15
  };
  Node q, p, r, s, w;
};

/// Many contexts are mixed for the decisions that cost most: valences, degrees, and whether the next vertex
/// is on the front. Others have one adaptive model each. Both sides call the same functions in the same
/// order; look() comes before each decision that is mixed.
class ConnectivityModels {
 public:
  ConnectivityModels();

  OffsetModel first_degree, first_valence;  ///< of a component's first face
  std::array<BitModel, 16> dummy;
  CountModel dummy_valence;
  BitModel near;
  BitModel backward;
  std::array<CountModel, 2> steps;
  std::array<CountModel, 4> share;

  /// What the decisions to come are about.
  void look(const FrontView& view);

  /// Is the next vertex on the front?
  template <class Coder>
  bool code_on_front(Coder& coder, bool on_front) {
    return code_decision(coder, on_front, 0);
  }
  /// Valence or degree relative to the regular one: is it 0, is it above, then one by one.
  template <class Coder>
  int32_t code_valence(Coder& coder, int32_t offset) {
    offset = code_offset(coder, offset, 1);
    earlier_ = {offset, earlier_[0]};
    return offset;
  }
  template <class Coder>
  int32_t code_degree(Coder& coder, int32_t offset) {
    return code_offset(coder, offset, 1 + offset_nodes);
  }

 private:
  // Ten contexts and a constant are eleven of the mixer's sixteen inputs; the others are 0.
  static constexpr unsigned contexts = 10;
  // Offsets beyond are so rare that their rest is a count without contexts. Views clamp valences to -20
  // below, too.
  static constexpr unsigned most_steps = 20;
  static constexpr unsigned offset_nodes = 2 + 2 * most_steps;
  static constexpr unsigned nodes = 1 + 2 * offset_nodes;
  // 2^13 groups of 32 bytes, 256 kB a context. No sweep is recorded.
  static constexpr unsigned table_bits = 13;

  template <class Coder>
  int32_t code_offset(Coder& coder, int32_t offset, unsigned node) {
    if (code_decision(coder, offset == 0, node)) return 0;
    const bool up = code_decision(coder, offset > 0, node + 1);
    const int32_t size = up ? offset : -offset;
    for (unsigned i = 0; i < most_steps; ++i) {
      const int32_t step = static_cast<int32_t>(i) + 1;
      if (!code_decision(coder, size > step, node + 2 + (up ? 0 : most_steps) + i)) return up ? step : -step;
    }
    const auto more = far_.code(coder, static_cast<uint32_t>(size) - most_steps - 1);
    // Damaged bytes may give any count: cut to 30 bits, sums with the regular valence do not overflow.
    const auto far = static_cast<int32_t>((more & 0x3fffffff) + most_steps + 1);
    return up ? far : -far;
  }

  template <class Coder>
  bool code_decision(Coder& coder, bool bit, unsigned node) {
    std::array<WideCell*, contexts> cells;
    std::array<int32_t, contexts> logits;
    const unsigned slot = slot_of(node);
    if (slot == far_slot) {
      for (unsigned i = 0; i < contexts; ++i)
        cells[i] = &tables_[i][hashed(hashes_[i], node) >> (32 - table_bits)].cells[node % 8];
    } else {
#pragma GCC unroll 16
      for (unsigned i = 0; i < contexts; ++i) cells[i] = &groups_[i]->cells[slot];
    }
#pragma GCC unroll 16
    for (unsigned i = 0; i < contexts; ++i) logits[i] = cells[i]->logit();
    Mixer<16>::Inputs inputs;
    inputs[0] = shortened(SignedLanes{logits[0], logits[1], logits[2], logits[3]},
                          SignedLanes{logits[4], logits[5], logits[6], logits[7]});
    // 77 is a constant input, by which a mixer learns a bias; the mixed positions have the same one.
    inputs[1] = shortened(SignedLanes{logits[8], logits[9], 77, 0}, SignedLanes{});
    bit = coder.code(bit, mixer_.predict(inputs, node, free_class_ * 4 + (node < 3 ? node : 3), node));
    mixer_.update(bit);
#pragma GCC unroll 16
    for (unsigned i = 0; i < contexts; ++i) cells[i]->update(bit);
    return bit;
  }

  /// The decisions that come most have their cells side by side, in one line of the cache; others are looked
  /// up anew.
  static constexpr unsigned far_slot = 8;
  static unsigned slot_of(unsigned node) {
    constexpr unsigned below = 1 + 2 + most_steps;  // the first step down
    return node < 5 ? node : node - below < 3 ? node - below + 5 : far_slot;
  }
  struct alignas(32) Group {
    std::array<WideCell, 8> cells;
  };

  static std::array<int32_t, 16> initial_weights();

  Mixer<16> mixer_;
  std::array<std::vector<Group>, contexts> tables_;
  std::array<Group*, contexts> groups_ = {};
  std::array<uint32_t, contexts> hashes_ = {};
  std::array<int32_t, 2> earlier_ = {};
  unsigned free_class_ = 0;
  CountModel far_;
};

}  // namespace maille
