#pragma once

#include <maille/mesh.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "base/wide_integer.h"
#include "entropy/integer_model.h"
#include "entropy/mixer.h"
#include "entropy/mixing.h"
#include "numbers/number_map.h"
#include "surface/fans/dictionary.h"
#include "surface/front/mirror_images.h"
#include "surface/front/position_predictor.h"
#include "surface/front/repeat_candidates.h"

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

/// Position of a double among half octaves: floor(2 log2(x)), from -126 to 126. The mantissa is compared with
/// that of sqrt(2) (0x6a09e667f3bcc), so that nothing is computed that machines could round differently.
[[gnu::always_inline]] inline int half_octave(double x) {
  if (!(x > 1e-18)) return -126;
  if (x > 1e18) return 126;
  uint64_t bits;
  __builtin_memcpy(&bits, &x, 8);
  const int exponent = static_cast<int>(bits >> 52) - 1023;
  return 2 * exponent + static_cast<int>((bits & 0xfffffffffffff) >= 0x6a09e667f3bcc);
}

/// The size of a code of this map in the numbers' own unit; 1 for floats in order, where it varies.
inline double step_of(const NumberMap& map) {
  switch (map.kind) {
    case NumberMap::Kind::lattice:
      return map.step;
    case NumberMap::Kind::decimal: {
      // Divided step by step, as pow() differs between machines.
      double step = 1;
      for (int32_t i = 0; i < map.exponent; ++i) step /= 10;
      return map.factor == 0 ? step : step * map.factor;
    }
    case NumberMap::Kind::binary:
      return std::ldexp(map.factor == 0 ? 1 : map.factor, map.exponent);
    default:
      return 1;
  }
}

/// Codes the numbers of positions one decision after the other, each of the kind "is the code at least this
/// one?", on an interval that shrinks. Four experts say how probable each side is, each with a mean and a
/// scale; contexts say what happened before where things looked the same; repeats are whole codes that may
/// come again. A mixer adds the logits of all, with weights learnt while coding. One class serves both
/// directions, docs/format.md, 14.6 and 14.7.
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
        type_(type),
        codes_(codes),
        predictor_(surface, rings, points),
        residuals_(codes.size()),
        mixer_(scale_bins * node_types, 8 * 4 * node_types, node_types, initial_weights()),
        few_{std::vector<WideCell>(few_contexts * nodes), std::vector<WideCell>(few_contexts * nodes)},
        table_(with_repeats ? table_bits_for(most < points ? most : points) : 1),
        is_entry_(has_dictionaries() ? codes.size() : 0),
        followers_(with_repeats ? size_t{4} << follower_bits : 0) {
    for (unsigned k = 0; k < 3; ++k) {
      curved_[k] = maps[k].is_curved() ? &maps[k] : nullptr;
      low_end_[k] = maps[k].table.empty() ? lowest : Wide{0};
      high_end_[k] = maps[k].table.empty() ? highest : static_cast<Wide>(maps[k].table.size() - 1);
      step_[k] = step_of(maps[k]) / coding.unit;
      inverse_step_[k] = 1 / step_[k];
    }
    for (auto& expert : scales_) expert.fill(1.0F);
    if (coding.mirror) images_.emplace(*coding.mirror, surface, points, codes);
  }

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
  using Wide = std::conditional_t<sizeof(Code) == 4, int64_t, WideInteger>;
  static constexpr Wide lowest = std::numeric_limits<Code>::min();
  static constexpr Wide highest = std::numeric_limits<Code>::max();
  static constexpr unsigned experts = PositionPrediction::experts;
  static constexpr unsigned contexts = with_repeats ? 4 : 0;
  static constexpr unsigned inputs = with_repeats ? 24 : 8;
  static constexpr unsigned bias_input = experts;
  // Tables of 2^16 codes each, part of the format (14.7). Different contexts may meet in one place: then a
  // match is wrong, no more.
  static constexpr unsigned follower_bits = 16;
  static constexpr unsigned most_contexts = 5;
  static constexpr unsigned node_types = 16;
  /// Above this share of images that were right to a step, of 65536, experts expect the image only. (Half of
  /// it costs 0 to 1.5 %, all of it up to 5 %.)
  static constexpr int32_t least_trust = 50000;
  static constexpr unsigned image_kind = 9;  ///< of repeats
  /// Above this probability (of 65536) codes are asked first whether they are the centre itself. It changes
  /// which decision comes first, so the format has it (14.7). Chosen, not swept.
  static constexpr uint16_t often_exact = 40000;
  static constexpr unsigned scale_bins = 48;  ///< half octaves of the deviation, from 2^-3 to 2^20 units
  static constexpr unsigned scale_kinds = 16;
  static constexpr unsigned few_contexts = 48 * 16;
  static constexpr unsigned nodes = 132;

  /// About five buckets for each point, in 2^12 to 2^20: the larger bound keeps the table at 16 MB. The
  /// format's rule; not swept.
  static unsigned table_bits_for(uint32_t points) {
    unsigned bits = 12;
    while (bits < 20 && (uint64_t{1} << bits) < uint64_t{points} * 5) ++bits;
    return bits;
  }
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

  /// The number a code stands for, up to an offset, in units.
  double value(Wide code, unsigned axis) const {
    if (!curved_[axis]) return static_cast<double>(code) * step_[axis];
    return curved_value(code, axis);
  }
  double curved_value(Wide code, unsigned axis) const {
    // Squares of differences stay finite in doubles.
    constexpr double farthest = 1e30;
    const double value = curved_[axis]->value_of(type_, static_cast<int64_t>(code)) / coding_.unit;
    return value < farthest ? value > -farthest ? value : -farthest : farthest;
  }
  /// Half way from the code before to this one.
  double boundary(Wide code, unsigned axis) const {
    if (!curved_[axis]) return (static_cast<double>(code) - 0.5) * step_[axis];
    return (curved_value(code - 1, axis) + curved_value(code, axis)) * 0.5;
  }
  Wide nearest_code(double value, unsigned axis) const {
    if (curved_[axis]) return static_cast<Wide>(curved_[axis]->nearest_code(type_, value * coding_.unit));
    const double code = std::floor(value * inverse_step_[axis] + 0.5);
    constexpr double most = sizeof(Code) == 4 ? 2147483647.0 : 9.2e18;
    // The comparisons also send NaN to an end: a conversion of what does not fit would be undefined.
    return code > -most ? code < most ? static_cast<Wide>(code) : static_cast<Wide>(most)
                        : static_cast<Wide>(-most);
  }

  void code_point(uint32_t point, const PositionPrediction& prediction) {
    prediction_ = &prediction;
    point_ = point;
    residual_.fill({});
    const auto& s = prediction.covariance;
    Vector3 where;
    coded_residuals_ = 0;
    entries_ = 1;
    for (unsigned i = 0; i < 3; ++i) {
      axis_ = prediction.axes[i];
      place_ = i;
      condition(s);
      code_number();
      where[axis_] = value(codes_[at(point, axis_)], axis_);
      for (unsigned j = 0; j < experts; ++j) residual_[j][axis_] = where[axis_] - prediction.mean[j][axis_];
    }
    newest_ = point;
    predictor_.learn(point, where);
  }

  /// Is there an image of a known point where this one will be?
  bool expect_image(uint32_t point, uint32_t vertex) {
    has_image_ = images_->expect(point, vertex);
    if (!has_image_) return false;
    image_ = images_->place();
    for (unsigned k = 0; k < 3; ++k)
      has_image_ = has_image_ && image_[k] >= low_end_[k] && image_[k] <= high_end_[k];
    return has_image_;
  }
  /// All that is expected lies at the image, as surely as variances can say: 0.05 is what find_variance()
  /// adds to each.
  const PositionPrediction& at_image(const PositionPrediction& prediction) {
    at_image_ = prediction;
    Vector3 place;
    for (unsigned k = 0; k < 3; ++k) place[k] = value(image_[k], k);
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
      const Wide off = codes_[at(point, k)] - image_[k];
      right = right && off <= 1 && off >= -1;
    }
    // The mean of the last sixteen or so.
    trust_ += ((right ? 65536 : 0) - trust_) >> 4;
  }

  size_t at(uint32_t point, unsigned axis) const { return size_t{point} * 3 + axis; }

  /// Mean and variance of this axis given the axes coded before it: the formula of conditional normal
  /// distributions (mean + S_ab S_bb^-1 (b - mean b), S_aa - S_ab S_bb^-1 S_ba), with the 1 x 1 and 2 x 2
  /// cases written out. If the axes before are almost dependent, the determinant is rounding error and they
  /// are not used.
  void condition(const std::array<Vector3, 3>& s) {
    const auto& axes = prediction_->axes;
    double variance = s[axis_][axis_];
    std::array<double, 2> factor = {};
    if (place_ == 1) {
      factor[0] = s[axis_][axes[0]] / s[axes[0]][axes[0]];
      variance -= factor[0] * s[axis_][axes[0]];
    } else if (place_ == 2) {
      const double aa = s[axes[0]][axes[0]];
      const double bb = s[axes[1]][axes[1]];
      const double ab = s[axes[0]][axes[1]];
      const double determinant = aa * bb - ab * ab;
      if (determinant > 1e-9 * aa * bb) {
        const double ca = s[axis_][axes[0]];
        const double cb = s[axis_][axes[1]];
        factor[0] = (ca * bb - cb * ab) / determinant;
        factor[1] = (cb * aa - ca * ab) / determinant;
        variance -= factor[0] * ca + factor[1] * cb;
      }
    }
    // Rounding to whole units alone has a variance of 1/12; an estimate below 0.03 says more than can be
    // known.
    deviation_ = std::sqrt(variance > 0.03 ? variance : 0.03);
    for (unsigned j = 0; j < experts; ++j) {
      double mean = prediction_->mean[j][axis_];
      for (unsigned i = 0; i < place_; ++i) mean += factor[i] * residual_[j][axes[i]];
      mean_[j] = mean;
    }
  }

  static unsigned clamp_bin(int bin, int low, int count) {
    const int place = bin - low;
    return static_cast<unsigned>(place < 0 ? 0 : place >= count ? count - 1 : place);
  }

  void set_up_experts() {
    const PositionPrediction& p = *prediction_;
    const double inverse = 1 / deviation_;
    scale_bin_ = clamp_bin(half_octave(deviation_), -6, scale_bins);
    spread_bin_ = clamp_bin(half_octave(p.spread * inverse), -3, 8);
    edge_bin_ = clamp_bin(half_octave(p.edge), 0, 32);
    const unsigned apart = clamp_bin(half_octave(p.disagreement * inverse), -4, 8);
    kind_ = {(p.valence_class >> 1) * 4 + (p.parallelogram_class > 0 ? p.parallelogram_class - 1 : 0),
             spread_bin_, p.valence_class, apart + 8 * (edge_bin_ > 12)};
    for (unsigned j = 0; j < experts; ++j) {
      const double ratio = static_cast<double>(scales_[j][scale_place(j)]);
      // A logistic distribution has the standard deviation pi / sqrt(3) = 1.81 times its scale: 0.55 is its
      // inverse.
      const double scale = 0.55 * deviation_ * ratio;
      // distribution() takes 4096ths of a scale.
      inverse_scale_[j] = static_cast<float>(4096 / (scale > 0.01 ? scale : 0.01));
      if (j == experts - 1) scale_ = scale > 0.01 ? scale : 0.01;
    }
    low_ = SignedLanes{};
    high_ = SignedLanes{} + (1 << 30);
  }
  /// Each expert has ratios by another property of the place, so that they are wrong at different places.
  unsigned scale_place(unsigned j) const { return scale_bin_ * scale_kinds + kind_[j]; }

  /// Two tables without hashing, of few contexts: they learn soon, and serve points whose hashed contexts are
  /// new.
  void set_up_contexts() {
    const unsigned side = mean_[0] > mean_[1] ? 1 : 0;
    few_base_ = {&few_[0][(scale_bin_ * 16 + spread_bin_ * 2 + side) * nodes],
                 &few_[1][((edge_bin_ >> 1) * scale_bins + scale_bin_) * nodes]};
    if constexpr (with_repeats) set_up_hashes();
  }
  /// What these contexts see is exact: whether the same shape came before, bit for bit. Part of the format
  /// (14.7, "Contexts").
  void set_up_hashes() {
    const PositionPrediction& p = *prediction_;
    const auto seed = [&](uint32_t kind) { return hashed(kind * 4 + axis_, 0x1234567u); };
    // Residuals of this point so far, or those of the one before.
    uint32_t h = hashed(seed(1), place_);
    if (place_ == 0) {
      for (unsigned k = 0; k < 3; ++k) h = hashed(h, newest_ == none ? 0 : residual_code(newest_, k));
    } else {
      h = hashed(h, static_cast<uint32_t>(coded_residuals_));
    }
    hash_[0] = h;
    // How the first two parallelograms differ.
    const Neighbourhood& around = predictor_.neighbourhood();
    h = hashed(seed(2), around.parallelogram_count);
    for (unsigned i = 0; i < 2 && i < around.parallelogram_count; ++i) {
      const WideParallelogram& parallelogram = around.parallelograms[i];
      const double tip = along(parallelogram.a) + along(parallelogram.b) - along(parallelogram.across);
      h = hashed(h, exact(tip - p.mean_parallelogram[axis_]));
    }
    hash_[1] = h;
    // The place itself; the edges of the best parallelogram; what the residuals at its corners were.
    hash_[2] = hashed(seed(3), static_cast<uint32_t>(nearest_code(p.mean_parallelogram[axis_], axis_)));
    hash_[3] = seed(4);
    hash_[4] = seed(5);
    if (p.best_a != none) {
      hash_[3] = hashed(hashed(hash_[3], exact(along(p.best_a) - along(p.best_across))),
                        exact(along(p.best_b) - along(p.best_across)));
      hash_[4] =
          hashed(hashed(hashed(hash_[4], residual_code(p.best_a, axis_)), residual_code(p.best_b, axis_)),
                 residual_code(p.best_across, axis_));
    }
    for (unsigned i = 0; i < contexts; ++i) table_.prefetch(hash_[i]);
  }
  /// Of a point against its own centre, cut to 32 bits: enough for a context.
  uint32_t residual_code(uint32_t point, unsigned axis) const {
    return static_cast<uint32_t>(residuals_[at(point, axis)]);
  }
  double along(uint32_t point) const { return predictor_.position(point)[axis_]; }
  /// A difference of numbers as bits; as a float, so that noise of the last bits of doubles does not make a
  /// context of its own. -0 is 0.
  static uint32_t exact(double difference) {
    const auto narrow = static_cast<float>(difference);
    uint32_t bits;
    __builtin_memcpy(&bits, &narrow, 4);
    return narrow == 0 ? 0 : bits;
  }

  Wide centre() const {
    const bool expected = coding_.centre == MixedCoding::Centre::expected;
    return nearest_code(expected ? mean_[experts - 1] : prediction_->best_parallelogram[axis_], axis_);
  }

  void code_number() {
    set_up_experts();
    set_up_contexts();
    Code& code = codes_[at(point_, axis_)];
    const Wide centre = this->centre();
    base_ = value(centre, axis_);
    for (unsigned j = 0; j < experts; ++j) {
      const double relative = mean_[j] - base_;
      relative_mean_[j] = static_cast<float>(relative > -1e32 ? relative < 1e32 ? relative : 1e32 : -1e32);
    }
    Wide low = low_end_[axis_];
    Wide high = high_end_[axis_];
    // Only the encoder knows it; decisions of a decoder come from the stream.
    if constexpr (Coder::encoding) target_ = code;
    if constexpr (with_repeats) find_candidates(centre);

    bucket_ = ~0u;
    begin_buckets(0);
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
    WideCell& exact = exact_[scale_bin_ * 8 + exact_hits_];
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
    residuals_[at(point_, axis_)] = static_cast<int32_t>(low - centre);
    coded_residuals_ = coded_residuals_ * 0x9e3779b1u + static_cast<uint32_t>(low - centre) + 1;
    learn_scales();
    if constexpr (with_repeats) learn_repeats(low, centre);
  }

  /// The class of distance that is most likely, so that few decisions find the true one. A wrong guess costs
  /// time and a little of what models learn: the decisions name the class whatever comes first.
  unsigned expected_class(Wide centre, bool up, unsigned most_class) const {
    const double off = mean_[experts - 1] - value(centre, axis_);
    double distance = (up ? off : -off) + scale_;
    if (distance < scale_ * 0.5) distance = scale_ * 0.5;
    double step = step_[axis_];
    if (curved_[axis_])
      step = std::fabs(value(centre + (centre < highest ? 1 : 0), axis_) - value(centre, axis_));
    const int halves = half_octave(distance / (step > 1e-18 ? step : 1e-18) + 1);
    const unsigned c = static_cast<unsigned>(halves < 0 ? 0 : halves / 2);
    return c < most_class ? c : most_class - 1;
  }

  bool ask_class(Wide at_least, Wide& low, Wide& high, unsigned k, unsigned type) {
    // The classes 0 to 2 of both sides share the first bucket with the side.
    unsigned slot;
    if (k < 3) {
      begin_buckets(0);
      slot = 1 + side_ * 3 + k;
    } else {
      begin_buckets(1 + side_ + 2 * ((k - 3) / 7));
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
          if (repeats_.code_whole(coder_, target_, low)) return;
        }
        return code_raw_rest(low, high);
      }
      const Wide half = low + (size >> 1);
      if (i % 3 == 0 && i < 6) begin_buckets(0x100 + (((c * 2 + side_) << 12) | (prefix & 0xfff)) * 2);
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
    const double width = boundary(high, axis_) - boundary(low, axis_);
    return width < (with_repeats ? 0.08 : 1.0) * scale_;
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

  /// Which of the buckets of this number's hashed contexts holds the next decisions.
  void begin_buckets(unsigned bucket) {
    if (bucket == bucket_) return;
    bucket_ = bucket;
    std::array<uint32_t, most_contexts> hashes;
#pragma GCC unroll 8
    for (unsigned i = 0; i < contexts; ++i) {
      hashes[i] = bucket == 0 ? hash_[i] : hashed(hash_[i], bucket * 0x85ebca6bu);
      table_.prefetch(hashes[i]);
    }
#pragma GCC unroll 8
    for (unsigned i = 0; i < contexts; ++i) buckets_[i] = &table_.find(hashes[i]);
  }

  /// Is the code at least `at_least`? The interval from low to high shrinks to the side that is. Decisions
  /// whose answer follows from the interval cost nothing and teach nothing. low <= code <= high always holds,
  /// so the interval is never empty, whatever the bytes.
  bool ask(Wide at_least, Wide& low, Wide& high, unsigned slot, unsigned type, unsigned few,
           bool hashed_too = true) {
    if (at_least <= low) return true;
    if (at_least > high) return false;
    const auto where = static_cast<float>(boundary(at_least, axis_) - base_);
    constexpr auto most = static_cast<float>(largest_deviation);
    const FloatLanes deviation =
        clamp_lanes((where - relative_mean_) * inverse_scale_, FloatLanes{} - most, FloatLanes{} + most);
    // Clamped before, so that the conversion is defined.
    const SignedLanes place = __builtin_convertvector(deviation, SignedLanes);
    const SignedLanes between = {distribution(place[0]), distribution(place[1]), distribution(place[2]),
                                 distribution(place[3])};
    const SignedLanes above = high_ - between;
    const SignedLanes below = between - low_;
    const SignedLanes by_experts =
        // What an expert says is the ratio of what its distribution has above and below, within the interval
        // that is left; at least 1 each, as its logarithm is taken.
        logit_of_ratio(above > 1 ? above : SignedLanes{} + 1, below > 1 ? below : SignedLanes{} + 1);
    typename Mixer<inputs>::Inputs logits;
    if (!hashed_too) slot = 0;
    std::array<WideCell*, 2> wide = {few_base_[0] + few, few_base_[1] + few};
    std::array<NarrowCell*, most_contexts> narrow;
    std::array<int32_t, most_contexts> learnt = {};
#pragma GCC unroll 8
    for (unsigned i = 0; i < contexts; ++i) {
      narrow[i] = &buckets_[i]->cells[slot];
      learnt[i] = hashed_too ? narrow[i]->logit() : 0;
    }
    logits[0] = shortened(by_experts, SignedLanes{77, wide[0]->logit(), wide[1]->logit(), learnt[0]});
    const SignedLanes others = {learnt[1], learnt[2], learnt[3], learnt[4]};
    bool repeated = false;
    if constexpr (with_repeats) {
      typename RepeatCandidates<Wide>::Logits by_kind = {};
      repeated = repeats_.any();
      if (repeated) repeats_.say(at_least, type, by_kind);
      logits[1] = shortened(others, by_kind[0]);
      logits[2] = shortened(by_kind[1], by_kind[2]);
    }
    const unsigned first = scale_bin_ * node_types + type;
    const unsigned second = (prediction_->valence_class * 4 +
                             (prediction_->parallelogram_class < 3 ? prediction_->parallelogram_class : 3)) *
                                node_types +
                            type;
    const uint32_t probability =
        mixer_.predict(logits, first, second, type, with_repeats && !repeated ? 2 : inputs / 8);
    bool bit = false;
    if constexpr (Coder::encoding) bit = target_ >= at_least;
    bit = coder_.code(bit, probability);
    mixer_.update(bit);
    if (few != 0) {
      wide[0]->update(bit);
      wide[1]->update(bit);
    }
    if (hashed_too) {
#pragma GCC unroll 8
      for (unsigned i = 0; i < contexts; ++i) narrow[i]->update(bit);
    }
    if constexpr (with_repeats) {
      if (repeated) repeats_.learn(at_least, type, bit);
    }
    if (bit) {
      low = at_least;
      low_ = between;
    } else {
      high = at_least - 1;
      high_ = between;
    }
    return bit;
  }

  /// Codes that may come again as they are, in the order in which equal ones count (14.7, "Matches").
  void find_candidates(Wide centre) {
    const PositionPrediction& p = *prediction_;
    const Neighbourhood& around = predictor_.neighbourhood();
    uint32_t neighbour = newest_;
    for (unsigned i = 0; i < around.ring_count; ++i) {
      if (i == 0 || around.ring[i] > neighbour) neighbour = around.ring[i];
    }
    repeats_.begin_number();
    const auto place = [&](uint32_t hash) { return hash >> (32 - follower_bits); };
    const uint32_t near = neighbour == none ? 0 : static_cast<uint32_t>(codes_[at(neighbour, axis_)]);
    follower_[0] = &followers_[place(hashed(hashed(axis_, near), 0x3c6ef372u))];
    follower_[1] = &followers_[(size_t{1} << follower_bits) + place(hash_[0])];
    follower_[2] = &followers_[(size_t{2} << follower_bits) + place(hash_[3])];
    follower_[3] = &followers_[(size_t{3} << follower_bits) + place(hash_[4])];
    if (has_image_) add_candidate(image_kind, image_[axis_]);
    add_candidate(0, *follower_[0]);
    if (p.best_a != none) {
      add_candidate(1, codes_[at(p.best_a, axis_)]);
      add_candidate(2, codes_[at(p.best_b, axis_)]);
      add_candidate(3, codes_[at(p.best_across, axis_)]);
    }
    add_candidate(4, nearest_code(static_cast<double>(relative_mean_[1]) + base_, axis_));
    add_candidate(5, centre + *follower_[1]);
    add_candidate(6, centre);
    add_candidate(7, centre + *follower_[2]);
    add_candidate(8, centre + *follower_[3]);
    if (has_dictionaries()) add_entries();
  }
  void add_candidate(unsigned kind, Wide code) {
    if (code < low_end_[axis_] || code > high_end_[axis_]) return;
    const double far = std::fabs(value(code, axis_) - mean_[experts - 1]) / deviation_;
    repeats_.add(kind, code, clamp_bin(half_octave(far), -3, 8));
  }
  bool has_dictionaries() const {
    const auto& all = coding_.dictionaries;
    return with_repeats && all[0].size() + all[1].size() + all[2].size() > 0;
  }
  /// The entry nearest to what is expected, and the one on the other side of that. Where in the gap the
  /// expected number lies, and how wide the gap is beside the deviation, says how probable each is.
  void add_entries() {
    const Dictionary& dictionary = coding_.dictionaries[axis_];
    if (dictionary.size() == 0) return;
    const double expected = mean_[experts - 1];
    const uint32_t nearest = dictionary.nearest(static_cast<int64_t>(nearest_code(expected, axis_)));
    const double off = expected - value(dictionary[nearest], axis_);
    const uint32_t other = off > 0 ? nearest + 1 : nearest - 1;
    unsigned part = 0, sharpness = 0;
    if (other < dictionary.size()) {
      const double gap = std::fabs(value(dictionary[other], axis_) - value(dictionary[nearest], axis_));
      part = static_cast<unsigned>(std::fabs(off) < gap * 0.5 ? 16 * std::fabs(off) / gap : 7);
      sharpness = clamp_bin(half_octave(gap / deviation_), -1, 8);
    }
    const auto entry_at = [&](uint32_t point) {
      return point != none && is_entry_[at(point, axis_)] ? 1u : 0u;
    };
    const unsigned around = entries_ * 4 + 2 * entry_at(prediction_->best_a) + entry_at(prediction_->best_b);
    const unsigned first = RepeatCandidates<Wide>::first_entry;
    const auto add = [&](unsigned kind, int64_t code) {
      if (code < low_end_[axis_] || code > high_end_[axis_]) return;  // of damaged bytes
      repeats_.add_entry(kind, code, around, sharpness, part);
    };
    add(first, dictionary[nearest]);
    if (other < dictionary.size()) add(first + 1, dictionary[other]);
  }
  void learn_repeats(Wide code, Wide centre) {
    repeats_.end_number(code);
    *follower_[0] = static_cast<Code>(code);
    for (unsigned i = 1; i < 4; ++i) *follower_[i] = static_cast<Code>(code - centre);
    if (!has_dictionaries()) return;
    const Dictionary& dictionary = coding_.dictionaries[axis_];
    const bool entry = dictionary.find(static_cast<int64_t>(code)) < dictionary.size();
    is_entry_[at(point_, axis_)] = entry ? 1 : 0;
    entries_ = entries_ << 1 | (entry ? 1 : 0);
  }

  // The mean of |error| / deviation of each expert, of about the last 33 numbers of this kind: 0.03 a step.
  // Errors beyond 20 deviations are edges, and count as 20. Both are in the format (14.7); not swept.
  void learn_scales() {
    const double where = value(codes_[at(point_, axis_)], axis_);
    const double inverse = 1 / deviation_;
    for (unsigned j = 0; j < experts; ++j) {
      double ratio = std::fabs(where - mean_[j]) * inverse;
      ratio = ratio < 20 ? ratio : 20;
      float& scale = scales_[j][scale_place(j)];
      scale += 0.03F * (static_cast<float>(ratio) - scale);
    }
  }

  Coder& coder_;
  MixedCoding coding_;
  Scalar type_;
  std::span<Code> codes_;
  PositionPredictor predictor_;
  std::vector<int32_t> residuals_;  // against the centres, by number
  std::array<const NumberMap*, 3> curved_;
  std::array<Wide, 3> low_end_;  // of the codes that there are
  std::array<Wide, 3> high_end_;
  std::array<double, 3> step_;
  std::array<double, 3> inverse_step_;
  Mixer<inputs> mixer_;
  std::array<std::vector<WideCell>, 2> few_;
  BucketTable table_;
  std::conditional_t<with_repeats, RepeatCandidates<Wide>, char> repeats_;
  std::optional<MirrorImages<Code>> images_;
  std::vector<uint8_t> is_entry_;  // by number
  std::vector<Code> followers_;  // the code last seen behind that of a neighbour; the residual, behind others
  std::array<std::array<float, scale_bins * scale_kinds>, experts> scales_;

  // Of the point at hand.
  const PositionPrediction* prediction_ = nullptr;
  PositionPrediction at_image_;
  bool has_image_ = false;
  std::array<Wide, 3> image_{};
  int32_t trust_ = 65536;  // how many of the last images were right, to a step
  uint32_t point_ = 0;
  uint32_t newest_ = none;
  uint32_t coded_residuals_ = 0;
  std::array<WideCell, scale_bins * 8> exact_;
  unsigned exact_hits_ = 0;
  unsigned entries_ = 1;  // which of the numbers so far are in a dictionary, behind a 1
  std::array<Vector3, experts> residual_;
  // Of the number at hand.
  unsigned axis_ = 0;
  unsigned place_ = 0;
  double deviation_ = 1;
  double scale_ = 1;
  Wide target_ = 0;
  unsigned side_ = 0;
  unsigned scale_bin_ = 0;
  unsigned spread_bin_ = 0;
  unsigned edge_bin_ = 0;
  std::array<unsigned, experts> kind_;
  std::array<double, experts> mean_;
  double base_ = 0;  // experts' means are kept relative to this, in floats
  FloatLanes relative_mean_;
  FloatLanes inverse_scale_;
  SignedLanes low_;  // distribution functions at the ends of the interval
  SignedLanes high_;
  std::array<WideCell*, 2> few_base_;
  std::array<uint32_t, most_contexts> hash_;
  unsigned bucket_ = 0;
  std::array<CellBucket*, most_contexts> buckets_;
  std::array<Code*, 4> follower_;
};

}  // namespace maille
