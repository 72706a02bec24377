#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/short_lanes.h"
#include "entropy/mixing.h"

namespace maille {

/// Codes that may come again as a whole, each found in a way of its own (its kind). As long as one may be
/// right it says of each decision which side it is on, as probably as its kind was right where things looked
/// the same. docs/format.md, 14.7.
template <class Wide>
class RepeatCandidates {
 public:
  // Kinds are those of the format (14.7, "Matches"); three vectors of four logits hold them.
  static constexpr unsigned kinds = 12;
  static constexpr unsigned types = 16;
  /// Kinds from this one on are entries of dictionaries: their cells have other contexts.
  static constexpr unsigned first_entry = 10;
  using Logits = std::array<SignedLanes, kinds / 4>;

  RepeatCandidates() : cells_(first_entry * fits * 8 * types) {}

  void begin_number() {
    count_ = 0;
    present_ = 0;
  }
  /// `fit`: how far the code is from what is expected, 0 to 7.
  void add(unsigned kind, Wide code, unsigned fit) {
    add_at(kind, code, (kind * 8 + hits_[kind]) * fits + fit);
  }
  /// `sharpness`, `part`: 0 to 7 each, how wide the gap between entries is, and where in it one is expected;
  /// `around`: 0 to 31.
  void add_entry(unsigned kind, Wide code, unsigned around, unsigned sharpness, unsigned part) {
    const unsigned place = (around * 8 + sharpness) * 8 + part;
    // Made with the first one: few meshes have dictionaries, and arrays of a stream never do.
    constexpr size_t all = (first_entry * fits * 8 + (kinds - first_entry) * entry_places) * types;
    if (cells_.size() < all) cells_.resize(all);
    add_at(kind, code, first_entry * fits * 8 + (kind - first_entry) * entry_places + place);
  }

  bool any() const { return count_ > 0; }
  /// Each candidate that is alive says its side, as surely as its kind was right at such decisions.
  [[gnu::always_inline]] void say(Wide at_least, unsigned type, Logits& logits) const {
    for (unsigned i = 0; i < count_; ++i) {
      const Candidate& candidate = live_[i];
      const int32_t logit = cells_[candidate.cells + type].logit();
      logits[candidate.kind / 4][candidate.kind % 4] = candidate.code >= at_least ? logit : -logit;
    }
  }
  /// A candidate that was on the wrong side is dead: it cannot be the code any more.
  [[gnu::always_inline]] void learn(Wide at_least, unsigned type, bool bit) {
    unsigned still = 0;
    for (unsigned i = 0; i < count_; ++i) {
      const bool right = (live_[i].code >= at_least) == bit;
      cells_[live_[i].cells + type].update(right);
      if (right) live_[still++] = live_[i];
    }
    count_ = still;
  }
  /// Is it one of those that still may be right? Where else nothing is known, this is faster than decision by
  /// decision.
  template <class Coder>
  bool code_whole(Coder& coder, Wide target, Wide& code) {
    constexpr unsigned whole = types - 1;
    for (unsigned i = 0; i < count_; ++i) {
      WideCell& cell = cells_[live_[i].cells + whole];
      const uint32_t p = cell.probability;
      bool right = target == live_[i].code;
      // Probabilities stay off 0 and 1, so that a surprise costs ten bits at most.
      right = coder.code(right, p < 64 ? 64 : p > 65472 ? 65472 : p);
      cell.update(right);
      if (!right) continue;
      code = live_[i].code;
      return true;
    }
    return false;
  }
  /// Was it one of them?
  bool end_number(Wide code) {
    bool repeated = false;
    for (unsigned i = 0; i < first_entry; ++i) {
      const bool right = (present_ >> i & 1) != 0 && code_[i] == code;
      hits_[i] = (hits_[i] << 1 | static_cast<unsigned>(right)) & 7;
      repeated = repeated || right;
    }
    return repeated;
  }

 private:
  static constexpr unsigned fits = 8;
  // around, sharpness and part: see add_entry().
  static constexpr unsigned entry_places = 32 * 8 * 8;

  /// Of two that are the same the first one counts.
  void add_at(unsigned kind, Wide code, unsigned cells) {
    for (unsigned i = 0; i < count_; ++i) {
      if (live_[i].code == code) return;
    }
    code_[kind] = code;
    present_ |= 1u << kind;
    live_[count_++] = {code, kind, cells * types};
  }

  struct Candidate {
    Wide code;
    unsigned kind;
    unsigned cells;
  };
  std::vector<WideCell> cells_;
  std::array<Candidate, kinds> live_;
  unsigned count_ = 0;
  std::array<Wide, kinds> code_{};
  unsigned present_ = 0;                // kinds with a code of their own, as bits
  std::array<unsigned, kinds> hits_{};  // the last three numbers
};

}  // namespace maille
