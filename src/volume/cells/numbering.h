#pragma once

#include <array>
#include <cstdint>

#include "volume/cells/decisions.h"

namespace maille {

/// Numbers of new points, in the order in which cells meet them. Most are the last number plus one, or follow
/// from three numbers of the cell as in any strided numbering. Generators that number corners, middles of
/// edges, of faces and of cells each with a counter of their own are met by `tracks`: the last number of each
/// running counter. Numbers are any 64 bits; all sums wrap. docs/format.md, 16.4.
class Numbering {
 public:
  // Eight running counters; three more guesses, one for each neighbour of a hexahedron's corner. Parts of the
  // format.
  static constexpr unsigned most_tracks = 8;
  static constexpr unsigned most_others = 3;

  /// Codes one number and returns it. `expected`: the number that three corners of the cell suggest, if
  /// `has_expected`; `context` below 64 says what kind of node it is. `others(suggest)` has up to three more
  /// guesses, asked for only when the first one is wrong.
  template <class Coder, class Others>
  [[gnu::always_inline]] uint64_t code(Coder& coder, uint64_t number, bool has_expected, uint64_t expected,
                                       unsigned context, Others others) {
    const uint64_t next = track_[0] + 1;
    // Where both guesses agree they are nearly always right; what is below the last number is mostly taken.
    const unsigned agreement = !has_expected ? 0 : expected == next ? 1 : expected > next ? 2 : 3;
    const bool expected_first = has_expected && last_hit_ == 1;
    context = context * 4 + agreement;
    // Nearly always it is the first guess, so the others are not even made before.
    const uint64_t first = expected_first ? expected : next;
    if (flag(context, expected_first, 0).code(coder, number == first)) [[likely]] {
      remember_hit(0, has_expected && first == expected);
      // The track just goes on: the usual case moves nothing.
      if (first == next) {
        track_[0] = first;
      } else {
        move_to_front(first);
      }
      return first;
    }
    return code_other(coder, number, has_expected, expected, context, others);
  }

 private:
  // The tracks, each plus one; the expected number; two tracks minus one; the others.
  static constexpr unsigned most_guesses = most_tracks + 3 + most_others;
  /// What was not the first guess.
  template <class Coder, class Others>
  [[gnu::noinline]] uint64_t code_other(Coder& coder, uint64_t number, bool has_expected, uint64_t expected,
                                        unsigned context, Others others) {
    std::array<uint64_t, most_guesses> guess{};
    unsigned count = 0;
    const auto suggest = [&](uint64_t value) {
      // Each number once, so that no second flag is spent on a guess that was refused. Sixteen at most, hence
      // by search.
      for (unsigned i = 0; i < count; ++i) {
        if (guess[i] == value) return;
      }
      guess[count++] = value;
    };
    const bool expected_first = has_expected && last_hit_ == 1;
    if (expected_first) suggest(expected);
    suggest(track_[0] + 1);
    if (has_expected && !expected_first) suggest(expected);
    others(suggest);
    for (unsigned i = 1; i < tracks_; ++i) suggest(track_[i] + 1);
    for (unsigned i = 0; i < 2 && i < tracks_; ++i) suggest(track_[i] - 1);
    for (unsigned i = 1; i < count; ++i) {
      if (!flag(context, expected_first, i).code(coder, number == guess[i])) continue;
      remember_hit(i, has_expected && guess[i] == expected);
      move_to_front(guess[i]);
      return guess[i];
    }
    // Three is the mark of a number that no guess had.
    history_ = (history_ * 4 + 3) & 15;
    return code_jump(coder, number);
  }
  /// 64 contexts, 4 kinds of agreement, 16 histories, which guess comes first, and the place of the guess.
  RunModel& flag(unsigned context, bool expected_first, unsigned guess) {
    return guesses_[((context * 16 + history_) * 2 + expected_first) * most_guesses + guess];
  }
  void remember_hit(unsigned place, bool as_expected) {
    history_ = (history_ * 4 + (place < 2 ? place : 2)) & 15;
    last_hit_ = as_expected ? 1 : 0;
  }
  /// The track one step from this number goes on with it and moves to the front; if there is none, the number
  /// begins a track, in place of the oldest one if there are eight.
  void move_to_front(uint64_t number) {
    unsigned from = 0;
    while (from < tracks_ && track_[from] + 1 != number && track_[from] - 1 != number) ++from;
    if (from == tracks_) from = tracks_ < most_tracks ? tracks_++ : most_tracks - 1;
    for (; from > 0; --from) track_[from] = track_[from - 1];
    track_[0] = number;
  }
  /// Codes the difference to the nearest track, which stays where it is; the number begins a track of its
  /// own. A decoder may be told a track that does not exist yet: it is 0 then, which is harmless.
  template <class Coder>
  uint64_t code_jump(Coder& coder, uint64_t number) {
    unsigned nearest = 0;
    if constexpr (Coder::encoding) {
      for (unsigned i = 1; i < tracks_; ++i) {
        if (distance(number, track_[i]) < distance(number, track_[nearest])) nearest = i;
      }
    }
    unsigned node = 1;
    for (unsigned level = 0; level < 3; ++level) {
      node = node * 2 + which_[node].code(coder, (nearest >> (2 - level) & 1) != 0);
    }
    nearest = node - 8;
    number = track_[nearest] +
             static_cast<uint64_t>(jump_.code(coder, static_cast<int64_t>(number - track_[nearest])));
    if (tracks_ < most_tracks) ++tracks_;
    for (unsigned i = tracks_ - 1; i > 0; --i) track_[i] = track_[i - 1];
    track_[0] = number;
    return number;
  }
  static uint64_t distance(uint64_t a, uint64_t b) { return a < b ? b - a : a - b; }

  // All bits set, so that the first number is expected to be 0.
  std::array<uint64_t, most_tracks> track_ = {~uint64_t{0}};
  unsigned tracks_ = 1;
  unsigned history_ = 0;
  unsigned last_hit_ = 0;
  std::vector<RunModel> guesses_ = std::vector<RunModel>(64 * 4 * 16 * 2 * most_guesses);
  std::array<BitModel, 8> which_;
  DifferenceModel jump_;
};

}  // namespace maille
