#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "entropy/mixing.h"
#include "surface/fans/dictionary.h"
#include "surface/front/position_experts.h"
#include "surface/front/repeat_candidates.h"

namespace maille {

/// Finds codes that may come again as a whole: those of neighbours, of images, what came behind the same
/// things before, and entries of dictionaries. docs/format.md, 14.7, "Matches".
template <class Code>
class PositionRepeats {
 public:
  using Codes = PositionCodes<Code>;
  using Wide = typename Codes::Wide;
  using Candidates = RepeatCandidates<Wide>;

  /// Both must outlive it. `dictionaries`: one for each axis, all of them may be empty.
  PositionRepeats(const Codes& codes, const std::array<Dictionary, 3>& dictionaries)
      : codes_(codes), followers_(size_t{4} << follower_bits) {
    if (dictionaries[0].size() + dictionaries[1].size() + dictionaries[2].size() == 0) return;
    dictionaries_ = &dictionaries;
    is_entry_.resize(codes.size());
  }

  void begin_point() { entries_ = 1; }
  /// The candidates, in the order in which equal ones count. `image`: the code of an expected image;
  /// `hashes`: of PositionContexts.
  template <class Hashes>
  void begin_number(const PositionNumber& number, Wide centre, const PositionExperts& experts,
                    const Neighbourhood& around, const Hashes& hashes, std::optional<Wide> image) {
    const unsigned axis = number.axis;
    const PositionPrediction& p = *number.prediction;
    uint32_t neighbour = number.newest;
    for (unsigned i = 0; i < around.ring_count; ++i) {
      if (i == 0 || around.ring[i] > neighbour) neighbour = around.ring[i];
    }
    candidates_.begin_number();
    const auto add = [&](unsigned kind, Wide code) {
      if (!codes_.has(code, axis)) return;
      const double far = std::fabs(codes_.value(code, axis) - experts.expected()) / experts.deviation();
      candidates_.add(kind, code, clamp_bin(half_octave(far), -3, 8));
    };
    const auto place = [&](uint32_t hash) { return hash >> (32 - follower_bits); };
    const uint32_t near = neighbour == none ? 0 : static_cast<uint32_t>(codes_.of(neighbour, axis));
    follower_[0] = &followers_[place(hashed(hashed(axis, near), 0x3c6ef372u))];
    follower_[1] = &followers_[(size_t{1} << follower_bits) + place(hashes[0])];
    follower_[2] = &followers_[(size_t{2} << follower_bits) + place(hashes[3])];
    follower_[3] = &followers_[(size_t{3} << follower_bits) + place(hashes[4])];
    if (image) add(image_kind, *image);
    add(0, *follower_[0]);
    if (p.best_a != none) {
      add(1, codes_.of(p.best_a, axis));
      add(2, codes_.of(p.best_b, axis));
      add(3, codes_.of(p.best_across, axis));
    }
    add(4, codes_.nearest_code(experts.rounded_mean(1), axis));
    add(5, centre + *follower_[1]);
    add(6, centre);
    add(7, centre + *follower_[2]);
    add(8, centre + *follower_[3]);
    if (dictionaries_) add_entries(number, experts);
  }
  void end_number(const PositionNumber& number, Wide code, Wide centre) {
    candidates_.end_number(code);
    *follower_[0] = static_cast<Code>(code);
    for (unsigned i = 1; i < 4; ++i) *follower_[i] = static_cast<Code>(code - centre);
    if (!dictionaries_) return;
    const Dictionary& dictionary = (*dictionaries_)[number.axis];
    const bool entry = dictionary.find(static_cast<int64_t>(code)) < dictionary.size();
    is_entry_[Codes::at(number.point, number.axis)] = entry ? 1 : 0;
    entries_ = entries_ << 1 | (entry ? 1 : 0);
  }

  Candidates& candidates() { return candidates_; }

 private:
  // Tables of 2^16 codes each, part of the format (14.7). Different contexts may meet in one place: then a
  // match is wrong, no more.
  static constexpr unsigned follower_bits = 16;
  static constexpr unsigned image_kind = 9;

  /// The entry nearest to what is expected, and the one on the other side of that. Where in the gap the
  /// expected number lies, and how wide the gap is beside the deviation, says how probable each is.
  void add_entries(const PositionNumber& number, const PositionExperts& experts) {
    const unsigned axis = number.axis;
    const Dictionary& dictionary = (*dictionaries_)[axis];
    if (dictionary.size() == 0) return;
    const double expected = experts.expected();
    const uint32_t nearest = dictionary.nearest(static_cast<int64_t>(codes_.nearest_code(expected, axis)));
    const double off = expected - codes_.value(dictionary[nearest], axis);
    const uint32_t other = off > 0 ? nearest + 1 : nearest - 1;
    unsigned part = 0, sharpness = 0;
    if (other < dictionary.size()) {
      const double gap =
          std::fabs(codes_.value(dictionary[other], axis) - codes_.value(dictionary[nearest], axis));
      part = static_cast<unsigned>(std::fabs(off) < gap * 0.5 ? 16 * std::fabs(off) / gap : 7);
      sharpness = clamp_bin(half_octave(gap / experts.deviation()), -1, 8);
    }
    const auto entry_at = [&](uint32_t point) {
      return point != none && is_entry_[Codes::at(point, axis)] ? 1u : 0u;
    };
    const unsigned around =
        entries_ * 4 + 2 * entry_at(number.prediction->best_a) + entry_at(number.prediction->best_b);
    const unsigned first = Candidates::first_entry;
    const auto add = [&](unsigned kind, int64_t code) {
      if (!codes_.has(code, axis)) return;  // of damaged bytes
      candidates_.add_entry(kind, code, around, sharpness, part);
    };
    add(first, dictionary[nearest]);
    if (other < dictionary.size()) add(first + 1, dictionary[other]);
  }

  const Codes& codes_;
  const std::array<Dictionary, 3>* dictionaries_ = nullptr;  // null: there are no entries
  Candidates candidates_;
  std::vector<uint8_t> is_entry_;  // by number
  unsigned entries_ = 1;           // which of the point's numbers so far are in a dictionary, behind a 1
  std::vector<Code> followers_;  // the code last seen behind that of a neighbour; the residual, behind others
  std::array<Code*, 4> follower_;  // of the number at hand
};

}  // namespace maille
