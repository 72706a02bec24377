#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "entropy/bit_model.h"
#include "entropy/integer_model.h"
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

/// Models of the fast and default levels: one adaptive model for each decision, in a small context.
struct PlainConnectivityModels {
  static constexpr unsigned degree_contexts = 12 * 4;
  static constexpr unsigned valence_contexts = 15 * 3 * 4;
  static constexpr bool mixed = false;

  std::array<OffsetModel, degree_contexts> degree;
  std::array<BitModel, 64> on_front;
  std::array<BitModel, 16> dummy;
  std::array<OffsetModel, valence_contexts> valence;
  CountModel dummy_valence;
  BitModel near;
  BitModel backward;
  std::array<CountModel, 2> steps;
  std::array<CountModel, 4> share;
};

/// The best levels mix many contexts for the decisions that cost most.
class MixedConnectivityModels : public PlainConnectivityModels {
 public:
  static constexpr bool mixed = true;

  MixedConnectivityModels();

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
  static constexpr unsigned contexts = 10;
  static constexpr unsigned most_steps = 20;
  static constexpr unsigned offset_nodes = 2 + 2 * most_steps;
  static constexpr unsigned nodes = 1 + 2 * offset_nodes;
  static constexpr unsigned table_bits = 16;

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
    const auto far = static_cast<int32_t>((more & 0x3fffffff) + most_steps + 1);
    return up ? far : -far;
  }

  template <class Coder>
  bool code_decision(Coder& coder, bool bit, unsigned node) {
    std::array<WideCell*, contexts> cells;
    std::array<int32_t, 12> logits;
    for (unsigned i = 0; i < contexts; ++i) {
      cells[i] = &tables_[i][hashed(hashes_[i], node) >> (32 - table_bits)];
      logits[i] = cells[i]->logit();
    }
    logits[contexts] = 77;
    logits[contexts + 1] = 0;
    Mixer<12>::Inputs inputs;
    for (unsigned i = 0; i < 3; ++i)
      inputs[i] = SignedLanes{logits[4 * i], logits[4 * i + 1], logits[4 * i + 2], logits[4 * i + 3]};
    bit = coder.code(bit, mixer_.predict(inputs, node, free_class_ * 4 + (node < 3 ? node : 3), node));
    mixer_.update(bit);
    for (WideCell* cell : cells) cell->update(bit);
    return bit;
  }

  static std::array<int32_t, 12> initial_weights();

  Mixer<12> mixer_;
  std::array<std::vector<WideCell>, contexts> tables_;
  std::array<uint32_t, contexts> hashes_ = {};
  std::array<int32_t, 2> earlier_ = {};
  unsigned free_class_ = 0;
  CountModel far_;
};

}  // namespace maille
