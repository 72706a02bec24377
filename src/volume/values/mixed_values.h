#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include "base/wide_integer.h"
#include "code/online_least_squares.h"
#include "entropy/mixer.h"
#include "entropy/rans.h"
#include "surface/front/repeat_candidates.h"
#include "volume/values/point_stencil.h"
#include "volume/values/tuple_values.h"

namespace maille {

/// Arrays with more components than this are not mixed: each has models of its own, 4,000 bytes a component.
/// Part of the format.
inline constexpr uint32_t most_mixed_components = 16;
uint64_t mixed_coder_bytes(const StreamedArray& array);

/// The numbers of one array as TupleValueCoder has them, smaller and ten times slower: each is found by
/// decisions of the kind "is the code at least this one?", on an interval that shrinks. Four experts say how
/// probable each side is, each with a mean and a scale; codes that may come again as they are say so too.
/// docs/format.md, 16.12.
/// The chain of doubles from slots to probabilities is the same in both directions and on all machines: + - *
/// / and sqrt in a fixed order, rounded to float where the format says so. Places are bounded to 1e30, so
/// that no square overflows.
template <class Coder, unsigned Bits>
class MixedValueCoder {
 public:
  static constexpr bool encoding = Coder::encoding;
  static constexpr bool has_plain = false;  ///< code_full(), as TupleValueCoder has it
  static constexpr bool takes_planes = true;

  explicit MixedValueCoder(const StreamedArray& array);

  /// Codes one tuple, component after component. Its values go to `slot`.
  void code(Coder& coder, const PointStencil& stencil, uint32_t slot, std::byte* tuple);
  /// Where the numbers of a tuple of the step before are in the map of this array, by component; the result
  /// is valid until the next call.
  const double* places_before(const std::byte* tuple);
  /// Where the numbers of the last tuple are.
  const std::vector<double>& places() const { return places_; }
  /// Encoder: the largest error of numbers with a bound, so far.
  double largest_error() const { return largest_error_; }
  /// What came to mixed_coder_bytes(), while numbers of so many slots are kept.
  uint64_t grown_bytes(size_t slots) const {
    const uint64_t numbers = uint64_t{slots} * array_.components;
    return exceptions_.bytes() + bytes_to_hold(values_, numbers) +
           (array_.follows ? bytes_to_hold(known_before_, numbers) : 0);
  }
  void prefetch(uint32_t slot) const {
    const size_t place = size_t{slot} * array_.components;
    if (place < values_.size()) __builtin_prefetch(&values_[place]);
  }

 private:
  using Code = std::conditional_t<Bits == 32, int32_t, int64_t>;
  using Wide = std::conditional_t<Bits == 32, int64_t, WideInteger>;
  // 16 features; from 1,024 samples on weights are solved again after 256, before that after 32.
  using Fit = OnlineLeastSquares<16, 256>;
  /// Of an array that follows: with features of the step before. What it has to find is small where things
  /// change little, so its origin is that nothing but the first sum has changed.
  using FollowingFit = OnlineLeastSquares<28, 256>;
  using Repeats = RepeatCandidates<Wide>;
  using Sums = std::array<double, 3>;
  static constexpr Wide lowest = std::numeric_limits<Code>::min();
  static constexpr Wide highest = std::numeric_limits<Code>::max();
  static constexpr unsigned experts = 4;
  static constexpr unsigned best = 2;  ///< the expert that had missed least in this situation
  static constexpr unsigned fitted = 3;
  static constexpr unsigned on_plane = 4;   ///< a candidate that is no expert
  static constexpr unsigned as_before = 5;  ///< likewise: the number of the step before
  static constexpr unsigned changed = 6;    ///< as the first sum, and as the last one
  static constexpr unsigned candidates = 8;
  static constexpr unsigned inputs = 16;
  static constexpr unsigned node_types = 16;
  static constexpr unsigned scale_bins = 64;
  // Places of few_: 1 for the side of the centre, 2 + 32 for lengths by side, 34 + 96 for the first two bits
  // by side, length and prefix; 0 is none.
  static constexpr unsigned nodes = 132;
  static constexpr unsigned follower_bits = 14;
  static constexpr unsigned followers = 2;
  /// Above this probability (0.61) codes are asked first whether they are the centre itself. Chosen with the
  /// first version (24b5167), no sweep is on record.
  static constexpr uint16_t often_exact = 40000;

  struct Value {
    double place = 0;
    float twist = 0;     ///< what the first sum missed
    float bend = 0;      ///< what the plane missed
    float residual = 0;  ///< what the best expert missed
    float error = 0;     ///< its size, not below a part of a step
    int16_t size = 0;    ///< the same in half octaves
    Code code = 0;
  };
  /// A number of the step before, in the map of this array.
  struct Before {
    double place = 0;
    float twist = 0;
  };
  /// What was learnt of one component in one situation: how far off numbers are there, and by which candidate
  /// least.
  struct Situation {
    double square = 0;  ///< mean of squared errors
    unsigned visits = 0;
    std::array<float, candidates> miss{};  ///< mean half octaves by which each candidate missed
  };
  using Situations = std::array<Situation, PointStencil::situations>;

  void code_number(Coder& coder, const PointStencil& stencil, uint32_t slot, std::byte* number);
  void expect(const PointStencil& stencil);
  void add_features(const PointStencil& stencil, const Sums& sums);
  template <class PlaceOf>
  void find_sums(const PointStencil& stencil, PlaceOf place_of, double last, Sums& sums) const;
  void find_changes(const PointStencil& stencil, const Sums& sums, Sums& changes);
  double place_at(uint32_t slot) const;
  float twist_at(uint32_t slot) const;
  double fitted_place() const;
  double predict() const;
  typename Fit::Features first_features() const {
    typename Fit::Features features;
    std::copy_n(features_.begin(), features.size(), features.begin());
    return features;
  }
  void find_sizes(const PointStencil& stencil);
  void set_scales();
  void find_repeats(const PointStencil& stencil);
  void add_repeat(unsigned kind, Wide code);
  Wide find_code(Coder& coder);
  void code_mantissa(Coder& coder, unsigned length, unsigned side, Wide& low, Wide& high);
  void code_rest(Coder& coder, Wide& low, Wide& high) const;
  bool ask(Coder& coder, Wide at_least, Wide& low, Wide& high, unsigned type, unsigned few);
  bool is_flat(Wide low, Wide high) const;
  unsigned expected_length(bool up) const;
  void learn(Wide code);
  void learn_repeats(Wide code);
  bool code_exception(Coder& coder, const PointStencil& stencil, uint32_t slot, std::byte* number);

  const NumberSpace& space() const { return spaces_[component_]; }
  const Value& at(uint32_t slot) const { return values_[size_t{slot} * array_.components + component_]; }
  /// Bounded, so that no infinity gets into sums and squares.
  double place(Wide code) const { return bounded(space().place_of(static_cast<int64_t>(code))); }
  /// Half way from the code before to this one.
  double boundary(Wide code) const {
    return code <= lowest ? place(lowest) : (place(code - 1) + place(code)) * 0.5;
  }
  Wide code_near(double place) const {
    const Wide code = space().code_near(place);
    return code <= lowest ? lowest + 1 : code > highest ? highest : code;
  }
  const Before& before_at(uint32_t slot) const {
    return known_before_[size_t{slot} * array_.components + component_];
  }
  static double bounded(double place) {
    return place < farthest ? place > -farthest ? place : -farthest : farthest;
  }
  // Squares of it, and sums of such squares, are far from the largest double.
  static constexpr double farthest = 1e30;

  StreamedArray array_;
  size_t number_size_;
  std::vector<NumberSpace> spaces_;
  Exceptions exceptions_;
  double largest_error_ = 0;
  std::vector<Value> values_;  ///< by slot and component
  std::vector<Value> last_;    ///< the tuple before
  std::vector<double> places_;
  std::vector<Before> known_before_;  ///< by slot and component, if the array follows a step
  std::vector<Before> last_before_;
  std::vector<double> places_before_;
  std::vector<Situations> situations_;  ///< by component
  /// By situation, one for all components and that of corner 0 for all corners of full hexahedra: what is
  /// known around a number says as much of it in any direction, and a fit of all learns soonest. One of the
  /// two.
  std::vector<Fit> fits_;
  std::vector<FollowingFit> following_fits_;
  Mixer<inputs> mixer_;
  std::array<std::vector<std::vector<WideCell>>, 2> few_;  ///< by bin and side: made when one is met
  std::array<std::array<float, scale_bins>, experts> ratios_;
  std::array<WideCell, scale_bins * 8> exact_;
  unsigned exact_hits_ = 0;
  Repeats repeats_;
  // Codes by hashes of what came before them: two tables of 2^14, without keys, made when one is asked.
  std::vector<Code> followers_;
  int repeat_score_ = 0;  ///< above 0: codes come again
  uint32_t numbers_ = 0;

  // Of the tuple at hand.
  std::array<Value, 2> before_;  ///< the components coded last
  // Of the number at hand.
  unsigned component_ = 0;
  Situation* situation_ = nullptr;
  unsigned fit_ = 0;
  FollowingFit::Features features_;
  std::array<double, experts> mean_;
  std::array<double, candidates> candidate_;  ///< sums, fit and plane
  double origin_ = 0;  ///< of what is fitted: the first sum, or the number before and that sum's change
  double base_ = 0;    ///< the centre's place; means are kept relative to it, in floats
  double step_ = 1;
  double deviation_ = 1;  ///< by the errors of neighbours: root of the mean of squares
  double size_ = 1;       ///< the same: mean of logarithms
  double scale_ = 1;      ///< of the best expert
  unsigned deviation_bin_ = 0, size_bin_ = 0, row_ = 0;
  std::array<WideCell*, 2> few_base_;
  std::array<Code*, followers> follower_;
  Wide centre_ = 0;
  Wide target_ = 0;
  // One lane for each expert: a decision asks all four at once.
  FloatLanes relative_mean_;
  FloatLanes inverse_scale_;
  SignedLanes low_;  ///< distribution functions at the ends of the interval
  SignedLanes high_;
  Value value_;
  Before in_step_before_;
};

}  // namespace maille
