#pragma once

#include <maille/mesh.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "entropy/mixer.h"
#include "entropy/mixing.h"
#include "numbers/number_map.h"
#include "surface/fans/dictionary.h"
#include "surface/front/mirror_images.h"
#include "surface/front/position_codes.h"
#include "surface/front/position_contexts.h"
#include "surface/front/position_experts.h"
#include "surface/front/position_predictor.h"
#include "surface/front/position_repeats.h"

namespace maille {

/// How positions are coded at the best efforts. docs/format.md, 14.6 and 14.7.
struct MixedCoding {
  /// The number from which a code is looked for: the finest structure of the codes shows when it is exact.
  enum class Centre : uint8_t { expected, best_parallelogram };
  static constexpr unsigned centre_count = 2;
  Centre centre = Centre::best_parallelogram;
  bool with_repeats = true;           ///< contexts see numbers as they are, and what may come again
  double unit = 1;                    ///< of positions: about the smallest difference of numbers
  std::optional<MirrorPlane> mirror;  ///< many points have an image in it
  bool with_dictionaries = false;     ///< with repeats only
  /// Codes that an axis has often.
  std::array<Dictionary, 3> dictionaries;
};

/// Codes the numbers of positions one decision after the other, each of the kind "is the code at least this
/// one?", on an interval that shrinks. PositionExperts say how probable each side is; PositionContexts what
/// happened before where things looked the same; PositionRepeats are whole codes that may come again. A mixer
/// adds the logits of all, with weights learnt while coding. One class serves both directions,
/// docs/format.md, 14.6 and 14.7.
///
/// Doubles and floats in a fixed order of + - * / and sqrt, which IEEE rounds the same everywhere; all else
/// are integers. Without `with_repeats` hashed contexts and repeats are left out.
template <class Coder, class Code, bool with_repeats>
class MixedPositionCoder {
 public:
  MixedPositionCoder(Coder& coder, const MixedCoding& coding, Scalar type, std::span<const NumberMap> maps,
                     const PatchSurface& surface, const VertexRings& rings, uint32_t points, uint32_t most,
                     std::span<Code> codes)
      : coder_(coder),
        coding_(coding),
        codes_(type, maps, coding.unit, codes),
        predictor_(surface, rings, points),
        mixer_(PositionExperts::scale_bins * node_types, 8 * 4 * node_types, node_types, initial_weights()),
        contexts_(most < points ? most : points, codes.size()) {
    if constexpr (with_repeats) repeats_.emplace(codes_, coding_.dictionaries);
    if (coding.mirror) images_.emplace(*coding.mirror, surface, points, codes);
  }
  // Parts refer to each other.
  MixedPositionCoder(const MixedPositionCoder&) = delete;
  MixedPositionCoder& operator=(const MixedPositionCoder&) = delete;

  /// Codes a point of the surface at its first vertex.
  void code(uint32_t vertex, uint32_t point) {
    const PositionPrediction& prediction = predictor_.predict(vertex);
    if (!images_) return code_point(point, prediction);
    const bool expected = expect_image(point, vertex);
    code_point(point, expected && trust_ > least_trust ? at_image(prediction) : prediction);
    if (expected) learn_trust(point);
    has_image_ = false;
    images_->learn(point, vertex);
  }
  /// Codes one outside of it.
  void code_other(uint32_t point) { code_point(point, predictor_.predict_other()); }

 private:
  using Codes = PositionCodes<Code>;
  using Contexts = PositionContexts<Code, with_repeats>;
  using Wide = typename Codes::Wide;
  static constexpr unsigned experts = PositionExperts::count;
  static constexpr unsigned contexts = Contexts::count;
  static constexpr unsigned inputs = with_repeats ? 24 : 8;
  static constexpr unsigned bias_input = experts;
  static constexpr unsigned node_types = 16;
  /// Above this share of images that were right to a step, of 65536, experts expect the image only. (Half of
  /// it costs 0 to 1.5 %, all of it up to 5 %.)
  static constexpr int32_t least_trust = 50000;
  /// Above this probability (of 65536) codes are asked first whether they are the centre itself. It changes
  /// which decision comes first, so the format has it (14.7). Chosen, not swept.
  static constexpr uint16_t often_exact = 40000;

  /// Where learning begins (14.7): matches that are alive count most, then experts; contexts know nothing
  /// yet. Chosen, not swept.
  static std::array<int32_t, inputs> initial_weights() {
    std::array<int32_t, inputs> weights;
    weights.fill(65536 / 25);
    for (unsigned i = 0; i < experts; ++i) weights[i] = 65536 / 5;
    weights[bias_input] = 0;
    for (unsigned i = experts + 3 + contexts; i < inputs && with_repeats; ++i) weights[i] = 65536 * 35 / 100;
    return weights;
  }

  void code_point(uint32_t point, const PositionPrediction& prediction) {
    number_.prediction = &prediction;
    number_.point = point;
    experts_.begin_point();
    contexts_.begin_point();
    if constexpr (with_repeats) repeats_->begin_point();
    Vector3 where;
    for (number_.place = 0; number_.place < 3; ++number_.place) {
      number_.axis = prediction.axes[number_.place];
      where[number_.axis] = code_number();
    }
    number_.newest = point;
    predictor_.learn(point, where);
  }

  /// Is there an image of a known point where this one will be?
  bool expect_image(uint32_t point, uint32_t vertex) {
    has_image_ = images_->expect(point, vertex);
    if (!has_image_) return false;
    image_ = images_->place();
    for (unsigned k = 0; k < 3; ++k) has_image_ = has_image_ && codes_.has(image_[k], k);
    return has_image_;
  }
  /// All that is expected lies at the image, as surely as variances can say: 0.05 is what find_variance()
  /// adds to each.
  const PositionPrediction& at_image(const PositionPrediction& prediction) {
    at_image_ = prediction;
    Vector3 place;
    for (unsigned k = 0; k < 3; ++k) place[k] = codes_.value(image_[k], k);
    at_image_.mean.fill(place);
    at_image_.mean_parallelogram = at_image_.best_parallelogram = place;
    at_image_.covariance = {};
    for (unsigned k = 0; k < 3; ++k) at_image_.covariance[k][k] = 0.05;
    at_image_.spread = at_image_.disagreement = 0;
    return at_image_;
  }
  void learn_trust(uint32_t point) {
    bool right = true;
    for (unsigned k = 0; k < 3; ++k) {
      const Wide off = codes_.of(point, k) - image_[k];
      right = right && off <= 1 && off >= -1;
    }
    // The mean of the last sixteen or so.
    trust_ += ((right ? 65536 : 0) - trust_) >> 4;
  }

  Wide centre() const {
    const bool expected = coding_.centre == MixedCoding::Centre::expected;
    return codes_.nearest_code(
        expected ? experts_.expected() : number_.prediction->best_parallelogram[number_.axis], number_.axis);
  }

  /// Returns the number that the code stands for.
  double code_number() {
    experts_.begin_number(number_);
    contexts_.begin_number(number_, experts_, codes_, predictor_);
    Code& code = codes_.of(number_.point, number_.axis);
    const Wide centre = this->centre();
    experts_.begin_decisions(codes_.value(centre, number_.axis));
    Wide low = codes_.low_end(number_.axis);
    Wide high = codes_.high_end(number_.axis);
    // Only the encoder knows it; decisions of a decoder come from the stream.
    if constexpr (Coder::encoding) target_ = code;
    if constexpr (with_repeats) {
      repeats_->begin_number(number_, centre, experts_, predictor_.neighbourhood(), contexts_.hashes(),
                             has_image_ ? std::optional(image_[number_.axis]) : std::nullopt);
    }

    contexts_.begin_buckets(0);
    const bool up = ask(centre, low, high, 0, 0, 1);
    side_ = up ? 1 : 0;
    // Distances from 1 on either side; their class is the number of bits below the top one.
    const Wide origin = up ? centre - 1 : centre;
    // Distances have at most as many bits as codes and one more, so the loops below end.
    const unsigned most_class = 8 * sizeof(Code);
    const auto threshold = [&](unsigned c) {  // the first code of class c, seen from the centre
      const Wide distance = Wide{1} << c;
      return up ? origin + distance : origin - distance;
    };
    const unsigned start = expected_class(centre, up, most_class);
    unsigned c = start;
    // Is the class above c?
    const auto beyond = [&](unsigned k, unsigned type) {
      const Wide t = threshold(k + 1);
      const Wide at_least = up ? t : t + 1;
      return ask_class(at_least, low, high, k, type) == up;
    };
    WideCell& exact = exact_[experts_.scale_bin() * 8 + exact_hits_];
    const bool exact_first = with_repeats && up && exact.probability > often_exact;
    if (exact_first && !beyond(0, 14)) {
      c = 0;
    } else if (beyond(c, 1)) {
      for (++c; c < most_class && beyond(c, c - start < 3 ? 1 + c - start : 3); ++c) {
      }
    } else {
      while (c > 0 && !beyond(c - 1, start - c < 3 ? 4 + start - c : 6)) --c;
    }
    code_mantissa(c, low, high);
    code = static_cast<Code>(low);
    if constexpr (with_repeats) {
      exact.update(low == centre);
      exact_hits_ = (exact_hits_ << 1 | (low == centre ? 1 : 0)) & 7;
    }
    contexts_.end_number(number_, static_cast<int32_t>(low - centre));
    if constexpr (with_repeats) repeats_->end_number(number_, low, centre);
    const double where = codes_.value(code, number_.axis);
    experts_.learn(number_, where);
    return where;
  }

  /// The class of distance that is most likely, so that few decisions find the true one. A wrong guess costs
  /// time and a little of what models learn: the decisions name the class whatever comes first.
  unsigned expected_class(Wide centre, bool up, unsigned most_class) const {
    const double off = experts_.expected() - codes_.value(centre, number_.axis);
    double distance = (up ? off : -off) + experts_.scale();
    if (distance < experts_.scale() * 0.5) distance = experts_.scale() * 0.5;
    const double step = codes_.step(centre, number_.axis);
    const int halves = half_octave(distance / (step > 1e-18 ? step : 1e-18) + 1);
    const unsigned c = static_cast<unsigned>(halves < 0 ? 0 : halves / 2);
    return c < most_class ? c : most_class - 1;
  }

  bool ask_class(Wide at_least, Wide& low, Wide& high, unsigned k, unsigned type) {
    // The classes 0 to 2 of both sides share the first bucket with the side.
    unsigned slot;
    if (k < 3) {
      contexts_.begin_buckets(0);
      slot = 1 + side_ * 3 + k;
    } else {
      contexts_.begin_buckets(1 + side_ + 2 * ((k - 3) / 7));
      slot = (k - 3) % 7;
    }
    return ask(at_least, low, high, slot, type, 2 + side_ * 16 + (k < 15 ? k : 15));
  }

  /// Halves the interval of the class until one code is left. Contexts begin anew every third bit, up to the
  /// sixth: below, bits of irregular meshes are noise, and buckets would be wasted on them.
  void code_mantissa(unsigned c, Wide& low, Wide& high) {
    unsigned prefix = 1;
    for (unsigned i = 0; low < high; ++i) {
      const Wide size = high - low + 1;
      if (i >= 2 && is_flat(low, high)) {
        if constexpr (with_repeats) {
          if (repeats_->candidates().code_whole(coder_, target_, low)) return;
        }
        return code_raw_rest(low, high);
      }
      const Wide half = low + (size >> 1);
      if (i % 3 == 0 && i < 6)
        contexts_.begin_buckets(0x100 + (((c * 2 + side_) << 12) | (prefix & 0xfff)) * 2);
      const unsigned within = (1u << i % 3) | (prefix & ((1u << i % 3) - 1));
      const unsigned few =
          i < 2 ? 34 + ((side_ * 16 + (c < 15 ? c : 15)) * 3 + (i == 0 ? 0 : 1 + (prefix & 1))) : 0;
      const bool bit = ask(half, low, high, within - 1, 7 + (i < 6 ? i : 6), few, i < 6);
      prefix = prefix << 1 | static_cast<unsigned>(bit);
    }
  }

  /// Is the distribution flat over the interval, so that models would learn nothing? Contexts still would,
  /// from numbers that repeat in ways of their own.
  bool is_flat(Wide low, Wide high) const {
    const double width = codes_.boundary(high, number_.axis) - codes_.boundary(low, number_.axis);
    return width < (with_repeats ? 0.08 : 1.0) * experts_.scale();
  }
  void code_raw_rest(Wide& low, Wide& high) {
    // The interval's size is a power of two unless it was cut off at the end of the range.
    while (low < high) {
      const Wide size = high - low + 1;
      unsigned bits = 0;
      while (bits < 16 && (Wide{2} << bits) <= size) ++bits;
      uint32_t value = 0;
      const Wide unit = size >> bits;
      if constexpr (Coder::encoding) value = static_cast<uint32_t>((target_ - low) / unit);
      value = coder_.code_raw(value < (1u << bits) ? value : (1u << bits) - 1, bits);
      low += unit * value;
      const Wide end = low + unit - 1;
      if (value + 1 < (1u << bits) || end > high) high = end < high ? end : high;
    }
  }

  /// Is the code at least `at_least`? The interval from low to high shrinks to the side that is. Decisions
  /// whose answer follows from the interval cost nothing and teach nothing. low <= code <= high always holds,
  /// so the interval is never empty, whatever the bytes.
  bool ask(Wide at_least, Wide& low, Wide& high, unsigned slot, unsigned type, unsigned few,
           bool hashed_too = true) {
    if (at_least <= low) return true;
    if (at_least > high) return false;
    const SignedLanes between = experts_.share_below(codes_.boundary(at_least, number_.axis));
    const typename Contexts::Cells cells = contexts_.cells(few, slot, hashed_too);
    const auto& learnt = cells.narrow_logits;
    typename Mixer<inputs>::Inputs logits;
    logits[0] = shortened(experts_.logits(between),
                          SignedLanes{77, cells.wide[0]->logit(), cells.wide[1]->logit(), learnt[0]});
    bool repeated = false;
    if constexpr (with_repeats) {
      typename RepeatCandidates<Wide>::Logits by_kind = {};
      repeated = repeats_->candidates().any();
      if (repeated) repeats_->candidates().say(at_least, type, by_kind);
      logits[1] = shortened(SignedLanes{learnt[1], learnt[2], learnt[3], learnt[4]}, by_kind[0]);
      logits[2] = shortened(by_kind[1], by_kind[2]);
    }
    const unsigned first = experts_.scale_bin() * node_types + type;
    const unsigned second =
        (number_.prediction->valence_class * 4 +
         (number_.prediction->parallelogram_class < 3 ? number_.prediction->parallelogram_class : 3)) *
            node_types +
        type;
    const uint32_t probability =
        mixer_.predict(logits, first, second, type, with_repeats && !repeated ? 2 : inputs / 8);
    bool bit = false;
    if constexpr (Coder::encoding) bit = target_ >= at_least;
    bit = coder_.code(bit, probability);
    mixer_.update(bit);
    contexts_.learn(cells, few, hashed_too, bit);
    if constexpr (with_repeats) {
      if (repeated) repeats_->candidates().learn(at_least, type, bit);
    }
    if (bit) {
      low = at_least;
    } else {
      high = at_least - 1;
    }
    experts_.narrow(bit, between);
    return bit;
  }

  Coder& coder_;
  MixedCoding coding_;
  Codes codes_;
  PositionPredictor predictor_;
  PositionExperts experts_;
  Mixer<inputs> mixer_;
  Contexts contexts_;
  std::optional<PositionRepeats<Code>> repeats_;
  std::optional<MirrorImages<Code>> images_;
  std::array<WideCell, PositionExperts::scale_bins * 8> exact_;
  unsigned exact_hits_ = 0;

  PositionNumber number_;
  Wide target_ = 0;
  unsigned side_ = 0;
  // Of the point at hand.
  PositionPrediction at_image_;
  bool has_image_ = false;
  std::array<Wide, 3> image_{};
  int32_t trust_ = 65536;  // how many of the last images were right, to a step
};

}  // namespace maille
